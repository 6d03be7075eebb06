"""A planner's file with fitted values: what was fitted is in it, every other byte as it was."""

from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest
import yaml
from dynamics import THREE, replaced
from dyr_words import changed_words
from hypothesis import given, settings
from hypothesis import strategies as st
from loose_dyd import PSLF_UNIT, loose_dyd
from loose_records import loose, sound
from records import TEST, TIME, case_of, one, synthetic

from exfit import workflows
from exfit.case.load import parse_case
from exfit.features.planner.export import export
from exfit.features.planner.fields import text_of
from exfit.features.planner.fitted_file import FittedUnit, fitted_file, number_text
from exfit.features.planner.import_case import imported_case
from exfit.features.planner.psse import record_text
from exfit.features.planner.records import (
    PSLF,
    PSSE,
    contradictions,
    definition_of,
    definitions,
    unused_of,
)
from exfit.features.planner.units import read_units
from exfit.models.sheet import typical
from exfit.plants import LIMITER_KINDS
from exfit.results.comparisons import AsFound
from exfit.results.model import FittedParameter
from exfit.util.vocabulary import FITTED, TYPICAL

DEFINITIONS = {
    definition.record.name: definition
    for definition in definitions()
    if definition_of(definition.record.name) == definition
}
GENROU, ESAC1A = DEFINITIONS["GENROU"], DEFINITIONS["ESAC1A"]
OF_PSLF = {definition.record.name: definition for definition in definitions(PSLF)}
PARTNERS = {
    PSSE: {"machine": GENROU, "exciter": ESAC1A},
    PSLF: {"machine": OF_PSLF["genrou"], "exciter": OF_PSLF["exac4"]},
}
FILES = {PSSE: "units.dyr", PSLF: "units.dyd"}
WRITTEN = 5e-6  # of a value: half of the sixth digit
ENCODINGS = ("utf-8", "latin-1", "utf-8-sig", "utf-16", "utf-16-be")


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    """Return a fit that holds; its models and values are then replaced."""
    folder = tmp_path_factory.mktemp("fit")
    synthetic(folder, TEST, TIME)
    result = workflows.fit(case_of(one(TEST, free=["KA"]), folder))
    assert result.holds
    return replace(result, parameters={}, ties={}, network={}, network_model=None)


def unit_of(data, bus, machine_id="1", program=PSSE):
    """Return a unit of a file."""
    units = read_units(text_of(data, "f"), FILES[program]).units
    units = {(unit.bus, unit.id.upper()): unit for unit in units}
    return units[bus, machine_id.upper()]


def parts_of(unit):
    """Return the records of a unit by the beginnings of the names of their parameters."""
    parts = (unit.exciter, unit.machine, *unit.added, *unit.limiters)
    return {part.definition.prefix: part for part in parts}


def values_of(unit):
    """Return all values of a unit by their names in the system."""
    return {
        prefix + symbol: value
        for prefix, part in parts_of(unit).items()
        for symbol, value in part.values.items()
    }


def verified(fit, unit, values, sources=None, **others):
    """Return a fit of a unit as it was found with other values."""
    parts = parts_of(unit)
    of_part = {
        prefix: {symbol: values[prefix + symbol] for symbol in part.values}
        for prefix, part in parts.items()
    }
    found = values_of(unit)
    changed = {name for name in values if values[name] != found[name]}
    model = {prefix: part.definition.model.name for prefix, part in parts.items()}
    return replace(
        fit,
        **{
            "model": model[""],
            "fixed": of_part[""],
            "machine": of_part["machine."],
            "machine_model": model["machine."],
            "stabiliser": of_part.get("stabiliser.", {}),
            "stabiliser_model": model.get("stabiliser."),
            "governor": of_part.get("governor.", {}),
            "governor_model": model.get("governor."),
            "limiters": {p[:-1]: of_part[p] for p in of_part if p[:-1] in LIMITER_KINDS},
            "limiter_models": {p[:-1]: model[p] for p in model if p[:-1] in LIMITER_KINDS},
            "sources": dict.fromkeys(changed, FITTED) | (sources or {}),
            "as_found": AsFound("", model[""], found, bus=unit.bus, machine_id=unit.id),
            "saturation": "quadratic",
            **others,
        },
    )


def exported(data, *fits, program=PSSE):
    """Return the file with the values of fits, which all must be in it."""
    names = (f"case-{number}" for number in count())
    written = fitted_file(data, FILES[program], [*map(FittedUnit, names, fits)])
    assert [left for left in written.left if left.verified] == []
    return written


