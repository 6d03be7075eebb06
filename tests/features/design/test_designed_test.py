"""Laws of designed tests: the limits hold, additions add, and fits are as good as predicted."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import yaml
from designed_fits import spread_of_fits
from places import CONFIGS

import exfit
from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.features.design.candidates import Limits
from exfit.features.design.experiment_design import identify

CASE = CONFIGS / "ac1a_typical.yaml"
LIMITS = {"vt": 0.04, "efd": 2.6, "efd_min": 0.2}
OF = ("KA", "TE")
ROUNDING = 1e-6  # of sums over samples, in another order


@pytest.fixture(scope="module")
def content():
    """Return a case in which two parameters are free, on a coarse clock: designed at once."""
    content = yaml.safe_load(CASE.read_text())
    free = content["parameters"]["free"]
    content["parameters"] = {
        "fixed": content["parameters"]["fixed"]
        | {name: each["start"] for name, each in free.items() if name not in OF},
        "free": {name: free[name] for name in OF},
    }
    for key in ("record", "validate"):
        content.pop(key)
    content["test"] |= {"duration": 4.0}
    content["simulation"] = {"output_step": 0.02}
    return content


@pytest.fixture(scope="module")
def design(content):
    case = exfit.Case.from_dict(content)
    return exfit.design_test(case, limits=LIMITS, channels=["vt", "efd"])


@pytest.mark.long
def test_the_planned_response_keeps_every_limit(design, content):
    """Simulated anew, as a case with the steps of the sheet."""
    steps = [{"at": step.at, "step": step.step} for step in design.best.steps]
    test = {"vt0": 1.0, "duration": 4.0, "vref": steps}
    signals = exfit.simulate(exfit.Case.from_dict({**content, "test": test})).response.signals
    assert np.abs(signals["vt"] - 1.0).max() <= LIMITS["vt"] + ROUNDING
    assert signals["efd"].max() <= LIMITS["efd"] + ROUNDING
    assert signals["efd"].min() >= LIMITS["efd_min"] - ROUNDING
    level = np.cumsum([step.step for step in design.best.steps])
    assert np.abs(level).max() <= LIMITS["vt"] + ROUNDING
    assert design.best.steps[-1].at < design.best.duration


@pytest.mark.long
def test_every_addition_lowers_the_criterion(design):
    assert len(design.stages) >= 4
    assert all(after.criterion < before.criterion for before, after in pairwise(design.stages))
    assert design.best is design.stages[-1]


def test_a_designed_test_beats_the_best_single_step_with_the_same_limits(design):
    assert design.single.channels == design.best.channels
    assert max(design.ratios.values()) <= 0.7


def test_no_single_step_of_a_finer_ladder_is_better(design, content):
    """The errors are those that `identify` gives a case with that step."""

    def mean_error(step):
        test = {"vt0": 1.0, "duration": 4.0, "vref": [{"at": 1.0, "step": step}]}
        channels = {"vt": design.noise["vt"], "efd": design.noise["efd"]}
        case = exfit.Case.from_dict({**content, "test": test})
        plans = {plan.label: plan for plan in identify(case, channels).plans}
        errors = [plans["+ efd"].confidence.parameters[name].relative_error for name in OF]
        return float(np.sqrt(np.mean(np.square(errors))))

    best = design.single.steps[0].step
    assert mean_error(best) == pytest.approx(design.single.criterion, rel=1e-4)
    # smaller ones show less: the limits alone bound a step
    assert all(mean_error(share * best) > design.single.criterion for share in (0.5, 0.8, 0.95))


@pytest.mark.long
def test_fits_of_simulated_records_scatter_as_predicted(design, content):
    """The spread of 16 is known to 18 %: the bounds are five times that on either side."""
    truth = {name: content["parameters"]["free"][name]["start"] for name in OF}
    spread = np.std(spread_of_fits(content, design, design.best, truth, 16, 3), axis=0)
    predicted = np.array([design.best.errors[name] for name in OF])
    assert (spread / predicted < 1.9).all()
    assert (spread / predicted > 0.3).all()


@pytest.mark.long
def test_the_chosen_parameter_is_known_better_than_where_all_count(design, content):
    case = exfit.Case.from_dict(content)
    alone = exfit.design_test(case, "KA", limits=LIMITS, channels=["vt", "efd"])
    assert alone.of == ("KA",)
    assert alone.best.errors["KA"] <= 1.05 * design.best.errors["KA"]  # both are searches


@pytest.mark.long
def test_the_same_case_gives_the_same_design_and_d_optimal_another_criterion(design, content):
    case = exfit.Case.from_dict(content)
    again = exfit.design_test(case, limits=LIMITS, channels=["vt", "efd"])
    assert again.as_json() == design.as_json()
    volume = exfit.design_test(case, limits=LIMITS, channels=["vt", "efd"], criterion="D")
    # the geometric mean of the axes of an ellipsoid is below the mean square of its shadows
    assert volume.single.criterion <= design.single.criterion


def test_other_values_of_parameters_move_the_extremes(design):
    for signal, (low, high) in design.extremes.items():
        other = design.other_values.extremes[signal]
        assert other[0] <= low + 5e-3
        assert other[1] >= high - 5e-3
    assert design.other_values.extremes != design.extremes


def test_no_step_within_the_limits_is_refused(content):
    case = exfit.Case.from_dict(content)
    with pytest.raises(CaseError, match="no design: not even a single step"):
        exfit.design_test(case, limits={"efd": 1.1}, channels=["vt"])


def test_what_cannot_be_is_refused_by_name():
    for limits in ({"vt": 0.0}, {"vref": -1.0}, {"vt": np.nan}, {"efd": 1.0, "efd_min": 2.0}):
        with pytest.raises(CaseError, match="limit "):
            exfit.design_test(CASE, limits=limits)
    with pytest.raises(CaseError, match="limit VT: not a limit"):
        Limits.of({"VT": 1.0})
    with pytest.raises(CaseError, match=r"of: KX: must be one of KA, .*\n?channels: x: must be"):
        exfit.design_test(CASE, ["KX"], channels=["x"])
    with pytest.raises(CaseError, match="criterion: E: must be one of A, D"):
        exfit.design_test(CASE, criterion="E")
    for duration in (1.0, 1e6, np.nan):
        with pytest.raises(
            CaseError, match=r"duration: .* s: must exceed 2 s and be at most 600 s"
        ):
            exfit.design_test(CASE, duration=duration)
    with pytest.raises(CaseError, match="no reference whose steps are simulated"):
        exfit.design_test(load_case(CONFIGS / "first_order.yaml"))


def test_limits_are_stated_as_they_are_given():
    limits = Limits.of({"vt": 0.03, "efd": 4.0})
    assert limits.given == {"vt": 0.03, "vref": 0.03, "efd": 4.0}
    assert replace(limits, vref=0.1).of_vref == 0.1
