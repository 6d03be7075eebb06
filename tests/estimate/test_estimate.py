"""The estimator against known minima and SciPy's least_squares (nobody here wrote it)."""

import subprocess
import sys
from inspect import signature

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from known_minima import CERTIFIED, KNOWN, TEXTBOOK, Case, random_problem
from more_garbow_hillstrom import rosenbrock
from scipy.optimize import least_squares as scipy_least_squares
from tiers import few_of

from exfit import estimate
from exfit.estimate import least_squares
from exfit.estimate.linear import bounded_minimum
from exfit.estimate.searches import ArmijoDamping, FullStep, LineSearch, RatioDamping, TrustRegion
from exfit.estimate.solver import STRATEGIES
from exfit.util.vocabulary import PHASES
from exfit.util.vocabulary import STRATEGIES as EXPLANATIONS

EVERY_METHOD = list(STRATEGIES)
SAFE_METHODS = [method for method in STRATEGIES if method != "gn"]  # full steps may diverge
TIGHT = {"ftol": 1e-20, "gtol": 1e-14, "xtol": 1e-14, "max_iterations": 400}


def as_good_as(squares, wanted):
    """A vanishing sum of squares is reached to 1e-12: Powell's function has a singular Jacobian."""
    return squares <= wanted * (1.0 + 1e-7) + 1e-12


@pytest.mark.parametrize("method", SAFE_METHODS)
@pytest.mark.parametrize("name", few_of(KNOWN, 8))
def test_finds_the_known_minimum(name, method):
    case = KNOWN[name]
    found = least_squares(case.fun, case.starts[-1], case.jac, method=method, max_iterations=200)
    assert found.success, found.message
    assert as_good_as(2.0 * found.cost, case.squares)


@pytest.mark.parametrize("name", CERTIFIED)
def test_agrees_with_the_certified_values(name):
    # at tight tolerances the rounding of f leaves about half of the sixteen digits
    case = CERTIFIED[name]
    found = least_squares(case.fun, case.starts[-1], case.jac, method="dgn", **TIGHT)
    assert found.x == pytest.approx(case.minimum, rel=1e-6)
    assert 2.0 * found.cost == pytest.approx(case.squares, rel=1e-8)


@pytest.mark.parametrize("name", ["Misra1a", "MGH10", "Eckerle4", "Thurber", "Lanczos3"])
def test_finds_the_certified_minimum_from_the_far_start(name):
    case = CERTIFIED[name]
    found = least_squares(case.fun, case.starts[0], case.jac, method="lm", max_iterations=400)
    assert 2.0 * found.cost == pytest.approx(case.squares, rel=1e-7)


def minpack(case, start):
    # with tolerances that give it as many digits as exfit's defaults give
    return scipy_least_squares(
        case.fun, start, case.jac, method="lm", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=2000
    )


def test_levenberg_marquardt_needs_no_more_than_minpack():
    wins, total, theirs = [], 0, 0
    for case in KNOWN.values():
        found = least_squares(case.fun, case.starts[-1], case.jac, method="lm")
        other = minpack(case, case.starts[-1])
        wins.append(found.nfev + found.njev <= other.nfev + other.njev)
        total, theirs = total + found.nfev + found.njev, theirs + other.nfev + other.njev
    assert np.mean(wins) > 0.75  # on most problems
    assert total <= theirs  # and on all of them together


@pytest.mark.parametrize("jac", ["2-point", "3-point"])
@pytest.mark.parametrize("name", ["rosenbrock", "beale", "osborne 1", "Misra1a", "Thurber"])
def test_differences_lead_to_the_same_minimum(name, jac):
    case = KNOWN[name]
    found = least_squares(case.fun, case.starts[-1], jac)
    assert as_good_as(2.0 * found.cost, case.squares)


@pytest.mark.parametrize(("jac", "accuracy"), [("2-point", 1e-6), ("3-point", 1e-9)])
@pytest.mark.parametrize("side", ["inside", "at the lower bound", "at the upper bound"])
def test_differences_equal_the_exact_jacobian(jac, accuracy, side):
    case = CERTIFIED["Misra1a"]
    x = np.array(case.minimum)
    bounds = {"inside": (0.0, np.inf), "at the lower bound": (x, np.inf)}.get(side, (0.0, x))
    found = least_squares(case.fun, x, jac, bounds, max_iterations=0)
    exact = case.jac(x)
    assert found.jac == pytest.approx(exact, rel=1e-6, abs=accuracy * abs(exact).max())


@pytest.mark.parametrize("method", SAFE_METHODS)
def test_exactly_redundant_parameters_do_no_harm(method):
    # the product of the first two is all that is seen, as with KA and the gains of the PID
    case = CERTIFIED["Misra1a"]
    fun = lambda z: case.fun(np.array([np.exp(z[0] + z[1]), np.exp(z[2])]))  # noqa: E731
    start = np.log([25.0, 10.0, 5e-4])
    found = least_squares(
        fun, start, Case(fun, (), 0.0).jac, (start - 5.0, start + 5.0), method, x_scale=1.0
    )
    assert found.success
    assert 2.0 * found.cost == pytest.approx(case.squares, rel=1e-9)
    # least norm: neither of the two moves more than the other
    assert found.x[0] - start[0] == pytest.approx(found.x[1] - start[1], abs=1e-6)


