"""Compressed records: cost, gradient and J'J of all samples where they are made, and when not."""

import numpy as np
import pytest
from records import UNIT, case_of, found_in, one, synthetic
from tiers import few_of

from exfit.fitting import compression as module
from exfit.fitting import problem as of_problem
from exfit.fitting import uncertainty
from exfit.fitting.build import build_experiments
from exfit.fitting.compression import compressed, is_as_all
from exfit.fitting.problem import FitProblem, problem_of, residuals_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import search
from exfit.fitting.uncertainty import linearisation, uncertainty_at
from exfit.inference.confidence import confidence
from exfit.workflows import fit

TEST = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}, {"at": 2.0, "step": -0.03}]}
SEED = 3
DENSE = 20_000  # samples in 3 s, at random instants
COARSE = {"simulation": {"step": 0.01}}
CHANNELS = {"vt": "vt", "efd": {"column": "efd", "weight": 0.02}}
AGREE = 1e-8  # relative: polynomials follow the response within a ten-millionth of its noise


def dense_case(folder, record=None, channels=None, sections=None, test=None):
    """Return a case whose record has many samples, and dozens to each step of a coarse grid."""
    rng = np.random.default_rng(SEED)
    time = np.sort(rng.uniform(0.0, 3.0, DENSE))
    synthetic(folder, TEST, time, signals=("vt", "efd"))
    content = {**one(test or TEST, channels or CHANNELS, tuple(UNIT), **(record or {}))}
    content["parameters"]["free"]["TE"]["prior"] = {"mean": 1.4, "std": "10 %"}
    return case_of({**content, **(sections or {})}, folder)


def residuals(case):
    return residuals_of(
        case, [one.with_enough_substeps(case.values()) for one in build_experiments(case)]
    )


def forms(found, theta):
    """Return cost, gradient and J'J."""
    r, slopes = found(theta), found.exact(theta)
    return 0.5 * float(r @ r), slopes.T @ r, slopes.T @ slopes


OF_RECORD = {
    "vt0": found_in(1.0, 0.9, 1.1),
    "vref": [
        {"at": found_in(1.0, 0.8, 1.2), "step": 0.05},
        {"at": 2.0, "step": found_in(-0.03, -0.05, -0.01)},
    ],
}


@pytest.mark.parametrize(
    ("record", "test", "sections"),
    few_of(
        [
            ({}, TEST, {}),
            ({}, OF_RECORD, {}),
            ({"mask": [[0.4, 0.7], [1.001, 1.004]]}, TEST, COARSE),
            ({"window": [0.2, 2.03], "delay": 0.0123}, TEST, {}),
            ({}, {**TEST, "begin": -0.5}, {}),
        ],
        2,
    ),
    ids=["whole", "of the record", "mask, coarse grid", "ends with a step, late", "begins early"],
)
def test_cost_and_gradient_and_curvature_are_those_of_all_samples(tmp_path, record, test, sections):
    """Where samples are left out, too, and some stand for themselves."""
    every = residuals(dense_case(tmp_path, record, sections=sections, test=test))
    rng = np.random.default_rng(SEED)
    for _ in range(3):
        theta = every.start + rng.uniform(-0.3, 0.3, len(every.start))
        few = compressed(every, theta)
        assert module.LEAST_GAIN * few.count < every.count
        assert is_as_all(few, every, theta)
        for all_, ours in zip(forms(every, theta), forms(few, theta), strict=True):
            assert ours == pytest.approx(all_, rel=AGREE, abs=AGREE * np.max(np.abs(all_)))


def test_what_another_set_does_is_seen(tmp_path):
    """Three times the gain and a tenth of a time constant: the costs agree to a thousandth."""
    every = residuals(dense_case(tmp_path))
    few = compressed(every)
    rng = np.random.default_rng(SEED)
    for _ in range(10):
        theta = np.clip(every.start + rng.uniform(-1.0, 1.0, len(every.start)), *every.bounds)
        assert few.costs([theta]) == pytest.approx(every.costs([theta]), rel=1e-3)


@pytest.mark.long
def test_a_match_of_the_curves_is_that_of_all_samples(tmp_path):
    """Each channel by itself: the larger root mean square decides."""
    every = residuals(dense_case(tmp_path))
    few = compressed(every)
    whole, short = every(every.start), few(every.start)
    ends = np.cumsum(every.sizes)
    parts = np.split(whole[: every.count], ends[:-1])
    limit = max(float(np.sqrt(np.mean(part**2))) for part in parts)
    assert len(parts) == len(CHANNELS)
    for factor, matches in ((1.0 + 1e-9, True), (1.0 - 1e-9, False)):
        assert every.match(whole, factor * limit) is matches
        assert few.match(short, factor * limit) is matches


