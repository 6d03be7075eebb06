"""Cases with several records and unknowns: every fault of theirs is told with place and limit."""

from copy import deepcopy
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from places import ROOT

from exfit.case.json_schema import json_schema
from exfit.case.load import parse_case
from exfit.cli import main
from exfit.errors import CaseError, ExfitError
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import residuals_of

EXAMPLE = yaml.safe_load("""\
model: AC1A
plant: {type: open-circuit, machine: GENROU}
records:
  - name: up
    test:
      vref:
        - {at: {start: 1.0, min: 0.8, max: 1.2}, step: {start: 0.05, min: 0.02, max: 0.08}}
    record:
      file: up.csv
      time: t
      channels: {vt: {column: vt, weight: 2.0, filter: {median: 3}, outliers: 6}, efd: efd}
  - name: down
    plant: {type: infinite-bus, network: {f0: 50, X: 0.3, P: 0.8, Q: 0.1}}
    test: {vt0: {start: 1.0, min: 0.9, max: 1.1}, vref: [{at: 1.0, step: -0.05}]}
    record:
      file: up.csv
      time: t
      delay: {start: 0.0, min: -0.1, max: 0.1}
      channels:
        vt: {column: vt, scale: {start: 1.0, min: 0.9, max: 1.1}, filter: {lowpass: 8.0}}
      mask: [[2.0, 3.0]]
      gaps: skip
parameters:
  fixed: {KE: 1.0, VAMIN: =-VAMAX, TE: =0.9*TE0}
  free:
    TE0: {start: 1.0, min: 0.1, max: 9}
    KA: {start: 766, min: 10, max: 5000, prior: {mean: 700, std: 20 %}}
estimate: {loss: huber, loss_scale: 1.5, search: global, starts: 4}
validate:
  - name: again
    test: {vref: [{at: {start: auto}, step: {start: auto}}]}
    record: {file: up.csv, time: t, channels: {vt: vt}}
""")
PLAYBACK = yaml.safe_load("""\
model: AC1A
plant: {type: playback}
test: {vref: [{at: 1.0, step: 0.05}]}
record: {file: up.csv, time: t, channels: {vt: vt, efd: efd, ifd: ifd}}
parameters: {free: {KA: {start: 766, min: 10, max: 5000}}}
""")
ALONE = yaml.safe_load("""\
model: FIRST_ORDER
plant: {type: none}
test: {vt0: 0, duration: 5, vref: [{at: 1, step: 1}]}
""")
GONE = object()

TEST = ("records", 0, "test")
AT = (*TEST, "vref", 0, "at")
SIZE = (*TEST, "vref", 0, "step")
VT = ("records", 0, "record", "channels", "vt")
TIME = ("records", 0, "record", "time")
CHANNEL = {"column": "vt", "unit": "kV"}
DOWN = ("records", 1, "record")
NETWORK = ("records", 1, "plant", "network")
FREE = ("parameters", "free")
FIXED = ("parameters", "fixed")
STD = (*FREE, "KA", "prior", "std")


def shown(place):
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)[1:]


def changed(place, value, content=EXAMPLE):
    """Return a copy of a case with a value at a place, or with none."""
    content = deepcopy(content)
    section = content
    for key in place[:-1]:
        section = section[key]
    if value is GONE:
        del section[place[-1]]
    else:
        section[place[-1]] = value
    return content


def faults_of(content):
    with pytest.raises(CaseError) as caught:
        parse_case(yaml.safe_dump(content, sort_keys=False), Path("case.yaml"))
    return caught.value.faults


