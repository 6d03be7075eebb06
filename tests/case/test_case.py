"""Cases: what a sound file says is what the case holds; every fault is told with its line."""

from dataclasses import FrozenInstanceError, fields, replace
from math import exp
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from exfit.case.case import Case
from exfit.case.json_schema import json_schema
from exfit.case.load import load_case, parse_case
from exfit.case.schema import CaseDocument
from exfit.case.yaml import scalar
from exfit.errors import CaseError, RecordError
from exfit.fitting.recordings import initial_level, record_of
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.plants import MACHINE, SATURATION
from exfit.util.text import dotted

EXAMPLE = """\
model: AC1A                     # a name of the catalogue
saturation: quadratic
plant:
  type: open-circuit
  machine: GENROU
  parameters: {Tpd0: 6.0, Tppd0: 0.035, Xd: 1.8, Xpd: 0.3, Xppd: 0.25, Xl: 0.2, S10: 0.12, S12: 0.4}
test:
  vt0: 1.0
  vref: [{at: 1.0, step: 0.05}]
record:
  file: data/up.csv
  time: t
  channels: {vt: vt, efd: {column: "Uf [V]", scale: 0.0625, offset: -1.0, weight: 2.0}}
  window: [0.0, 10.0]
parameters:
  fixed: {KE: 1.0, TR: 0.0, VRMAX: 6.03, VRMIN: -5.43}
  free:
    KA: {start: 766, min: 10, max: 5000}
    TA: {start: 0.02, min: 0.002, max: 0.2}
    KD: {start: 0.3556, min: 0, max: 3.0, scale: linear}
estimate:
  strategy: auto
  jacobian: central
  iterations: 50
  tolerance: {gradient: 1.0e-7, gradient_absolute: 1.0e-9, step: 1.0e-9}
  difference_step: 1.0e-5
  stop: {rmse: 2.0e-4}
  armijo: 1.0e-3
  dgn: {step: full, cut: half}
  lm: {update: ratio, nu_min: 1.0e-6}
  good_enough: {rmse: 3.0e-4}
simulation: {step: 0.002, output_step: 0.01}
validate:
  - name: down-step
    test: {vref: [{at: 1.0, step: -0.05}]}
    record: {file: data/down.csv, time: t, channels: {vt: vt}}
criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}
"""

SHORTEST_CASE = """\
model: FIRST_ORDER
plant: {type: none}
test: {vt0: 0, duration: 5, vref: [{at: 0, step: 1}]}
"""


@pytest.fixture(scope="module")
def validator():
    """Return what another program checks a case with, by the schema."""
    return jsonschema.Draft202012Validator(json_schema())


@pytest.fixture
def case_file(tmp_path):
    """Return a function that writes a case file and returns its path."""

    def write(content: str | bytes):
        path = tmp_path / "bump.yaml"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


def faults_of(path):
    with pytest.raises(CaseError) as caught:
        load_case(path)
    return caught.value.faults


def changed(old, new, text=EXAMPLE):
    assert old in text
    return text.replace(old, new, 1)


def line_of(part, text):
    return text[: text.index(part)].count("\n") + 1


def test_the_case_holds_what_the_file_says(case_file):
    path = case_file(EXAMPLE)
    case = load_case(path)
    assert (case.path, case.folder) == (path, path.parent)
    assert (case.model, case.parts.exciter) == ("AC1A", MODELS["AC1A"])
    assert case.parts.machine == MACHINES["GENROU"]
    assert case.test.vt0 == 1.0
    assert [(step.at, step.step) for step in case.test.vref] == [(1.0, 0.05)]
    assert (case.record.file, case.record.time) == ("data/up.csv", "t")
    assert case.record.window == (0.0, 10.0)
    vt, efd = case.record.channels["vt"], case.record.channels["efd"]
    assert (vt.column, vt.scale, vt.offset, vt.weight) == ("vt", 1.0, 0.0, 1.0)
    assert (efd.column, efd.scale, efd.offset, efd.weight) == ("Uf [V]", 0.0625, -1.0, 2.0)
    free = case.parameters.free["KA"]
    assert (free.start, free.min, free.max, free.scale) == (766.0, 10.0, 5000.0, "log")
    assert case.parameters.free["KD"].scale == "linear"
    estimate = case.estimate
    assert (estimate.strategy, estimate.jacobian, estimate.iterations) == ("auto", "central", 50)
    assert (estimate.tolerance.gradient, estimate.tolerance.step) == (1e-7, 1e-9)
    assert (estimate.tolerance.gradient_absolute, estimate.difference_step) == (1e-9, 1e-5)
    assert (estimate.stop.rmse, estimate.armijo) == (2e-4, 1e-3)
    assert (estimate.dgn.step, estimate.dgn.cut) == ("full", "half")
    assert (estimate.lm.update, estimate.lm.nu_min) == ("ratio", 1e-6)
    assert (estimate.good_enough.rmse, case.criteria.rows[0].limit) == (3e-4, 1.5e-4)
    assert (case.simulation.step, case.simulation.output_step) == (0.002, 0.01)
    (validation,) = case.validations
    assert (validation.name, validation.record.file) == ("down-step", "data/down.csv")
    assert validation.test.vref[0].step == -0.05


def test_what_identifies_the_unit_is_text_or_a_number_under_any_name(case_file):
    given = "about: {Plant: Höhe 7, Unit: 2, Test date: 2024-05-03, Rated MVA: 120.5}\n"
    case = load_case(case_file(given + EXAMPLE))
    told = {"Plant": "Höhe 7", "Unit": 2, "Test date": "2024-05-03", "Rated MVA": 120.5}
    assert case.about == told
    assert load_case(case_file(EXAMPLE)).about == {}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("[1]", "a list is not text; put it in quotes"),
        ("true", "true is not text; put it in quotes"),
        (".inf", "inf is not a finite number"),
        ("''", "is empty"),
        ("", "has no value"),
    ],
)
def test_what_identifies_the_unit_is_nothing_else(case_file, value, text):
    path = case_file(f"about: {{Plant: {value}}}\n{EXAMPLE}")
    assert faults_of(path) == (f"{path}:1: about.Plant: {text}",)