@pytest.mark.parametrize("weakness", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("method", ["dgn", "lm", "auto"])
def test_reaches_the_floor_of_a_nearly_singular_valley(weakness, method):
    t = np.linspace(0.0, 1.0, 50)

    def fun(z):
        strong = np.exp(z[0] + z[1]) * np.exp(-t) - np.e * np.exp(-t)
        return np.append(strong, weakness * (z[0] - z[1]))

    found = least_squares(fun, [2.0, -3.0], Case(fun, (), 0.0).jac, method=method, x_scale=1.0)
    # the floor is at (1/2, 1/2); the condition of J is about 10 / weakness
    assert found.success
    assert found.x == pytest.approx([0.5, 0.5], abs=1e-6)
    assert found.nfev < 30


@pytest.mark.parametrize("method", SAFE_METHODS)
@pytest.mark.parametrize("seed", few_of(range(12), 4))
def test_active_bounds_cost_no_more_than_scipy_finds(seed, method):
    fun, jac, start, bounds = random_problem(seed)
    found = least_squares(fun, start, jac, bounds, method)
    others = [
        scipy_least_squares(fun, start, jac, bounds, other, ftol=1e-14, xtol=1e-14, gtol=1e-14)
        for other in ("trf", "dogbox")
    ]
    assert found.success, found.message
    assert found.cost <= min(other.cost for other in others) * (1.0 + 1e-8)
    assert found.nfev <= 30


def test_the_random_problems_have_active_bounds():
    active = 0
    for seed in range(12):
        fun, jac, start, bounds = random_problem(seed)
        x = least_squares(fun, start, jac, bounds).x
        active += np.count_nonzero((x == bounds[0]) | (x == bounds[1]))
    assert active >= 12  # exactly on the bound, and on average one of the four


@pytest.mark.parametrize("method", SAFE_METHODS)
def test_a_bound_is_left_when_the_minimum_lies_inside(method):
    found = least_squares(
        rosenbrock, [-1.2, 0.0], TEXTBOOK["rosenbrock"].jac, ([-1.2, 0.0], [5.0, 9.0]), method
    )
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-6)


@pytest.mark.parametrize("method", EVERY_METHOD)
def test_stops_exactly_on_a_bound_that_binds(method):
    found = least_squares(
        rosenbrock, [0.4, 1.0], TEXTBOOK["rosenbrock"].jac, (-9.0, [0.5, 9.0]), method
    )
    assert found.x[0] == 0.5
    assert found.x[1] == pytest.approx(0.25, abs=1e-8)
    assert found.optimality < 1e-6
    assert found.grad[0] < 0.0  # it would like to go on


@pytest.mark.parametrize("jac", ["2-point", "3-point"])
def test_a_variable_without_room_stays(jac):
    found = least_squares(rosenbrock, [0.3, 1.0], jac, ([0.3, -9.0], [0.3, 9.0]))
    assert found.x == pytest.approx([0.3, 0.09], abs=1e-7)
    assert found.x[0] == 0.3


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 7),
    deficiency=st.integers(0, 3),
)
def test_the_bounded_linear_problem_meets_its_optimality_conditions(seed, n, deficiency):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    left, s, right = np.linalg.svd(A)
    s[n - min(deficiency, n - 1) :] = 0.0
    A = (left * s) @ right
    b = rng.standard_normal(n)
    low, high = -rng.exponential(1.0, n), rng.exponential(1.0, n)
    low[rng.random(n) < 0.2] = 0.0
    y = bounded_minimum(A, b, low, high)
    slope = A.T @ (A @ y + b)
    size = 1e-8 * (1.0 + np.linalg.norm(A) * np.linalg.norm(b))
    assert np.all((low <= y) & (y <= high))
    assert np.all(slope[y > low] <= size)
    assert np.all(slope[y < high] >= -size)


def test_more_parameters_than_residuals_gives_the_nearest_of_all_minima():
    found = least_squares(lambda x: np.array([x[0] + x[1] - 2.0]), [0.0, 0.0], x_scale=1.0)
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-6)


def test_scipy_is_not_imported():
    code = (
        "import sys, exfit.estimate as estimate; [getattr(estimate, n) for n in estimate.__all__]; "
        "sys.exit('scipy' in ''.join(sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_package_offers_what_its_users_name():
    assert set(estimate.__all__) == {
        "AT_TOLERANCE",
        "STATUS",
        "ArmijoDamping",
        "CostProfile",
        "Descent",
        "Functions",
        "LineSearch",
        "LocalMinimum",
        "LowerMinimum",
        "MultistartResult",
        "OneByOne",
        "ProfileEnd",
        "Progress",
        "RatioDamping",
        "Result",
        "Searches",
        "SolverIteration",
        "Stop",
        "TrustRegion",
        "half_square",
        "least_squares",
        "multistart",
        "profile",
        "profiles",
        "spread",
        "to_half",
        "to_parabola",
    }
    assert all(hasattr(estimate, name) for name in estimate.__all__)
    assert list(signature(least_squares).parameters)[:5] == ["fun", "x0", "jac", "bounds", "method"]


def test_every_search_has_a_phase_with_a_name():
    searches = (FullStep(), LineSearch(), TrustRegion(), RatioDamping(), ArmijoDamping())
    assert {search.phase for search in searches} == {*PHASES}


def test_every_strategy_with_a_name_has_its_function():
    assert tuple(EXPLANATIONS) == tuple(STRATEGIES)