# where a value is wrong, the value, where the message points, what it says
FORM = {
    "text for a start": (AT, {"start": "x", "min": 0, "max": 2}, (*AT, "start"), "'x' is not poss"),
    "misspelt auto": ((*AT, "start"), "Auto", (*AT, "start"), "did you mean auto?"),
    "no start": ((*AT, "start"), GONE, (*AT, "start"), "is missing"),
    "empty start": ((*AT, "start"), None, (*AT, "start"), "has no value"),
    "list for an instant": (AT, [1], AT, "a list is not a number"),
    "auto for an instant": (AT, "auto", AT, "'auto' is not a number"),
    "scale of an unknown": ((*AT, "scale"), "log", (*AT, "scale"), "unknown key"),
    "text for a bound": ((*AT, "min"), "x", (*AT, "min"), "'x' is not a number"),
    "text for a delay": ((*DOWN, "delay"), "x", (*DOWN, "delay"), "'x' is not a number"),
    "text for vt0": (
        ("records", 1, "test", "vt0"),
        "x",
        ("records", 1, "test", "vt0"),
        "'x' is no",
    ),
    "number for a prior": (STD[:-1], 5, STD[:-1], "5 is not a mapping"),
    "prior without std": (STD[:-1], {"mean": 3}, STD, "is missing"),
    "text for a mean": ((*STD[:-1], "mean"), "x", (*STD[:-1], "mean"), "'x' is not a number"),
    "quoted std": (STD, "20", STD, "'20' is neither a number nor a percentage such as 20 %"),
    "negative share": (STD, "-1 %", STD, "'-1 %' is neither a number nor a percentage"),
    "std of nothing": (STD, 0, STD, "0 is not above 0"),
    "list for a std": (STD, [1], STD, "a list is not a number"),
    "number for a filter": ((*VT, "filter"), 5, (*VT, "filter"), "5 is not a mapping"),
    "text for a filter": (
        (*VT, "filter"),
        "lowpass",
        (*VT, "filter"),
        "'lowpass' is not a mapping",
    ),
    "number for a time": (TIME, 5, TIME, "5 is not text"),
    "date without time": (TIME, ["Date"], (*TIME, 1), "is missing"),
    "three columns of time": (TIME, ["a", "b", "c"], TIME, "3 entries; at most 2 allowed"),
    "time without unit": (TIME, {"column": "t"}, (*TIME, "unit"), "is missing"),
    "unit of no time": (TIME, {"column": "t", "unit": "kV"}, (*TIME, "unit"), "'kV' is not poss"),
    "empty sheet": ((*TIME[:-1], "sheet"), "", (*TIME[:-1], "sheet"), "is empty"),
    "number for a unit": ((*VT, "unit"), 5, (*VT, "unit"), "5 is not text"),
    "base of nothing": (VT, CHANNEL | {"base": 0}, (*VT, "base"), "0 is not above 0"),
    "base to be found": (
        VT,
        CHANNEL | {"base": {"start": 1, "min": 0.5, "max": 2}},
        (*VT, "base"),
        "a mapping is not a number",
    ),
    "empty filter": ((*VT, "filter"), {}, (*VT, "filter", "lowpass"), "is missing"),
    "cutoff of nothing": (
        (*VT, "filter"),
        {"lowpass": 0},
        (*VT, "filter", "lowpass"),
        "0 is not above 0",
    ),
    "two filters": (
        (*VT, "filter"),
        {"lowpass": 1, "median": 3},
        (*VT, "filter", "lowpass"),
        "not allowed with this type",
    ),
    "half a sample": (
        (*VT, "filter"),
        {"median": 3.5},
        (*VT, "filter", "median"),
        "3.5 is not a whole number",
    ),
    "outliers from nothing on": ((*VT, "outliers"), 0, (*VT, "outliers"), "0 is not above 0"),
    "noise of nothing": (
        ("validate", 0, "record", "channels"),
        {"vt": {"column": "vt", "noise": -1}},
        ("validate", 0, "record", "channels", "vt", "noise"),
        "-1 is not above 0",
    ),
    "number for a mask": ((*DOWN, "mask"), [2], (*DOWN, "mask", 0), "2 is not a list"),
    "three ends of a mask": (
        (*DOWN, "mask"),
        [[1, 2, 3]],
        (*DOWN, "mask", 0),
        "3 entries; at most 2 allowed",
    ),
    "text in a mask": ((*DOWN, "mask"), [["a", 2]], (*DOWN, "mask", 0, 0), "'a' is not a number"),
    "other gaps": ((*DOWN, "gaps"), "fill", (*DOWN, "gaps"), "known: refuse, skip"),
    "mapping for records": (("records",), {}, ("records",), "a mapping is not a list"),
    "no records": (("records",), [], ("records",), "0 entries; at least 1 needed"),
    "number for a record": (("records", 0), 5, ("records", 0), "5 is not a mapping"),
    "record without name": (("records", 1, "name"), GONE, ("records", 1, "name"), "is missing"),
    "name with a slash": (("records", 1, "name"), "a/b", ("records", 1, "name"), "letters, digits"),
    "text for a plant": (
        ("records", 1, "plant"),
        "x",
        ("records", 1, "plant"),
        "'x' is not a mapp",
    ),
    "plant without type": (
        ("records", 0, "plant"),
        {},
        ("records", 0, "plant", "type"),
        "is missing",
    ),
    "plant with its own machine": (
        ("records", 0, "plant"),
        {"type": "open-circuit", "machine": "GENROU"},
        ("records", 0, "plant", "machine"),
        "unknown key",
    ),
    "plant without network": (NETWORK, GONE, NETWORK, "is missing"),
    "tied network": ((*NETWORK, "X"), "=2", (*NETWORK, "X"), "'=2' is not a number"),
    "text without =": ((*FIXED, "VAMIN"), "-VAMAX", (*FIXED, "VAMIN"), "'-VAMAX' is not a number"),
    "tied start": ((*FREE, "KA", "start"), "=KE", (*FREE, "KA", "start"), "'=KE' is not a number"),
    "unknown loss": (
        ("estimate", "loss"),
        "cauchy",
        ("estimate", "loss"),
        "known: least-squares, huber, soft-l1",
    ),
    "loss from nothing on": (
        ("estimate", "loss_scale"),
        0,
        ("estimate", "loss_scale"),
        "0 is not above 0",
    ),
    "no starts": (("estimate", "starts"), 0, ("estimate", "starts"), "0 is below 1"),
}
MEANING = {
    "no lower bound": ((*AT, "min"), GONE, (*AT, "min"), "is missing"),
    "crossed bounds": ((*AT, "min"), 1.5, (*AT, "min"), "1.5 is not below max = 1.2"),
    "equal bounds": ((*AT, "min"), 1.2, (*AT, "min"), "1.2 is not below max = 1.2"),
    "start outside": (
        (*AT, "start"),
        1.5,
        (*AT, "start"),
        "1.5 lies outside its bounds 0.8 ... 1.2",
    ),
    "step across 0": ((*SIZE, "min"), -0.02, (*SIZE, "min"), "-0.02 ... 0.08 contains 0"),
    "step from 0": ((*SIZE, "min"), 0, (*SIZE, "min"), "0 ... 0.08 contains 0"),
    "scale across 0": (
        (*DOWN, "channels", "vt", "scale", "min"),
        -1,
        (*DOWN, "channels", "vt", "scale", "min"),
        "-1 ... 1.1 contains 0",
    ),
    "scale of nothing": (
        (*DOWN, "channels", "vt", "scale"),
        0,
        (*DOWN, "channels", "vt", "scale"),
        "must not be 0",
    ),
    "vt0 from 0": (
        ("records", 1, "test", "vt0", "min"),
        0,
        ("records", 1, "test", "vt0", "min"),
        "0 is not above 0",
    ),
    "auto in the second step": (
        (*TEST, "vref"),
        [{"at": 1, "step": 0.05}, {"at": {"start": "auto"}, "step": 0.1}],
        (*TEST, "vref", 1, "at", "start"),
        "auto finds the first step of vref",
    ),
    "auto of vs": (
        (*TEST, "vs"),
        [{"at": 1, "step": {"start": "auto"}}],
        (*TEST, "vs", 0, "step", "start"),
        "auto finds the first step of vref",
    ),
    "scale of vt without vt0": (
        ("records", 1, "test", "vt0"),
        GONE,
        ("records", 1, "test", "vt0"),
        "the record does not show it while scale of vt is fitted",
    ),
    "share of nothing": ((*STD[:-1], "mean"), 0, STD, "a share of mean = 0 is 0"),
    "no share": (STD, "0.0 %", STD, "'0.0 %' is not above 0"),
    "endless share": (STD, 400 * "9" + " %", STD, "not finite"),
    "even median": (
        (*VT, "filter", "median"),
        4,
        (*VT, "filter", "median"),
        "4 is not an odd number",
    ),
    "even median of a validation": (
        ("validate", 0, "record", "channels"),
        {"vt": {"column": "vt", "filter": {"median": 4}}},
        ("validate", 0, "record", "channels", "vt", "filter", "median"),
        "4 is not an odd number",
    ),
    "base of no unit": (VT, {"column": "vt", "base": 15.75}, (*VT, "unit"), "in which unit"),
    "unit without base": (VT, {"column": "vt", "unit": "kV"}, (*VT, "base"), "what is 1 pu in kV"),
    "per cent without base": (VT, {"column": "vt", "unit": "%"}, (*VT, "base"), "is 1 pu in %"),
    "mask backwards": ((*DOWN, "mask"), [[3, 2]], (*DOWN, "mask", 0), "3 is not below end 2"),
    "name twice": (("records", 1, "name"), "UP", ("records", 1, "name"), "'UP' is taken by 'up'"),
    "name of a validation": (
        ("validate", 0, "name"),
        "up",
        ("validate", 0, "name"),
        "'up' is taken by 'up'",
    ),
    "name of a file": (("records", 1, "name"), "fit", ("records", 1, "name"), "'fit' is taken"),
    "name of a device": (("records", 1, "name"), "con", ("records", 1, "name"), "is a device of W"),
    "name with a dot": (("records", 1, "name"), "up2.", ("records", 1, "name"), "ends with a dot"),
    "name of a table": (
        ("validate", 0, "name"),
        "up-iterations",
        ("validate", 0, "name"),
        "'up-iterations' is taken by 'up': the file up-iterations.csv would be of both",
    ),
    "name of a part": (("records", 1, "name"), "machine", ("records", 1, "name"), "is taken"),
    "beginning of a part": (
        ("records", 1, "name"),
        "Network.1",
        ("records", 1, "name"),
        "is taken",
    ),
    "test beside records": (
        ("test",),
        {"vref": [{"at": 1, "step": 1}]},
        ("test",),
        "not allowed with records",
    ),
    "record beside records": (
        ("record",),
        {"file": "a", "time": "t", "channels": {"vt": "vt"}},
        ("record",),
        "not allowed with records",
    ),
    "network without P": (
        NETWORK,
        {"f0": 50, "X": 0.3, "Q": 0.1},
        (*NETWORK, "P"),
        "is missing",
    ),
    "unknown data of a network": (
        (*NETWORK, "Z"),
        3,
        (*NETWORK, "Z"),
        "not a parameter of the net",
    ),
    "network outside its sheet": ((*NETWORK, "X"), -3, (*NETWORK, "X"), "-3 lies outside 0 ... 10"),
    "event of a grid that is not there": (
        (*TEST, "E"),
        [{"at": 1, "step": 0.1}],
        (*TEST, "E"),
        "not allowed with plant open-circuit",
    ),
    "noise of a validation beside its weight": (
        ("validate", 0, "record", "channels"),
        {"vt": {"column": "vt", "noise": 1e-4, "weight": 2.0}},
        ("validate", 0, "record", "channels", "vt", "weight"),
        "not allowed with noise",
    ),
    "tie that ends": ((*FIXED, "VAMIN"), "=", (*FIXED, "VAMIN"), "ends too soon"),
    "tie that cannot be read": ((*FIXED, "VAMIN"), "=-VAMAX)", (*FIXED, "VAMIN"), "cannot be read"),
    "function in a tie": ((*FIXED, "VAMIN"), "=log(2)", (*FIXED, "VAMIN"), "is not arithmetic"),
    "unknown name in a tie": (
        (*FIXED, "VAMIN"),
        "=-VAMX",
        (*FIXED, "VAMIN"),
        "did you mean VAMAX?",
    ),
    "name of another part in a tie": (
        ("plant", "parameters"),
        {"Tppd0": "=Tpd0/200"},
        ("plant", "parameters", "Tppd0"),
        "Tpd0 is not a parameter",
    ),
    "circle": (
        (*FIXED, "VAMAX"),
        "=-VAMIN",
        (*FIXED, "VAMIN"),
        "VAMIN -> VAMAX -> VAMIN: a circle",
    ),
    "circle of one": ((*FIXED, "VAMIN"), "=VAMIN", (*FIXED, "VAMIN"), "a circle"),
    "tie across its limit": (
        (*FIXED, "VAMIN"),
        "=VAMAX",
        (*FIXED, "VAMIN"),
        "14.5 is not below VAMAX = 14.5",
    ),
    "tie outside the sheet": ((*FIXED, "KE"), "=99*KA", (*FIXED, "KE"), "75834 lies outside"),
    "tie without a value": (
        (*FIXED, "VAMIN"),
        "=-VAMAX/(KE-1)",
        (*FIXED, "VAMIN"),
        "division by zero at VAMAX = 14.5, KE = 1",
    ),
    "tied and free": (
        (*FREE, "VAMIN"),
        {"start": -1, "min": -2, "max": -0.5, "scale": "linear"},
        (*FREE, "VAMIN"),
        "both fixed and free",
    ),
    "helper that nothing uses": ((*FIXED, "TE"), 1.0, (*FREE, "TE0"), "not a parameter of AC1A"),
    "helper with the name of another part": (
        FIXED,
        {"machine.Tpd0": 3.0, "TE": "=TE0+0*machine.Tpd0"},
        (*FIXED, "machine.Tpd0"),
        "not a parameter of AC1A",
    ),
    "a scale of no loss": (
        ("estimate", "loss"),
        "least-squares",
        ("estimate", "loss_scale"),
        "only with estimate.loss",
    ),
    "starts beyond number": (
        ("estimate", "starts"),
        10**9,
        ("estimate", "starts"),
        "1000000000 is above 1000000",
    ),
    "starts of a local search": (
        ("estimate", "search"),
        "local",
        ("estimate", "starts"),
        "only with estimate.search: global",
    ),
}
FAULTS = FORM | MEANING


