"""The estimator against known minima, SciPy's least_squares (nobody here wrote it) and its laws.

Problems: Moré, Garbow & Hillstrom 1981 (data and minima), and the nonlinear regression sets of
the NIST Statistical Reference Datasets with their certified values (eleven digits).
"""

import subprocess
import sys
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares as scipy_least_squares

from exfit.estimate import (
    STATUS,
    STRATEGIES,
    Stop,
    bounded_minimum,
    half_square,
    least_squares,
)

EVERY_METHOD = list(STRATEGIES)
TIGHT = {"ftol": 1e-20, "gtol": 1e-14, "xtol": 1e-14, "max_iterations": 400}


@dataclass(frozen=True)
class Case:
    """A residual function, where to start, and the sum of squares and point to be found."""

    fun: object
    starts: tuple
    squares: float
    minimum: tuple | None = None

    def jac(self, x):
        """Complex step: exact to rounding, for functions that accept complex numbers."""
        columns = [np.imag(self.fun(x + 1e-30j * unit)) / 1e-30 for unit in np.eye(len(x))]
        return np.column_stack(columns)


def numbers(text):
    return np.array(text.split(), dtype=float)


def rosenbrock(x):
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def powell_singular(x):
    return np.array(
        [
            x[0] + 10.0 * x[1],
            np.sqrt(5.0) * (x[2] - x[3]),
            (x[1] - 2.0 * x[2]) ** 2,
            np.sqrt(10.0) * (x[0] - x[3]) ** 2,
        ]
    )


def beale(x):
    powers = np.array([1, 2, 3])
    return np.array([1.5, 2.25, 2.625]) - x[0] * (1.0 - x[1] ** powers)


def box3d(x):
    t = 0.1 * np.arange(1, 11)
    return np.exp(-t * x[0]) - np.exp(-t * x[1]) - x[2] * (np.exp(-t) - np.exp(-10.0 * t))


def wood(x):
    return np.array(
        [
            10.0 * (x[1] - x[0] ** 2),
            1.0 - x[0],
            np.sqrt(90.0) * (x[3] - x[2] ** 2),
            1.0 - x[2],
            np.sqrt(10.0) * (x[1] + x[3] - 2.0),
            (x[1] - x[3]) / np.sqrt(10.0),
        ]
    )


OSBORNE = numbers(
    ".844 .908 .932 .936 .925 .908 .881 .850 .818 .784 .751 .718 .685 .658 .628 .603 .580 .558"
    " .538 .522 .506 .490 .478 .467 .457 .448 .438 .431 .424 .420 .414 .411 .406"
)


def osborne1(x):
    t = 10.0 * np.arange(33)
    return OSBORNE - (x[0] + x[1] * np.exp(-t * x[3]) + x[2] * np.exp(-t * x[4]))


MISRA = (
    numbers("77.6 114.9 141.1 190.8 239.9 289.0 332.8 378.4 434.8 477.3 536.8 593.1 689.1 760.0"),
    numbers("10.07 14.73 17.94 23.93 29.61 35.18 40.02 44.82 50.76 55.05 61.01 66.40 75.47 81.78"),
)
KOWALIK = (
    numbers("4 2 1 .5 .25 .167 .125 .1 .0833 .0714 .0625"),
    numbers(".1957 .1947 .1735 .16 .0844 .0627 .0456 .0342 .0323 .0235 .0246"),
)
MEYER = (
    50.0 + 5.0 * np.arange(16),
    numbers(
        "34780 28610 23650 19630 16370 13720 11540 9744 8261 7030 6005 5147 4427 3820 3307 2872"
    ),
)
BOXBOD = (numbers("1 2 3 5 7 10"), numbers("109 149 149 191 213 224"))
ECKERLE = (
    np.concatenate(
        [np.arange(400, 436, 5.0), 435 + 1.5 * np.arange(1, 21), 470 + 5.0 * np.arange(7)]
    ),
    numbers(
        ".0001575 .0001699 .0002350 .0003102 .0004917 .0008710 .0017418 .0046400 .0065895"
        " .0097302 .0149002 .0237310 .0401683 .0712559 .1264458 .2073413 .2902366 .3445623"
        " .3698049 .3668534 .3106727 .2078154 .1164354 .0616764 .0337200 .0194023 .0117831"
        " .0074357 .0022732 .0008800 .0004579 .0002345 .0001586 .0001143 .0000710"
    ),
)
THURBER = (
    numbers(
        "-3.067 -2.981 -2.921 -2.912 -2.840 -2.797 -2.702 -2.699 -2.633 -2.481 -2.363 -2.322"
        " -1.501 -1.460 -1.274 -1.212 -1.100 -1.046 -.915 -.714 -.566 -.545 -.400 -.309 -.109"
        " -.103 .010 .119 .377 .790 .963 1.006 1.115 1.572 1.841 2.047 2.200"
    ),
    numbers(
        "80.574 84.248 87.264 87.195 89.076 89.608 89.868 90.101 92.405 95.854 100.696 101.060"
        " 401.672 390.724 567.534 635.316 733.054 759.087 894.206 990.785 1090.109 1080.914"
        " 1122.643 1178.351 1260.531 1273.514 1288.339 1327.543 1353.863 1414.509 1425.208"
        " 1421.384 1442.962 1464.350 1468.705 1447.894 1457.628"
    ),
)
LANCZOS = (
    0.05 * np.arange(24),
    numbers(
        "2.5134 2.0443 1.6684 1.3664 1.1232 .9269 .7679 .6389 .5338 .4479 .3776 .3197 .2720"
        " .2325 .1997 .1723 .1493 .1301 .1138 .1000 .0883 .0783 .0698 .0624"
    ),
)