@pytest.mark.long
def test_a_fit_ends_where_that_of_all_samples_ends(tmp_path, monkeypatch):
    case = dense_case(tmp_path, sections={"estimate": {"strategy": "auto"}})
    ours = fit(case)
    left_whole = []
    monkeypatch.setattr(of_problem, "compressed", lambda whole: left_whole.append(whole) or whole)
    every = fit(case)
    assert left_whole
    assert ours.message == every.message
    # near the end rounding decides on a last iteration
    assert (ours.nfev, ours.njev) == pytest.approx((every.nfev, every.njev), abs=1)
    assert ours.cost == pytest.approx(every.cost, rel=AGREE)
    assert ours.knowledge.sentences[-1] == every.knowledge.sentences[-1]  # of the intervals
    for name, value in every.values.items():
        # costs that agree to 1e-10 leave values a thousandth of their errors apart at most
        assert ours.values[name] == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("channels", few_of([{"vt": "vt"}, CHANNELS], 1), ids=["vt", "vt and efd"])
def test_errors_and_intervals_are_those_of_all_samples(tmp_path, monkeypatch, channels):
    """Several channels share out their degrees of freedom by samples, as they are too few to fit.

    Of all samples each channel has its own: of 20,000 samples and 7 parameters no part in 1000.
    """
    agree = 1e-6 if len(channels) == 1 else 1e-3
    whole = residuals(dense_case(tmp_path, channels=channels))
    every = confidence(linearisation(FitProblem(whole, whole), whole.start, ()))
    monkeypatch.setattr(uncertainty, "MOST_NUMBERS_AT_ONCE", 0)
    ours = confidence(linearisation(problem_of(whole), whole.start, ()))
    assert ours.dof == pytest.approx(every.dof, rel=1e-6)
    for name, one_ in every.parameters.items():
        assert ours.parameters[name].std_error == pytest.approx(one_.std_error, rel=agree)
    for ours_, theirs in zip(ours.noise, every.noise, strict=True):
        assert ours_.std == pytest.approx(theirs.std, rel=agree)
        assert len(channels) > 1 or ours_.p_value == theirs.p_value


@pytest.mark.long
def test_a_match_is_as_good_as_that_of_all_samples(tmp_path, monkeypatch):
    """What is known beforehand is one more residual of both."""
    asked = {}

    def stopped(descent, start, _):
        asked[len(descent.functions.fun(start))] = descent.good_enough
        raise KeyboardInterrupt

    match = {"estimate": {"good_enough": {"rmse": 2e-4}}}
    case = dense_case(tmp_path, sections=match)
    every = residuals(case)
    few = compressed(every)
    monkeypatch.setattr("exfit.estimate.Descent.run", stopped)
    for problem in (FitProblem(every, every), FitProblem(every, few)):
        with pytest.raises(KeyboardInterrupt):
            search(case, problem, "auto", print, print)
    squares = [count * limit**2 for count, limit in asked.items()]
    assert set(asked) == {every.count + 1, few.count + 1}
    assert squares[0] == pytest.approx(squares[1], rel=1e-12)


@pytest.mark.long
def test_sensitivities_are_at_the_instants_of_the_record(tmp_path):
    """A recorder's delay is in them, too."""
    case = dense_case(tmp_path, {"delay": 0.2})
    whole = residuals(case)
    theta = whole.start
    (ours, _) = uncertainty_at(problem_of(whole), theta, ()).sensitivity
    (every, _) = uncertainty_at(FitProblem(whole, whole), theta, ()).sensitivity
    assert len(ours.time) < len(every.time)
    later = ours.time <= every.time[-1]
    for name, moved in ours.moved.items():
        line = np.interp(ours.time[later], every.time, every.moved[name])
        # which lies between samples up to a millisecond apart
        most = 1e-3 * np.max(np.abs(line))
        np.testing.assert_allclose(moved[later], line, rtol=0.0, atol=most)


def filtered(filter_):
    return {"channels": {"vt": {"column": "vt", "filter": filter_}}}


ONE_STEP = {"vt0": 1.0, "vref": [{"at": found_in(1.0, 0.8, 1.2), "step": 0.05}]}


@pytest.mark.long
@pytest.mark.parametrize(
    ("record", "sections", "test"),
    [
        (filtered({"median": 3}), {}, TEST),
        ({"channels": {"vt": {"column": "vt", "averaged": 0.1}, "efd": "efd"}}, {}, TEST),
        ({"delay": found_in(0.0, -0.1, 0.1)}, {}, TEST),
        ({"channels": {"vt": {"column": "vt", "offset": found_in(0.0, -0.1, 0.1)}}}, {}, TEST),
        ({"channels": {"vt": {"column": "vt", "scale": found_in(1.0, 0.9, 1.1)}}}, {}, TEST),
        ({}, {"estimate": {"loss": "huber"}}, TEST),
        ({"channels": {"vt": "vt"}}, {}, ONE_STEP),
    ],
    ids=["filter", "one averaged", "delay", "offset", "scale", "loss", "only instant"],
)
def test_what_is_not_a_quadratic_form_of_the_grid_stays_as_it_is(tmp_path, record, sections, test):
    given = {key: value for key, value in record.items() if key != "channels"}
    case = dense_case(tmp_path, given, record.get("channels"), sections, test)
    every = residuals(case)
    assert compressed(every) is every


def test_a_record_with_few_samples_stays_as_it_is(tmp_path):
    synthetic(tmp_path, TEST, np.arange(0.0, 3.0, 0.01))
    every = residuals(case_of(one(TEST, free=("KA",)), tmp_path))
    assert isinstance(every, Residuals)
    assert compressed(every) is every