def test_the_example_is_sound():
    jsonschema.validate(EXAMPLE, json_schema())
    case = parse_case(yaml.safe_dump(EXAMPLE), Path("case.yaml"))
    assert [one.name for one in case.recordings] == ["up", "down"]
    assert case.values()["TE"] == pytest.approx(0.9)
    assert case.values()["VAMIN"] == -case.values()["VAMAX"]
    assert case.free()["KA"].prior.sigma == pytest.approx(140.0)
    assert list(case.free()) == ["KA", "TE0"]
    assert case.on_load


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_reported_with_its_place_and_limit_and_brings_no_others(fault):
    place, value, told_at, text = FAULTS[fault]
    told = [fault.split(": ", 2) for fault in faults_of(changed(place, value))]
    assert {where for _, where, _ in told} == {shown(told_at)}
    assert any(text in what for _, _, what in told)
    assert all(file.startswith("case.yaml:") for file, _, _ in told)


@pytest.fixture(scope="module")
def validator():
    """Return what another program checks a case with, by the schema."""
    return jsonschema.Draft202012Validator(json_schema())


@pytest.mark.parametrize("fault", FORM)
def test_the_schema_refuses_a_wrong_form(fault, validator):
    place, value, _, _ = FORM[fault]
    assert not validator.is_valid(changed(place, value))


