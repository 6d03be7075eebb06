"""The search of a case: what its settings under `estimate` do."""

import numpy as np
import pytest
from records import case_of, config, several
from records import recording as recorded

from exfit.estimate import STATUS, Searches, Stop, TrustRegion, least_squares
from exfit.fitting.parameters import UNIT
from exfit.fitting.search import JACOBIANS, fitted, jacobian_error, search
from exfit.results.model import AT_TOLERANCE
from exfit.util.text import to_json
from exfit.workflows import fit
from exfit.workflows.profiles import profile

ignore = lambda _: None  # noqa: E731


def searched(folder, content, **settings):
    """Return the residuals of a case, and where its search ends under some settings."""
    content = {**content, "estimate": settings}
    case = case_of(content, folder)
    problem = fitted(case)[1]
    return problem.residuals, search(case, problem, case.estimate.strategy, ignore, ignore)[0]


def rms(residuals, theta):
    """Return the root mean square of the weighted error of each channel of each record."""
    ends = np.cumsum(residuals.sizes)[:-1]
    return [np.sqrt(np.mean(own**2)) for own in np.split(residuals(theta)[: residuals.count], ends)]


@pytest.mark.parametrize("prior", [False, True])
def test_the_search_stops_where_the_curves_of_all_records_match(tmp_path, prior):
    limit = 2e-4
    content = several(recorded("up"), recorded("down"))
    if prior:  # far off, so that its residual alone is beyond the limit
        content["parameters"]["free"]["KD"]["prior"] = {"mean": 0.1, "std": 0.02}
    residuals, result = searched(tmp_path, content, stop={"rmse": limit})
    assert result.stop is Stop.MATCH
    assert max(rms(residuals, result.history[-1].x)) <= limit
    assert all(max(rms(residuals, line.x)) > limit for line in result.history[:-1])
    assert result.promise > 0.0
    of_priors = np.ones(len(residuals.priors))
    assert len(of_priors) == prior
    assert residuals.match(np.append(np.zeros(residuals.count), of_priors), 1e-9)


def test_a_start_that_matches_is_the_result(tmp_path):
    _, result = searched(tmp_path, config("ac1a_typical"), stop={"rmse": 1.0})
    assert (result.nit, result.nfev, result.stop) == (0, 1, Stop.MATCH)


def test_a_fit_that_ends_at_a_tolerance_says_so_and_how_far_from_a_minimum(tmp_path):
    content = config("first_order")
    far, near = ({"stop": {"rmse": limit}} for limit in (1e-2, 1e-5))
    for settings, words in ((far, "standard errors away"), (near, "but within 0.1 standard")):
        result = fit(case_of({**content, "estimate": settings}, tmp_path))
        assert result.success
        assert result.outcome == "ended at a tolerance"
        assert any(words in note for note in result.notes)
    whole = fit(case_of(content, tmp_path))
    assert whole.outcome == "converged"
    assert not any("tolerance of the case" in note for note in whole.notes)


def test_the_distance_from_a_minimum_is_that_of_the_costs(tmp_path):
    """In a nearly linear problem: z^2 is twice the cost above the minimum, in variances."""
    content = config("first_order")
    stopped = fit(case_of({**content, "estimate": {"stop": {"rmse": 1e-4}}}, tmp_path))
    whole = fit(case_of(content, tmp_path))
    freedom = len(stopped.comparison.time) - len(stopped.parameters)
    variance = 2.0 * stopped.cost / freedom
    distance = np.sqrt(2.0 * (stopped.cost - whole.cost) / variance)
    assert any(f"may be {distance:.2g} standard errors away" in note for note in stopped.notes)


def test_the_results_know_the_status_of_a_tolerance():
    assert {STATUS[Stop.MATCH], STATUS[Stop.FLAT]} == {*AT_TOLERANCE}


def test_the_gradient_ends_the_search_as_the_thesis_says(tmp_path):
    relative, absolute = 1e-3, 1e-5
    tolerance = {"gradient": relative, "gradient_absolute": absolute}
    _, result = searched(tmp_path, config("ac1a_typical"), tolerance=tolerance)
    norms = [line.gradient_norm for line in result.history]
    limit = relative * norms[0] + absolute
    assert result.stop is Stop.FLAT
    assert norms[-1] <= limit < min(norms[:-1])
    _, guarded = searched(tmp_path, config("ac1a_typical"), tolerance={"gradient": relative})
    assert guarded.stop is not Stop.FLAT
    assert guarded.nit > result.nit