def regression(data, model):
    return lambda b: model(data[0], b) - data[1]


def cubic_ratio(t, b):
    return (b[0] + b[1] * t + b[2] * t**2 + b[3] * t**3) / (
        1.0 + b[4] * t + b[5] * t**2 + b[6] * t**3
    )


kowalik = regression(KOWALIK, lambda t, b: b[0] * (t**2 + t * b[1]) / (t**2 + t * b[2] + b[3]))
meyer = regression(MEYER, lambda t, b: b[0] * np.exp(b[1] / (t + b[2])))

TEXTBOOK = {
    "rosenbrock": Case(rosenbrock, ((-1.2, 1.0),), 0.0, (1.0, 1.0)),
    "powell singular": Case(powell_singular, ((3.0, -1.0, 0.0, 1.0),), 0.0),
    "beale": Case(beale, ((1.0, 1.0),), 0.0, (3.0, 0.5)),
    "box3d": Case(box3d, ((0.0, 10.0, 20.0),), 0.0),
    "wood": Case(wood, ((-3.0, -1.0, -3.0, -1.0),), 0.0, (1.0, 1.0, 1.0, 1.0)),
    "kowalik-osborne": Case(kowalik, ((0.25, 0.39, 0.415, 0.39),), 3.0750560385e-4),
    "meyer": Case(meyer, ((0.02, 4000.0, 250.0),), 87.945855171),
    "osborne 1": Case(osborne1, ((0.5, 1.5, -1.0, 0.01, 0.02),), 5.4648946975e-5),
}
CERTIFIED = {
    "Misra1a": Case(
        regression(MISRA, lambda t, b: b[0] * (1.0 - np.exp(-b[1] * t))),
        ((500.0, 1e-4), (250.0, 5e-4)),
        1.2455138894e-01,
        (2.3894212918e02, 5.5015643181e-04),
    ),
    "MGH09": Case(
        kowalik,
        ((25.0, 39.0, 41.5, 39.0), (0.25, 0.39, 0.415, 0.39)),
        3.0750560385e-04,
        (1.9280693458e-01, 1.9128232873e-01, 1.2305650693e-01, 1.3606233068e-01),
    ),
    "MGH10": Case(
        meyer,
        ((2.0, 400000.0, 25000.0), (0.02, 4000.0, 250.0)),
        8.7945855171e01,
        (5.6096364710e-03, 6.1813463463e03, 3.4522363462e02),
    ),
    "BoxBOD": Case(
        regression(BOXBOD, lambda t, b: b[0] * (1.0 - np.exp(-b[1] * t))),
        ((1.0, 1.0), (100.0, 0.75)),
        1.1680088766e03,
        (2.1380940889e02, 5.4723748542e-01),
    ),
    "Eckerle4": Case(
        regression(ECKERLE, lambda t, b: b[0] / b[1] * np.exp(-0.5 * ((t - b[2]) / b[1]) ** 2)),
        ((1.0, 10.0, 500.0), (1.5, 5.0, 450.0)),
        1.4635887487e-03,
        (1.5543827178e00, 4.0888321754e00, 4.5154121844e02),
    ),
    "Thurber": Case(
        regression(THURBER, cubic_ratio),
        (
            (1000.0, 1000.0, 400.0, 40.0, 0.7, 0.3, 0.03),
            (1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05),
        ),
        5.6427082397e03,
        (
            1.2881396800e03,
            1.4910792535e03,
            5.8323836877e02,
            7.5416644291e01,
            9.6629502864e-01,
            3.9797285797e-01,
            4.9727297349e-02,
        ),
    ),
    "Lanczos3": Case(
        regression(LANCZOS, lambda t, b: sum(b[k] * np.exp(-b[k + 1] * t) for k in (0, 2, 4))),
        ((1.2, 0.3, 5.6, 5.5, 6.5, 7.6), (0.5, 0.7, 3.6, 4.2, 4.0, 6.3)),
        1.6117193594e-08,
        (
            8.6816414977e-02,
            9.5498101505e-01,
            8.4400777463e-01,
            2.9515951832e00,
            1.5825685901e00,
            4.9863565084e00,
        ),
    ),
}
KNOWN = {**TEXTBOOK, **CERTIFIED}