def test_the_schema_takes_what_the_case_takes(validator):
    for place, value in (
        (AT, 1.0),
        (AT, {"start": "auto"}),
        (AT, {"start": "auto", "min": 0.5}),
        (STD, 140.0),
        (STD, "12.5%"),
        ((*FIXED, "VAMIN"), -14.5),
        ((*VT, "filter"), {"lowpass": 8}),
        (VT, "vt"),
        (VT, CHANNEL | {"base": 15.75}),
        (VT, CHANNEL | {"scale": 0.0635}),
        (VT, CHANNEL | {"unit": "pu"}),
        (TIME, ["Date", "Time"]),
        (TIME, {"column": "t", "unit": "ms"}),
        ((*TIME[:-1], "sheet"), "Data"),
        (("records", 1, "plant"), {"type": "open-circuit"}),
        ((*DOWN, "mask"), []),
    ):
        content = changed(place, value)
        validator.validate(content)
        parse_case(yaml.safe_dump(content), Path("case.yaml"))


def test_all_faults_come_together():
    content, wanted = EXAMPLE, set()
    for fault in (
        "crossed bounds",
        "vt0 from 0",
        "even median",
        "mask backwards",
        "name of a part",
        "unknown data of a network",
        "no share",
        "unknown name in a tie",
        "loss from nothing on",
        "noise of a validation beside its weight",
    ):
        place, value, told_at, _ = FAULTS[fault]
        content = changed(place, value, content)
        wanted.add(shown(told_at))
    assert {fault.split(": ")[1] for fault in faults_of(content)} == wanted