def other_values(unit, random, share=0.4):
    """Return values of a unit of which some are others, within the sheets and without a fault."""
    values = values_of(unit)
    for prefix, part in parts_of(unit).items():
        drawn = sound(part.definition, random)
        names = [name for name in part.definition.names if name in part.values]
        chosen = {name for name in names if random.random() < share}
        trial = {**part.values, **{name: rounded(drawn[name]) for name in chosen}}
        rows = {row.symbol: row for row in part.definition.model.sheet}
        inside = all(rows[name].low <= trial[name] <= rows[name].high for name in chosen)
        acts = not unused_of(part.definition.record, trial)
        if inside and acts and not [*contradictions(part.definition.model, trial)]:
            values |= {prefix + name: trial[name] for name in chosen}
    return values


def rounded(value):
    """Return a value as it is written."""
    return float(f"{value:.6g}")


def partners(definition, random):
    """Return the records of a unit, one of them of a kind: (definition, values)."""
    chosen = {**PARTNERS[definition.program], definition.kind: definition}
    if definition.kind == "limiter":  # this exciter has all places for one
        chosen["exciter"] = DEFINITIONS["AC1C"]
    records = [(own, sound(own, random)) for own in chosen.values()]
    random.shuffle(records)
    return records


def odd_file(definition, random):
    """Return a file of three units between what exfit does not know, in an odd layout."""
    ends = str(random.choice(["\n", "\r\n", "\r"]))
    text = "// Prüfstand: 'as of' 1999\n\n@! units / of 2026\n"
    for bus in (7, 101, 99_999):
        for own, values in partners(definition, random):
            text += loose(own, values, random, bus=bus, machine_id="G1")
        text += f"{bus} 'WEHGOV' G1 0 0 0.050 3*1.0 / {bus} governor's\n"
        text += f"{bus}, 'USRMDL', '2', 'OWN' 1 2 3.5000, ,/\n"
    text += str(random.choice(["", "\x1a", "\n\n", "/ the end", "  \t"]))
    text = text.replace("\r\n", "\n").replace("\n", ends)
    encoding = str(random.choice(ENCODINGS))
    mark = b"\xfe\xff" if encoding == "utf-16-be" else b""
    return mark + text.encode(encoding)


def odd_file_of_pslf(definition, random):
    """Return a file of three units between what exfit does not know, in an odd layout."""
    text = '# Prüfstand: "as of" 1999\n\nlodrep\nmodels\n'
    for bus in (7, 101, 99_999):
        for own, values in partners(definition, random):
            text += loose_dyd(own, values, random, bus, "G1")
        text += f'wehgov {bus} ! ! "G1" : mwcap=9 0.050 3.0 # {bus} governor\'s\n'
        text += f"imetr {bus} ! ! ! 7 ! ! ! : #9\t0.0,\n"
    ends = str(random.choice(["\n", "\r\n", "\r"]))
    return text.replace("\n", ends).encode(str(random.choice(ENCODINGS[:4])))


ODD_FILES = {PSSE: odd_file, PSLF: odd_file_of_pslf}


def there_and_back(fit, definition, random):
    program = definition.program
    read, write = partial(unit_of, program=program), partial(exported, program=program)
    data = ODD_FILES[program](definition, random)
    unit = read(data, 101, "G1")
    values = other_values(unit, random)
    there = write(data, verified(fit, unit, values))
    now = read(there.data, 101, "G1")
    assert values_of(now) == pytest.approx(values, rel=WRITTEN, abs=0.0)
    words = changed_words(text_of(data, "f"), text_of(there.data, "f"))
    assert sorted(words) == sorted((each.before, each.after) for each in there.changes)
    named = {(change.model, change.parameter) for change in there.changes}
    assert len(named) == len(there.changes)
    for bus in (7, 99_999):
        assert values_of(read(there.data, bus, "G1")) == values_of(read(data, bus, "G1"))
    back = write(there.data, verified(fit, now, values_of(unit)))
    again = values_of(read(back.data, 101, "G1"))
    assert again == pytest.approx(values_of(unit), rel=WRITTEN, abs=0.0)
    assert {(change.model, change.parameter) for change in back.changes} == named
    assert write(data, verified(fit, unit, values_of(unit))).data == data


@pytest.mark.long
@pytest.mark.parametrize("name", [*DEFINITIONS, *OF_PSLF])
def test_values_go_into_every_kind_of_record_and_back_and_nothing_else_changes(fit, name):
    there_and_back(fit, (DEFINITIONS | OF_PSLF)[name], np.random.default_rng(0))