def test_what_may_be_missing_has_a_default(case_file):
    case = load_case(case_file(SHORTEST_CASE))
    assert case.saturation == "quadratic"
    assert case.parts.machine is case.record is None
    assert not case.criteria.given
    assert case.typical() == ("k", "a")
    assert case.parameters.fixed == case.parameters.free == {}
    assert case.values() == {"k": 4.0, "a": 2.0}
    estimate = case.estimate
    assert (estimate.strategy, estimate.jacobian, estimate.iterations) == (
        "lm-then-dgn",
        "exact",
        100,
    )
    assert (estimate.tolerance.gradient, estimate.tolerance.step) == (1e-8, 1e-10)
    assert estimate.good_enough is None
    assert estimate.tolerance.gradient_absolute is estimate.difference_step is estimate.stop is None
    assert (estimate.armijo, estimate.dgn.step, estimate.dgn.cut) == (1e-4, "capped", "parabola")
    assert (estimate.lm.update, estimate.lm.nu_min) == ("radius", 1e-3)
    assert (case.simulation.step, case.simulation.output_step) == ("auto", 0.005)
    assert case.validations == ()


def test_values_are_typical_unless_fixed_or_free(case_file):
    case = load_case(case_file(EXAMPLE))
    values = case.values()
    sheets = [case.parts.exciter.sheet, case.parts.machine.sheet]
    names = [
        [prefix + row.symbol for row in rows]
        for prefix, rows in zip(("", MACHINE), sheets, strict=True)
    ]
    assert list(values) == [*names[0], *names[1]]
    assert (values["KE"], values["KA"], values["KF"]) == (1.0, 766.0, 0.03)
    assert "KF" in case.typical()
    assert not {"KA", "KE", "VRMAX"} & set(case.typical())
    assert values[MACHINE + "Tpd0"] == 6.0
    of_machine = [name for name in case.typical() if name.startswith(MACHINE)]
    assert of_machine == [MACHINE + name for name in ("Tpq0", "Tppq0", "H", "D", "Xq", "Xpq")]


@pytest.mark.parametrize("name", ["ac1a", "Ac1A", "ESAC1A"])
def test_names_of_models_are_read_in_any_case(case_file, name):
    text = changed("model: AC1A", f"model: {name}")
    case = load_case(case_file(changed("GENROU", "genrou", text)))
    assert (case.parts.exciter.name, case.parts.machine.name) == ("AC1A", "GENROU")


def test_a_model_may_be_a_file_beside_the_case(case_file, tmp_path):
    (tmp_path / "my_exciter.py").write_text(
        '"""MINE: a gain.\n\ndrawing\n"""\n'
        "from exfit.models.sheet import sheet\n"
        'SHEET = sheet(("K", 2.0, "pu", (1.0, 3.0), "gain"),)\n'
        'STATES = "X"\n'
        "def equations(s, u, p, d): return p.K\n"
        "def rest(v, u, p, x): return v\n"
    )
    text = changed("FIRST_ORDER", "my_exciter.py", SHORTEST_CASE)
    assert load_case(case_file(text)).values() == {"K": 2.0}


def test_a_record_in_engineering_units_with_timestamps_is_the_record_per_unit(case_file, tmp_path):
    rows = [(0.0, 1.0, 1.25), (0.5, 1.01, 1.3), (1.5, 1.05, 1.5), (12.0, 1.04, 1.4)]
    (tmp_path / "plain.csv").write_text(
        "t,vt,ifd\n" + "".join(f"{t},{vt},{ifd}\n" for t, vt, ifd in rows)
    )
    lines = [
        f"20.09.2015;23:59:{50 + t:04.1f};{15.75 * vt:.5f};{400 * ifd:.0f}"
        if t < 10
        else f"21.09.2015;00:00:{t - 10:04.1f};{15.75 * vt:.5f};{400 * ifd:.0f}"
        for t, vt, ifd in rows
    ]
    heading = "Datum;Uhrzeit;Ugen [kV];Läuferstrom [A]"
    text = "\r\n".join([heading, *lines]).replace(".", ",").replace("20,09,2015", "20.09.2015")
    text = text.replace("21,09,2015", "21.09.2015")
    (tmp_path / "field.csv").write_bytes(text.encode("cp1252"))
    common = """\
model: AC1A
plant: {type: open-circuit, machine: GENROU}
test: {vref: [{at: 1.0, step: 0.05}]}
parameters: {free: {KA: {start: 400, min: 10, max: 5000}}}
"""
    plain = load_case(
        case_file(common + "record: {file: plain.csv, time: t, channels: {vt: vt, ifd: ifd}}\n")
    )
    field = load_case(
        case_file(
            common
            + """\
record:
  file: field.csv
  time: [Datum, Uhrzeit]
  channels:
    vt: {column: "Ugen [kV]", unit: kV, base: 15.75}
    ifd: {column: "Läuferstrom [A]", unit: A, base: 400}
"""
        )
    )
    one, other = (record_of(case, case.recordings[0]) for case in (plain, field))
    assert np.array_equal(one.time, other.time)
    for signal in ("vt", "ifd"):
        assert other.signals[signal] == pytest.approx(one.signals[signal], rel=1e-6)


def test_a_case_cannot_be_changed(case_file):
    case = load_case(case_file(EXAMPLE))
    with pytest.raises(FrozenInstanceError):
        case.saturation = "exponential"
    with pytest.raises(FrozenInstanceError):
        case.path = Path("other.yaml")
    with pytest.raises(ValidationError):
        case.parameters.free["KA"].start = 1.0
    for mapping in (
        case.parameters.fixed,
        case.parameters.free,
        case.record.channels,
        case.plant.parameters,
        load_case(case_file(SHORTEST_CASE)).parameters.fixed,
    ):
        with pytest.raises(TypeError):
            mapping["KA"] = 1.0


def test_a_case_can_be_written_out_again():
    document = CaseDocument.model_validate(yaml.safe_load(EXAMPLE))
    again = CaseDocument.model_validate(document.model_dump(by_alias=True, exclude_defaults=True))
    assert again.model_dump() == document.model_dump()


def test_a_case_has_every_section_of_the_document():
    own = {"path", "from_file", "parts", "ties", "external"}
    own |= {"given_records", "given_values", "given_sources", "given_std_errors", "freed"}
    assert {field.name for field in fields(Case)} - own == {*CaseDocument.model_fields}