def test_noise_is_of_all_channels_or_of_none():
    content = changed((*VT, "noise"), 1e-4)
    told = {tuple(fault.split(": ")[1:]) for fault in faults_of(content)}
    assert told == {
        (
            "records[0].record.channels.vt.weight",
            "not allowed with noise",
            "the weight is one over the noise",
        ),
        ("records[0].record.channels.efd.noise", "is missing", "other channels have it"),
        ("records[1].record.channels.vt.noise", "is missing", "other channels have it"),
    }


def test_auto_needs_vt_in_the_record():
    content = changed(("validate", 0, "record", "channels"), {"efd": "efd"})
    content["validate"][0]["test"]["vt0"] = 1.0
    told = [fault.split(": ", 2)[1:] for fault in faults_of(content)]
    assert told == [
        [f"validate[0].test.vref[0].{key}.start", "auto needs vt in the record"]
        for key in ("at", "step")
    ]


@pytest.mark.parametrize(
    ("place", "value", "told_at", "text"),
    [
        (("record", "delay"), 0.1, ("record", "delay"), "not allowed with plant playback"),
        (
            ("record", "delay"),
            {"start": 0, "min": -1, "max": 1},
            ("record", "delay"),
            "the record drives it",
        ),
        (
            ("test", "vref", 0, "at"),
            {"start": 1, "min": 0, "max": 2},
            ("test", "vref", 0, "at"),
            "the record drives it",
        ),
        (
            ("record", "channels", "vt"),
            {"column": "vt", "noise": 1e-4},
            ("record", "channels", "vt", "noise"),
            "has no effect: the signal drives",
        ),
        (
            ("record", "channels", "vt"),
            {"column": "vt", "filter": {"median": 3}},
            ("record", "channels", "vt", "filter"),
            "has no effect: the signal drives",
        ),
        (
            ("validate",),
            [
                {
                    "name": "a",
                    "plant": {"type": "open-circuit"},
                    "test": PLAYBACK["test"],
                    "record": {"file": "a", "time": "t", "channels": {"vt": "vt"}},
                }
            ],
            ("validate", 0, "plant"),
            "not allowed with plant playback",
        ),
    ],
)
def test_what_is_not_allowed_with_a_record_that_drives_is_refused(place, value, told_at, text):
    told = [fault.split(": ", 2) for fault in faults_of(changed(place, value, PLAYBACK))]
    assert [where for _, where, _ in told] == [shown(told_at)]
    assert text in told[0][2]


