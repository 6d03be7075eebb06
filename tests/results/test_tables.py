"""The files of a result for other programs to read."""

import csv
import io

import pytest
from records import case_of, config, recording, several

from exfit.results.tables import history_table, parameter_file
from exfit.workflows import fit


@pytest.mark.long
def test_the_file_of_parameters_names_every_record_with_its_error(tmp_path):
    content = several(recording("up"), recording("down"), estimate={"iterations": 1})
    found = fit(case_of(content, tmp_path))
    heading = parameter_file(found).splitlines()[0]
    for one_of in found.comparisons:
        assert f"{one_of.record}: rmse {one_of.rmse:.4g} pu" in heading


@pytest.mark.long
def test_the_history_counts_trials_and_says_where_a_step_was_capped(tmp_path):
    settings = {"strategy": "lm", "lm": {"update": "ratio"}, "iterations": 6}
    result = fit(case_of({**config("ac1a_typical"), "estimate": settings}, tmp_path))
    rows = list(csv.DictReader(io.StringIO(history_table(result))))
    assert [row["capped"] for row in rows] == ["", "yes", "yes", "yes", "no", "no", "no"]
    assert [row["trials"] for row in rows] == ["0", "1", "1", "1", "2", "2", "2"]
    assert [int(row["inner"]) for row in rows] == [line.inner for line in result.history]
