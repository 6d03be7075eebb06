"""Programmes: checked like a case, with the places of their own file."""

import json

import pytest

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.features.programme.programme import load_programme

MACHINE = {"Tpd0": 6.0, "Tppd0": 0.035, "Xd": 1.8, "Xpd": 0.3, "Xppd": 0.25, "Xl": 0.2}
RECORD = {"file": "up.csv", "time": "t", "channels": {"vt": "vt"}}
TEST = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]}
ON_LOAD = {"type": "infinite-bus", "network": {"f0": 60, "X": 0.3, "P": 0.5, "E": 1.0}}
KA = {"start": 200.0, "min": 20.0, "max": 2000.0}
TPD0 = {"start": 5.0, "min": 1.0, "max": 10.0}
PROGRAMME = {
    "model": "SEXS",
    "plant": {"type": "open-circuit", "machine": "GENROU", "parameters": MACHINE},
    "parameters": {"free": {"K": KA}},
    "tests": [
        {"name": "down", "use": "validate", "test": TEST, "record": RECORD},
        {"name": "up", "kind": "bump", "test": TEST, "record": RECORD},
        {"name": "on-load", "plant": ON_LOAD, "test": TEST, "record": RECORD},
        {
            "name": "off",
            "kind": "rejection",
            "test": TEST,
            "record": RECORD,
            "free": {"Tpd0": TPD0},
        },
    ],
}


@pytest.fixture
def loaded(tmp_path):
    """Return the programme of a content."""

    def load(content):
        path = tmp_path / "unit.yaml"
        path.write_text(json.dumps(content, indent=1), encoding="utf-8")
        return load_programme(path)

    return load


def changed(place, value):
    """Return the programme with another value at a place; without it where the value is None."""
    content = json.loads(json.dumps(PROGRAMME))
    inner = content
    for key in place[:-1]:
        inner = inner[key]
    if value is None:
        del inner[place[-1]]
    else:
        inner[place[-1]] = value
    return content


def faults_of(load, content):
    """Return the faults of a content, each without its file and line."""
    with pytest.raises(CaseError) as refused:
        load(content)
    return [line.split(": ", 1)[1] for line in str(refused.value).splitlines()]


def test_the_bump_tests_are_the_records_and_the_validations_of_one_case(loaded):
    case = loaded(PROGRAMME).case_of("fit")
    assert [recording.name for recording in case.recordings] == ["up", "on-load"]
    assert [recording.name for recording in case.validations] == ["down"]
    assert [*case.free()] == ["K"]


def test_a_test_of_the_machine_is_fitted_for_its_own_data_alone(loaded):
    case = loaded(PROGRAMME).case_of("off")
    assert [recording.name for recording in case.recordings] == ["off"]
    assert [*case.free()] == ["machine.Tpd0"]
    assert case.values()["K"] == KA["start"]


def test_a_programme_of_bump_tests_is_the_case_that_has_them_as_records(loaded, tmp_path):
    tests = [{key: test[key] for key in test if key != "use"} for test in PROGRAMME["tests"][:3]]
    content = {key: value for key, value in PROGRAMME.items() if key != "tests"}
    records = [{key: test[key] for key in test if key != "kind"} for test in tests]
    path = tmp_path / "case.yaml"
    path.write_text(json.dumps({**content, "records": records}), encoding="utf-8")
    case, of_programme = load_case(path), loaded({**content, "tests": tests}).case_of("fit")
    assert case.values() == of_programme.values()
    assert case.recordings == of_programme.recordings


def test_a_case_is_the_programme_of_one_test(loaded):
    content = {key: value for key, value in PROGRAMME.items() if key != "tests"}
    programme = loaded({**content, "test": TEST, "record": RECORD})
    assert programme.tests == ()
    assert programme.case_of("fit").recordings[0].record.file == "up.csv"


@pytest.mark.parametrize(
    ("place", "value", "fault"),
    [
        (("tests", 1, "kind"), "bmp", "tests[1].kind: 'bmp' is not possible; did you mean bump?"),
        (("tests", 1, "name"), "DOWN", "tests[1].name: 'DOWN' is taken by 'down'"),
        (("tests", 3, "name"), "fit", "tests[3].name: 'fit' is taken by a file of every run"),
        (("tests", 3, "name"), "lpt1.a", "tests[3].name: 'lpt1.a' is a device of Windows"),
        (("tests", 3, "name"), "report", "tests[3].name: 'report' is taken by a file of every"),
        (("tests", 3, "free"), {}, "tests[3].free: 0 entries; at least 1 needed"),
        (("tests", 3, "free"), None, "tests[3].free: is missing"),
        (("tests", 3, "free", "Tpd0", "start"), 50.0, "tests[3].free.Tpd0.start: 50 lies outside"),
        (("tests", 3, "free", "Tpdo"), TPD0, "tests[3].free.Tpdo: not a parameter of GENROU"),
        (("tests", 3, "free", "Tpd0", "source"), "maker", "tests[3].free.Tpd0.source: not allowed"),
        (
            ("plant", "parameters", "Xd"),
            {"value": 1.8, "std_error": "x"},
            "plant.parameters.Xd.std_",
        ),
        (("tests", 2, "plant", "network", "X"), {"valu": 1.0}, "tests[2].plant.network.X.valu"),
        (("tests", 1, "free"), {"Tpd0": TPD0}, "tests[1].free: not allowed with this type"),
        (("tests", 2, "plant", "network", "X"), None, "tests[2].plant.network.X: is missing"),
        (("tests", 0, "test", "vref", 0, "at"), "x", "tests[0].test.vref[0].at: 'x' is not a num"),
        (("tests", 0, "record", "channels", "p"), "p", "tests[0].record.channels.p: not allowed"),
        (("parameters", "free", "K", "start"), 1.0, "parameters.free.K.start: 1 lies outside"),
        (("plant", "parameters", "Xd"), -1.0, "plant.parameters.Xd: -1 lies outside"),
        (("record",), RECORD, "record: not allowed with tests"),
        (("records",), [], "records: 0 entries; at least 1 needed"),
        (("tests",), [], "tests: 0 entries; at least 1 needed"),
        (("tests",), "none", "tests: 'none' is not a list"),
    ],
    ids=str,
)
def test_a_fault_is_reported_at_its_place_in_the_programme(loaded, place, value, fault):
    faults = faults_of(loaded, changed(place, value))
    assert [line for line in faults if line.startswith(fault)] == faults


def test_all_faults_of_a_programme_come_together(loaded):
    content = changed(("tests", 3, "free", "Tpd0", "start"), 50.0)
    content["tests"][0]["test"]["vref"][0]["at"] = "x"
    content["plant"]["parameters"]["Xd"] = -1.0
    places = [line.partition(": ")[0] for line in faults_of(loaded, content)]
    assert places == [
        "plant.parameters.Xd", "tests[0].test.vref[0].at", "tests[3].free.Tpd0.start",
    ]  # fmt: skip


def test_a_validation_needs_a_test_that_is_fitted(loaded):
    content = json.loads(json.dumps(PROGRAMME))
    content["tests"] = content["tests"][:1]
    text = "tests[0].use: no bump test is fitted: nothing to validate"
    assert faults_of(loaded, content) == [text]


def test_a_command_for_cases_names_the_one_for_programmes(loaded, tmp_path):
    loaded(PROGRAMME)
    with pytest.raises(CaseError, match=r"tests: makes this a programme .* exfit run runs it"):
        load_case(tmp_path / "unit.yaml")
