"""All units of a dynamics file at once: each as it is read alone, whatever is wrong with others."""

import numpy as np
import pytest
from dynamics import SOUND, garbage, replaced
from tiers import few_of

from exfit.errors import DynamicsError
from exfit.features.planner.fields import text_of
from exfit.features.planner.psse import sound_records
from exfit.features.planner.units import read_unit, read_units

BUSES = range(101, 109)


def at_bus(bus, text=SOUND):
    """Return the records of the sound unit at another bus."""
    return text.replace("1 GENROU", f"{bus} GENROU").replace("1 ESAC1A", f"{bus} ESAC1A")


def test_every_unit_is_read_as_it_is_alone():
    text = "".join(at_bus(bus) for bus in BUSES)
    units = read_units(text, "f")
    assert [unit.bus for unit in units.units] == [*BUSES]
    assert (units.refused, units.faults) == ((), ())
    assert units.units == tuple(read_unit(text, "unit.dyr", bus) for bus in BUSES)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (" 766 ", " x ", "ESAC1A: KA: 'x' is not a number"),
        (" 766 ", " -1 ", "ESAC1A: KA: -1 lies outside"),
        (" 766 ", " ", "ESAC1A: 18 values after the id"),
        (".4 /", ".4 / \n103 GENSAL 1 /", "GENSAL: a second machine; GENROU is on line"),
    ],
)
def test_a_fault_of_one_unit_leaves_the_others(old, new, words):
    text = at_bus(102) + at_bus(103, replaced(old, new)) + at_bus(104)
    units = read_units(text, "f")
    assert [unit.bus for unit in units.units] == [102, 104]
    (refused,) = units.refused
    assert (refused.bus, refused.modelled) == (103, True)
    assert words in "\n".join(fault.text for fault in refused.faults)
    assert {fault.line for fault in refused.faults} <= {5, 6, 7, 8, 9}


def test_a_machine_that_the_governor_of_another_drives_is_known_to_have_constant_power():
    shares = "20 0 0 .1 1 -1 1 0 .3 .2 0 5 .3 .2 .5 0 .3 0 0 0 /"
    text = at_bus(102) + at_bus(103) + f"102 IEEEG1 1 103 '1' {shares}\n"
    first, second = read_units(text, "f").units
    assert not any("drives this machine" in each.text for each in first.warnings)
    assert second.governor is None
    (warning,) = second.warnings
    drives = "IEEEG1 of machine 1 at bus 102 drives this machine, too"
    assert warning.text == f"{drives}: not modelled, its power is constant"
    assert read_unit(text, "unit.dyr", 103).warnings == second.warnings
    governed = text + f"103 IEEEG1 1 0 0 {shares}\n"
    assert not any("drives" in each.text for each in read_units(governed, "f").units[1].warnings)


def test_tgov1_may_stand_for_a_water_turbine():
    """Its lead is then below 0, as in a public reduction of the western grid of America."""
    (unit,) = read_units(at_bus(102) + "102 TGOV1 1 .05 .2 1 0 -1 15 0 /\n", "f").units
    assert (unit.governor.values["T2"], unit.warnings) == (-1.0, ())


@pytest.mark.parametrize("damaged", ["-14.5 /", ".4 /"])
def test_a_record_without_an_end_leaves_the_other_units(damaged):
    whole = at_bus(103)
    text = at_bus(102) + replaced(damaged, damaged[:-1], whole) + at_bus(104)
    units = read_units(text, "f")
    assert [unit.bus for unit in units.units] == [102, 104]
    assert "has no '/' before the next one" in units.faults[0].text