def as_good_as(squares, wanted, relative=1e-7):
    """A vanishing sum of squares is reached to 1e-12: Powell's function has a singular Jacobian."""
    return squares <= wanted * (1.0 + relative) + 1e-12


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
@pytest.mark.parametrize("name", KNOWN)
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
    return scipy_least_squares(
        case.fun, start, case.jac, method="lm", ftol=1e-10, xtol=1e-10, gtol=1e-10, max_nfev=2000
    )


def test_levenberg_marquardt_needs_no_more_than_minpack():
    wins, total, theirs = [], 0, 0
    for case in KNOWN.values():
        found = least_squares(case.fun, case.starts[-1], case.jac, method="lm")
        other = minpack(case, case.starts[-1])
        wins.append(found.nfev + found.njev <= other.nfev + other.njev)
        total, theirs = total + found.nfev + found.njev, theirs + other.nfev + other.njev
    assert np.mean(wins) > 0.75
    assert total < 1.02 * theirs


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


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
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


def random_problem(seed):
    """A sum of exponentials with noise, its start, and bounds of which some bind."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 60)
    truth = rng.uniform([0.5, 0.2, 0.5, 1.5], [2.0, 1.0, 2.0, 4.0])
    model = lambda x: x[0] * np.exp(-x[1] * t) + x[2] * np.exp(-x[3] * t)  # noqa: E731
    data = model(truth) + 1e-2 * rng.standard_normal(len(t))
    low = truth * rng.uniform(0.4, 1.1, 4)
    high = low + truth * rng.uniform(0.1, 0.8, 4)
    fun = lambda x: model(x) - data  # noqa: E731
    return fun, Case(fun, (), 0.0).jac, 0.5 * (low + high), (low, high)


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
@pytest.mark.parametrize("seed", range(12))
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


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
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
    method=st.sampled_from(EVERY_METHOD),
    jac=st.sampled_from(["2-point", "3-point", "exact"]),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_laws_that_hold_for_every_run(seed, method, jac):
    fun, exact, start, (low, high) = random_problem(seed)
    calls = []

    def counted(x):
        assert np.all(low <= x)
        assert np.all(x <= high)
        calls.append(half_square(fun(x)))
        return fun(x)

    seen = []
    found = least_squares(
        counted,
        start,
        exact if jac == "exact" else jac,
        (low, high),
        method,
        callback=seen.append,
    )
    assert found.nfev == len(calls)
    assert found.cost == half_square(fun(found.x))
    assert found.cost <= calls[0]
    assert jac != "exact" or found.cost == min(calls)
    assert np.array_equal(found.fun, fun(found.x))
    assert found.grad == pytest.approx(found.jac.T @ found.fun, rel=1e-12)
    assert found.jac == pytest.approx(exact(found.x), rel=1e-5, abs=1e-5)
    assert found.history == tuple(seen)
    assert [line.number for line in seen] == list(range(len(seen)))
    assert seen[0].cost == calls[0]
    assert found.message == found.stop.value
    assert found.status == STATUS[found.stop]
    assert found.success == (found.status > 0)
    assert found.nit <= len(seen) - 1


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 7),
    deficiency=st.integers(0, 3),
)
@settings(max_examples=150, deadline=None, derandomize=True)
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


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
@pytest.mark.parametrize("failure", [np.nan, np.inf, FloatingPointError, ZeroDivisionError])
def test_a_trial_that_blows_up_is_rejected(method, failure):
    def fragile(x):
        if x[1] < 0.9:
            if isinstance(failure, type):
                raise failure
            return np.full(2, failure)
        return rosenbrock(x)

    found = least_squares(
        fragile, [3.0, 5.0], TEXTBOOK["rosenbrock"].jac, method=method, x_scale=1.0
    )
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-6)
    assert all(np.isfinite(line.cost) for line in found.history)


@pytest.mark.parametrize("method", EVERY_METHOD)
@pytest.mark.parametrize("where", ["fun", "jac", "callback"])
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_an_interruption_keeps_the_best_point(method, where, count):
    best, calls = [np.inf], {"fun": 0, "jac": 0, "callback": 0}

    def maybe(place):
        calls[place] += 1
        if place == where and calls[place] > count:
            raise KeyboardInterrupt

    def fun(x):
        maybe("fun")
        best[0] = min(best[0], half_square(beale(x)))
        return beale(x)

    def jac(x):
        maybe("jac")
        return TEXTBOOK["beale"].jac(x)

    found = least_squares(fun, [1.0, 1.0], jac, method=method, callback=lambda _: maybe("callback"))
    if calls[where] > count:
        assert found.stop is Stop.INTERRUPTED
        assert found.status < 0
    assert found.cost == best[0]
    assert found.cost == half_square(beale(found.x))


def test_an_interruption_before_the_first_point_goes_on_up():
    def fun(x):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        least_squares(fun, [1.0])


def line(x):
    return np.array([x[0] - 1.0, 2.0 * x[0] + 1.0])


def noisy_floor(x):
    """Rounded so coarsely that the last steps drown in it."""
    return np.round(np.array([x[0] - 1.0, x[0] ** 2 + 1.0]), 9)


def kinked(x):
    """Lowest at 0, where the derivative jumps."""
    return np.array([1.0 + 0.01 * abs(x[0]), x[0]])


def steeper(x):
    """Return the derivative from the right, also at 0: it promises 5e-5 of the cost."""
    return np.array([[0.01 if x[0] >= 0.0 else -0.01], [1.0]])


def ended(stop):
    """A run that ends for the reason given."""
    jac = TEXTBOOK["rosenbrock"].jac
    start = [-1.2, 1.0]
    unsound = np.diag([1.0, 1e-9])
    case = CERTIFIED["Misra1a"]
    match stop:
        case Stop.GRADIENT:
            return least_squares(line, [3.0])
        case Stop.FLOOR:
            return least_squares(case.fun, case.starts[1], case.jac, gtol=0.0)
        case Stop.STEP:
            return least_squares(case.fun, case.starts[1], case.jac, xtol=1e-3)
        case Stop.ITERATIONS:
            return least_squares(rosenbrock, start, jac, max_iterations=3)
        case Stop.INTERRUPTED:
            return least_squares(rosenbrock, start, jac, callback=interrupt)
        case Stop.JACOBIAN:
            return least_squares(rosenbrock, start, lambda x: np.full((2, 2), np.nan))
        case Stop.KINK:
            return least_squares(kinked, [1.0], steeper, method="dgn")
        case Stop.STALLED:
            return least_squares(rosenbrock, start, lambda x: -jac(x), method="dgn")
        case Stop.FULL_STEP:
            return least_squares(np.arctan, [3.0], lambda x: np.diag(1 / (1 + x**2)), method="gn")
        case Stop.ILL_CONDITIONED:
            # the scale is given: that of the columns would hide the difference
            return least_squares(
                lambda x: unsound @ x, [1.0, 1.0], lambda x: unsound, method="gn", x_scale=1.0
            )


def interrupt(_):
    raise KeyboardInterrupt


@pytest.mark.parametrize("stop", [s for s in Stop if s is not Stop.TRUSTED])
def test_every_reason_to_stop_is_reachable_and_says_so(stop):
    found = ended(stop)
    assert found.stop is stop
    assert found.message == stop.value
    assert found.success == (stop in (Stop.GRADIENT, Stop.FLOOR, Stop.STEP, Stop.KINK))


@pytest.mark.parametrize("method", EVERY_METHOD)
def test_no_run_ends_with_an_inner_reason(method):
    for case in TEXTBOOK.values():
        assert least_squares(case.fun, case.starts[0], case.jac, method=method).status > -6


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
def test_a_start_at_the_minimum_stays_there(method):
    case = CERTIFIED["Misra1a"]
    found = least_squares(case.fun, case.minimum, case.jac, method=method)
    assert found.success
    assert found.nfev <= 4
    exact = least_squares(rosenbrock, [1.0, 1.0], TEXTBOOK["rosenbrock"].jac, method=method)
    assert exact.success
    assert exact.nfev == 1


@pytest.mark.parametrize("method", ["dgn", "lm", "auto", "robust"])
def test_coarse_residuals_do_not_burn_the_iterations(method):
    found = least_squares(noisy_floor, [3.0], "3-point", method=method)
    assert found.x == pytest.approx(
        least_squares(lambda x: np.array([x[0] - 1.0, x[0] ** 2 + 1.0]), [3.0]).x, abs=1e-3
    )
    assert found.nit < 30


def phases(found):
    return [line.phase for line in found.history[1:]]


def test_each_method_goes_through_its_phases():
    case = TEXTBOOK["osborne 1"]
    run = lambda method, **more: least_squares(  # noqa: E731
        case.fun, case.starts[0], case.jac, method=method, **more
    )
    assert set(phases(run("gn"))) <= {"gn"}
    assert set(phases(run("dgn"))) == {"dgn"}
    assert set(phases(run("lm"))) == {"lm"}
    both = phases(run("lm-then-dgn"))
    assert both == sorted(both, reverse=True)
    assert set(both) == {"lm", "dgn"}
    assert set(phases(run("auto"))) == {"dgn"}
    assert phases(run("robust"))[0] == "gn"
    assert phases(run("robust"))[-1] in ("gn", "lm")


def test_auto_goes_on_until_the_match_is_good_enough():
    case = TEXTBOOK["osborne 1"]
    rms = np.sqrt(case.squares / 33)
    content = least_squares(case.fun, case.starts[0], case.jac, good_enough=1.01 * rms)
    greedy = least_squares(case.fun, case.starts[0], case.jac, good_enough=0.99 * rms)
    assert set(phases(content)) == {"dgn"}
    assert "lm" in phases(greedy)
    assert greedy.cost <= content.cost * (1.0 + 1e-12)
    restart = phases(greedy).index("lm") + 1
    assert np.array_equal(greedy.history[restart].x, case.starts[0])


def test_the_cost_falls_within_every_phase():
    for case in KNOWN.values():
        for method in EVERY_METHOD:
            lines = least_squares(case.fun, case.starts[-1], case.jac, method=method).history
            for before, after in pairwise(lines):
                assert after.cost <= before.cost or np.isnan(after.damping)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"x0": [np.nan]}, "finite"),
        ({"x0": []}, "finite"),
        ({"x0": [[1.0]]}, "one dimension"),
        ({"x0": [1.0], "bounds": (2.0, 3.0)}, "lies outside"),
        ({"x0": [1.0], "bounds": (2.0, 1.0)}, "exceeds"),
        ({"x0": [1.0], "bounds": ([0.0, 0.0], 2.0)}, "bounds"),
        ({"x0": [1.0], "method": "newton"}, "newton"),
        ({"x0": [1.0], "jac": "4-point"}, "4-point"),
        ({"x0": [1.0], "x_scale": 0.0}, "x_scale"),
        ({"x0": [1.0], "fun": lambda x: [np.nan]}, "not finite"),
        ({"x0": [1.0], "fun": lambda x: x / 0}, "not finite"),
        ({"x0": [1.0], "fun": lambda x: [[1.0]]}, "one dimension"),
        ({"x0": [1.0], "jac": lambda x: np.ones((3, 1))}, "shape"),
    ],
)
def test_unusable_arguments_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        least_squares(**{"fun": line, **arguments})


def test_the_result_cannot_be_changed():
    found = least_squares(line, [3.0])
    with pytest.raises(AttributeError):
        found.cost = 0.0
    for field in ("x", "cost", "fun", "jac", "grad", "optimality", "nfev", "njev", "status"):
        assert field in {f.name for f in fields(found)}


def test_more_parameters_than_residuals_gives_the_nearest_of_all_minima():
    found = least_squares(lambda x: np.array([x[0] + x[1] - 2.0]), [0.0, 0.0], x_scale=1.0)
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-6)


def test_scipy_is_not_imported():
    code = "import sys, exfit.estimate; sys.exit('scipy' in ''.join(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("method", ["dgn", "lm", "lm-then-dgn", "auto", "robust"])
def test_a_minimum_where_the_derivative_jumps_counts_as_one(method):
    found = least_squares(kinked, [1.0], steeper, method=method)
    assert found.success
    assert abs(found.x[0]) < 1e-6