@settings(max_examples=10, derandomize=True, deadline=None)
@given(name=st.sampled_from([*DEFINITIONS, *OF_PSLF]), seed=st.integers(0, 2**32 - 1))
def test_a_file_in_any_layout_keeps_every_byte_but_fitted_values(fit, name, seed):
    there_and_back(fit, (DEFINITIONS | OF_PSLF)[name], np.random.default_rng(seed))


def test_only_fields_whose_values_changed_are_written_again(fit):
    unit = unit_of(THREE.encode(), 9)
    values = {**values_of(unit), "KA": 312.34567, "TE": 1.3, "machine.Tpd0": 5.0}
    written = exported(THREE.encode(), verified(fit, unit, values))
    start = THREE.index("9 GENROU")
    own = replaced(" 766 ", " 312.346 ", THREE[start:]).replace("GENROU 1 6.0", "GENROU 1 5.0")
    assert written.data.decode() == THREE[:start] + own
    assert [(each.model, each.parameter, each.before) for each in written.changes] == [
        ("ESAC1A", "KA", 766.0),
        ("GENROU", "Tpd0", 6.0),
    ]


def test_a_file_of_pslf_keeps_every_other_byte(fit):
    """Values in their order and values behind their names."""
    (unit,) = read_units(PSLF_UNIT, "units.dyd").units
    values = {**values_of(unit), "KA": 312.34567, "machine.S12": 0.5}
    fits = [FittedUnit("case", verified(fit, unit, values))]
    written = fitted_file(PSLF_UNIT.encode(), "units.dyd", fits)
    expected = replaced('"ka" 150', '"ka" 312.346', replaced("0.12 0.4", "0.12 0.5", PSLF_UNIT))
    assert written.data.decode() == expected
    assert [change.parameter for change in written.changes] == ["KA", "S12"]


def test_a_fit_that_does_not_hold_leaves_its_unit(fit):
    data = THREE.encode()
    unit = unit_of(data, 9)
    poor = verified(fit, unit, {**values_of(unit), "KA": 300.0}, interrupted=True)
    good = verified(fit, unit_of(data, 1), {**values_of(unit_of(data, 1)), "KA": 300.0})
    written = fitted_file(data, "f", [FittedUnit("poor", poor), FittedUnit("good", good)])
    assert [(left.name, left.verified) for left in written.left] == [("poor", False)]
    assert written.left[0].reason.startswith("not verified: interrupted")
    assert {(change.bus, change.case) for change in written.changes} == {(1, "good")}


def test_typical_values_stay_and_fitted_ones_that_no_field_holds_are_refused(fit):
    data = THREE.encode()
    unit = unit_of(data, 9)
    values = {**values_of(unit), "KA": 300.0, "machine.H": 9.0}
    written = exported(data, verified(fit, unit, values, {"machine.H": TYPICAL}))
    assert [change.parameter for change in written.changes] == ["KA"]


REFUSED = {
    "another model": ({"model": "AC4A"}, "f:10: ESAC1A: the fitted model is AC4A; exfit translate"),
    "another machine": ({"machine_model": "GENSAL"}, "f:9: GENROU: the fitted model is GENSAL"),
    "a stabiliser": ({"stabiliser_model": "PSS1A"}, "f: the unit has no record of PSS1A"),
    "a user's model": ({"inputs": {"model": "0"}}, "AC1A is not a model of the catalogue"),
    "saturation": ({"saturation": "exponential"}, "fitted with saturation: exponential"),
}


def test_fitted_values_of_a_limiter_without_a_record_are_refused_with_those_of_its_unit(
    fit,
):
    data = THREE.encode()
    unit = unit_of(data, 9)
    at_work = {"limiter_models": {"oel": "OEL3C"}, "limiters": {"oel": {"ITFPU": 1.1}}}
    as_given = verified(fit, unit, {**values_of(unit), "KA": 300.0}, **at_work)
    assert [change.parameter for change in exported(data, as_given).changes] == ["KA"]
    free = replace(as_given, parameters={"oel.ITFPU": FittedParameter(1.1, 1.0, 0.1, 10.0)})
    written = fitted_file(data, "f", [FittedUnit("case", free)])
    assert written.data == data
    (left,) = written.left
    assert left.verified
    assert left.reason == "f: the unit has no record of OEL3C: fitted: oel.ITFPU"