def test_a_record_that_another_holds_is_named_and_belongs_to_no_other_unit():
    """A converter left out '/' and end of line: the machine of 104 is data of the device."""
    machine = "{} 'GENROU' 1 6 .03 .5 .08 6.4 0 .9 .86 .12 .2 .09 .05 0 0 /\n"
    sound = at_bus(102) + machine.format(105)
    whole, damaged = (
        read_units(
            f"{sound}103 'GFORM' 1 .1 2 {end}{machine.format(104)}104 SEXS 1 .1 10 100 .1 0 5 /",
            "f",
        )
        for end in ("/\n", "")
    )
    assert ([unit.bus for unit in whole.units], whole.faults) == ([102, 104], ())
    assert whole.refused[0].alone is not None
    (fault,) = damaged.faults
    assert fault.text == "GFORM: 'GENROU' among its values: is a '/' missing before?"
    assert [unit.bus for unit in damaged.units] == [102]
    alone, without_machine = damaged.refused
    assert (alone.alone is None, without_machine.bus) == (False, 104)


UNREADABLE = {  # whether it may be the exciter of machine 105
    "105 'SEXS' 1 .1 10 100\n": True,
    "105 'SEXS 1 .1 10 100 .1 0 5 /\n": True,
    "1O5 'SEXS' 1 .1 10 100\n": True,
    "'NORTH' 'SEXS' 1 .1 10 100\n": True,
    "106 'SEXS' 1 .1 10 100\n": False,
    "#---- machines -----\n": False,
    f"{'1' * 5000} 'SEXS' 1 .1 10 100\n": True,
    "<<<<<<< HEAD\n": False,
}


@pytest.mark.parametrize(("record", "doubtful"), UNREADABLE.items())
def test_a_machine_without_an_exciter_is_alone_unless_an_unreadable_record_may_be_it(
    record, doubtful
):
    machine = "105 'GENROU' 1 6 .03 .5 .08 6.4 0 .9 .86 .12 .2 .09 .05 0 0 /\n"
    units = read_units(f"{machine}{record}{at_bus(102)}", "f")
    assert [unit.bus for unit in units.units] == [102]
    assert units.faults
    (alone,) = units.refused
    assert (alone.alone is None) == doubtful
    why = "a record that cannot be read may be its exciter"
    assert (alone.faults[-1].text == why) == doubtful


FOREIGN = (
    "{bus} 'WEHGOV' 1 0 0 0.05 /\n", "{bus} 'USRMDL' 1 'HYG3' 5 0 0 1 2*3.5 /\n",
    "{bus} TGOV1 1 x y /\n", "{bus} 'PSS1A' 1 1 /\n", "{bus} 'UEL1' 1 -9E9 /\n",
    "{bus} 'OEL9' 1 /\n", "{bus} VTGTPA 1 1 0 /\n", "{bus} IEELBL 1 1 0 /\n",
    "{bus} TGOV1 1 .05 .5 1 0 3 10 0 /\n",
)  # fmt: skip


@pytest.mark.parametrize("seed", few_of(range(20), 5))
def test_no_record_beside_machine_and_exciter_stops_a_unit_and_each_left_out_is_named_once(seed):
    random = np.random.default_rng(seed)
    text = ""
    for bus in BUSES:
        records = [at_bus(bus), *(own.format(bus=bus) for own in random.permutation(FOREIGN))]
        text += "".join(random.permutation(records))
    units = read_units(text, "f")
    assert ([unit.bus for unit in units.units], units.refused) == ([*BUSES], ())
    for unit in units.units:
        assert unit.governor.values["R"] == 0.05
        assert {*unit.unknown} == {"WEHGOV", "USRMDL HYG3", "OEL9", "VTGTPA"}
        left = [warning.text for warning in unit.warnings if "is left out" in warning.text]
        names = ("WEHGOV", "USRMDL HYG3", "OEL9", "VTGTPA", "TGOV1", "PSS1A", "UEL1")
        assert [sum(name in words for words in left) for name in names] == [1] * len(names)


LOADS = "LDSHBL LVSHBL IEELAR CIM5BL CIM6OW CLODZN CMLDBLU2 ACMTBLU1 EXTLAL LDFRBL DLSHBL"