RECORDED = (("records", 0, "test", "vref"), "recorded")
LEVEL = ("records", 0, "record", "channels", "vref")
FILE = {"file": "ref.csv", "time": "t", "column": "v"}
UP = "records[0]"


@pytest.mark.parametrize(
    ("changes", "faults"),
    [
        ([RECORDED], {f"{UP}.record.channels.vref": "is missing: test.vref is recorded"}),
        (
            [RECORDED, (LEVEL, "vref"), (("records", 0, "test", "begin"), -1.0)],
            {f"{UP}.test.begin": "the record shows it from its start only",
             f"{UP}.test.vt0": "must be given with begin"},
        ),
        ([(LEVEL, "vref")], {f"{UP}.record.channels.vref": "give recorded there, or leave"}),
        (
            [RECORDED, (LEVEL, {"column": "vref", "unit": "kV", "noise": 1e-4, "averaged": 0.1,
                                "scale": {"start": 1, "min": 0.5, "max": 2}})],
            {f"{UP}.record.channels.vref.noise": "has no effect: the signal drives",
             f"{UP}.record.channels.vref.averaged": "has no effect: the signal drives",
             f"{UP}.record.channels.vref.scale": "must be a number"},
        ),
        (
            [RECORDED, (LEVEL, {"column": "vref", "unit": "kV"})],
            {f"{UP}.record.channels.vref.base": "what is 1 pu in kV?"},
        ),
        (
            [(RECORDED[0], {**FILE, "unit": "kV", "filter": {"median": 4}, "noise": 1})],
            {f"{UP}.test.vref.base": "what is 1 pu in kV?",
             f"{UP}.test.vref.filter.median": "4 is not an odd number",
             f"{UP}.test.vref.noise": "unknown key"},
        ),
        ([(RECORDED[0], {"file": "ref.csv"})], {f"{UP}.test.vref.time": "is missing",
                                                f"{UP}.test.vref.column": "is missing"}),
        (
            [RECORDED, (LEVEL, "vref"), (("records", 0, "record", "resample"), 50.0)],
            {f"{UP}.record.resample": "its filter smears the jumps"},
        ),
        ([(RECORDED[0], "recordet")], {f"{UP}.test.vref": "did you mean recorded?"}),
    ],
)  # fmt: skip
def test_every_fault_of_a_recorded_reference_is_reported(changes, faults):
    content = EXAMPLE
    for place, value in changes:
        content = changed(place, value, content)
    reported = dict(fault.split(": ", 2)[1:] for fault in faults_of(content))
    assert reported.keys() == faults.keys()
    assert all(text in reported[place] for place, text in faults.items())


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("recorded", "record.channels.vref drives it without"),
        (FILE, "give the record a channel vref"),
    ],
)
def test_a_playback_takes_its_reference_from_a_channel_alone(given, text):
    content = changed(("test",), {"steady_until": 1.0, "vref": given}, PLAYBACK)
    (fault,) = faults_of(content)
    assert ": test.vref: not allowed with plant playback: " in fault
    assert text in fault