def test_a_case_made_in_python_is_that_of_the_file(case_file):
    path = case_file(EXAMPLE)
    made = Case.from_dict(yaml.safe_load(EXAMPLE), folder=path.parent, name=path.name)
    assert replace(made, from_file=True) == load_case(path)


def test_a_case_may_be_made_of_tuples_and_numbers_of_numpy():
    content = yaml.safe_load(EXAMPLE)
    content["record"]["window"] = (np.float32(0.5), np.int64(9))
    content["test"]["vref"] = tuple(content["test"]["vref"])
    content["record"]["file"] = Path(content["record"]["file"])
    case = Case.from_dict(content)
    assert case.record.window == (0.5, 9.0)
    assert case.test == Case.from_dict(yaml.safe_load(EXAMPLE)).test
    assert case.folder == Path()


def test_all_faults_of_a_case_made_in_python_are_reported_with_their_places():
    content = yaml.safe_load(EXAMPLE)
    content["parameters"]["free"]["KA"]["start"] = None
    content["modle"] = content.pop("model")
    content["record"]["window"] = (9.0, 0.5)
    with pytest.raises(CaseError) as refused:
        Case.from_dict(content, name="unit 1")
    faults = refused.value.faults
    assert any(fault.startswith("unit 1: parameters.free.KA.start: has no v") for fault in faults)
    assert "unit 1: modle: unknown key; did you mean model?" in faults
    assert any(fault.startswith("unit 1: record.window: start 9 is") for fault in faults)


# what is wrong -> old text, new text, where the message must point, what else it must say
FORM = {
    "unknown key": ("saturation:", "saturtion:", "saturtion", ["unknown key", "saturation?"]),
    "unknown inner key": ("iterations:", "tries:", "estimate.tries", ["unknown key", "strategy"]),
    "limit of an unknown phase": (
        "iterations: 50",
        "iterations: {lm: 20, dng: 20}",
        "estimate.iterations.dng",
        ["unknown key", "dgn?"],
    ),
    "no iterations of a phase": (
        "iterations: 50",
        "iterations: {lm: 0}",
        "estimate.iterations.lm",
        ["0 is below 1"],
    ),
    "words for iterations": (
        "iterations: 50",
        "iterations: many",
        "estimate.iterations",
        ["'many' is not a whole number"],
    ),
    "Armijo's constant too large": (
        "armijo: 1.0e-3",
        "armijo: 0.5",
        "estimate.armijo",
        ["0.5 is not below 0.5"],
    ),
    "coarse differences": (
        "difference_step: 1.0e-5",
        "difference_step: 0.2",
        "estimate.difference_step",
        ["0.2 is above 0.1"],
    ),
    "unknown cut": ("cut: half", "cut: third", "estimate.dgn.cut", ["parabola, half"]),
    "unknown step": ("step: full", "step: long", "estimate.dgn.step", ["capped, full"]),
    "unknown update": ("update: ratio", "update: rate", "estimate.lm.update", ["ratio?"]),
    "factor on the damping": (
        "nu_min: 1.0e-6",
        "increase: 3",
        "estimate.lm.increase",
        ["unknown key", "nu_min"],
    ),
    "no match": ("stop: {rmse: 2.0e-4}", "stop: {rmse: 0}", "estimate.stop.rmse", ["not above 0"]),
    "unknown key of a machine": (
        "machine: GENROU",
        "machine: GENROU\n  machin: x",
        "plant.machin",
        ["did you mean machine?"],
    ),
    "unknown key of a channel": ("weight:", "wait:", "record.channels.efd.wait", ["weight"]),
    "unknown key of a bound": ("max: 0.2}", "top: 0.2}", "parameters.free.TA.top", ["max"]),
    "unknown key of a step": ("step: 0.05", "steps: 0.05", "test.vref[0].steps", ["step?"]),
    "unknown signal": ("{vt: vt, efd:", "{ut: vt, efd:", "record.channels.ut", ["'ut'", "vt"]),
    "missing key": ("  time: t\n", "", "record.time", ["is missing"]),
    "missing start": ("start: 0.02, ", "", "parameters.free.TA.start", ["is missing"]),
    "missing kind of plant": ("  type: open-circuit\n", "", "plant.type", ["is missing"]),
    "wrong kind of plant": (
        "n-circuit",
        "n-line",
        "plant.type",
        ["'open-line'", "known: open-circuit, infinite-bus"],
    ),
    "text in a number": ("KE: 1.0", "KE: 1.0x", "parameters.fixed.KE", ["'1.0x' is not a number"]),
    "quoted number": ("KE: 1.0", "KE: '1.0'", "parameters.fixed.KE", ["'1.0' is not a number"]),
    "truth in a number": ("KE: 1.0", "KE: true", "parameters.fixed.KE", ["true is not a number"]),
    "yes in a number": ("KE: 1.0", "KE: yes", "parameters.fixed.KE", ["'yes' is not a number"]),
    "clock in a number": ("at: 1.0", "at: 1:30", "test.vref[0].at", ["'1:30' is not a number"]),
    "list in a number": ("KE: 1.0", "KE: [1]", "parameters.fixed.KE", ["a list is not a number"]),
    "infinite": ("max: 5000", "max: .inf", "parameters.free.KA.max", ["inf is not a finite"]),
    "not a number": ("KE: 1.0", "KE: .nan", "parameters.fixed.KE", ["nan is not a finite"]),
    "endless digits": ("KE: 1.0", "KE: " + 5000 * "9", "parameters.fixed.KE", ["inf is not"]),
    "number in a text": ("time: t", "time: 0", "record.time", ["0 is not text", "quotes"]),
    "number for a column": ("{vt: vt,", "{vt: 3,", "record.channels.vt", ["3 is not a mapping"]),
    "empty text": ("time: t", "time: ''", "record.time", ["is empty"]),
    "no value": ("saturation: quadratic", "saturation:", "saturation", ["has no value"]),
    "decimal comma": ("Tpd0: 6.0,", "Tpd0: 6,0,", "plant.parameters.0", ["write a point"]),
    "null in a list": ("window: [0.0,", "window: [~,", "record.window[0]", ["has no value"]),
    "text for a section": (
        "  vt0: 1.0\n  vref: [{at: 1.0, step: 0.05}]\n",
        "  x\n",
        "test",
        ["'x'"],
    ),
    "list for a section": (
        "criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}",
        "criteria: [1]",
        "criteria",
        ["not a mapping"],
    ),
    "file of criteria as text": (
        "criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}",
        "criteria: operator.yaml",
        "criteria",
        ["'operator.yaml' is not a mapping", "of a file: {file: its name}"],
    ),
    "earlier name of the criteria": (
        "criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}",
        "accept: {rmse: 1.5e-4}",
        "accept",
        ["is now a row of criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}"],
    ),
    "earlier place of the criteria": (
        "criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}",
        "report: {criteria: {rmse: 5}}",
        "report",
        ["now those of the case: {limits: [{quantity: rms, percent: 5}]}"],
    ),
    "number for values": ("{KE: 1.0, TR: 0.0,", "5 #", "parameters.fixed", ["5 is not a mapping"]),
    "mapping for a list": (
        "[0.0, 10.0]",
        "{}",
        "record.window",
        ["a mapping is not a list"],
    ),
    "empty list": ("[{at: 1.0, step: 0.05}]", "[]", "test.vref", ["0 entries", "at least 1"]),
    "no channel": (
        '{vt: vt, efd: {column: "Uf [V]", scale: 0.0625, offset: -1.0, weight: 2.0}}',
        "{}",
        "record.channels",
        ["0 entries", "at least 1"],
    ),
    "half a window": ("[0.0, 10.0]", "[0.0]", "record.window[1]", ["is missing"]),
    "long window": ("[0.0, 10.0]", "[0.0, 1, 2]", "record.window", ["3 entries", "at most 2"]),
    "wrong strategy": ("auto", "lmm", "estimate.strategy", ["'lmm'", "did you mean lm?"]),
    "wrong saturation": ("quadratic", "cubic", "saturation", ["'cubic'", "exponential-se"]),
    "half an iteration": (
        "ns: 50",
        "ns: 50.5",
        "estimate.iterations",
        ["50.5 is not a whole number"],
    ),
    "no iteration": ("ns: 50", "ns: 0", "estimate.iterations", ["0 is below 1"]),
    "an accuracy of a literal step": (
        "step: 0.002",
        "step: 0.002, accuracy: 1.0e-7",
        "simulation.accuracy",
        ["only with simulation.step: auto"],
    ),
    "step of no length": ("step: 0.002", "step: 0.0", "simulation.step", ["0 is not above 0"]),
    "weight of nothing": ("2.0}", "-2}", "record.channels.efd.weight", ["-2 is not above 0"]),
    "negative tolerance": ("1.0e-7", "-1e-7", "estimate.tolerance.gradient", ["-1e-07 is below 0"]),
    "name with a slash": ("down-step", "a/b", "validate[0].name", ["'a/b'", "letters, digits"]),
    "hidden name": ("down-step", "..", "validate[0].name", ["'..'", "begin with a letter"]),
    "empty name": ("down-step", "''", "validate[0].name", ["''"]),
    "long name": ("down-step", "x" * 101, "validate[0].name", ["longer than 100"]),
    "validation without record": (
        "    record: {file: data/down.csv, time: t, channels: {vt: vt}}\n",
        "",
        "validate[0].record",
        ["is missing"],
    ),
    "key twice": ("time: t", "time: t\n  time: u", "record.time", ["duplicate key", "line 12"]),
    "strange tag": ("KE: 1.0", "KE: !!float 1.0", "parameters.fixed.KE", ["tag", "float"]),
}

