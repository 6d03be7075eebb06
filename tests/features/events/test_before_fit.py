"""Files of grid events in which something is wrong are named before a fit; sound ones are not."""

import pytest
from event_files import BAD, GOOD, bad_file, good_file
from tiers import few_of
from unit_events import simulated

from exfit import workflows
from exfit.errors import ExfitError
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
