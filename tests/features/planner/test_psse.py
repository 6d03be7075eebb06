"""PSS/E dynamics files: what is written is read back; what is damaged is told with its line."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from dynamics import SAMPLE, SOUND, THREE, garbage, replaced
from hypothesis import given, settings
from hypothesis import strategies as st
from loose_records import SWAPPED, loose, sound
from tiers import few_of

from exfit.case.load import parse_case
from exfit.case.stated_values import taken_apart
from exfit.case.yaml import read_yaml
from exfit.errors import DynamicsError
from exfit.features.planner.buses import Bus
from exfit.features.planner.fields import text_of
from exfit.features.planner.import_case import import_unit, imported_case
from exfit.features.planner.psse import heads, record_text
from exfit.features.planner.records import (
    SIGNALS,
    Definition,
    definition_of,
    definitions,
    read_values,
    with_exchanged,
)
from exfit.features.planner.units import read_unit
from exfit.models import MODELS
from exfit.models.sheet import record, typical
from exfit.workflows import simulate

DEFINITIONS = {(one.model.name, one.record.name): one for one in definitions()}
# a record with all that records may have, whatever the catalogue holds
DEFINITIONS["AC1A", "MADEUP"] = Definition(
    "exciter",
    MODELS["AC1A"],
    *record(
        "MADEUP",
        "TR KA Switch TA E1 SE1 E2 SE2 TE Spare TUC",
        icons={"UEL": 1, "VOS": 2},
        absent={"Switch": 0.0, "Spare": -1.5},
        ignored="TUC",
        doubt="the order is made up",
    ),
)
GENROU = definition_of("GENROU")
ESAC1A, TGOV1 = definition_of("ESAC1A"), definition_of("TGOV1")


@pytest.fixture(params=DEFINITIONS, ids=" as ".join)
def definition(request):
    """Name each record of each model in turn."""
    return DEFINITIONS[request.param]


def read_back(definition, text):
    (head,), faults = heads(text)
    assert faults == []
    return read_values(definition, head.line, head.fields)


@settings(max_examples=settings.default.max_examples // 3, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def each_record_gives_the_same_numbers_back(definition, seed):
    random = np.random.default_rng(seed)
    values = sound(definition, random)
    read = read_back(definition, text_of(loose(definition, values, random).encode(), "unit.dyr"))
    assert read.faults == []
    assert read.values == values
    text = record_text(definition, values, 123456, "1")
    assert max(map(len, text.splitlines())) <= 80
    again = read_back(definition, text)
    assert again.faults == []
    curve = definition.record.cons
    if "E1" in curve and values["E1"] > values["E2"]:
        assert again.values == {name: values[SWAPPED.get(name, name)] for name in values}
    else:
        assert again.values == values
    assert again.values.get("E1", 0.0) <= again.values.get("E2", 0.0)
    assert record_text(definition, again.values, 123456, "1") == text


def test_what_is_written_in_any_style_is_read_and_written_the_same(definition):
    each_record_gives_the_same_numbers_back(definition)


def test_a_record_names_only_what_the_sheet_or_the_record_explains(definition):
    explained = {row.symbol for row in definition.model.sheet}
    record = definition.record
    explained |= {*record.ignored, *(name for name, _ in record.absent)}
    assert set(definition.record.cons) <= explained
    assert len(set(definition.names)) == len(definition.names)


def test_a_record_of_a_model_s_own_name_is_found_under_it(definition):
    if definition.record == definition.model.records[0]:
        found = definition_of(definition.record.name.lower())
        assert found == definition


def test_another_model_s_name_does_not_stand_for_a_model_that_can_be_written_so():
    """PSS/E's ESAC8B is no AC8B, though an AC8B may be handed over as one."""
    found = definition_of("ESAC8B")
    assert found is None or found.model.name != "AC8B"


