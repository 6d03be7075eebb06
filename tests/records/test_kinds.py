"""Which test a record holds, by what moves in it and what moves first."""

import numpy as np
import pytest
from columns import Columns
from places import SAMPLES

from exfit.records.formats import open_table
from exfit.records.inspection import inspect
from exfit.records.kinds import (
    BUMP,
    EVENT,
    FOLLOWING,
    INJECTION,
    ISOLATED_LOAD,
    OF_GOVERNOR,
    REFERENCE,
)

TIME = np.arange(0.0, 60.0, 0.1)
NOISE = {"speed": 3e-5, "p": 1e-3, "gate": 1e-3, "vt": 2e-4}


def after(lag, at=10.0):
    """Return a step at an instant that a lag follows."""
    since = np.maximum(TIME - at, 0.0)
    return 1.0 - np.exp(-since / lag) if lag else np.sign(since)


def kind(**clean):
    rng = np.random.default_rng(3)
    noise = {name: NOISE.get(name, 0.0) * rng.standard_normal(len(TIME)) for name in clean}
    return inspect(Columns({"t": TIME, **{k: y + noise[k] for k, y in clean.items()}})).kind


@pytest.mark.parametrize(
    ("test", "name"),
    [("load", ISOLATED_LOAD), ("reference", REFERENCE), ("injection", REFERENCE)],
)
def test_the_tests_of_a_whole_unit_are_known_by_their_records(test, name):
    found = inspect(open_table(SAMPLES / f"hydro_unit_{test}.csv")).kind
    assert found.name == name
    assert found.sure == (test == "load")  # a reference and an injected signal look alike


@pytest.mark.parametrize(("signal", "name"), [("pref", REFERENCE), ("fs", INJECTION)])
def test_a_recorded_input_of_the_governor_says_which_test_it_is(signal, name):
    found = kind(p=0.6 + 0.05 * after(4.0), speed=np.ones_like(TIME), **{signal: 0.01 * after(0.0)})
    assert (found.name, found.sure) == (name, True)


@pytest.mark.parametrize("lag", [1.5, 5.0])
def test_a_gate_that_follows_a_falling_speed_is_no_step_of_load(lag):
    fall = -0.004 * after(lag)
    found = kind(speed=1.0 + fall, gate=0.5 - 15.0 * fall, p=0.6 - 15.0 * fall)
    assert found.name == FOLLOWING


def test_a_step_of_the_voltage_reference_is_no_test_of_the_governor():
    kick = after(0.5) - after(3.0)
    found = kind(vt=1.0 + 0.03 * after(0.5), p=0.6 + 0.02 * kick, gate=np.full_like(TIME, 0.6),
                 speed=1.0 + 1e-4 * kick)  # fmt: skip
    assert found.name not in OF_GOVERNOR


@pytest.mark.parametrize(
    ("late", "size", "name"), [(0.0, 6e-4, BUMP), (1.0, 6e-4, EVENT), (1.0, 1e-4, BUMP)]
)
def test_where_q_swings_as_the_voltage_by_half_and_no_step_lasts_the_frequency_tells(
    late, size, name
):
    def swing(phase=0.0):
        return after(0.2) * np.exp(2.0 - 0.2 * TIME) * np.sin(5.0 * TIME - phase)

    found = kind(vt=1.0 + 0.01 * swing(), q=0.1 + 0.03 * swing(late), p=0.6 + 0.02 * swing(),
                 frequency=60.0 * (1.0 + size * swing()))  # fmt: skip
    assert found.name == name