def test_each_phase_has_its_own_limit_of_iterations(tmp_path):
    settings = {"lm": {"update": "ratio"}, "iterations": {"lm": 4, "dgn": 3}}
    _, result = searched(tmp_path, config("ac1a_typical"), **settings)
    assert [line.phase for line in result.history[1:]] == ["lm"] * 4 + ["dgn"] * 3
    assert result.stop is Stop.ITERATIONS


def test_a_phase_without_a_limit_of_its_own_has_the_usual_one(tmp_path):
    content = config("first_order")
    limited = searched(tmp_path, content, iterations={"gn": 1})[1]
    assert limited.nit == searched(tmp_path, content)[1].nit > 1


def test_a_radius_limits_the_first_step_of_levenberg_marquardt(tmp_path):
    residuals, _ = searched(tmp_path, config("ac1a_typical"), iterations=1)
    for radius in (0.1, 0.2):
        result = least_squares(
            residuals,
            residuals.start,
            residuals.exact,
            residuals.bounds,
            "lm",
            max_iterations=1,
            x_scale=residuals.units,
            searches=Searches(lm=TrustRegion(radius / UNIT)),
        )
        assert result.history[1].step_norm == pytest.approx(radius, rel=0.1)  # Moré's slack


def test_the_default_settings_written_out_are_the_default(tmp_path):
    written = {
        "armijo": 1e-4,
        "dgn": {"step": "capped", "cut": "parabola"},
        "lm": {"update": "radius"},
        "iterations": {"gn": 100, "dgn": 100, "lm": 100},
        "tolerance": {"gradient": 1e-8, "step": 1e-10},
    }
    _, result = searched(tmp_path, config("ac1a_typical"), **written)
    _, usual = searched(tmp_path, config("ac1a_typical"))
    assert to_json([list(line.x) for line in result.history]) == to_json(
        [list(line.x) for line in usual.history]
    )


@pytest.mark.parametrize("step", ["capped", "full"])
def test_only_a_capped_step_is_called_capped(tmp_path, step):
    settings = {"strategy": "dgn", "dgn": {"step": step}}
    _, result = searched(tmp_path, config("ac1a_typical"), **settings)
    capped = [line.capped for line in result.history]
    assert capped[0] is None
    assert {*capped[1:]} == ({True, False} if step == "capped" else {False})


def test_the_cut_of_a_step_is_its_half_or_lies_at_the_parabola(tmp_path):
    lengths = {}
    for cut in ("half", "parabola"):
        settings = {"strategy": "dgn", "dgn": {"step": "full", "cut": cut}}
        _, result = searched(tmp_path, config("ac1a_typical"), **settings)
        shortened = [line for line in result.history if line.inner]
        assert shortened
        lengths[cut] = [(line.damping, line.inner) for line in shortened]
    assert all(damping == 0.5**inner for damping, inner in lengths["half"])
    assert all(0.2**inner <= damping <= 0.5**inner for damping, inner in lengths["parabola"])
    assert any(damping != 0.5**inner for damping, inner in lengths["parabola"])


@pytest.mark.parametrize(("kind", "order"), [("central", 2), ("forward", 1), ("backward", 1)])
def test_the_step_of_differences_sets_their_error(tmp_path, kind, order):
    """Half the step: half the error, or a quarter; what is beyond is of a higher order."""
    errors = []
    for step in (2e-3, 1e-3):
        settings = {"jacobian": kind, "difference_step": step}
        case = case_of({**config("first_order"), "estimate": settings}, tmp_path)
        residuals = fitted(case)[1].residuals
        apart = JACOBIANS[kind](residuals, residuals.start) - residuals.exact(residuals.start)
        errors.append(np.linalg.norm(apart))
    assert errors[0] / errors[1] == pytest.approx(2.0**order, rel=0.01)


