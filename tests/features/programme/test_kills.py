"""A programme that is killed: the next run goes on, and its report is the same."""

import pytest
from killed_programmes import killed_and_resumed, report_of, whole_run
from programmes import programme_content, written

SHARES = (0.2, 0.6, 0.9)  # of the time of a run without a kill


@pytest.mark.long
def test_a_run_that_is_killed_loses_nothing_and_the_next_one_does_nothing_twice(tmp_path):
    programme = written(programme_content(), tmp_path)
    _, seconds = whole_run(programme, tmp_path / "whole", "--no-plots")
    expected = report_of(tmp_path / "whole")
    for share in SHARES:
        place = tmp_path / f"killed at {share}"
        resumed = killed_and_resumed(programme, place, share * seconds, expected, "--no-plots")
        assert resumed.whole, resumed
