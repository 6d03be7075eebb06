"""What channels that are no signal of the test, and channels that disagree, do to its steps."""

import numpy as np
import pytest
from columns import Columns
from tiers import few_of

from exfit.features.start.starting_tests import starting_tests
from exfit.records.inspection import inspect
from exfit.records.recorded_tests import tests_of as recorded_tests
from exfit.records.steps import MOST_SHAPED, steps_of_record

TIME = np.arange(0.0, 40.0, 0.02)
UP, DOWN = 3.2, 20.0  # s


def drift(rng, kind):
    """Return a frequency (M,) in Hz that wanders by itself."""
    noise = 3e-4 * rng.standard_normal(len(TIME))
    if kind == "walk":
        return 50.0 + 4e-4 * np.cumsum(rng.standard_normal(len(TIME)))
    if kind == "sway":
        return 50.0 + 0.02 * np.sin(rng.uniform(0.1, 1.2) * TIME + rng.uniform(0.0, 6.0)) + noise
    after = np.maximum(TIME - rng.uniform(0.0, 3.0), 0.0)
    return 50.0 + 0.03 * (1.0 - np.exp(-after / rng.uniform(0.5, 8.0))) + noise


def moved(at, lag):
    after = np.maximum(TIME - at, 0.0) / lag
    return 1.0 - (1.0 + after) * np.exp(-after)


def channels(rng, vt=(0.05, -0.05), ifd=(60.0, -88.0)):
    """Return vt (pu) and ifd (A) of two steps, by how much each changes."""
    return {
        "vt": 1.0
        + vt[0] * moved(UP, 0.3)
        + vt[1] * moved(DOWN, 0.3)
        + rng.normal(0.0, 1e-4, len(TIME)),
        "ifd (A)": 900.0
        + ifd[0] * moved(UP, 0.1)
        + ifd[1] * moved(DOWN, 0.1)
        + rng.normal(0.0, 1.0, len(TIME)),
    }


def inspected(columns):
    return inspect(Columns({"t": TIME, **columns}))


@pytest.mark.parametrize("seed", few_of(range(40), 5))
def test_a_column_that_is_no_signal_moves_no_step(seed):
    rng = np.random.default_rng([seed, 58])
    own = channels(rng)
    kind = ("walk", "sway", "creep")[seed % 3]
    alone, beside = inspected(own), inspected({**own, "f": drift(rng, kind)})
    assert beside.channel_of("vt").name == "vt"
    assert beside.channel_of("frequency").name == "f"
    for step, other in zip(alone.steps, beside.steps, strict=True):
        assert (step.at, step.error, step.seen_in) == (other.at, other.error, other.seen_in)


def test_of_many_channels_the_clearest_say_when_a_step_was_made():
    """By the shapes of their rises; the others show the same steps within wider errors."""
    rng = np.random.default_rng(59)
    clear = {f"c{k}": moved(UP, 0.3) + rng.normal(0.0, 1e-4, len(TIME)) for k in range(MOST_SHAPED)}
    faint = {f"d{k}": moved(UP, 1.0) + rng.normal(0.0, 5e-3, len(TIME)) for k in range(20)}
    alone, together = (steps_of_record(TIME, each) for each in (clear, {**clear, **faint}))
    (step,), (other,) = alone.steps, together.steps
    assert (step.at, step.error) == (other.at, other.error)
    assert abs(other.at - UP) <= other.error
    for name in clear:
        assert together.channels[name] == alone.channels[name]
    by_shape = steps_of_record(TIME, faint).channels
    for name in faint:
        (change,), (shaped,) = together.channels[name].changes, by_shape[name].changes
        assert change.error >= shaped.error
        assert abs(change.at - UP) <= change.error


def sizes(inspection, size):
    return [test.sizes for test in starting_tests([inspection], {"all": size})]


def test_a_step_of_which_the_field_contradicts_the_voltage_has_no_sign_and_is_asked_for():
    agreed = inspected(channels(np.random.default_rng(1)))
    assert sizes(agreed, 0.05) == [(0.05,), (-0.05,)]
    assert agreed.findings == ()
    disputed = inspected(channels(np.random.default_rng(1), vt=(0.05, 0.003)))
    assert sizes(disputed, 0.05) == [(0.05,), (None,)]
    (finding,) = disputed.findings
    assert finding.startswith("ifd (A): falls by 88")
    assert "at 20 s, against the voltage" in finding
    first, second = recorded_tests(disputed)
    assert (first.name(), second.name()) == ("up-5%-at-3s", "step-at-20s")


def test_a_field_current_that_moves_with_the_voltage_once_and_once_against_it_is_not_inverted():
    disputed = inspected(channels(np.random.default_rng(2), vt=(0.05, 0.05)))
    assert sizes(disputed, 0.05) == [(0.05,), (None,)]
    (finding,) = disputed.findings
    assert "the direction of that step is open" in finding


def test_a_field_current_that_always_moves_against_the_voltage_leaves_the_sign_to_it():
    inverted = inspected(channels(np.random.default_rng(3), ifd=(-60.0, 88.0)))
    assert sizes(inverted, 0.05) == [(0.05,), (-0.05,)]
    assert all("the channel is inverted" in finding for finding in inverted.findings)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_where_the_voltage_stays_the_field_shows_the_sign_of_a_step(way):
    own = channels(np.random.default_rng(4), vt=(0.0, 0.0), ifd=(60.0 * way, -60.0 * way))
    assert sizes(inspected(own), 0.02) == [(0.02 * way,), (-0.02 * way,)]
