"""PSLF dynamics files: what is written is read back; what is damaged is told with its line."""

import re

import numpy as np
import pytest
from loose_dyd import PSLF_UNIT, garbage, loose_dyd, sorted_curve
from loose_records import sound
from tiers import few_of

from exfit.errors import DynamicsError
from exfit.features.planner.import_case import import_unit, imported_case
from exfit.features.planner.pslf import PSLF_FILES, heads, record_text
from exfit.features.planner.records import PSLF, definition_of, definitions, read_values
from exfit.features.planner.units import read_unit, read_units
from exfit.models.sheet import typical

DEFINITIONS = {definition.record.name: definition for definition in definitions(PSLF)}


@pytest.fixture(params=DEFINITIONS)
def definition(request):
    """Name each record of PSLF in turn."""
    return DEFINITIONS[request.param]


def read_back(text):
    ((head,), faults) = heads(text)
    assert faults == []
    assert head.faults == ()
    return head, read_values(head.definition, head.line, head.fields)


def there_and_back(definition, seed):
    random = np.random.default_rng(seed)
    values = sound(definition, random)
    head, read = read_back(loose_dyd(definition, values, random, 123, "G1"))
    assert (head.bus, head.id, head.definition) == (123, "G1", definition)
    assert read.faults == []
    assert read.values == values
    text = record_text(definition, values, 123456, "1")
    assert max(map(len, text.splitlines())) <= 80
    _, again = read_back(text)
    assert again.faults == []
    assert again.values == sorted_curve(values)
    assert record_text(definition, again.values, 123456, "1") == text


def test_a_record_is_read_as_it_was_typed_and_comes_back_from_what_is_written(definition):
    for seed in range(10):
        there_and_back(definition, seed)


@pytest.mark.long
def test_a_hundred_records_of_a_model_go_there_and_back(definition):
    for seed in range(10, 100):
        there_and_back(definition, seed)


def test_a_record_names_only_what_the_sheet_or_the_record_explains(definition):
    record = definition.record
    explained = {row.symbol for row in definition.model.sheet}
    explained |= {*record.ignored, *dict(record.absent), *dict(record.icons)}
    assert set(definition.names) <= explained
    assert len(set(definition.names)) == len(definition.names)
    assert definition.absent == ()
    assert definition_of(record.name.upper(), PSLF) == definition


def test_an_order_from_a_thin_source_is_in_doubt():
    certain = {name for name, own in DEFINITIONS.items() if not own.record.doubt}
    assert certain == {
        "genrou", "gensal", "gentpj", "gentpf", "hyg3", "hygovr",
        "exac4", "exac8b", "exst1", "esst1a", "exst4b", "esst4b", "esst5b",
        "rexs", "ieeest", "pss2a", "pss2b", "tgov1", "ieeeg1", "ggov1", "wsccst",
    }  # fmt: skip
    _, read = read_back(record_text(DEFINITIONS["exac1"], sound_of("exac1"), 1, "1"))
    assert "not confirmed" in read.warnings[0].text


def sound_of(name):
    return sound(DEFINITIONS[name], np.random.default_rng(1))


def test_a_sample_is_read_and_its_case_names_what_it_rests_on():
    unit = read_unit(PSLF_UNIT, "unit.dyd", 1)
    assert (unit.machine.line, unit.exciter.line) == (5, 9)
    assert unit.machine.values["S12"] == 0.4
    assert unit.exciter.values["KA"] == 150.0
    case = imported_case(unit, "unit.dyd").text
    assert "model: EXAC4" in case
    assert "# exac4 on line 9" in case
    assert "Ka" not in case


def governed(base, record):
    """Return a unit with a governor on a base."""
    values = dict(typical(DEFINITIONS[record].model.sheet))
    text = record_text(DEFINITIONS[record], values, 1, "1").replace("#9", f"#9 mwcap={base}")
    return read_unit(f"{PSLF_UNIT}{text}\n", "a.dyd", 1)


@pytest.mark.parametrize("record", ["tgov1", "ggov1"])
def test_the_base_of_a_governor_is_its_share_of_the_machine_s_or_is_named(record):
    for base, share in ((120.0, 1.0), (90.0, 0.75)):
        unit = governed(base, record)
        assert unit.governor.values["Trate_Mbase"] == share
        assert not [text for _, text in unit.warnings if " MW" in text]
    text = PSLF_UNIT.replace("mva=120.0 ", "")
    values = dict(typical(DEFINITIONS[record].model.sheet))
    text += record_text(DEFINITIONS[record], values, 1, "1").replace("#9", "#9 mwcap=90")
    (warning,) = [text for _, text in read_unit(text, "a.dyd", 1).warnings if "on 90 MW" in text]
    assert "the machine's base is not in the file" in warning


def test_efd_is_multiplied_by_the_speed_where_the_record_says_so():
    values = sound_of("exac1")
    text = (
        PSLF_UNIT[: PSLF_UNIT.index("exac4")]
        + record_text(DEFINITIONS["exac1"], values, 1, "1")
        + "\n"
    )
    assert "efd_times_speed" not in imported_case(read_unit(text, "a.dyd", 1), "a.dyd").text
    text = PSLF_UNIT[: PSLF_UNIT.index("exac4")]
    text += record_text(DEFINITIONS["exac1"], values | {"SPDMLT": 1.0}, 1, "1") + "\n"
    assert "efd_times_speed: true" in imported_case(read_unit(text, "a.dyd", 1), "a.dyd").text


# ---- damage

