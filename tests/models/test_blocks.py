"""Blocks against their transfer functions, limits and curves against what they promise."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import signal

from exfit.models.blocks import (
    SHORTEST,
    exponential,
    exponential_se,
    field_ceiling,
    field_demand,
    integrator,
    lag,
    lead_lag,
    limited_integrator,
    limited_lag,
    pid,
    quadratic,
    rate,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.plants.parts import Names

END, COUNT = 1.0, 200
TIME = np.linspace(0.0, END, COUNT + 1)

gains = st.floats(0.1, 50.0)
lags = st.floats(0.05, 5.0)
laws = settings(deadline=None, derandomize=True, max_examples=20)


def response(block, states, u=lambda t: 1.0):
    """Return the output of ``block(u, *states) -> (y, *slopes)`` on TIME, by Runge-Kutta."""
    x, h, y = np.array(states, dtype=float), TIME[1], []

    def slopes(t, x):
        return np.array(block(u(t), *x)[1:])

    for t in TIME:
        y.append(block(u(t), *x)[0])
        k1 = slopes(t, x)
        k2 = slopes(t + h / 2, x + h / 2 * k1)
        k3 = slopes(t + h / 2, x + h / 2 * k2)
        k4 = slopes(t + h, x + h * k3)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(y)


def step_response(numerator, denominator):
    """Return the exact unit step response of a transfer function on TIME."""
    return signal.step((numerator, denominator), T=TIME)[1]


def assert_equal_responses(got, expected):
    """Compare to Runge-Kutta's error, (5 ms / 50 ms)^4 / 120 at the shortest lag drawn."""
    assert got == pytest.approx(expected, abs=1e-6 * (1.0 + np.abs(expected).max()))


@laws
@given(gains, lags)
def test_lag_is_its_transfer_function(K, T):
    got = response(lambda u, x: lag(u, x, K, T), [0.0])
    assert_equal_responses(got, step_response([K], [T, 1.0]))


@laws
@given(st.floats(0.01, 5.0), lags)
def test_lead_lag_is_its_transfer_function(TC, TB):
    got = response(lambda u, x: lead_lag(u, x, TC, TB), [0.0])
    assert_equal_responses(got, step_response([TC, 1.0], [TB, 1.0]))


@laws
@given(gains, lags)
def test_washout_is_its_transfer_function(K, T):
    got = response(lambda u, x: washout(u, x, K, T), [0.0])
    assert_equal_responses(got, step_response([K, 0.0], [T, 1.0]))


@laws
@given(lags)
def test_integrator_is_its_transfer_function(T):
    got = response(lambda u, x: integrator(u, x, T), [0.0])
    assert_equal_responses(got, step_response([1.0], [T, 0.0]))


@laws
@given(gains, gains, gains, lags)
def test_pid_is_its_transfer_function(KP, KI, KD, TD):
    got = response(lambda u, i, d: pid(u, i, d, KP, KI, KD, TD), [0.0, 0.0])
    numerator = [KP * TD + KD, KP + KI * TD, KI]
    assert_equal_responses(got, step_response(numerator, [TD, 1.0, 0.0]))


def assert_equal_up_to_a_stage(got, expected, slope):
    """Compare where a limit is met: the last stages of that step may be held a step too early."""
    assert np.abs(got - expected).max() <= slope * TIME[1] / 2 + 1e-9
    assert np.median(np.abs(got - expected)) < 1e-6 * (1.0 + np.abs(expected).max())


@laws
@given(gains, lags, st.floats(0.5, 30.0))
def test_a_limited_lag_follows_the_lag_up_to_its_limit_and_stays(K, T, limit):
    def block(u, x):
        y, slope = limited_lag(u, x, K, T, -limit, limit)
        return y, slope.slope

    free = step_response([K], [T, 1.0])
    got = response(block, [0.0])
    assert_equal_up_to_a_stage(got, np.clip(free, -limit, limit), K / T)


@laws
@given(gains, lags, st.floats(0.1, 30.0))
def test_a_limited_integrator_follows_the_integrator_up_to_its_limit(u, T, limit):
    def block(u, x):
        y, slope = limited_integrator(u, x, T, -limit, limit)
        return y, slope.slope

    got = response(block, [0.0], lambda t: u)
    assert_equal_up_to_a_stage(got, np.clip(u * TIME / T, -limit, limit), u / T)


