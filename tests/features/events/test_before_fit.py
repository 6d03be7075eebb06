"""Files of grid events in which something is wrong are named before a fit; sound ones are not."""

import numpy as np
import pytest
from event_files import BAD, GOOD, bad_file, good_file
from tiers import few_of
from unit_events import simulated

from exfit import workflows
from exfit.errors import ExfitError
from exfit.features.events.record_causes import rest_causes
from exfit.records.record import Record
from exfit.verdict.diagnostics import event_warnings


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Return the event of the unit, as it was."""
    return simulated(tmp_path_factory.mktemp("course"))


def messages(file, folder):
    """Return what is said of a file before a fit."""
    try:
        return [*event_warnings(file.written(folder))]
    except ExfitError as fault:
        return [str(fault)]


@pytest.mark.parametrize("name", few_of(BAD, 6))
def test_what_is_wrong_with_an_event_is_named_before_the_fit(name, course, tmp_path):
    _, word = BAD[name]
    said = messages(bad_file(name, course), tmp_path)
    assert any(word in text for text in said), said


@pytest.mark.parametrize("name", few_of(list(GOOD), 4))
def test_a_sound_event_is_not_accused(name, tmp_path):
    assert messages(good_file(name, tmp_path), tmp_path) == []


def test_thirty_files_of_each_kind_are_looked_at():
    assert (len(BAD), len(GOOD)) == (30, 30)


def test_a_check_that_fails_at_rest_names_what_is_wrong_with_the_record(course, tmp_path):
    case = bad_file("phase to ground taken for phase to phase", course).written(tmp_path)
    with pytest.raises(ExfitError, match=r"about 1 / sqrt\(3\)") as refused:
        workflows.check(case)
    assert "no state of rest" in str(refused.value)


def test_a_voltage_of_zero_at_rest_is_named_and_no_base_is_proposed_for_it():
    time = np.linspace(0.0, 2.0, 21)
    (cause,) = rest_causes(Record.from_arrays(time, {"vt": 0.0 * time}), 1.0)
    assert cause.cause.startswith("vt rests at 0 pu")
    assert not cause.changes
    only_later = {"vt": np.where(time < 1.0, np.nan, 1.0), "p": 0.5 + 0.0 * time}
    assert not [*rest_causes(Record.from_arrays(time, only_later, missing=True), 1.0)]