MEANING = {
    "unknown model": ("AC1A", "AC1B", "model", ["AC1B", "did you mean AC11C or AC1A?"]),
    "missing model file": (
        "model: AC1A",
        "model: mine.py",
        "model",
        ["mine.py", "cannot be read: No such file"],
    ),
    "unknown machine": ("GENROU", "GENRUO", "plant.machine", ["'GENRUO'", "did you mean GENROU?"]),
    "unknown fixed": ("KE: 1.0", "KEE: 1.0", "parameters.fixed.KEE", ["AC1A", "did you mean KE?"]),
    "unknown free": ("TA: {", "Ta: {", "parameters.free.Ta", ["AC1A", "did you mean TA?"]),
    "unknown machine data": ("S10:", "S1O:", "plant.parameters.S1O", ["GENROU", "mean S1"]),
    "fixed and free": (
        "{KE: 1.0",
        "{KA: 2, KE: 1.0",
        "parameters.free.KA",
        ["both fixed and free"],
    ),
    "fixed outside the sheet": ("TR: 0.0", "TR: 2", "parameters.fixed.TR", ["2 lies", "0 ... 1 s"]),
    "start outside the sheet": (
        "{start: 0.02, min: 0.002, max: 0.2}",
        "{start: -0.1, min: -0.2, max: 12}",
        "parameters.free.TA.start",
        ["-0.1 is below 0 s", "the equations"],
    ),
    "bound outside the sheet": (
        "min: 10,",
        "min: 1e-3,",
        "parameters.free.KA.min",
        ["0.001 is below 0.01 pu", "the equations"],
    ),
    "limit outside the sheet": (
        "VRMAX: 6.03, VRMIN: -5.43}\n  free:\n",
        "VRMIN: -5.43}\n  free:\n    VRMAX: {start: 6, min: 1, max: 10000}\n",
        "parameters.free.VRMAX.max",
        ["10000 lies outside -9999 ... 9999 pu", "data sheet"],
    ),
    "log without a lower bound": (
        "min: 0, max: 3.0, scale: linear",
        "max: 3.0",
        "parameters.free.KD.min",
        ["is missing", "scale: log", "scale: linear"],
    ),
    "no size to search by": (
        "start: 0.3556, min: 0, max: 3.0",
        "start: 0, min: 0",
        "parameters.free.KD.start",
        ["0 sets no scale", "min and max"],
    ),
    "many starts without a bound": (
        "max: 3.0, scale: linear}\nestimate:\n",
        "scale: linear}\nestimate:\n  search: global\n  starts: 8\n",
        "parameters.free.KD.max",
        ["is missing", "8 starts"],
    ),
    "time below the bypass": (
        "{start: 0.02, min: 0.002, max: 0.2}",
        "{start: 5e-5}",
        "parameters.free.TA.start",
        ["5e-05", "0.0001 s", "min"],
    ),
    "machine data outside": ("6.0,", "-6.0,", "plant.parameters.Tpd0", ["-6 lies", "0.01 ... 100"]),
    "start below its bounds": ("766", "9", "parameters.free.KA.start", ["9 lies", "10 ... 5000"]),
    "start above its bounds": ("766", "5001", "parameters.free.KA.start", ["5001", "10 ... 5000"]),
    "crossed bounds": ("min: 10,", "min: 6000,", "parameters.free.KA.min", ["6000", "max = 5000"]),
    "equal bounds": (
        "max: 5000",
        "max: 10",
        "parameters.free.KA.min",
        ["10 is not below max = 10"],
    ),
    "log from zero": (", scale: linear", "", "parameters.free.KD.min", ["0 is not above 0", "log"]),
    "time across bypass": ("0.002, m", "1e-5, m", "parameters.free.TA.min", ["1e-05", "0.0001 s"]),
    "crossed limits": ("-5.43", "7", "parameters.fixed.VRMIN", ["7 is not below VRMAX = 6.03"]),
    "crossed typical limit": (
        "VRMAX: 6.03, VRMIN: -5.43",
        "VRMAX: -6",
        "parameters.fixed.VRMAX",
        ["VRMIN (typical)", "-5.43", "-6"],
    ),
    "crossed start": (
        "VRMAX: 6.03, VRMIN: -5.43}\n  free:\n",
        "VRMIN: 0}\n  free:\n    VRMAX: {start: 0, min: 0, max: 9, scale: linear}\n",
        "parameters.fixed.VRMIN",
        ["0 is not below VRMAX = 0"],
    ),
    "saturation falls": ("{KE", "{SE1: 0.01, KE", "parameters.fixed.SE1", ["0.01", "0.03"]),
    "one saturation point": ("{KE", "{E1: 3.14, KE", "parameters.fixed.E1", ["3.14 equals E2"]),
    "no saturation to take a logarithm of": (
        "{KE",
        "{SE2: 0.0, KE",
        "parameters.fixed.SE2",
        ["0 lies on no exponential"],
    ),
    "machine data out of order": (
        "Xd: 1.8",
        "Xd: 0.3",
        "plant.parameters.Xd",
        ["0.3", "Xpd = 0.3"],
    ),
    "machine saturation": ("S12: 0.4", "S12: 0.1", "plant.parameters.S12", ["0.1", "S10 = 0.12"]),
    "step of nothing": ("step: 0.05", "step: 0", "test.vref[0].step", ["0 is not a step"]),
    "steps out of order": (
        "{at: 1.0, step: 0.05}",
        "{at: 2, step: 1}, {at: 2, step: -1}",
        "test.vref[1].at",
        ["2 s is not after 2 s"],
    ),
    "step of no difference": (
        "jacobian: central",
        "jacobian: exact",
        "estimate.difference_step",
        ["only with estimate.jacobian: central, forward or backward"],
    ),
    "damping of a radius": (
        "update: ratio, nu_min: 1.0e-6",
        "nu_min: 1.0e-6",
        "estimate.lm.nu_min",
        ["only with estimate.lm.update: ratio"],
    ),
    "ramp in no time": ("step: 0.05", "step: 0.05, ramp: 0", "test.vref[0].ramp", ["0 is not abo"]),
    "step within a ramp": (
        "{at: 1.0, step: 0.05}",
        "{at: 1.0, step: 0.05, ramp: 0.5}, {at: 1.25, step: -0.05}",
        "test.vref[1].at",
        ["1.25 s is before 1.5 s, where the ramp before ends"],
    ),
    "ramp found by itself": (
        "{at: 1.0, step: 0.05}",
        "{at: {start: auto}, step: 0.05, ramp: 0.5}",
        "test.vref[0].ramp",
        ["auto is for a step"],
    ),
    "table that stays": (
        "[{at: 1.0, step: 0.05}]",
        "{table: [[0, 1], [10, 1]]}",
        "test.vref.table",
        ["stays at 1"],
    ),
    "table that goes back": (
        "[{at: 1.0, step: 0.05}]",
        "{table: [[0, 1], [2, 1], [1.5, 1.05], [10, 1.05]]}",
        "test.vref.table[2]",
        ["1.5 s is before 2 s"],
    ),
    "table with a time given thrice": (
        "[{at: 1.0, step: 0.05}]",
        "{table: [[0, 1], [2, 1], [2, 1.01], [2, 1.05], [10, 1.05]]}",
        "test.vref.table[3]",
        ["2 s is given more than twice"],
    ),
    "table of one row": (
        "[{at: 1.0, step: 0.05}]",
        "{table: [[0, 1]]}",
        "test.vref.table",
        ["1 entry", "at least 2"],
    ),
    "table that moves outside the window": (
        "[{at: 1.0, step: 0.05}]",
        "{table: [[-1, 1], [-0.5, 1.05], [10, 1.05]]}",
        "test.vref.table[0]",
        ["-1 s", "0 ... 10 s"],
    ),
    "step outside the window": ("at: 1.0", "at: 10", "test.vref[0].at", ["10 s", "0 ... 10 s"]),
    "step before the window": ("at: 1.0", "at: -1", "test.vref[0].at", ["-1 s", "0 ... 10 s"]),
    "window backwards": ("[0.0, 10.0]", "[10, 2.5]", "record.window", ["10 is not below end 2.5"]),
    "duration and record": ("vt0: 1.0", "duration: 9", "test.duration", ["only without a record"]),
    "duration of a validation": (
        "test: {vref",
        "test: {duration: 3, vref",
        "validate[0].test.duration",
        ["only without a record"],
    ),
    "criterion without a limit": (
        "quantity: rms, limit: 1.5e-4",
        "quantity: rms",
        "criteria.limits[0]",
        ["has no limit"],
    ),
    "part of a step": (
        "quantity: rms, limit: 1.5e-4",
        "quantity: rise_time, limit: 1, from: 1",
        "criteria.limits[0]",
        ["from: not with rise_time"],
    ),
    "part that ends before it begins": (
        "limit: 1.5e-4",
        "limit: 1.5e-4, from: 2, to: 1",
        "criteria.limits[0]",
        ["from: 2 s is not below to: 1 s"],
    ),
    "no criteria": (
        "criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}",
        "criteria: {source: nobody}",
        "criteria",
        ["has no limits: name a file"],
    ),
    "file beside limits": (
        "criteria: {",
        "criteria: {file: limits.yaml, ",
        "criteria",
        ["file: not with source or limits"],
    ),
    "voltage of nothing": ("vt0: 1.0", "vt0: 0", "test.vt0", ["0 is not above 0"]),
    "no measured voltage": (
        "channels: {vt: vt}",
        "channels: {ifd: vt}",
        "validate[0].test.vt0",
        ["is missing", "no vt"],
    ),
    "name twice": (
        "criteria:",
        "  - {name: Down-Step, test: {vref: [{at: 1, step: 1}]},\n"
        "     record: {file: x, time: t, channels: {vt: vt}}}\ncriteria:",
        "validate[1].name",
        ["'Down-Step' is taken by 'down-step'"],
    ),
}
FAULTS = FORM | MEANING


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_reported_with_its_line_place_value_and_limit(case_file, fault):
    old, new, place, named = FAULTS[fault]
    base = changed("quadratic", "exponential") if "logarithm" in fault else EXAMPLE
    text = changed(old, new, base)
    path = case_file(text)
    told = [fault for fault in faults_of(path) if f": {place}: " in fault]
    assert all(fault.startswith(f"{path}:") for fault in told)
    assert any(all(part in fault for part in named) for fault in told)