@pytest.mark.parametrize("case", REFUSED)
def test_a_record_of_another_model_is_refused(fit, case):
    others, reason = REFUSED[case]
    unit = unit_of(THREE.encode(), 9)
    result = verified(fit, unit, {**values_of(unit), "SE2": 0.2}, **others)
    written = fitted_file(THREE.encode(), "f", [FittedUnit("case", result)])
    assert written.data == THREE.encode()
    assert [(left.name, left.verified) for left in written.left] == [("case", True)]
    assert written.left[0].reason.startswith(reason)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("KA", 1e7, "f:10: ESAC1A: KA: 10000000 lies outside 0.01 ... 100000 pu"),
        ("VAMIN", 20.0, "f:10: ESAC1A: VAMIN: 20 is not below VAMAX = 14.5"),
        ("machine.Xpd", 0.1, "f:9: GENROU: Xpd: 0.1 is not above Xl = 0.2"),
    ],
)
def test_a_value_that_the_record_cannot_have_is_refused_before_anything_is_written(
    fit, name, value, reason
):
    unit = unit_of(THREE.encode(), 9)
    result = verified(fit, unit, {**values_of(unit), "TA": 0.03, name: value})
    written = fitted_file(THREE.encode(), "f", [FittedUnit("case", result)])
    assert (written.data, written.changes) == (THREE.encode(), ())
    assert reason in written.left[0].reason


def test_a_record_that_changed_since_is_refused_with_its_values(fit):
    unit = unit_of(THREE.encode(), 9)
    result = verified(fit, unit, {**values_of(unit), "KA": 300.0})
    since = (THREE[: THREE.index("9 GENROU")] + replaced(" 766 ", " 700 ")).replace(
        "1 GENROU 1 6.0 .035 .5 .077 3.25 0. 1.8 1.7 .3 .55 .25 .2 .12 .4 /\n1 ESAC1A 1 0 0 0 700",
        "9 GENROU 1 6.0 .035 .5 .077 3.25 0. 1.8 1.7 .3 .55 .25 .2 .12 .4 /\n9 ESAC1A 1 0 0 0 700",
    )
    written = fitted_file(since.encode(), "f", [FittedUnit("case", result)])
    assert written.data == since.encode()
    assert written.left[0].reason == "f:10: ESAC1A: changed since import: KA is 700, as found 766"


def test_a_unit_that_is_not_in_the_file_or_has_several_fits_is_named(fit):
    data = THREE.encode()
    unit = unit_of(data, 9)
    result = verified(fit, unit, {**values_of(unit), "KA": 300.0})
    elsewhere = replace(result, as_found=replace(result.as_found, bus=8))
    nowhere = replace(result, as_found=replace(result.as_found, bus=None, machine_id=None))
    fits = [
        FittedUnit(*each)
        for each in [("a", result), ("b", result), ("c", elsewhere), ("d", nowhere)]
    ]
    written = fitted_file(data, "f", fits)
    assert written.data == data
    assert [left.reason for left in written.left] == [
        "several fits of the unit: a, b",
        "several fits of the unit: a, b",
        "f: no record of bus 8, machine 1",
        "the case does not give bus and id of its unit (as_found)",
    ]


@pytest.mark.parametrize("name", [name for name, of in DEFINITIONS.items() if of.record.unused])
def test_what_its_program_does_without_is_0_in_a_case_and_stays_in_the_file(name, fit):
    own = DEFINITIONS[name]
    partners = {"machine": GENROU, "exciter": ESAC1A} | {own.kind: own}
    values = {kind: typical(of.model.sheet) for kind, of in partners.items()}
    ((symbol, _),) = own.record.unused
    values[own.kind][symbol] = 0.4
    text = "\n".join(record_text(of, values[kind], 7, "1") for kind, of in partners.items()) + "\n"
    unit, full = unit_of(text.encode(), 7), own.prefix + symbol
    (warning,) = [w.text for w in unit.warnings if f"{name}: {symbol}: PSS/E ignores 0.4" in w.text]
    assert warning.endswith("; 0 is taken")
    case = imported_case(unit, "units.dyr").text
    found = yaml.safe_load(case)["as_found"]
    assert found["unused"] == {full: 0.4}
    assert found["parameters"][full] == values_of(unit)[full] == 0.0
    as_case = {"case_text": case, "case": Path("unit.yaml")}
    changed = {**values_of(unit), "KA": 321.0}
    written = export(verified(fit, unit, changed, **as_case), 7, "1")
    assert f"{record_text(own, values[own.kind] | {'KA': 321.0}, 7, '1')}\n" in written.text
    assert not any("ignores" in text for text in written.warnings)
    kept = exported(text.encode(), verified(fit, unit, changed))
    assert [after for _, after in changed_words(text, kept.data.decode())] == [321.0]
    acting = export(verified(fit, unit, {**changed, full: 0.4}), 7, "1")
    assert f"{name}: PSS/E ignores {symbol} = 0.4" in acting.warnings