def test_a_limit_holds_only_what_pushes_outward():
    for x, u, slope in (
        (2.0, 5.0, 0.0),
        (2.0, 1.0, -1.0),
        (-2.0, -5.0, 0.0),
        (-2.0, 1.0, 3.0),
        (0.0, 5.0, 5.0),
        (2.5, 3.0, 0.0),
    ):
        assert limited_lag(u, x, 1.0, 1.0, -2.0, 2.0)[1].slope == slope


def test_a_state_leaves_its_limit_at_once():
    """The lag is held at 1 by an input of 5; it moves the moment the input is below 1."""
    turn = 0.5

    def block(u, x):
        y, slope = limited_lag(u, x, 1.0, 0.1, -1.0, 1.0)
        return y, slope.slope

    got = response(block, [1.0], lambda t: 5.0 if t < turn - 1e-9 else 0.0)
    at = round(turn / TIME[1])
    assert (got[:at] == 1.0).all()
    # the stage at the turn itself already sees the new input: a third of a step early at most
    expected = np.exp(-(TIME[at:] - TIME[at]) / 0.1)
    assert np.abs(got[at:] - expected).max() < TIME[1] / 0.1


def test_a_pid_freezes_its_integral_only_while_it_pushes_outward():
    def slopes(u, integral):
        return pid(u, integral, u, 1.0, 2.0, 0.0, 0.1, -3.0, 3.0)

    assert slopes(1.0, 1.0) == (2.0, 2.0, 0.0)  # within the limits
    assert slopes(1.0, 2.0) == (3.0, 0.0, 0.0)  # at the limit, pushing on
    assert slopes(1.0, 9.0) == (3.0, 0.0, 0.0)
    assert slopes(-1.0, 9.0) == (3.0, -2.0, 0.0)  # at the limit, turning back
    assert slopes(-1.0, -2.0) == (-3.0, 0.0, 0.0)
    assert slopes(1.0, -9.0) == (-3.0, 2.0, 0.0)


@pytest.mark.parametrize("T", [0.0, SHORTEST / 2])
def test_a_time_constant_of_nothing_bypasses_a_block(T):
    assert rate(T) == 0.0
    assert lag(3.0, 7.0, 2.0, T) == (6.0, 0.0)
    assert lead_lag(3.0, 7.0, 5.0, T) == (3.0, 0.0)
    assert washout(3.0, 7.0, 2.0, T) == (0.0, 0.0)
    y, slope = limited_lag(3.0, 7.0, 2.0, T, -5.0, 5.0)
    assert (y, slope.slope) == (5.0, 0.0)


# --- rectifier ------------------------------------------------------------------------------------


def fex(IN):
    """Return the rectifier's factor as IEEE Std 421.5 defines it, with exact constants."""
    if IN <= 0.0:
        return 1.0
    if math.sqrt(3) / 4 >= IN:
        return 1.0 - IN / math.sqrt(3)
    if IN < 0.75:
        return math.sqrt(0.75 - IN**2)
    return math.sqrt(3) * (1.0 - IN) if IN <= 1.0 else 0.0


