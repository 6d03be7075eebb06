"""What a record of a grid event gives the unit that it drives: rest, switchings, filter, offset."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from exfit.case.case import Case
from exfit.dsp.jumps import jumps_while_moving
from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiment
from exfit.fitting.event import names_of_switchings, with_even_clock
from exfit.fitting.experiment import MASKED
from exfit.records.record import Record

TIME = np.arange(600) / 60.0
EVENT = 2.0  # s
SWING = np.where(TIME > EVENT, np.sin(4.0 * (TIME - EVENT)) * np.exp(-0.5 * (TIME - EVENT)), 0.0)

UNIT = {
    "model": "SEXS",
    "given": "exact",
    "plant": {"type": "grid-playback", "machine": "GENROU", "network": {"f0": 60.0}},
}
CHANNELS = dict.fromkeys(("vt", "angle", "p", "q"), "x")
VALUES = Case.from_dict(
    {**UNIT, "record": {"file": "x", "time": "t", "channels": CHANNELS}}
).values()


def record(seed=0, noise=1e-4, **signals):
    """Return a record that is at rest until 2 s, with other signals in place of its own."""
    generator = np.random.default_rng(seed)
    own = {"vt": 1.0 + 0.02 * SWING, "angle": 0.4 + 0.2 * TIME + 0.1 * SWING,
           "p": 0.7 + 0.1 * SWING, "q": 0.1 - 0.05 * SWING}  # fmt: skip
    own |= signals
    noisy = {
        k: x + generator.normal(0.0, noise, len(TIME)) for k, x in own.items() if x is not None
    }
    return Record.from_arrays(TIME, noisy)


def setup_of(record, channels=None, test=None, **section):
    """Return the test of a case of a grid event with such a record."""
    content = {
        **UNIT,
        "record": {"channels": channels or {k: k for k in record.signals}, **section},
        **({"test": test} if test else {}),
    }
    return build_experiment(*recorded(Case.from_dict(content, record)))


def recorded(case):
    return case, case.recordings[0], case.values()


@pytest.mark.parametrize("seed", range(5))
def test_the_rest_before_an_event_is_found(seed):
    """It ends no later than a few samples after the event begins, and most of it is taken."""
    setup = setup_of(record(seed))
    assert 1.5 < setup.test.steady_until < EVENT + 0.1
    assert setup.experiment.own["p0"] == pytest.approx(0.7, abs=1e-4)
    assert setup.experiment.own["q0"] == pytest.approx(0.1, abs=1e-4)
    assert setup.experiment.own["vt0"] == pytest.approx(1.0, abs=1e-4)


def test_a_rest_that_is_given_is_taken():
    assert setup_of(record(), test={"steady_until": 1.0}).test.steady_until == 1.0
    with pytest.raises(RecordError, match=r"6 samples before test\.steady_until"):
        setup_of(record(), test={"steady_until": 0.1})


def test_a_record_without_rest_or_event_is_refused():
    moving = 0.7 + 0.1 * np.sin(8.0 * TIME)
    with pytest.raises(RecordError, match=r"p: moves within its first .* give test.steady_until"):
        setup_of(record(p=moving))
    still = np.ones(len(TIME))
    with pytest.raises(
        RecordError, match=r"no signal leaves its noise: there is no event; give test\.steady_until"
    ):
        setup_of(record(vt=still, angle=TIME, p=still, q=still))


def test_an_angle_that_turns_evenly_at_rest_drives_nothing_there():
    setup = setup_of(record(noise=0.0))
    inputs = setup.experiment.simulator.inputs.recorded
    assert_allclose(inputs["angle"].samples, 0.1 * SWING, atol=1e-9)
    assert_allclose(inputs["vt"].samples, 0.02 * SWING, atol=1e-9)


@pytest.mark.parametrize(("unit", "scale"), [("Hz", 1.0), ("mHz", 1e3), ("pu", 1.0 / 60.0)])
def test_a_frequency_comes_in_its_own_unit(tmp_path, unit, scale):
    frequency = 59.98 + 0.05 * SWING
    own = {"t": TIME, "vt": 1.0 + 0.02 * SWING, "f": scale * frequency}
    own |= {"p": 0.7 + 0.1 * SWING, "q": 0.1 - 0.05 * SWING}
    head = ",".join(own)
    np.savetxt(
        tmp_path / "x.csv", np.stack([*own.values()], 1), delimiter=",", header=head, comments=""
    )
    channels = {"vt": "vt", "frequency": {"column": "f", "unit": unit}, "p": "p", "q": "q"}
    content = {**UNIT, "record": {"file": "x.csv", "time": "t", "channels": channels}}
    case = Case.from_dict(content, folder=tmp_path)
    setup = build_experiment(case, case.recordings[0], case.values())
    samples = setup.experiment.simulator.inputs.recorded["angle"].samples
    assert_allclose(samples, 2.0 * np.pi * 0.05 * SWING, atol=1e-6)


def jumping(width=1):
    """Return a voltage that jumps at 4 s, between two samples or over so many intervals."""
    way = np.clip((np.arange(600) - 240) / width, 0.0, 1.0)
    return 1.0 + 0.02 * SWING - 0.05 * way


@pytest.mark.parametrize("width", [1, 2])
def test_a_record_is_not_compared_about_a_switching(width):
    setup = setup_of(record(vt=jumping(width)))
    (switching,) = setup.switchings
    at = TIME[240] + 0.5 * width / 60.0
    assert (switching.signal, switching.at) == ("vt", pytest.approx(at, abs=1e-9))
    assert switching.change == pytest.approx(-0.05, abs=0.01)
    for channel in setup.channels:
        away = np.abs(TIME - at) - MASKED
        assert channel.kept[away > 1e-6].all()
        assert not channel.kept[away < -1e-6].any()


def test_a_switching_is_compared_where_the_case_says_so():
    setup = setup_of(record(vt=jumping()), switchings="compare")
    assert setup.free == ()
    assert setup.switchings == ()
    assert all(channel.kept.all() for channel in setup.channels)
    spline = setup.experiment.simulator.inputs.recorded["vt"]
    assert spline.jumps == ((240, 241),)


def test_the_instant_of_a_switching_is_found_between_two_samples():
    """Its derivative is that of differences; what is left of the voltage is as without a jump."""
    turning = 0.4 + 0.2 * TIME + 0.1 * SWING + 0.08 * (TIME[240] < TIME)
    setup = setup_of(record(noise=0.0, vt=jumping(), angle=turning))
    (parameter,), recorded = setup.free, setup.experiment.simulator.inputs.recorded
    assert parameter.name == "switching.at"
    assert TIME[240] < parameter.low < parameter.start < parameter.high < TIME[241]
    assert_allclose(recorded["vt"].samples, 0.02 * SWING, atol=2e-4)
    assert_allclose(recorded["angle"].samples, 0.1 * SWING, atol=2e-3)
    values = setup.with_start_values(VALUES)
    _, slopes = setup.experiment.response_with_derivatives(values, [{"switching.at": 1.0}])
    step = 1e-4
    high, low = (
        setup.experiment.samples(values | {"switching.at": parameter.start + d})[0]
        for d in (step, -step)
    )
    kept = setup.channels[0].kept
    differences = (high - low)[kept] / (2.0 * step)
    assert_allclose(slopes[kept, :, 0], differences, rtol=0.0, atol=1e-3)
    assert np.ptp(slopes[kept]) > 0.1


def test_the_instant_of_a_small_switching_is_not_found():
    small = 1.0 + 0.02 * SWING - 0.007 * (TIME[240] < TIME)
    setup = setup_of(record(vt=small))
    assert len(setup.switchings) == 1
    assert setup.free == ()


def test_no_swing_is_taken_for_a_switching():
    """Of 0.5 to 3 Hz, at 30 and 60 samples a second, with and without noise."""
    for frequency in (0.5, 1.0, 2.0, 3.0):
        for rate in (30.0, 60.0):
            time = np.arange(int(10 * rate)) / rate
            swing = 0.05 * np.sin(2.0 * np.pi * frequency * time + 0.3)
            noise = np.random.default_rng(1).normal(0.0, 1e-4, len(time))
            for samples in (swing, swing + noise):
                assert jumps_while_moving(time, samples, 0.005) == [], (frequency, rate)


def test_a_filter_acts_on_what_drives_and_what_is_compared():
    """A record of a linear unit that was filtered as a whole is still one of that unit."""
    plain, filtered = setup_of(record()), setup_of(record(), filter={"lowpass": 5.0})
    for setup in (plain, filtered):
        assert all(
            channel.filtering is None or channel.filtering.filter is None
            for channel in setup.channels
        )
    rough = [np.std(np.diff(s.record.signals["p"][:500], 3)) for s in (plain, filtered)]
    assert rough[1] < 0.1 * rough[0]
    driving = [
        np.std(np.diff(s.experiment.simulator.inputs.recorded["vt"].samples, 3))
        for s in (plain, filtered)
    ]
    assert driving[1] < 0.1 * driving[0]
    kept = filtered.channels[0].kept
    assert_allclose(kept, TIME[-1] - 0.2 > TIME)


def test_an_offset_of_the_frequency_turns_the_angle():
    """Its derivative is exact: the turning is linear in the offset."""
    unknown = {"start": 0.0, "min": -0.05, "max": 0.05}
    setup = setup_of(record(noise=0.0), test={"frequency_offset": unknown})
    (parameter,) = setup.free
    assert parameter.name == "frequency_offset"
    experiment, values = setup.experiment, setup.with_start_values(VALUES)
    _, slopes = experiment.response_with_derivatives(values, [{"frequency_offset": 1.0}])
    step = 1e-4
    high, low = (experiment.samples(values | {"frequency_offset": d})[0] for d in (step, -step))
    assert_allclose(slopes[:, :, 0], (high - low) / (2.0 * step), rtol=0.0, atol=2e-5)
    assert np.ptp(slopes) > 0.01


@pytest.mark.parametrize("key", ["switchings", "filter"])
def test_only_an_event_has_its_keys(key):
    content = {
        "model": "SEXS",
        "given": "exact",
        "plant": {"type": "open-circuit", "machine": "GENROU"},
        "test": {"vref": [{"at": 1.0, "step": 0.02}], "frequency_offset": 0.01},
        "record": {"file": "x.csv", "time": "t", "channels": {"vt": "vt"}},
    }
    content["record"][key] = {"lowpass": 5.0} if key == "filter" else "mask"
    with pytest.raises(CaseError, match=f"record.{key}: not allowed with plant open-circuit") as no:
        Case.from_dict(content)
    assert "test.frequency_offset: not allowed" in str(no.value)


def test_the_names_of_switchings_are_those_that_a_fit_finds():
    """So that the parameters of a fit may be given to another run."""
    signals = record(vt=jumping() + 0.04 * (TIME > 6.0))
    content = {**UNIT, "record": {"channels": {k: k for k in signals.signals}}}
    case = Case.from_dict(content, signals)
    setup = build_experiment(*recorded(case))
    names = [*names_of_switchings(case, case.recordings[0])]
    assert names == ["switching.at", "switching2.at"]
    assert names == [parameter.name for parameter in setup.free]


def test_what_is_compared_may_come_later_than_what_drives():
    """The rest is still found in the record; the delay is a number or found."""
    found = setup_of(record(), delay={"start": 0.0, "min": -0.1, "max": 0.1})
    assert found.test.steady_until < EVENT + 0.1
    assert [parameter.name for parameter in found.free] == ["delay"]
    at_once, late = setup_of(record(noise=0.0)), setup_of(record(noise=0.0), delay=0.05)
    early, shifted = (setup.experiment.samples(VALUES)[0] for setup in (at_once, late))
    assert_allclose(shifted[3:], early[:-3], rtol=0.0, atol=1e-6)  # 3 samples are 0.05 s


def test_rounded_time_stamps_of_an_event_are_made_even():
    """An angle that turns shows a clock that is read to 0.1 ms; one that is uneven stays so."""
    rounded = Record.from_arrays(np.round(TIME, 4), {"vt": 1.0 + SWING})
    assert_allclose(with_even_clock(rounded).time, TIME, atol=6e-5)
    assert np.ptp(np.diff(with_even_clock(rounded).time)) < 1e-12
    uneven = Record.from_arrays(TIME + 1e-3 * (np.arange(len(TIME)) == 7), {"vt": 1.0 + SWING})
    assert np.array_equal(with_even_clock(uneven).time, uneven.time)