@pytest.mark.parametrize("name", ["GGOV1", "IEEEG1", "HYG3", "HYGOVR1", "H6E"])
def test_what_a_governor_s_model_does_not_have_goes_back_as_it_was(name, fit):
    own = DEFINITIONS[name]
    unmodelled = {symbol: 0.5 * usual + 0.25 for symbol, usual in own.record.absent}
    parts = {of: typical(of.model.sheet) | dict(of.record.held) for of in (GENROU, ESAC1A, own)}
    parts[own] |= unmodelled
    text = "".join(f"{record_text(of, values, 7, '1')}\n" for of, values in parts.items())
    unit = unit_of(text.encode(), 7)
    case = imported_case(unit, "units.dyr").text
    found = parse_case(case, Path("unit.yaml")).as_found.unused
    assert found == {own.prefix + symbol: value for symbol, value in unmodelled.items()}
    values = {**values_of(unit), "KA": 321.0}
    result = verified(fit, unit, values, case_text=case, case=Path("unit.yaml"))
    written = export(result, 7, "1")
    assert f"{record_text(own, parts[own], 7, '1')}\n" in written.text
    for symbol in unmodelled:
        assert any(f" {symbol} = " in warning for warning in written.warnings)


def test_the_rating_of_a_turbine_is_named_at_import_and_stays_in_the_file(fit):
    """It is in MW, the case has its share of the machine's base, which is not in a .dyr file."""
    parts = (GENROU, ESAC1A, DEFINITIONS["GGOV1"])

    def text_of_rating(MW):
        values = [typical(of.model.sheet) | {"Trate": MW} for of in parts]
        return "".join(record_text(*one, 7, "1") + "\n" for one in zip(parts, values, strict=True))

    def warned(unit):
        return [text for _, text in unit.warnings if "GGOV1: Trate: " in text]

    assert warned(unit_of(text_of_rating(0.0).encode(), 7)) == []
    text = text_of_rating(390.24)
    unit = unit_of(text.encode(), 7)
    (warning,) = warned(unit)
    assert warning.endswith("case, 390.24 over that base (1 is taken)")
    case = imported_case(unit, "units.dyr").text
    assert parse_case(case, Path("unit.yaml")).as_found.unused == {"governor.Trate": 390.24}
    values = {**values_of(unit), "KA": 321.0, "governor.Trate_Mbase": 3.9024}
    result = verified(fit, unit, values, case_text=case, case=Path("unit.yaml"))
    written = export(result, 7, "1")
    assert written.text.endswith(text[text.index("7  'GGOV1'") :])
    assert not any("Trate" in warning for warning in written.warnings)
    kept = exported(text.encode(), result)
    assert [after for _, after in changed_words(text, kept.data.decode())] == [321.0]


def test_four_zeros_in_place_of_a_saturation_give_way_to_a_whole_curve(fit):
    data = replaced("3.14 .03 4.18 .1", "0 0 0 0").encode()
    unit = unit_of(data, 1)
    same = exported(data, verified(fit, unit, {**values_of(unit), "KA": 300.0}))
    assert b"0 0 0 0 14.5" in same.data
    curve = {"E1": 3.0, "SE1": 0.1, "E2": 4.0, "SE2": 0.5}
    written = exported(data, verified(fit, unit, {**values_of(unit), **curve}))
    assert b"3.0 0.1 4.0 0.5 14.5" in written.data


@pytest.mark.parametrize(
    ("value", "text"),
    [(400.0, "400.0"), (0.0123456789, "0.0123457"), (1e-5, "1.0E-05"), (-2.5e7, "-2.5E+07")],
)
def test_a_number_is_readable_and_has_a_point(value, text):
    assert number_text(value) == text
    assert float(text) == pytest.approx(value, rel=WRITTEN)


def test_a_lag_of_0_is_written_with_the_gain_that_it_goes_with(fit):
    """KF and TF of the record are 0: a fit that has a KF has its TF as well."""
    data = replaced(" .024 1 ", " 0 0 ").encode()
    unit = unit_of(data, 1)
    found = values_of(unit)
    assert (found["KF"], found["TF"]) == (0.0, 1.0)
    other = exported(data, verified(fit, unit, {**found, "KA": 300.0}))
    assert other.data == data.replace(b" 766 ", b" 300.0 ")
    both = exported(data, verified(fit, unit, {**found, "KF": 0.03}))
    assert both.data == data.replace(b"1.3 0 0 ", b"1.3 0.03 1.0 ")
    assert [change.parameter for change in both.changes] == ["KF", "TF"]
