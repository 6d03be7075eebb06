"""What a case may say of a breaker that opens, and what it may not."""

import pytest

from exfit.case.case import Case
from exfit.errors import CaseError

DATA = {"Tpd0": 6.0, "Xd": 1.8, "Xpd": 0.3, "Xppd": 0.25, "Xl": 0.2}
ALONE = {"type": "machine-on-load", "machine": "GENROU", "parameters": DATA,
         "network": {"P": 0.1, "Q": -0.3}}  # fmt: skip
ON_LINE = {"type": "infinite-bus", "machine": "GENROU", "parameters": DATA,
           "network": {"f0": 50, "X": 0.3, "P": 0.1, "Q": -0.3}}  # fmt: skip
OFF_LINE = {"type": "open-circuit", "machine": "GENROU", "parameters": DATA}
PLAYED = {"type": "machine-playback", "machine": "GENROU", "parameters": DATA}
LENGTH = {"vt0": 1.0, "duration": 5.0}
FREE = {"start": "auto"}


def content(plant, test, channels=None, **record):
    section = {"file": "r.csv", "time": "t", "channels": dict.fromkeys(channels or ()), **record}
    section["channels"] = {name: {"column": name} for name in section["channels"]}
    model = {"model": "SEXS"} if plant["type"] in ("infinite-bus", "open-circuit") else {}
    return {**model, "plant": plant, "test": test} | ({"record": section} if channels else {})


def faults_of(case):
    with pytest.raises(CaseError) as raised:
        Case.from_dict(case)
    return str(raised.value)


@pytest.mark.parametrize("plant", [ALONE, ON_LINE])
def test_a_breaker_opens_with_and_without_a_record(plant):
    case = Case.from_dict(content(plant, {"breaker": {"opens": 1.0}, **LENGTH}))
    assert case.test.instants == (1.0,)
    recorded = content(plant, {"breaker": {"opens": FREE}}, ("vt", "ifd"))
    assert Case.from_dict(recorded).test.instants == ()


@pytest.mark.parametrize(
    ("plant", "test", "channels", "text"),
    [
        (OFF_LINE, {"breaker": {"opens": 1.0}, **LENGTH}, (),
         "test.breaker: not allowed with plant open-circuit"),
        (PLAYED, {"breaker": {"opens": 1.0}, "steady_until": 0.5}, ("vt", "efd"),
         "test.breaker: not allowed with plant machine-playback"),
        (ALONE, LENGTH, (), "no step: give one of breaker"),
        (ALONE, {}, ("vt",), "test.breaker: is missing: nothing else acts"),
        (ALONE, {"vref": [{"at": 1.0, "step": 0.1}], **LENGTH}, (),
         "test.vref: not allowed with plant machine-on-load"),
        (ALONE, {"breaker": {"opens": 6.0}, **LENGTH}, (),
         "test.breaker.opens: 6 s lies outside 0 ... 5 s, the duration"),
        (ALONE, {"breaker": {"opens": 1.0, "speed": "recorded"}, **LENGTH}, (),
         "test.breaker.speed: recorded needs the channel speed in the record"),
        (ALONE, {"breaker": {"opens": FREE}}, ("vt", "efd"),
         "test.breaker.opens: must be a number: the record's efd drives the simulation"),
        (ON_LINE, {"breaker": {"opens": FREE}}, ("vt", "speed"),
         "test.breaker.opens: must be a number: the record's speed drives the simulation"),
        (ON_LINE, {"breaker": {"opens": FREE}, "vref": [{"at": 3.0, "step": 0.1}]}, ("vt",),
         "test.breaker.opens: must be a number where the test has vref as well"),
        (ON_LINE, {"breaker": {"opens": FREE}}, ("ifd",), "auto needs vt in the record"),
        (ON_LINE, {"breaker": {"opens": {"start": 1.0}}}, ("vt",),
         "test.breaker.opens.min: is missing"),
        (ON_LINE, {"breaker": {"opens": 1.0}, "network": [{"at": 2.0, "X": 0.4}], **LENGTH}, (),
         "test.network[0].at: 2 s: no effect, as the breaker is open from 1 s on"),
        (ALONE, {"breaker": {"opens": 1.0}, "steady_until": 2.0}, ("vt",),
         "test.steady_until: 2 s is after the first step, at 1 s"),
        (ALONE, {"breaker": {"opens": 1.0}}, ("efd",),
         "neither vt nor ifd nor p nor q nor it nor speed: there is nothing to compare"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_refused(plant, test, channels, text):
    assert text in faults_of(content(plant, test, channels))


def test_a_delay_and_a_scale_to_be_found_do_not_move_what_drives():
    test = {"breaker": {"opens": 1.0}}
    delayed = content(ALONE, test, ("vt", "efd"), delay=0.01)
    assert "record.delay: not allowed where the record's efd drives" in faults_of(delayed)
    scaled = content(ALONE, test, ("vt", "speed"))
    scaled["record"]["channels"]["speed"]["scale"] = {"start": 1.0, "min": 0.9, "max": 1.1}
    assert "speed.scale: must be a number" in faults_of(scaled)
    weighted = content(ALONE, test, ("vt", "speed"))
    weighted["record"]["channels"]["speed"]["weight"] = 2.0
    assert "speed.weight: has no effect" in faults_of(weighted)


def test_channels_with_noise_beside_what_drives_need_none_there():
    case = content(ALONE, {"breaker": {"opens": 1.0}}, ("vt", "ifd", "efd", "speed"))
    for signal in ("vt", "ifd"):
        case["record"]["channels"][signal]["noise"] = 1e-3
    channels = Case.from_dict(case).recordings[0].record.channels
    noises = {signal: channel.noise for signal, channel in channels.items()}
    assert noises == {"vt": 1e-3, "ifd": 1e-3, "efd": None, "speed": None}


@pytest.mark.parametrize(
    ("network", "text"),
    [
        ({"P": 0.1}, "plant.network.Q: is missing"),
        ({"Q": 0.1}, "plant.network.P: is missing"),
        ({"P": 0.1, "Q": 0.0, "X": 0.3}, "plant.network.X: not a parameter of the network"),
    ],
)
def test_a_machine_alone_needs_its_load_and_nothing_else_of_the_network(network, text):
    case = content({**ALONE, "network": network}, {"breaker": {"opens": 1.0}, **LENGTH})
    assert text in faults_of(case)


def test_a_damper_without_a_time_constant_is_for_open_circuit_only():
    plant = {**ALONE, "parameters": {**DATA, "Tppd0": 0.0}}
    case = content(plant, {"breaker": {"opens": 1.0}, **LENGTH})
    assert "on load it must be positive" in faults_of(case)
