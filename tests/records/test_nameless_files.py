"""Files of all kinds of test without names: the physics decides, or it is asked."""

import numpy as np
import pytest
import yaml
from columns import Columns
from drawn_recordings import BUMP, EVENT, PHASES, REJECTION, drawn
from recorder_judge import MISSED, WRONG
from recordings_judge import judged

import exfit
from exfit.records.inspection import inspect

PLANTS = {BUMP: ("open-circuit", "infinite-bus"), EVENT: ("grid-playback",)}
PLANTS[REJECTION] = ("infinite-bus", "isolated")
# on load; rejections with a shunt, with the gate; vA fA pA; three waveforms, an angle that wraps
NUMBERS = (0, 2, 7, 42, *(pytest.param(number, marks=pytest.mark.long) for number in (18, 44)))
TIME = np.arange(0.0, 20.0, 0.02)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_file_without_names_is_read_rightly_or_asked_and_becomes_its_kind_of_case(
    number, tmp_path
):
    file = drawn(number)
    path = file.write(tmp_path)
    result = judged(file, path)
    assert result.outcome not in (MISSED, WRONG), result.reasons
    case = yaml.safe_load(exfit.new(path, "ST1A"))
    assert case["plant"]["type"] in PLANTS[file.kind]
    opens = "network" if case["plant"]["type"] == "isolated" else "breaker"
    assert (opens in case.get("test", {})) == (file.kind == REJECTION)


def wandering(level=50.0, size=0.02):
    return level + size * np.sin(0.5 * TIME) + np.random.default_rng(2).normal(0.0, 1e-4, TIME.size)


@pytest.mark.parametrize(("turn", "unit"), [(360.0, "deg"), (2.0 * np.pi, "rad")])
def test_an_angle_is_what_integrates_a_frequency(turn, unit):
    frequency = wandering()
    angle = turn * np.cumsum(frequency - 50.0) * 0.02
    channels = inspect(Columns({"t": TIME, "ch1": angle, "ch2": frequency})).channels
    assert [(channel.signal, channel.unit, channel.sure) for channel in channels] == [
        ("angle", unit, True),
        ("frequency", "Hz", True),
    ]


def test_a_level_near_the_rated_frequency_alone_is_asked_about():
    (channel,) = inspect(Columns({"t": TIME, "ch1": wandering()})).channels
    assert (channel.signal, channel.sure) == ("frequency", False)
    assert "is it the frequency?" in channel.question


def test_one_of_two_powers_that_is_no_per_unit_shows_that_the_other_is_none():
    noise = np.random.default_rng(1).normal(0.0, 1e-3, (3, TIME.size))
    columns = {"p": 150.0 + noise[0], "q": -1.9 + noise[1], "vt": 1.02 + 1e-3 * noise[2]}
    inspection = inspect(Columns({"t": TIME, **columns}))
    assert not inspection.channel_of("q").seems_per_unit
    assert inspection.channel_of("vt").seems_per_unit


def test_waveforms_a_third_of_a_cycle_apart_are_phases_in_their_turn():
    time = np.arange(0.0, 1.0, 1e-3)
    names = dict(zip(("ch3", "ch1", "ch2"), PHASES, strict=True))
    waves = {name: np.cos(2.0 * np.pi * (50.0 * time - k / 3.0)) for k, name in enumerate(names)}
    (group,) = inspect(Columns({"t": time, **{name: waves[name] for name in sorted(waves)}})).phases
    assert group.kind == "waveform"
    assert group.columns in (("ch3", "ch1", "ch2"), ("ch1", "ch2", "ch3"), ("ch2", "ch3", "ch1"))