def test_a_recorded_reference_needs_a_record():
    (fault,) = faults_of(changed(("test", "vref"), "recorded", ALONE))
    assert fault.endswith(": test.vref: recorded needs a record")


@pytest.mark.parametrize(
    ("value", "told_at", "text"),
    [
        ({"start": "auto"}, "test.vref[0].at.start", "auto needs a record"),
        ({"start": 1, "min": 2, "max": 0}, "test.vref[0].at.min", "2 is not below max = 0"),
    ],
)
def test_a_nuisance_of_a_test_without_a_record_is_checked_too(value, told_at, text):
    (told,) = faults_of(changed(("test", "vref", 0, "at"), value, ALONE))
    assert told.endswith(f": {told_at}: {text}")


def test_a_test_is_missing_where_there_are_no_records():
    (told,) = faults_of(changed(("test",), GONE, ALONE))
    assert told.endswith(": test: is missing")


@pytest.mark.parametrize("command", ["fit", "simulate", "validate", "check", "profile", "identify"])
@pytest.mark.parametrize("fault", ["text for a start", "no records", "circle", "crossed bounds"])
def test_the_commands_tell_a_fault_and_write_nothing(tmp_path, monkeypatch, fault, command):
    monkeypatch.chdir(tmp_path)
    place, value, told_at, text = FAULTS[fault]
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(changed(place, value), sort_keys=False))
    ran = CliRunner().invoke(main, [command, "case.yaml"])
    assert ran.exit_code == 1
    assert isinstance(ran.exception, SystemExit)
    assert shown(told_at) in ran.output
    assert text.split("'")[0] in ran.output
    assert [path.name for path in tmp_path.iterdir()] == ["case.yaml"]


@pytest.fixture(scope="module")
def beside_a_record(tmp_path_factory):
    """Return a folder with a record of a step at 1 s."""
    folder = tmp_path_factory.mktemp("fuzz")
    time = np.arange(0.0, 6.0, 0.02)
    vt = 1.0 + np.where(time < 1.0, 0.0, 0.05 - 0.05 * np.exp(1.0 - time))
    vt += 1e-4 * np.random.default_rng(0).standard_normal(len(time))
    rows = np.column_stack([time, vt, 1.1 * vt])
    np.savetxt(folder / "up.csv", rows, delimiter=",", header="t,vt,efd", comments="")
    return folder


def test_the_example_can_be_fitted(beside_a_record):
    case = parse_case(yaml.safe_dump(EXAMPLE), beside_a_record / "case.yaml")
    assert residuals_of(case, build_experiments(case)).count > 0