def partners(definition, random):
    """Return a record with what makes it a unit: a machine, an exciter."""
    records = [(definition, sound(definition, random))]
    if definition.kind != "machine":
        records.append((GENROU, sound(GENROU, random)))
    if definition.kind == "load controller":
        records.append((TGOV1, sound(TGOV1, random)))
    if definition.kind != "exciter":
        exciter = definition_of("AC1C") if definition.kind == "limiter" else ESAC1A
        records.append((exciter, sound(exciter, random)))
    random.shuffle(records)
    return records


@settings(max_examples=settings.default.max_examples // 10, derandomize=True, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def each_case_holds_the_numbers_of_its_file(definition, seed):
    random = np.random.default_rng(seed)
    records = partners(definition, random)
    text = "".join(loose(*one, random, bus=7, machine_id="G1") for one in records)
    case = imported_case(read_unit(text, "unit.dyr", 7, "g1"), "unit.dyr").text
    assert max(map(len, case.splitlines())) <= 100
    read = read_yaml(case, Path("case.yaml"))[0].value, yaml.safe_load(case)
    mine, theirs = (taken_apart(content).content for content in read)
    places = {"machine": ("plant", "parameters"), "exciter": ("parameters", "fixed")}
    places["limiter"] = ("limiters", 0, "parameters")
    places["load controller"] = ("governor", "load_controller", "parameters")
    for one, values in records:
        for data in (mine, theirs):
            for key in places.get(one.kind, (one.kind, "parameters")):
                data = data[key]
            assert data == values
    if definition.kind != "stabiliser":
        parsed = parse_case(case, Path("case.yaml"))
        assert parsed.typical() == ()


def test_a_case_holds_the_numbers_of_its_file(definition):
    if definition_of(definition.record.name) == definition:
        each_case_holds_the_numbers_of_its_file(definition)


@pytest.mark.parametrize(("code", "signal"), SIGNALS.items())
def test_the_codes_of_a_stabiliser_s_inputs_are_its_signals(code, signal):
    unmodelled = f"{code} is not modelled"
    for definition in (one for one in DEFINITIONS.values() if one.codes):
        values = typical(definition.model.sheet) | dict(definition.record.held)
        codes = dict.fromkeys(definition.codes, code)
        text = record_text(definition, values | codes, 7, "1")
        read = read_back(definition, text)
        assert read.inputs == (signal,) * len(definition.model.inputs)
        assert not [warning for warning in read.warnings if unmodelled in warning.text]
        unit = "".join(
            f"{record_text(other, typical(other.model.sheet), 7, '1')}\n"
            for other in (GENROU, ESAC1A)
        )
        case = yaml.safe_load(
            imported_case(read_unit(f"{unit}{text}\n", "unit.dyr"), "unit.dyr").text
        )
        given = case["stabiliser"].get("inputs", [*definition.model.inputs])
        assert given == [signal] * len(definition.model.inputs)


# ---- damage


@pytest.mark.parametrize("seed", few_of(range(300), 60))
def test_a_damaged_file_is_reported_with_its_line_or_is_sound(seed, tmp_path):
    random = np.random.default_rng(seed)
    path = tmp_path / "unit.dyr"
    path.write_bytes(garbage(SAMPLE.read_bytes(), random))
    try:
        unit = import_unit(path)
    except DynamicsError as error:
        text = str(error)
        assert text.startswith(str(path))
        # a bus or id was damaged: the file holds two units
        several = "2 units; select one by --bus and --id" in text
        assert several or re.search(r"unit\.dyr:\d+: ", text) or "no record" in text
        assert text.replace("\n", "").isprintable()
    else:
        parse_case(imported_case(unit, path.name).text, tmp_path / "case.yaml")


def fault_of(text, *given):
    with pytest.raises(DynamicsError) as caught:
        read_unit(text, "unit.dyr", *given)
    return caught.value.faults


FAULTS = {
    "a letter in a number": (" 766 ", " 7b6 ", "unit.dyr:2: ESAC1A: KA: '7b6' is not a number"),
    "no number": (" 766 ", " nan ", "unit.dyr:2: ESAC1A: KA: 'nan' is not a number"),
    "too large": (" 766 ", " 1e999 ", "unit.dyr:2: ESAC1A: KA: '1e999' is too large"),
    "a number in quotes": (" 766 ", " '766' ", "unit.dyr:2: ESAC1A: KA: '766' is not a number"),
    "a repeat count": (" 1.3 ", " 2*1.3 ", "unit.dyr:3: ESAC1A: TE: '2*1.3' repeats a value"),
    "an empty value": (" 766 ", ",,", "unit.dyr:2: ESAC1A: KA: empty, between two commas"),
    "an empty value over two lines": (
        " 766 ",
        ",\n,",
        "unit.dyr:3: ESAC1A: KA: empty, between two commas",
    ),
    "a value too many": (" 766 ", " 766 1 ", "unit.dyr:2: ESAC1A: 20 values after the id"),
    "a value too few": (" 766 ", " ", "ESAC1A: 18 values after the id, but the record has 19"),
    "a repeat count in place of values": (
        " 1.3 .024 ",
        " 2*1.3 ",
        "KF TF KC KD KE E1 SE1 E2 SE2 VRMAX VRMIN\n"
        "unit.dyr:3: ESAC1A: '2*1.3' repeats a value; write each one out",
    ),
    "the order of the symbols": (" 766 ", " ", "(19 constants): TR TB TC KA TA VAMAX VAMIN TE"),
    "a value outside the sheet": (
        " 766 ",
        " -1 ",
        "unit.dyr:2: ESAC1A: KA: -1 lies outside 0.01 ... 100000 pu",
    ),
    "crossed limits": ("14.5 -14.5\n", "-14.5 14.5\n", "unit.dyr:2: ESAC1A: VAMIN: 14.5 is not"),
    "a saturation at no voltage": ("3.14 .03", "0 .03", "unit.dyr:4: ESAC1A: E1: 0 is no point"),
    "reactances out of order": (" .25 .2 ", " .25 .35 ", "unit.dyr:1: GENROU: Xpd: 0.3 is not"),
    "no end": (".4 /", ".4", "unit.dyr:1: the record that begins here has no '/' before the next"),
    "no end of the last": ("-14.5 /", "-14.5", "unit.dyr:2: the record that begins here has no"),
    "an open quote": ("ESAC1A", "'ESAC1A", "unit.dyr:2: a quote is opened and not closed"),
    "a bus by its name": ("1 ESAC1A", "'WEST' ESAC1A", "unit.dyr:2: ESAC1A: 'WEST' is not the"),
    "a bus of zero": ("1 ESAC1A", "0 ESAC1A", "unit.dyr:2: ESAC1A: '0' is not the number of a bus"),
    "a long id": ("ESAC1A 1", "ESAC1A 123", "unit.dyr:2: ESAC1A: '123' is not a machine id"),
    "no bus": ("1 ESAC1A", "ESAC1A", "unit.dyr:2: 'ESAC1A 1 0' is not bus, 'model' and id"),
    "a typing error in the exciter": (
        "ESAC1A",
        "ESACA1A",
        "unit.dyr:2: ESACA1A: exfit has no exciter of that name; did you mean ESAC1A?",
    ),
    "a machine that exfit lacks": (
        "GENROU",
        "GENTWO1",
        "unit.dyr:1: GENTWO1: exfit has no machine of that name",
    ),
    "a classical machine": (
        "GENROU",
        "GENCLS",
        "unit.dyr:1: GENCLS is a constant voltage behind a reactance, with nothing to verify",
    ),
    "a second exciter": (
        "1 ESAC1A",
        "1 ESAC1A 1 0 /\n1 ESAC1A",
        "unit.dyr:3: ESAC1A: a second exciter; ESAC1A is on line 2",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_names_its_line_the_value_and_the_limit(fault):
    old, new, words = FAULTS[fault]
    assert words in "\n".join(fault_of(replaced(old, new)))


def test_a_unit_without_an_exciter_is_reported_with_those_that_could_be_read():
    (fault,) = fault_of(SOUND.splitlines()[0] + "\n1 IEEEG1 1 2 3 /")
    assert fault.startswith("unit.dyr:1: bus 1, id 1: has no exciter; known: ")
    assert "ESAC1A" in fault


def test_all_faults_of_a_unit_are_reported_at_once_in_the_order_of_their_lines():
    text = replaced(" 766 ", " x ", replaced(" 1.3 ", " -1 ", replaced(" .12 ", " -1 ")))
    assert [fault.split(": ")[:3] for fault in fault_of(text)] == [
        ["unit.dyr:1", "GENROU", "S10"],
        ["unit.dyr:2", "ESAC1A", "KA"],
        ["unit.dyr:3", "ESAC1A", "TE"],
    ]


def test_a_derivative_without_a_lag_is_warned_of():
    record = "1 ESAC8B 1 .02 40 5 10 0 1 0 10 -10 1 1 3 .1 4 .4 /\n"
    unit = read_unit(SOUND.splitlines()[0] + "\n" + record, "unit.dyr")
    assert unit.exciter.values["TD"] == 0.0
    assert "ESAC8B: KD: 10 has no effect, since TD is 0" in [text for _, text in unit.warnings]


def test_names_and_ids_may_be_quoted_and_a_bus_needs_its_number():
    text = SOUND.replace("GENROU 1", '"GENROU" "1 "').replace("ESAC1A 1", "'ESAC1A' '1 ' @")
    text = f"@! of release 35, it's\n{text.replace(' @', '')}"
    assert read_unit(text, "unit.dyr").machine.values == read_unit(SOUND, "unit.dyr").machine.values
    with pytest.raises(
        DynamicsError, match=r"'NORTH 21\.6' is not the number of a bus; write the n"
    ):
        read_unit(text.replace('1 "GENROU"', "'NORTH 21.6' 'GENROU'"), "unit.dyr")


def test_buses_by_their_names_have_the_numbers_of_a_power_flow_file():
    buses = {1: Bus("NORTH G1", 18.0), 2: Bus("SOUTH", 18.0), 9: Bus("SOUTH", 110.0)}
    for name in ("NORTH G1", "NORTH G1    18.000"):
        text = SOUND.replace("1 GENROU", f"'{name}' GENROU").replace("1 ESAC1A", f"'{name}' ESAC1A")
        for wanted in (None, 1, "north g1"):
            unit = read_unit(text, "unit.dyr", wanted, None, buses)
            assert (unit.bus, unit.bus_name) == (1, "NORTH G1")
    for name, known in (("SOUTH", buses), ("NORTH", buses), ("NORTH G1", {})):
        text = SOUND.replace("1 GENROU", f"'{name}' GENROU")
        with pytest.raises(DynamicsError, match=f"'{name}' is not the number of a bus"):
            read_unit(text, "unit.dyr", None, None, known)


@pytest.mark.parametrize("points", ["3.14 -.03 4.18 .1", "-3.14 .03 4.18 .1", "3.14 .3 4.18 -.1"])
def test_a_saturation_of_a_negative_value_is_refused(points):
    with pytest.raises(DynamicsError, match=r"(E1|SE1|SE2)"):
        read_unit(replaced("3.14 .03 4.18 .1", points), "unit.dyr")


@pytest.mark.parametrize("points", ["0 0 0 0", "0 0 4.18 .1"])
def test_a_saturation_of_zero_at_no_voltage_is_read_as_it_stands(points):
    values = read_unit(replaced("3.14 .03 4.18 .1", points), "unit.dyr").exciter.values
    assert [values[name] for name in ("E1", "SE1", "E2", "SE2")] == [*map(float, points.split())]


def test_a_saturation_whose_knee_lies_above_its_points_is_none_with_a_warning():
    """ACTIVSg2000 has forty exciters with E SE smaller at the higher voltage."""
    text = replaced("3.14 .03 4.18 .1", "4.18 .01 3.14 .03")
    unit = read_unit(text, "unit.dyr")
    values = [unit.exciter.values[name] for name in ("E1", "SE1", "E2", "SE2")]
    assert values == [4.18, 0.0, 3.14, 0.0]
    assert unit.exciter.unused == (("SE1", 0.01), ("SE2", 0.03))
    (warning,) = unit.warnings
    # sqrt(E SE) is linear in E and zero at the knee
    knee = 4.18 + 0.0418**0.5 * (4.18 - 3.14) / (0.0942**0.5 - 0.0418**0.5)
    assert (
        f"SE1: 0.01, and SE2 0.03, fall: the quadratic curve is 0 up to {knee:.4g} pu"
        in warning.text
    )
    assert "unused: {SE1: 0.01, SE2: 0.03}" in imported_case(unit, "unit.dyr").text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (" .25 .2 ", " .25 .26 ", "Xppd: 0.25 is below Xl = 0.26"),
        (" .55 .25 ", " .55 .305 ", "Xpd: 0.3 is below Xppd = 0.305"),
    ],
)
def test_reactances_that_no_machine_has_but_that_can_be_simulated_are_warned_of(old, new, words):
    """A public file of a steam plant has X''d below Xl."""
    unit = read_unit(replaced(old, new), "unit.dyr")
    assert [warning.text for warning in unit.warnings] == [f"GENROU: {words}"]
    response = simulate(
        parse_case(imported_case(unit, "unit.dyr").text, Path("case.yaml"))
    ).response
    assert np.all(np.isfinite(response.signals["vt"]))


@pytest.mark.parametrize("damage", ["0.0 /\n", "3 'ESAC1A' 1 2\n", "9 'GEN\n"])
def test_a_record_that_cannot_be_read_does_not_stop_a_unit_beside_it(damage):
    for text in (SOUND + damage, damage + SOUND):
        unit = read_unit(text, "unit.dyr", 1)
        assert unit.exciter.values["KA"] == 766.0
        assert unit.warnings
        assert all(text.endswith("the record is left out") for _, text in unit.warnings)


@pytest.mark.parametrize(
    ("given", "lines"),
    [
        ((), ["3 units; select one by --bus", "bus 1, id 1: GENROU, ESAC1A", "bus 1, id 2"]),
        ((1,), ["2 units; select", "bus 1, id 1: GENROU, ESAC1A", "bus 1, id 2: GENROU, ESAC1A"]),
        ((None, "1"), ["2 units; select", "bus 1, id 1", "bus 9, id 1"]),
        ((8,), ["no record of bus 8", "bus 1, id 1", "bus 1, id 2", "bus 9, id 1"]),
        ((9, "2"), ["no record of bus 9, id '2'", "bus 1, id 1"]),
    ],
)
def test_a_unit_among_several_must_be_chosen(given, lines):
    faults = fault_of(THREE, *given)
    for words, fault in zip(lines, faults, strict=False):
        assert words in fault


def test_a_chosen_unit_is_the_one_that_is_read():
    assert read_unit(THREE, "unit.dyr", 1, "2").machine.line == 5
    assert read_unit(THREE, "unit.dyr", 9).bus == 9


def test_a_record_that_multiplies_by_the_speed_makes_a_case_that_does():
    """EXDC2 alone, by public implementations; a record of another exciter says nothing of it."""
    values = " ".join(
        "0" if symbol == "Switch" else f"{typical(MODELS['EXDC2'].sheet)[symbol]:g}"
        for symbol in definition_of("EXDC2").record.cons
    )
    machine, _, exciter = SOUND.partition("\n")
    texts = f"{machine}\n1 EXDC2 1 {values} /\n", f"{machine}\n{exciter}"
    cases = [
        yaml.safe_load(imported_case(read_unit(text, "u.dyr"), "u.dyr").text) for text in texts
    ]
    assert [case.get("efd_times_speed") for case in cases] == [True, None]


def test_a_long_list_of_units_is_cut():
    many = "".join(f"{bus} WT9G1 1 0 /\n" for bus in range(1, 101))
    faults = fault_of(many)
    assert len(faults) == 22
    assert "80 more" in faults[-1]


def test_what_other_units_and_devices_hold_is_no_fault():
    others = (
        "'VSC 1' 'VSCDCT' 1 2 3*0. /\n200 'DISTR1', 300, '1 ', 1,, 2 /\n"
        "Line 'Toggler' Line_1 1.0 /\n300 'ESST99' 1 x y z /\n"
        " / a line of comment\n\n400 'IEELBL' '*' 2*1.0 /\n"
    )
    unit = read_unit(others + SOUND, "unit.dyr", 1)
    assert unit.exciter.values["KA"] == 766.0
    assert unit.warnings == ()


@pytest.mark.parametrize(
    ("record", "words"),
    [
        ("1 WEHGOV 1 0 0 /", "governor WEHGOV is left out"),
        ("1 'MAXEX2' 1 0 0 /", "excitation limiter MAXEX2 is left out"),
        (
            "1 'OEL3C' 1 0 1 1 x /",
            "limiter OEL3C is left out: 4 values after the id, but the record has 12 (1 integers "
            "and 11 constants): OELINPUT ITFPU KSCALE TF K1 KOEL TOEL KPOEL VOELMAX1 VOELMIN1 "
            "VOELMAX2 VOELMIN2; 'x' is not a number",
        ),
        ("1 'XYZ' 1 0 0 /", "XYZ is left out: not a known model"),
        ("1 'USRMDL' 1 'MYGOV' 5 0 0 /", "USRMDL MYGOV is left out: not a known model"),
    ],
)
def test_what_is_left_out_is_reported_and_written_in_the_case(record, words):
    unit = read_unit(SOUND + record, "unit.dyr")
    assert unit.warnings == ((5, words),)
    remarks = " ".join(
        imported_case(unit, "unit.dyr").text.split("model:")[0].replace("#", "").split()
    )
    assert f"Line 5: {' '.join(words.split())}." in remarks


@pytest.mark.parametrize(
    ("exciter", "flags", "limiter", "place", "why"),
    [
        ("AC1C", {"OEL": 1.0}, "OEL2C", "summing", ""),
        ("AC1C", {"OEL": 2.0}, "OEL2C", "takeover", ""),
        ("AC7C", {"OEL": 1.0, "UEL": 3.0}, "UEL2C", "takeover-output", ""),
        # 4 is a gate behind the PI; OEL3C has no gate; ESAC1A and ST6C say nothing
        ("AC7C", {"OEL": 4.0}, "OEL2C", "takeover", "AC7C has OEL = 4"),
        ("AC1C", {"OEL": 2.0}, "OEL3C", "summing", "AC1C has OEL = 2"),
        ("ESAC1A", {}, "OEL2C", "takeover", "ESAC1A does not state its place"),
        ("ST6C", {}, "OEL2C", "takeover", "ST6C has OEL = 1"),
    ],
)
def test_a_limiter_acts_where_its_exciter_s_flag_says_else_at_its_usual_place(
    exciter, flags, limiter, place, why
):
    parts = ((GENROU, {}), (definition_of(exciter), flags), (definition_of(limiter), {}))
    records = [
        record_text(part, typical(part.model.sheet) | changes, 7, "1") for part, changes in parts
    ]
    unit = read_unit("\n".join(records), "unit.dyr")
    (own,) = unit.limiters
    assert own.place == place
    told = [warning.text for warning in unit.warnings if warning.text.endswith("is taken")]
    assert told == ([f"{limiter}: {why}; {place} is taken"] if why else [])
    case = parse_case(imported_case(unit, "unit.dyr").text, Path("unit.yaml"))
    (attached,) = case.parts.limiters
    assert (attached.model.name, attached.place) == (limiter, place)


def test_a_limiter_whose_flag_is_0_is_left_out_as_in_PSSE():
    """The reference psse_idle_uel1 has such a unit: at the gate vt would be 1.4e-5 pu off."""
    parts = ((GENROU, {}), (definition_of("AC1C"), {"OEL": 0.0}), (definition_of("OEL2C"), {}))
    records = [record_text(part, typical(part.model.sheet) | own, 7, "1") for part, own in parts]
    unit = read_unit("\n".join(records), "unit.dyr")
    assert unit.limiters == ()
    assert "limiter OEL2C is left out: AC1C has OEL = 0" in [own.text for own in unit.warnings]


def test_a_governor_that_cannot_be_simulated_is_left_out_with_the_reason():
    for text, reason in (
        ("1 TGOV1 1 0.05 0.5 1 0 3 10 /", "6 values after the id"),
        ("1 TGOV1 1 0 0.5 1 0 3 10 0 /", "R: 0 lies outside 0.001 ... 10 pu"),
        ("1 HYGOV 1 .05 .3 5 .05 .5 .2 0 1 1 1.2 .5 .1 /", "GMIN: 1 is not below GMAX = 0"),
    ):
        unit = read_unit(SOUND + text, "unit.dyr")
        assert unit.governor is None
        (warning,) = unit.warnings
        assert warning.line == 5
        assert warning.text.startswith(f"governor {text.split()[1]} is left out: {reason}")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1", "utf-8", "utf-16"])
def test_a_file_is_read_in_any_usual_encoding_and_with_any_ends_of_line(encoding):
    for end in ("\n", "\r\n", "\r"):
        text = ("// Müller GmbH\n" + SOUND + "/ naïve\n\x1a").replace("\n", end)
        unit = read_unit(text_of(text.encode(encoding), "unit.dyr"), "unit.dyr")
        assert unit.exciter.line == 3


def test_what_a_record_cannot_say_of_a_model_is_warned_of():
    """Integers, symbols that the model lacks, and a doubt about the order."""
    for definition in DEFINITIONS.values():
        record = definition.record
        own = typical(definition.model.sheet)
        values = {**own, **dict.fromkeys(record.ignored, 7.5), **dict(record.absent)}
        taken = {*own, *record.ignored}
        icons = [(name, value) for name, value in record.icons if name not in taken]
        # a code that no signal stands for: the slope of the voltage, or the frequency of a bus
        unheard = 2 if 6 in definition.signals else 6
        of_icons = {name: value + ((name, value) in icons) for name, value in record.icons}
        of_icons |= dict.fromkeys(definition.codes, unheard)
        given = [value for name, value in of_icons.items() if name not in record.cons]
        absent = dict(record.absent)
        absent = {name: value - 1 if value > 1 else value + 1 for name, value in absent.items()}
        others = {**of_icons, **values, **absent}
        given += [others[name] for name in record.cons]
        text = f"1 {record.name} 1 " + " ".join(map(repr, given)) + " /"
        read = read_back(definition, text)
        told = "\n".join(warning.text for warning in read.warnings)
        for name, value in (*icons, *record.absent):
            other = of_icons[name] if name in of_icons else absent[name]
            assert f"{record.name}: {name}: {other:g} is not modelled; {value:g} is" in told
        assert record.doubt in told
        listed = (*definition.names, *dict(record.held))
        for row in definition.model.sheet:
            assert (row.symbol in listed) != (f"{row.symbol}: not in the record" in told)
        assert read.values == with_exchanged(record, {**own, **dict(record.held)})
