"""Faults of a case and its records that are known before a fit: each is put in and reported."""

import numpy as np
import pytest
import yaml
from places import CONFIGS
from records import write
from step_records import step_record

from exfit.case.case import Case
from exfit.case.load import load_case
from exfit.fitting.build import build_experiments
from exfit.verdict.diagnostics import case_warnings, record_warnings

RECORD = step_record(0, length=5.0)  # of AC1A
COLUMNS = dict(RECORD.table.content)
TIME = COLUMNS["t"]
STEP = {"at": RECORD.at, "step": RECORD.size}
AGAIN = {
    "name": "again",
    "record": {"file": "record.csv", "time": "t", "channels": {"vt": "vt"}},
}


def case_of(folder, step=STEP, record=None, validation=None, validated_at=RECORD.at, **changed):
    """Return the case that the record was made with, with a fault."""
    write(folder / "record.csv", **{**COLUMNS, **changed})
    content = yaml.safe_load((CONFIGS / "models" / "ac1a.yaml").read_text("utf-8"))
    content["test"] = {"vref": [step]}
    channels = {"vt": "vt", "efd": "efd", "ifd": "ifd"}
    content["record"] = {"file": "record.csv", "time": "t", "channels": channels, **(record or {})}
    if validation is not None:
        test = {"vref": [{**STEP, "at": validated_at}]}
        section = {**AGAIN, "test": test, "record": {**AGAIN["record"], **validation}}
        content["validate"] = [section]
    path = folder / "case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return load_case(path)


def warnings(case):
    values = case.values()
    setups = [setup.with_enough_substeps(values) for setup in build_experiments(case)]
    return [*case_warnings(case), *record_warnings(case, setups, values)]


def test_a_sound_case_has_no_warning(tmp_path):
    assert warnings(case_of(tmp_path)) == []


def test_reactances_of_no_machine_are_reported():
    content = yaml.safe_load((CONFIGS / "models" / "ac1a.yaml").read_text("utf-8"))
    content["plant"]["parameters"] |= {"Xpd": 0.3, "Xppd": 0.25, "Xl": 0.26}
    (text,) = case_warnings(Case.from_dict(content))
    assert text == "machine.Xppd: 0.25 is below Xl = 0.26, as in no machine"


FAULTS = {
    "inverted": ({"ifd": -COLUMNS["ifd"]}, ["ifd rests at -1.12 pu", "inverted", "scale: -1"]),
    "mirrored": (
        {"efd": 2.0 * COLUMNS["efd"][0] - COLUMNS["efd"]},
        ["efd moves against the response", "sign of the channel"],
    ),
    "another base": (
        {"efd": COLUMNS["efd"] / 3.0},
        ["efd starts from 1.12 pu, its record from 0.373", "base"],
    ),
    "wrong sign": (
        {"step": {**STEP, "step": -STEP["step"]}},
        ["vt moves against the response", "sign of the step"],
    ),
    "in per cent": (
        {"step": {**STEP, "step": 5.0}, "ifd": COLUMNS["ifd"]},
        ["test.vref[0].step: +5 pu is +500 % of rated voltage", "5 % is 0.05 pu"],
    ),
    "ripple": (
        {"vt": COLUMNS["vt"] + 2e-3 * np.sin(2.0 * np.pi * 12.0 * TIME)},
        ["vt: a ripple of 12 Hz, amplitude 0.002", "sine: {frequency: {start: auto}}"],
    ),
    "not at rest": (
        {"vt": COLUMNS["vt"] + 5e-3 * np.exp(-TIME)},
        ["vt moves by 0.00", "should be at rest"],
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_reported_once_with_what_to_do(tmp_path, fault):
    changes, words = FAULTS[fault]
    (warning,) = warnings(case_of(tmp_path, **changes))
    for word in words:
        assert word in warning


@pytest.mark.parametrize(
    ("fitted", "validated", "common"),
    [
        (None, None, "all of record.csv"),
        ([0.0, 4.0], None, "0 ... 4 s"),
        ([0.0, 4.0], [0.5, 5.0], "0.5 ... 4 s"),
        ([0.0, 2.5], [2.5, 5.0], None),
    ],
)
def test_a_validation_that_sees_what_is_fitted_is_reported(tmp_path, fitted, validated, common):
    validation = {} if validated is None else {"window": validated}
    record = {} if fitted is None else {"window": fitted}
    at = 3.0 if validated == [2.5, 5.0] else RECORD.at
    case = case_of(tmp_path, record=record, validation=validation, validated_at=at)
    texts = list(case_warnings(case))
    assert len(texts) == (common is not None)
    assert all(f"validate again: {common}" in text and "fitted as well" in text for text in texts)


def test_what_the_case_does_about_a_ripple_ends_its_warning(tmp_path):
    vt = COLUMNS["vt"] + 2e-3 * np.sin(2.0 * np.pi * 12.0 * TIME)
    channel = {"column": "vt", "sine": {"frequency": {"start": "auto"}}}
    assert warnings(case_of(tmp_path, record={"channels": {"vt": channel}}, vt=vt)) == []