PLACES = [
    AT,
    TIME,
    (*VT, "unit"),
    (*VT, "base"),
    (*AT, "start"),
    (*AT, "min"),
    (*AT, "max"),
    SIZE,
    (*SIZE, "start"),
    (*SIZE, "min"),
    (*TEST, "vref"),
    (*TEST, "vs"),
    (*TEST, "steady_until"),
    (*TEST, "vt0"),
    VT,
    (*VT, "scale"),
    (*VT, "offset"),
    (*VT, "noise"),
    (*VT, "weight"),
    (*VT, "filter"),
    (*VT, "filter", "median"),
    (*VT, "outliers"),
    ("records",),
    ("records", 0),
    ("records", 0, "name"),
    ("records", 0, "plant"),
    ("records", 1, "test", "vt0"),
    ("records", 1, "plant", "type"),
    NETWORK,
    (*NETWORK, "X"),
    (*DOWN, "delay"),
    (*DOWN, "delay", "min"),
    (*DOWN, "mask"),
    (*DOWN, "mask", 0),
    (*DOWN, "gaps"),
    (*DOWN, "window"),
    (*DOWN, "channels", "vt", "scale", "start"),
    (*DOWN, "channels", "vt", "filter", "lowpass"),
    FIXED,
    (*FIXED, "VAMIN"),
    (*FIXED, "TE"),
    (*FREE, "TE0"),
    (*FREE, "TE0", "min"),
    STD,
    STD[:-1],
    (*STD[:-1], "mean"),
    ("plant", "parameters"),
    ("estimate", "loss"),
    ("estimate", "loss_scale"),
    ("estimate", "search"),
    ("estimate", "starts"),
    ("validate", 0, "test", "vref"),
    ("validate", 0, "name"),
]
WORDS = st.sampled_from(
    [
        "auto", "x", "", "=", "=VAMAX", "=-VAMIN", "=TE0", "=0.9*machine.Tpd0", "=1/0", "=KA**0.5",
        "=(", "=up.delay", "=vt0", "20 %", "0 %", "1e9 %", "%", "skip", "huber", "open-circuit",
        "infinite-bus", "playback", "machine", "up", "down", "a.b", "lowpass", "=9**9**9", "=nan",
    ]
)  # fmt: skip
KEYS = st.sampled_from(
    [
        "start", "min", "max", "at", "step", "mean", "std", "lowpass", "median", "column", "scale",
        "offset", "noise", "type", "network", "machine", "VAMIN", "TE", "TE0", "X", "P", "name",
    ]
)  # fmt: skip
NUMBERS = st.one_of(
    st.sampled_from([0, -1, 1, 2, 3, 4, 0.05, -0.05, 1e-300, 1e300, 5.5, 7]),
    st.floats(),
    st.integers(-5, 5),
)
JUNK = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, WORDS),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(KEYS, inner, max_size=4)),
    max_leaves=6,
)


@pytest.mark.long
@given(st.lists(st.tuples(st.sampled_from(PLACES), JUNK), min_size=1, max_size=3))
def test_junk_in_the_new_keys_gives_a_case_or_its_refusal(beside_a_record, changes):
    """What is accepted can be set beside its record, or is refused in words there."""
    content = EXAMPLE
    for place, value in changes:
        try:
            content = changed(place, value, content)
        except (KeyError, IndexError, TypeError):
            continue  # an earlier change took the place away
    try:
        case = parse_case(yaml.safe_dump(content), beside_a_record / "case.yaml")
    except CaseError:
        return
    try:
        setups = build_experiments(case)
    except ExfitError:
        return
    residuals = residuals_of(case, setups)
    assert np.isfinite(residuals.start).all()
    low, high = residuals.bounds
    assert (low < high).all()


def test_an_even_median_of_all_channels_is_a_fault_as_that_of_one():
    path = ROOT / "configs/grid_event.yaml"
    text = path.read_text().replace("record:\n", "record:\n  filter: {median: 4}\n", 1)
    with pytest.raises(CaseError, match=r"record\.filter\.median: 4 is not an odd number"):
        parse_case(text, path)