FAULTS = {
    "a line that is not continued": (" /\n# of", "\n# of", "a.dyd:8: '0.12 0.4 0.0' does not"),
    "no colon": ('"1 " : #9 "tr"', '"1 " #9 "tr"', "a.dyd:9: exac4: the record has no ':'"),
    "too few values": ("0.12 0.4 0.0 0.0 0.0", "0.12", "a.dyd:5: genrou: 13 values after the id"),
    "no number": ("0.12 0.4", "0.l2 0.4", "a.dyd:8: genrou: S10: '0.l2' is not a number"),
    "outside": ('"ka" 150', '"ka" -1', "a.dyd:9: exac4: KA: -1 lies outside 0.01 ... 100000 pu"),
    "an unknown name": ('"Ta"', '"tz"', "a.dyd:10: exac4: unknown value 'tz'; known: tr"),
    "a name given twice": ('"kc"', '"tr"', "a.dyd:10: exac4: tr: given twice"),
    "a name without a value": ('"kc" 0.0', '"kc"', "a.dyd:10: exac4: 'kc': no name in quotes"),
    "a value that is missing": ('"kc" 0.0', "", "a.dyd:9: exac4: missing: kc"),
    "an open quote": ('"GEN1"', '"GEN1', "a.dyd:9: a quote is opened"),
    "a base": ("mva=120.0", "mva=12O", "a.dyd:5: genrou: mva: '12O' is not a number"),
    "a bus": ("exac4 1 ", "exac4 -1 ", "a.dyd:9: exac4: '-1' is not the number of a bus"),
    "a field too many": ("18.0 \"1 \" : #9 \"", "18.0 0 \"1 \" : #9 \"", "6 fields before ':'"),
    "an unknown exciter": ("exac4 1", "exac5 1", "exac5: exfit has no exciter of that name"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_names_its_line_the_value_and_the_limit(fault):
    old, new, words = FAULTS[fault]
    assert PSLF_UNIT.count(old) == 1
    with pytest.raises(DynamicsError) as raised:
        read_unit(PSLF_UNIT.replace(old, new), "a.dyd", 1)
    assert words in str(raised.value)


@pytest.mark.parametrize("seed", few_of(range(100), 25))
def test_a_damaged_file_is_reported_with_its_line_or_is_sound(seed, tmp_path):
    random = np.random.default_rng(seed)
    path = tmp_path / "unit.dyd"
    path.write_bytes(garbage(PSLF_UNIT.encode(), random))
    try:
        unit = import_unit(path, 1)
    except DynamicsError as error:
        for line in str(error).splitlines():
            assert re.match(rf"{re.escape(str(path))}(:\d+)?: |  bus \d+", line), line
    else:
        assert imported_case(unit, "unit.dyd").text


def test_a_fault_of_one_unit_leaves_the_others():
    other = PSLF_UNIT.replace(" 1 ", " 2 ").replace("150", "-150")
    units = read_units(PSLF_UNIT + other, "a.dyd")
    assert [unit.bus for unit in units.units] == [1]
    assert {unit.bus: unit.modelled for unit in units.refused} == {2: True}
    assert units.devices == {"wlwscc": 1}


@pytest.mark.parametrize("name", ["gen: 1/#", " GEN:  1/# 18.0", "GEN: 1/# 18"])
def test_a_unit_is_asked_for_by_the_name_of_its_bus_and_its_kv(name):
    other = PSLF_UNIT.replace(" 1 ", " 2 ").replace('"GEN: 1/#"', '"GEN 2"')
    unit = read_unit(PSLF_UNIT + other, "a.dyd", name)
    assert (unit.bus, unit.bus_name) == (1, "GEN: 1/#")
    assert "bus 1 GEN: 1/#" in imported_case(unit, "a.dyd").text
    with pytest.raises(DynamicsError) as raised:
        read_unit(PSLF_UNIT + other, "a.dyd", "GEN: 1/# 21")
    assert "no record of bus 'GEN: 1/# 21'" in str(raised.value)
    assert "bus 2 GEN 2, id 1: genrou, exac4" in str(raised.value)


def test_the_end_of_a_record_may_be_marked_as_other_writers_do():
    ended = PSLF_UNIT.replace("0.0 0.0 0.0\n", "0.0 0.0 0.0 /\n").replace('"kc" 0.0', '"kc" 0.0 /')
    usual, other = (read_unit(text, "a.dyd", 1).machine.values for text in (PSLF_UNIT, ended))
    assert other == usual


def test_the_suffix_says_the_program():
    assert PSLF_FILES.suffix == ".dyd"
    with pytest.raises(DynamicsError, match="no record of a unit: bus, 'model'"):
        read_unit("", "a.dyr")
    with pytest.raises(DynamicsError, match="no record of a unit: model, bus, name, kV"):
        read_unit("", "a.dyd")


@pytest.mark.parametrize(
    ("code", "signal", "says"),
    [(1, "speed", ""), (2, "pa", ""), (3, "speed", "ICS: 3 is not modelled; 1 is taken, speed")],
)
def test_the_codes_of_wsccst_are_its_own(code, signal, says):
    definition = DEFINITIONS["wsccst"]
    text = record_text(definition, typical(definition.model.sheet) | {"ICS": code}, 1, "1")
    _, read = read_back(text)
    assert read.inputs == (signal,)
    assert definition.codes_for(("p",)) == {}
    assert definition.codes_for(read.inputs) == {"ICS": code if signal == "pa" else 1}
    assert [warning.text for warning in read.warnings] == ([f"wsccst: {says}"] if says else [])