# a key that is misspelt is missing as well; a start leaves its range together with a bound
IN_PAIRS = {
    "missing kind of plant",
    "start outside the sheet",
    "unknown key of a bound",
    "unknown key of a step",
}


@pytest.mark.parametrize("fault", [fault for fault in FAULTS if fault not in IN_PAIRS])
def test_a_fault_brings_no_others_with_it(case_file, fault):
    old, new, place, _ = FAULTS[fault]
    base = changed("quadratic", "exponential") if "logarithm" in fault else EXAMPLE
    told = faults_of(case_file(changed(old, new, base)))
    assert {fault.split(": ")[1] for fault in told} == {place}


def test_all_faults_come_together_in_the_order_of_lines(case_file):
    text = EXAMPLE
    wanted = []
    for fault in (
        "unknown model",
        "wrong saturation",
        "machine data out of order",
        "step of nothing",
        "number in a text",
        "long window",
        "half an iteration",
        "name with a slash",
        "wrong strategy",
        "step of no length",
    ):
        old, new, place, _ = FAULTS[fault]
        text = changed(old, new, text)
        wanted.append((line_of(new, text), place))
    path = case_file(text)
    told = [fault.split(": ")[:2] for fault in faults_of(path)]
    assert told == [[f"{path}:{line}", place] for line, place in sorted(wanted)]