@pytest.mark.parametrize("load", LOADS.split())
def test_the_record_of_a_load_is_of_no_machine_whose_id_it_has(load):
    machine = "105 'GENROU' 1 6 .03 .5 .08 6.4 0 .9 .86 .12 .2 .09 .05 0 0 /\n"
    units = read_units(f"{machine}105 '{load}' 1 .1 2 /\n106 '{load}' 1 .1 2 /\n", "f")
    assert units.refused[0].alone is not None
    assert (len(units.refused), units.devices) == (1, {load: 2})
    with pytest.raises(DynamicsError, match="f: has no record of a unit"):
        read_unit(f"106 '{load}' 1 .1 2 /\n", "f")


def test_a_model_of_the_program_is_no_typing_error_of_another():
    text = at_bus(102).replace("ESAC1A", "IEET1B") + at_bus(103).replace("ESAC1A", "ESAC1B")
    texts = [[fault.text for fault in each.faults] for each in read_units(text, "f").refused]
    assert ["did you mean" in " ".join(each) for each in texts] == [False, True]


def test_a_unit_with_an_unknown_machine_or_exciter_is_refused_by_that_record():
    text = at_bus(101) + at_bus(102).replace("ESAC1A", "ESAC77") + at_bus(103)
    text += at_bus(104).replace("GENROU", "GENXYZ")
    units = read_units(text, "f")
    assert [unit.bus for unit in units.units] == [101, 103]
    assert [(unit.bus, unit.modelled) for unit in units.refused] == [(102, True), (104, True)]
    for unit, name in zip(units.refused, ("ESAC77", "GENXYZ"), strict=True):
        assert name in unit.faults[0].text


def test_a_unit_without_a_model_is_named_with_its_records():
    text = SOUND + "8 GENROU 1 1 /\n8 'IEEEG1' 1 0 /\n9 ESACA1A 1 3 /\n"
    no_model = {unit.bus: unit for unit in read_units(text, "f").refused}
    assert [unit.modelled for unit in no_model.values()] == [False] * 2
    assert "no exciter of the catalogue: GENROU, IEEEG1" in no_model[8].faults[0].text + (
        no_model[8].faults[1].text
    )
    assert no_model[9].faults[1].text == "ESACA1A: did you mean ESAC1A?"


def test_a_classical_machine_without_an_exciter_is_no_unit():
    text = (
        "6 GENCLS 1 3 0 /\n"
        + SOUND
        + "7 GENCLS 1 99999 0 /\n8 GENCLS 1 3 0 /\n8 SEXS 1 .1 10 100 .1 0 5 /\n"
    )
    units = read_units(text, "f")
    assert (len(units.units), units.classical) == (1, 2)
    assert read_unit(text[: text.index("8 GENCLS")], "unit.dyr") == units.units[0]
    (refused,) = units.refused
    assert "GENCLS is a constant voltage behind a reactance" in refused.faults[0].text
    with pytest.raises(DynamicsError, match="GENCLS is a constant voltage behind a reactance"):
        read_unit(text, "unit.dyr", 7)


@pytest.mark.parametrize("seed", few_of(range(100), 25))
def test_damage_to_a_file_of_units_is_reported_or_harmless(seed):
    random = np.random.default_rng(seed)
    sound = "".join(at_bus(bus) for bus in BUSES)
    try:
        text = text_of(garbage(sound.encode(), random), "unit.dyr")
    except DynamicsError:
        return
    units = read_units(text, "f")
    whole = [unit for unit in units.units if unit.bus in BUSES]
    # a damage hurts a record, or joins it to the next; only what is cut off takes more with it
    assert len(whole) >= len(BUSES) - 2 or len(text) < len(sound)
    reported = units.refused or units.faults
    assert reported or len(units.units) == len(BUSES) or len(text) < len(sound)


def test_a_field_stands_where_it_says():
    text = "// naïve\r\n1 'ESAC1A'\t\"1 \" 0,0 ,1 // x\r2 GENROU 1 /\n"
    for record in sound_records(text).records:
        for field in record.fields:
            assert text[field.start : field.end].strip("'\"").strip() == field.text