@laws
@given(st.floats(1e-3, 20.0), st.floats(-0.5, 2.0))
def test_a_rectifier_is_the_standard_s_factor_times_its_supply(ve, IN):
    assert rectifier(ve, IN * ve) == pytest.approx(fex(IN) * ve, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("IN", [0.0, math.sqrt(3) / 4, 0.75, 1.0])
def test_the_arcs_of_the_rectifier_meet(IN):
    below, above = rectifier(2.0, 2.0 * (IN - 1e-12)), rectifier(2.0, 2.0 * (IN + 1e-12))
    assert below == pytest.approx(above, abs=1e-11)


@pytest.mark.parametrize("IN", [math.sqrt(3) / 4, 0.75])
def test_the_inner_arcs_of_the_rectifier_meet_without_a_kink(IN):
    def slope(at):
        return (rectifier(1.0, at + 1e-6) - rectifier(1.0, at - 1e-6)) / 2e-6

    assert slope(IN - 2e-6) == pytest.approx(slope(IN + 2e-6), abs=1e-4)


@laws
@given(st.floats(1e-3, 20.0), st.floats(0.0, 20.0))
def test_the_supply_of_a_rectifier_gives_what_is_required(efd, load):
    ve = rectifier_supply(efd, load)
    assert rectifier(ve, load) == pytest.approx(efd, abs=1e-13 * (efd + load) * 10)


def test_a_rectifier_without_supply_gives_nothing_and_divides_by_nothing():
    assert rectifier(0.0, 1.0) == 0.0
    assert rectifier(0.0, 0.0) == 0.0


def test_a_rectifier_passes_on_what_is_not_a_number():
    assert math.isnan(rectifier(math.nan, 1.0))
    assert math.isnan(rectifier(1.0, math.nan))


# --- saturation -----------------------------------------------------------------------------------

FORMS = {"quadratic": quadratic, "exponential": exponential, "exponential-se": exponential_se}


@pytest.fixture(scope="module", params=list(FORMS))
def curve(request):
    return FORMS[request.param]


def points(E, factor, SE, growth):
    """Return two points, the higher one with the larger saturation."""
    return E, SE, E * factor, SE * growth


volts, factors = st.floats(0.5, 10.0), st.floats(1.05, 2.0)
small, growths = st.floats(0.01, 1.0), st.floats(1.2, 20.0)


@laws
@given(volts, factors, small, growths)
def test_a_saturation_curve_passes_through_both_points_in_either_order(curve, E, factor, SE, g):
    E1, SE1, E2, SE2 = points(E, factor, SE, g)
    for e, vx in ((E1, E1 * SE1), (E2, E2 * SE2)):
        assert curve(e, E1, SE1, E2, SE2).vx == pytest.approx(vx, rel=1e-9)
        assert curve(e, E2, SE2, E1, SE1).vx == pytest.approx(vx, rel=1e-9)


@laws
@given(volts, factors, small, growths, st.floats(-0.5, 3.0))
def test_the_slope_of_a_saturation_curve_is_its_derivative(curve, E, factor, SE, g, at):
    form = points(E, factor, SE, g)
    e, h = at * E, 1e-4 * E

    def vx(e):
        return curve(e, *form).vx

    expected = (vx(e + h) - vx(e - h)) / (2 * h)
    here = curve(e, *form)
    assume(quadratic is not curve or abs(here.vx) > 1e-6 or vx(e + 2 * h) == 0.0)  # off the knee
    scale = max(abs(here.slope), abs(here.vx) / E)
    # error h^2 times the third derivative over six, at growth rates of up to 60/E; and rounding
    assert here.slope == pytest.approx(expected, abs=1e-5 * scale + 1e-12)


@laws
@given(volts, factors, small, growths, st.floats(0.0, 1.0))
def test_quadratic_saturation_is_zero_below_its_knee_and_never_falls(E, factor, SE, g, share):
    E1, SE1, E2, SE2 = points(E, factor, SE, g)
    ratio = math.sqrt(E1 * SE1 / (E2 * SE2))
    knee = (E1 - ratio * E2) / (1.0 - ratio)
    below = quadratic(knee - 1e-9 * E2 - share * E, E1, SE1, E2, SE2)
    assert below == (0.0, 0.0)
    above = quadratic(knee + share * E, E1, SE1, E2, SE2)
    assert above.vx >= 0.0
    assert above.slope >= 0.0


@laws
@given(volts, factors, st.floats(-1.0, 20.0))
def test_a_curve_through_zeros_is_no_saturation_at_all(curve, E, factor, e):
    assert curve(e, E, 0.0, E * factor, 0.0) == (0.0, 0.0)
    assert curve(e, E * factor, 0.0, E, 0.0) == (0.0, 0.0)


@laws
@given(volts, factors, small)
def test_quadratic_saturation_may_begin_at_its_lower_point(E, factor, SE):
    for points in ((E, 0.0, E * factor, SE), (E * factor, SE, E, 0.0)):  # in either order
        assert quadratic(E, *points).vx == 0.0
        assert quadratic(E * factor, *points).vx == pytest.approx(E * factor * SE)


@laws
@given(st.floats(3.5, 8.0), st.floats(0.0, 2.0), st.floats(0.1, 2.0))
def test_the_ceiling_of_the_field_is_where_its_demand_reaches_the_limit(vfemax, ifd, KE):
    p = Names(KE=KE, KD=0.4, VFEMAX=vfemax)
    p.saturation = lambda e: quadratic(e, 3.14, 0.03, 4.18, 0.10)
    ve = 1.0
    for _ in range(20):  # Newton's steps, which the ceiling is made of
        ve = field_ceiling(ve, field_demand(ve, ifd, p), p)
    assert field_demand(ve, ifd, p) == pytest.approx(vfemax, rel=1e-12)
    # the standard's own form of the same limit
    share = quadratic(ve, 3.14, 0.03, 4.18, 0.10).vx / ve
    assert ve == pytest.approx((vfemax - 0.4 * ifd) / (KE + share), rel=1e-9)