def test_a_wrong_form_hides_no_contradiction(case_file):
    text = changed("KA: {start: 766,", "KA: {start: abc,")
    text = changed("TA: {start: 0.02,", "TA: {start: 0.3,", text)
    text = changed("VRMIN: -5.43", "VRMIN: 7", text)
    text = changed("Xl: 0.2", "Xl: x", text)
    told = faults_of(case_file(text))
    assert any("7 is not below VRMAX = 6.03" in fault for fault in told)
    assert list(dict.fromkeys(fault.split(": ")[1] for fault in told)) == [
        "plant.parameters.Xl",
        "parameters.fixed.VRMIN",
        "parameters.free.KA.start",
        "parameters.free.TA.start",
    ]


def test_an_unreadable_value_is_not_taken_for_its_typical_one(case_file):
    """VRMIN = 7 lies above the typical VRMAX = 6.03, but the file gives another one."""
    text = changed("VRMAX: 6.03, VRMIN: -5.43", "VRMAX: 8x, VAMIN: -1")
    assert len(faults_of(case_file(text))) == 1


def test_lines_are_those_of_nested_blocks(case_file):
    text = """\
model: AC1A
plant:
  type: open-circuit
  machine: GENROU
test:
  vref:
    - at: 1.0
      step: 0.05
    - at: 2.0
      step: x
parameters:
  free:
    KA:
      start: 1
      min: 2
      max: 3
record:
  file: a.csv
  time: t
  channels:
    vt:
      column: vt
      scale: []
validate:
  - name: a
    test:
      vref: [{at: 1, step: 1}]
"""
    path = case_file(text)
    assert [fault.split(": ")[:2] for fault in faults_of(path)] == [
        [f"{path}:10", "test.vref[1].step"],
        [f"{path}:14", "parameters.free.KA.start"],
        [f"{path}:23", "record.channels.vt.scale"],
        [f"{path}:25", "validate[0].record"],
    ]


@pytest.mark.parametrize(
    ("text", "place", "named"),
    [
        ("vt0: 0, duration: 5,", "vt0: 0,", ["test.duration", "is missing"]),
        ("vt0: 0, duration: 5,", "duration: 5,", ["test.vt0", "is missing"]),
        ("at: 0", "at: 5", ["test.vref[0].at", "5 s", "0 ... 5 s"]),
        ("at: 0", "at: -1", ["test.vref[0].at", "-1 s", "0 ... 5 s"]),
        ("duration: 5", "duration: 0", ["test.duration", "0 is not above 0"]),
        ("none}", "none, machine: GENROU}", ["plant.machine", "not allowed with this type"]),
        ("FIRST_ORDER", "FIRST_ODER", ["model", "did you mean FIRST_ORDER?"]),
    ],
)
def test_a_simulation_alone_is_checked_too(case_file, text, place, named):
    told = faults_of(case_file(changed(text, place, SHORTEST_CASE)))
    assert any(all(part in fault for part in named) for fault in told)


def test_a_model_alone_has_no_field(case_file):
    text = SHORTEST_CASE.replace("duration: 5, ", "")
    text += "record: {file: a, time: t, channels: {vt: v, ifd: i, efd: e}}\n"
    places = [fault.split(": ")[1] for fault in faults_of(case_file(text))]
    assert places == ["record.channels.ifd", "record.channels.efd"]


