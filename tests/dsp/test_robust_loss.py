"""Losses: what they are in SciPy, and how their parts hang together."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from exfit.dsp.robust_loss import LOSSES

SCIPY = {"least-squares": "linear", "huber": "huber", "soft-l1": "soft_l1"}
DECADES = np.logspace(-12, 12, 97)
NEAR = np.array([0.95, 1.05])  # of the scale, where Huber's loss bends
ERRORS = np.sort(np.concatenate([-DECADES, -NEAR, [0.0], NEAR, DECADES]))
SCALES = [1e-4, 1.0, 30.0]

every_loss = pytest.mark.parametrize("loss", LOSSES.values(), ids=LOSSES)
every_scale = pytest.mark.parametrize("scale", SCALES)


def contaminated_line():
    """Return time and samples of a line with noise of 0.01, every eighth sample far off it."""
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 10.0, 80)
    samples = 1.0 + 0.3 * time + rng.normal(0.0, 0.01, 80)
    samples[::8] += rng.normal(0.5, 0.3, 10)
    return time, samples


@pytest.mark.parametrize("name", LOSSES)
@pytest.mark.parametrize("scale", [0.005, 0.02, 0.2])
def test_least_squares_of_the_residual_is_the_minimum_scipy_finds(name, scale):
    time, samples = contaminated_line()
    tight = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}

    def errors(x):
        return x[0] + x[1] * time - samples

    def jacobian(x):
        return np.stack([np.ones_like(time), time], axis=1)

    theirs = least_squares(errors, [0.0, 0.0], jacobian, loss=SCIPY[name], f_scale=scale, **tight)
    loss = LOSSES[name]
    ours = least_squares(
        lambda x: loss.residual(errors(x), scale),
        [0.0, 0.0],
        lambda x: loss.slope(errors(x), scale)[:, None] * jacobian(x),
        **tight,
    )
    assert ours.x == pytest.approx(theirs.x, abs=1e-8)
    assert ours.cost == pytest.approx(theirs.cost, rel=1e-12)


def test_what_lies_far_off_moves_a_robust_line_less():
    time, samples = contaminated_line()
    errors = {}
    for name, loss in LOSSES.items():
        fit = least_squares(
            lambda x, loss=loss: loss.residual(x[0] + x[1] * time - samples, 0.02), [0.0, 0.0]
        )
        errors[name] = np.abs(fit.x[0] + fit.x[1] * time - (1.0 + 0.3 * time)).max()
    assert errors["huber"] < errors["least-squares"] / 5
    assert errors["soft-l1"] < errors["least-squares"] / 5


@every_loss
@every_scale
def test_a_small_error_counts_as_in_least_squares_and_the_sign_stays(loss, scale):
    small = 1e-6 * scale * np.array([-1.0, 0.0, 1.0])
    # of soft-l1, the next term of its series is the square of 1e-6
    assert loss.residual(small, scale) == pytest.approx(small, rel=1e-11)
    assert loss.slope(small, scale) == pytest.approx(1.0, rel=1e-11)
    assert loss.influence(small, scale) == pytest.approx(small, rel=1e-11)
    assert loss.curvature(small, scale) == pytest.approx(1.0, rel=1e-11)
    errors = ERRORS * scale
    assert np.array_equal(np.sign(loss.residual(errors, scale)), np.sign(errors))
    assert np.array_equal(np.sign(loss.influence(errors, scale)), np.sign(errors))


@every_loss
@every_scale
def test_slopes_are_those_of_differences(loss, scale):
    e = ERRORS * scale
    step = 1e-5 * np.maximum(np.abs(e), 1e-3 * scale)
    apart = np.abs(np.abs(e) - scale) > step  # no difference across the corner of Huber's psi
    e, step = e[apart], step[apart]

    def quotient(function):
        return (function(e + step, scale) - function(e - step, scale)) / (2.0 * step)

    # rounding of 1e-16 over a step of 1e-5, and the step's square
    residual = loss.residual(e, scale)
    assert quotient(loss.residual) == pytest.approx(loss.slope(e, scale), rel=1e-8)
    assert residual * loss.slope(e, scale) == pytest.approx(loss.influence(e, scale), rel=1e-12)
    # psi levels off: what is left of its slope far out is less than the rounding of psi
    rounding = 1e-15 * np.abs(loss.influence(e, scale)) / step
    error = np.abs(quotient(loss.influence) - loss.curvature(e, scale))
    assert np.all(error <= 1e-8 * loss.curvature(e, scale) + rounding)


@every_loss
def test_residual_slope_and_influence_have_no_jump(loss):
    for scale in SCALES:
        there = scale * np.array([-1.0, 0.0, 1.0])
        for function in (loss.residual, loss.slope, loss.influence):
            near = function(there * (1 + 1e-12) + 1e-12 * scale, scale)
            assert function(there, scale) == pytest.approx(near, rel=1e-11, abs=1e-11 * scale)


@pytest.mark.parametrize("name", ["huber", "soft-l1"])
def test_a_huge_error_counts_by_its_size_and_pulls_by_the_scale(name):
    e, scale = np.array([-1e300, -1e200, 1e200, 1e300]), 0.5
    loss = LOSSES[name]
    # of the residual sqrt(2 C |e|), the relative rounding of a logarithm of 700
    assert loss.residual(e, scale) == pytest.approx(
        np.sign(e) * np.sqrt(2 * scale * np.abs(e)), rel=1e-12
    )
    assert loss.slope(e, scale) == pytest.approx(np.sqrt(scale / (2 * np.abs(e))), rel=1e-12)
    assert loss.influence(e, scale) == pytest.approx(scale * np.sign(e), rel=1e-12)
    assert np.all(loss.curvature(e, scale) == 0.0)


@every_loss
def test_an_infinite_error_has_an_infinite_residual(loss):
    e = np.array([-np.inf, 1.0, np.inf])
    assert np.array_equal(loss.residual(e, 1.0)[[0, 2]], e[[0, 2]])
    assert not np.isnan([f(e, 1.0) for f in (loss.slope, loss.influence, loss.curvature)]).any()


def test_the_losses_are_named_and_cannot_be_added_to():
    assert list(LOSSES) == ["least-squares", "huber", "soft-l1"]
    with pytest.raises(TypeError):
        LOSSES["other"] = LOSSES["huber"]
