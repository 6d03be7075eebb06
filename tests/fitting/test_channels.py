"""The channels of a record as a fit compares them."""

import pytest
from records import case_of, recording, several

from exfit.errors import RecordError
from exfit.workflows import fit


def test_a_median_wider_than_a_tenth_of_the_record_is_refused(tmp_path):
    channels = {"vt": {"column": "vt", "filter": {"median": 999}}}
    content = several(recording("up", channels=channels), recording("down"))
    with pytest.raises(RecordError, match=r"median: 999 samples; at most 100, a tenth"):
        fit(case_of(content, tmp_path))