def test_a_time_may_be_free_below_the_bypass_altogether(case_file):
    text = changed("{start: 0.02, min: 0.002, max: 0.2}", "{start: 2e-5, min: 1e-5, max: 9e-5}")
    assert load_case(case_file(text)).parameters.free["TA"].max == 9e-5


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("", ["bump.yaml: the file is empty"]),
        ("# nothing\n", ["bump.yaml: the file is empty"]),
        ("- a\n- b\n", ["bump.yaml:1", "a list", "not a mapping"]),
        ("\nAC1A\n", ["bump.yaml:2", "'AC1A'", "not a mapping"]),
        ("a: [1\nb: 2\n", ["bump.yaml:2", "not YAML", "flow sequence"]),
        ("a: 1\n\tb: 2\n", ["bump.yaml:2", "not YAML", "tab"]),
        ("\ta: 1\n", ["bump.yaml:1", "not YAML", "indent with blanks, not with tabs"]),
        ("a: b: c\n", ["bump.yaml:1", "not YAML"]),
        ("a: 'x\n\n", ["bump.yaml:3", "not YAML"]),
        ("a: 1\nb: \x01\n", ["bump.yaml:2", "not YAML", "control"]),
        (b"a: 1\nb: \xff\n", ["bump.yaml:2", "not UTF-8", "0xff"]),
        (EXAMPLE.encode("utf-16"), ["bump.yaml:1", "not UTF-8"]),
        ("a: 1\n---\nb: 2\n", ["bump.yaml:2", "second document"]),
        ("a: *b\n", ["bump.yaml:1", "*b"]),
        ("a: &a [*a]\n", ["bump.yaml:1", "*a"]),
        ("{1: 2, [3]: 4}\n", ["bump.yaml:1", "key"]),
        ("a: " + "[" * 100, ["bump.yaml:1", "levels deep"]),
        ("a: " + "[" * 100_000, ["bump.yaml:1"]),  # as the parser says it
        ("%YAML 3.0\n---\na: 1\n", ["bump.yaml:1", "not YAML"]),
    ],
)
def test_what_is_no_case_file_at_all_is_refused(case_file, content, named):
    (told,) = faults_of(case_file(content))
    for part in named:
        assert part in told


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    assert faults_of(tmp_path / "no.yaml")[0].endswith(
        "no.yaml: cannot be read: No such file or directory"
    )
    assert faults_of(tmp_path)[0].endswith("cannot be read: Is a directory")


def test_without_the_parser_in_c_the_same_is_read(case_file, monkeypatch):
    path = case_file(EXAMPLE)
    case = load_case(path)
    monkeypatch.setattr("exfit.case.yaml.LOADER", yaml.BaseLoader)
    assert load_case(path) == case
    assert faults_of(case_file("a: [1\nb: 2\n"))[0].startswith(f"{path}:")
    assert faults_of(case_file("a: 1\nb: \x01\n"))[0].startswith(f"{path}:2: not YAML")


def test_aliases_stand_for_what_they_name(case_file):
    text = changed("vref: [{at: 1.0, step: 0.05}]", "vref: &steps [{at: 1.0, step: 0.05}]")
    text = changed("{vref: [{at: 1.0, step: -0.05}]}", "{vref: *steps}", text)
    assert load_case(case_file(text)).validations[0].test.vref[0].step == 0.05


def test_aliases_of_aliases_do_not_explode(case_file):
    levels = [f"a{at}: &a{at} [{', '.join([f'*a{at - 1}'] * 10)}]" for at in range(1, 15)]
    told = faults_of(case_file("a0: &a0 [1]\n" + "\n".join(levels) + "\ntest: *a14\n"))
    assert [*told] == [f"{case_file('')}:6: more than 50,000 values"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("-0", 0),
        ("+12", 12),
        ("1e-8", 1e-8),
        ("1.0e+3", 1000.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("-.5E3", -500.0),
        ("12345678901234567890", 12345678901234567890.0),
        (".inf", float("inf")),
        ("-.INF", float("-inf")),
        ("true", True),
        ("False", False),
        ("", None),
        ("~", None),
        ("null", None),
    ],
)
def test_plain_scalars_are_read_as_yaml_1_2_has_them(text, value):
    found = scalar(text)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    "text",
    [
        "1:30", "1:30:00", "2001-01-01", "yes", "no", "on", "off", "y", "1_000", "0x1F", "0o17",
        "010", "-007.5", "0b1", "e5", "1e", ".", "inf", "nan", "+", "-", "1.2.3", "١",
    ],
)  # fmt: skip
def test_other_plain_scalars_are_text(text):
    assert scalar(text) == text


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(["{!r}", "{:.17g}", "{:.17e}", "{:+.3f}"]),
)
def test_a_number_is_read_as_it_was_written(value, form):
    text = form.format(value)
    assert scalar(text) == float(text)


def test_the_schema_is_a_json_schema_and_takes_sound_cases():
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == jsonschema.Draft202012Validator.META_SCHEMA["$id"]
    assert schema["title"]
    for text in (EXAMPLE, SHORTEST_CASE):
        jsonschema.validate(yaml.safe_load(text), schema)


# what only the exact reading of numbers, or more than one value, can tell
BEYOND_THE_SCHEMA = {
    "clock in a number",
    "an accuracy of a literal step",
    "endless digits",
    "infinite",
    "key twice",
    "not a number",
    "strange tag",
}


@pytest.mark.parametrize("fault", [fault for fault in FORM if fault not in BEYOND_THE_SCHEMA])
def test_the_schema_refuses_what_the_case_refuses(fault, validator):
    old, new, _, _ = FORM[fault]
    assert not validator.is_valid(yaml.safe_load(changed(old, new)))


def test_every_key_of_the_schema_is_described():
    schema = json_schema()
    for part in (schema, *schema["$defs"].values()):
        assert part["description"]
        for entry in part["properties"].values():
            assert "description" in entry or "$ref" in entry


def test_the_saturation_forms_are_those_of_the_plant():
    assert json_schema()["properties"]["saturation"]["enum"] == list(SATURATION)