STARTS = [
    "ac1a_typical",
    "ac8b_unit2",
    *(
        pytest.param(name, marks=pytest.mark.long)
        for name in (
            "ac1a_good",
            "ac1a_low",
            "ac1a_high",
            "ac8b_unit1",
            "ac8b_unit1_ka_free",
            "ac8b_unit2_ka_free",
        )
    ),
]


@pytest.mark.parametrize("name", STARTS)
def test_gauss_newton_moves_from_every_start_of_the_thesis(tmp_path, name):
    _, result = searched(tmp_path, config(name), strategy="gn")
    assert result.cost < 0.95 * result.history[0].cost
    assert result.history[1].inner <= 1
    assert all(line.inner == 0 for line in result.history[2:] if line.step_norm)
    if not result.success:
        assert "strategy dgn" in result.message


def test_robust_leaves_a_full_step_that_fails_to_levenberg_marquardt(tmp_path):
    _, result = searched(tmp_path, config("ac1a_typical"), strategy="robust")
    lines = result.history[1:]
    assert [line.phase for line in lines] == ["gn"] + ["lm"] * (len(lines) - 1)
    assert lines[0].step_norm == 0.0


def test_a_step_of_levenberg_marquardt_is_capped_where_it_is_damped(tmp_path):
    _, result = searched(tmp_path, config("ac1a_typical"), strategy="lm")
    first = [line for line in result.history[1:] if not line.inner]
    assert [line.capped for line in first] == [line.damping > 0.0 for line in first]
    assert {line.capped for line in first} == {True, False}


@pytest.mark.long
def test_armijos_constant_is_that_of_levenberg_marquardt_too(tmp_path):
    least = {}
    for armijo in (1e-4, 0.45):
        _, result = searched(tmp_path, config("ac1a_high"), strategy="lm", armijo=armijo)
        least[armijo] = min(line.quality for line in result.history[1:] if line.step_norm)
    assert least[1e-4] < 0.45 < least[0.45]


def test_the_profiles_are_about_a_minimum_whatever_ends_a_fit(tmp_path):
    content = config("first_order")
    usual = profile(case_of(content, tmp_path), ["k"], ignore)
    stop = {**content, "estimate": {"stop": {"rmse": 0.1}}}
    assert profile(case_of(stop, tmp_path), ["k"], ignore).cost == usual.cost


@pytest.mark.parametrize(
    ("jacobian", "step"),
    [("central", None), ("central", 1e-3), ("forward", None), ("backward", None)],
)
def test_what_differences_make_of_a_redundant_gain_lies_below_their_error(jacobian, step, tmp_path):
    """With TA = 0 only the products of KA act: one direction is seen by none of the signals."""
    content = {**config("ac8b_unit1_ka_free"), "estimate": {"jacobian": jacobian}}
    if step is not None:
        content["estimate"]["difference_step"] = step
    residuals = fitted(case_of(content, tmp_path))[1].compressed
    low, high = residuals.bounds
    rng, error = np.random.default_rng(2026), jacobian_error(jacobian, step)
    for _ in range(3):
        theta = residuals.start + 0.05 * rng.uniform(-1.0, 1.0, len(low)) * (high - low)
        quotients = JACOBIANS[jacobian](residuals, np.clip(theta, low, high))
        singular = np.linalg.svd(quotients, compute_uv=False)
        # what rounding makes is a third of the error, what the record determines ten times it
        assert singular[-1] < error * singular[0]
        assert singular[-2] > 3.0 * error * singular[0]


def test_a_search_by_differences_leaves_a_redundant_gain_alone(tmp_path):
    """It takes the path of exact derivatives: else a direction that rounding makes is tried.

    The differences are right to 1e-8 of the largest singular value, the least other one is 2e-4.
    """
    content = config("ac8b_unit1_ka_free")
    _, exact = searched(tmp_path, content, strategy="dgn")
    _, result = searched(tmp_path, content, strategy="dgn", jacobian="central")
    assert result.success
    assert result.cost == pytest.approx(exact.cost, rel=1e-6)
    for line, expected in zip(result.history[:6], exact.history[:6], strict=True):
        assert line.x == pytest.approx(expected.x, abs=1e-3)
        assert line.inner == expected.inner
