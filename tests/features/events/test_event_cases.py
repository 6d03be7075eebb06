"""Cases of a grid event: what the file may say, and what it must."""

import pytest

from exfit.case.case import Case
from exfit.case.schema import BumpTest
from exfit.errors import CaseError


def event(**changes):
    """Return the content of a case of a grid event."""
    channels = {"vt": "vt", "angle": "a", "p": "p", "q": "q"}
    return {
        "model": "SEXS",
        "given": "exact",
        "plant": {"type": "grid-playback", "machine": "GENROU", "network": {"f0": 60}},
        "record": {"file": "x.csv", "time": "t", "channels": {**channels, **changes}},
    }


def test_a_record_of_an_event_needs_no_test():
    assert Case.from_dict(event()).recordings[0].test == BumpTest()
    several = event()
    several["records"] = [{"name": "a", "record": several.pop("record")}]
    assert Case.from_dict(several).recordings[0].test == BumpTest()


def test_a_record_of_another_plant_needs_one():
    content = event()
    content["plant"] |= {"type": "infinite-bus", "network": {"f0": 60, "X": 0.3, "P": 0.8, "Q": 0}}
    del content["record"]["channels"]["angle"]
    with pytest.raises(CaseError, match="case: test: is missing"):
        Case.from_dict(content)
    content["records"] = [{"name": "a", "record": content.pop("record")}]
    with pytest.raises(CaseError, match=r"records\[0\].test: is missing"):
        Case.from_dict(content)


CHANNELS = {
    "no angle": ({"angle": None}, "record.channels: neither angle nor frequency"),
    "two": ({"frequency": "f"}, "record.channels.frequency: not allowed with angle, which drives"),
    "no reactive power": ({"q": None}, "plant.network.Q: is missing: the record has no q"),
    "a voltage for an angle": (
        {"angle": {"column": "a", "unit": "kV"}},
        "record.channels.angle.unit: 'kV' cannot be converted to rad",
    ),
    "a base of an angle": (
        {"angle": {"column": "a", "unit": "deg", "base": 180.0}},
        "record.channels.angle.base: not allowed",
    ),
    "no voltage": ({"vt": None}, "record.channels.vt: is missing"),
    "a weight": ({"vt": {"column": "vt", "weight": 2.0}}, "record.channels.vt.weight: has no eff"),
}


def test_a_fit_needs_something_to_compare():
    content = event()
    content["record"]["channels"] = {"vt": "vt", "angle": "angle"}
    content["plant"]["network"] |= {"P": 0.8, "Q": 0.1}
    content["parameters"] = {"free": {"K": {"start": 50.0, "min": 10.0, "max": 100.0}}}
    with pytest.raises(CaseError, match="there is nothing to compare"):
        Case.from_dict(content)


def test_what_is_only_simulated_needs_nothing_to_compare():
    content = event()
    content["record"]["channels"] = {"vt": "vt", "angle": "angle"}
    content["plant"]["network"] |= {"P": 0.8, "Q": 0.1}
    assert Case.from_dict(content).kind.finds_rest


@pytest.mark.parametrize(("change", "says"), CHANNELS.values(), ids=CHANNELS)
def test_a_fault_of_a_record_of_an_event_is_reported_with_its_place(change, says):
    content = event(**change)
    channels = content["record"]["channels"]
    content["record"]["channels"] = {name: x for name, x in channels.items() if x is not None}
    with pytest.raises(CaseError) as refused:
        Case.from_dict(content)
    assert says in str(refused.value)