def test_a_place_is_shown_with_dots_and_brackets():
    assert dotted(("test", "vref", 0, "at")) == "test.vref[0].at"


def write_record(folder, times, rise=0.05):
    folder.mkdir(exist_ok=True)
    rows = [f"{t:.3f},{1.0 if t < 1 else 1.0 + rise * (1 - exp(1 - t)):.6f},16" for t in times]
    (folder / "up.csv").write_text("t,vt,Uf [V]\n" + "\n".join(rows) + "\n")


def test_a_record_is_read_beside_the_case(case_file, tmp_path):
    write_record(tmp_path / "data", np.arange(0.0, 5.0, 0.01))
    case = load_case(case_file(EXAMPLE))
    record = record_of(case, case.recordings[0])
    assert record.source == tmp_path / "data" / "up.csv"
    assert set(record.signals) == {"vt", "efd"}
    assert np.all(record.signals["efd"] == 0.0)


def test_the_initial_voltage_is_given_or_the_mean_before_the_first_step(case_file, tmp_path):
    write_record(tmp_path / "data", np.arange(0.0, 5.0, 0.01))
    case = load_case(case_file(changed("vt0: 1.0", "vt0: 1.02")))
    assert initial_level(case.test, record_of(case, case.recordings[0]), "vt") == 1.02
    case = load_case(case_file(changed("  vt0: 1.0\n", "")))
    assert initial_level(case.test, record_of(case, case.recordings[0]), "vt") == 1.0


@pytest.mark.parametrize(
    ("times", "text", "named"),
    [
        (np.arange(0.0, 0.5, 0.1), EXAMPLE, ["up.csv", "0 ... 0.4 s", "bump.yaml", "step at 1 s"]),
        (np.arange(2.0, 5.0, 0.1), EXAMPLE, ["up.csv", "2 ... 4.9 s", "bump.yaml", "step at 1 s"]),
        (
            np.arange(1.0, 5.0, 0.1),
            changed("  vt0: 1.0\n", ""),
            ["up.csv", "begins at 1 s", "vt0", "bump.yaml"],
        ),
    ],
)
def test_a_record_that_does_not_hold_its_test_is_refused(case_file, tmp_path, times, text, named):
    write_record(tmp_path / "data", times)
    case = load_case(case_file(text))
    with pytest.raises(RecordError) as caught:
        record_of(case, case.recordings[0])
    for part in named:
        assert part in str(caught.value)


IN_KV = """\
model: {model}
plant: {{{plant}}}
test: {{vt0: 1.0, vref: [{{at: 1.0, step: 0.05}}]}}
record: {{file: up.csv, time: t, channels: {{vt: {vt}}}}}
"""
OPEN_CIRCUIT = ("AC1A", "type: open-circuit, machine: GENROU")
FOUND = "{start: 1.0, min: 0.05, max: 1.5}"


@pytest.mark.parametrize(
    ("started", "vt", "refused"),
    [
        (OPEN_CIRCUIT, "'Ut [kV]'", True),
        (OPEN_CIRCUIT, "{column: 'Ut [kV]', weight: 2.0}", True),
        (OPEN_CIRCUIT, "{column: 'Ut [kV]', unit: kV, base: 15.75}", False),
        (OPEN_CIRCUIT, "{column: 'Ut [kV]', scale: 0.0635}", False),
        (OPEN_CIRCUIT, f"{{column: 'Ut [kV]', scale: {FOUND}}}", False),
        (("FIRST_ORDER", "type: none"), "'Ut [kV]'", False),
    ],
)
def test_numbers_in_kv_are_not_taken_for_per_unit(case_file, tmp_path, started, vt, refused):
    (tmp_path / "up.csv").write_text("t,Ut [kV]\n0,15.75\n0.5,15.75\n2,16.5\n")
    case = load_case(case_file(IN_KV.format(model=started[0], plant=started[1], vt=vt)))
    if refused:
        with pytest.raises(RecordError, match=r"up\.csv: column 'Ut \[kV\]': in kV .* unit: kV"):
            record_of(case, case.recordings[0])
    else:
        assert len(record_of(case, case.recordings[0]).time) == 3


def test_a_missing_record_is_reported_when_it_is_read(case_file):
    case = load_case(case_file(EXAMPLE))
    with pytest.raises(RecordError, match=r"up\.csv: cannot be read"):
        record_of(case, case.recordings[0])


LINES = EXAMPLE.splitlines(keepends=True)
WORDS = [
    "null", "~", "true", "1e999", "-1", "0", ".nan", "[]", "{}", "&a", "*a", "!!str", "!x", "<<",
    "- x", "? ", ": ", "|\n", ">\n", "\n---\n", "\n...\n", "\x85", *"\u2028-?:'\"#%@`[]{},\\\t\n",
    "KA", "vt0", "none", "AC8B", "FIRST_ORDER", "exponential", "linear",
]  # fmt: skip


@st.composite
def damaged_cases(draw):
    """Draw the example after a few cuts, insertions, repeated and exchanged lines."""
    text = EXAMPLE
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(text)))
        kind = draw(st.sampled_from(["junk", "word", "cut", "line", "value"]))
        if kind == "junk":
            text = text[:at] + draw(st.text(max_size=5)) + text[at:]
        elif kind == "word":
            text = text[:at] + draw(st.sampled_from(WORDS)) + text[at:]
        elif kind == "cut":
            text = text[:at] + text[at + draw(st.integers(1, 40)) :]
        elif kind == "line":
            text = text[:at] + "\n" + draw(st.sampled_from(LINES)) + text[at:]
        else:
            head, colon, tail = text[at:].partition(": ")
            _, end, rest = tail.partition(draw(st.sampled_from([",", "}", "\n"])))
            text = text[:at] + head + colon + draw(st.sampled_from(WORDS)) + end + rest
    return text.encode("utf-8", "surrogatepass")


@given(damaged_cases())
def test_no_damage_gives_anything_but_a_case_or_its_refusal(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "damaged.yaml"
    path.write_bytes(data)
    try:
        case = load_case(path)
    except CaseError:
        return
    assert case.values()


def test_a_text_is_checked_as_the_file_it_stands_for(tmp_path):
    assert parse_case(EXAMPLE, tmp_path / "other.yaml").folder == tmp_path
