"""What speaks against a simulated run: rest that does not hold, impossible voltages, long steps."""

from dataclasses import replace

import numpy as np
import pytest
from places import CONFIGS

from exfit.case.load import load_case
from exfit.verdict.run_quality import voltage_notes
from exfit.workflows import check, simulate, validate

UNSTABLE = {"KA": 7000.0, "KF": 0.0024}


@pytest.fixture(scope="module")
def case():
    return load_case(CONFIGS / "ac1a_typical.yaml")


def of_rest(notes):
    return [note for note in notes if note.startswith("unstable at rest")]


def test_an_unstable_rest_is_noted_with_its_eigenvalue(case):
    (note,) = of_rest(simulate(case, UNSTABLE).notes)
    assert "eigenvalue 2.44 ± 24.8j 1/s: an oscillation of 3.95 Hz grows e-fold in 0.41 s" in note
    assert of_rest(simulate(case).notes) == []


def test_a_validation_and_a_check_note_it_too(case):
    matches = validate(case, UNSTABLE)
    assert len(of_rest(matches[-1].notes)) == 1
    assert of_rest(validate(case, {})[-1].notes) == []
    assert len(of_rest(check(case.with_values(UNSTABLE, "test")).notes)) == 1
    assert of_rest(check(case).notes) == []


def test_a_voltage_that_no_unit_has_is_noted_with_its_instant(case):
    time = np.array([0.0, 1.0, 2.0, 3.0])
    (note,) = voltage_notes(case, time, np.array([1.0, 1.9, -2.5, -6591.0]))
    assert note.startswith("vt is beyond 2 pu from 2 s on, -6591 pu at most")
    assert [*voltage_notes(case, time, np.array([1.0, 1.9, -1.9, 2.0]))] == []
    without = load_case(CONFIGS / "first_order.yaml")
    assert [*voltage_notes(without, time, np.full(4, 3.0))] == []


def test_a_step_that_is_too_long_is_noted(case):
    coarse = replace(case, simulation=case.simulation.model_copy(update={"step": 0.05}))
    assert any("halving the step of 0.05 s changes vt" in note for note in simulate(coarse).notes)
    assert not any("halving" in note for note in simulate(case).notes)
