"""The check of a case: it finds a wrong derivative and a start that is no rest."""

from pathlib import Path

import numpy as np
import pytest
from places import ROOT

from exfit.case.load import load_case, parse_case
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import residuals_of
from exfit.fitting.residuals import Residuals
from exfit.models import MODELS
from exfit.simulation.flat_run import flat_drift
from exfit.workflows.model_check import AGREEMENT, STEPS, check, deviations

WITHOUT_RECORD = """\
model: AC1A
plant: {type: open-circuit, machine: GENROU}
test: {vt0: 1.0, duration: 2.0, vref: [{at: 1.0, step: 0.02}]}
parameters:
  fixed: {TR: 0.02}
  free:
    KA: {start: 400, min: 40, max: 4000}
"""


@pytest.fixture
def first_order():
    return load_case(ROOT / "configs" / "first_order.yaml")


def wrong(column, factor):
    exact = Residuals.exact

    def changed(self, theta):
        jacobian = exact(self, theta)
        jacobian[:, column] *= factor
        return jacobian

    return changed


def test_exact_derivatives_agree(first_order):
    found = check(first_order)
    assert found.agrees
    assert list(found.deviations) == ["k", "a"]
    assert all(len(row) == len(STEPS) for row in found.deviations.values())


@pytest.mark.parametrize(("column", "name"), [(0, "k"), (1, "a")])
def test_a_wrong_derivative_is_found_in_its_column(first_order, monkeypatch, column, name):
    monkeypatch.setattr(Residuals, "exact", wrong(column, 1.0 + 10.0 * AGREEMENT))
    found = check(first_order)
    assert not found.agrees
    assert [key for key, row in found.deviations.items() if min(row) > AGREEMENT] == [name]


def test_a_derivative_that_is_lost_is_found(first_order, monkeypatch):
    monkeypatch.setattr(Residuals, "exact", wrong(0, 0.0))
    assert not check(first_order).agrees


def test_central_differences_gain_two_digits_for_each_smaller_step(first_order):
    rows = deviations(residuals_of(first_order, build_experiments(first_order)))
    for row in rows.values():
        # the error is of second order in the step, until rounding takes over
        assert np.array(row[1:3]) == pytest.approx(np.array(row[:2]) / 100.0, rel=0.2)


def test_a_run_without_a_step_stays_flat(first_order):
    found = check(first_order)
    assert found.flat
    assert found.drift < 1e-12


def test_the_drift_of_a_flat_run_can_be_computed_alone(first_order):
    (setup,) = build_experiments(first_order)
    one, values = setup.experiment, {"k": 4.0, "a": 2.0} | first_order.values()
    assert flat_drift(*one.at(values), ["vt"]) < 1e-12


def test_a_run_that_drifts_is_found(first_order, monkeypatch):
    monkeypatch.setattr("exfit.workflows.model_check.FLAT_DRIFT", -1.0)
    assert not check(first_order).flat


def test_a_case_without_record_and_without_free_parameters_can_be_checked(tmp_path):
    text = WITHOUT_RECORD.partition("  free:")[0]
    found = check(parse_case(text, tmp_path / "bump.yaml"))
    assert found.deviations == {}
    assert found.agrees
    assert found.flat


def test_it_names_what_is_bypassed_and_what_is_taken_as_typical(tmp_path):
    found = check(parse_case(WITHOUT_RECORD, tmp_path / "bump.yaml"))
    assert found.bypassed == ("TB", "TC")
    exciter, machine = found.notes
    assert "KF 0.03" in exciter
    assert "TR" not in exciter
    assert "KA" not in exciter
    assert "Tpd0" in machine


def test_it_names_a_model_whose_diagram_is_in_doubt(tmp_path):
    text = WITHOUT_RECORD.partition("  free:")[0].replace("AC1A", "DC4C")
    found = check(parse_case(text, tmp_path / "bump.yaml"))
    assert f"DC4C {MODELS['DC4C'].doubt}" in found.notes
    assert MODELS["DC4C"].doubt.startswith("rests on one public diagram")


def test_it_reports_the_sub_steps_of_a_fast_case(tmp_path):
    text = WITHOUT_RECORD + "simulation: {step: 0.1}\n"
    found = check(parse_case(text, tmp_path / "bump.yaml"))
    assert found.step == 0.1
    # the shortest time constant is TA = 0.02 s or shorter: five parts of a step at least
    assert found.substeps >= 5


def test_the_error_of_the_step_is_reported_and_falls_sixteenfold_with_it():
    text = WITHOUT_RECORD.replace("step: 0.02}]", "step: 0.001}]")  # off the limits
    errors = [
        check(
            parse_case(
                f"{text}simulation: {{step: {step}, output_step: 0.016}}\n", Path("case.yaml")
            )
        ).step_error
        for step in (0.008, 0.004)
    ]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.2)
