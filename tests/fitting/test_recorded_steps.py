"""Steps that the record itself gives: start: auto."""

import json

import numpy as np
import pytest
from cases import FIRST_ORDER, TRUTH
from cases import TIME as SECONDS
from records import SAMPLES, STEP, TEST, TIME, case_of, config, found_in, one, synthetic, write

from exfit.case.case import Case
from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiments
from exfit.records.record import Record
from exfit.workflows import fit

REFERENCE = SAMPLES.parent / "tests" / "reference"
NAMES = {"kP": "KPR", "kI": "KIR", "kD": "KDR", "Td": "TDR"}  # as the reference calls them
UNITS = {"ac1a": "ac1a_typical", "ac8b_unit1": "ac8b_unit1", "ac8b_unit2": "ac8b_unit2"}


@pytest.mark.parametrize("direction", STEP)
@pytest.mark.parametrize("unit", UNITS)
def test_auto_starts_where_the_record_shows_the_step(tmp_path, unit, direction):
    content = config(UNITS[unit])
    content["record"]["file"] = str(SAMPLES / f"{unit}_{direction}.csv")
    content["test"] = {"vref": [{"at": {"start": "auto"}, "step": {"start": "auto"}}]}
    at, step = build_experiments(case_of(content, tmp_path))[0].free
    assert (at.name, step.name) == ("vref.at", "vref.step")
    assert at.low < at.start < at.high
    assert step.low < step.start < step.high
    assert at.start == pytest.approx(1.0, abs=0.1)
    # vt of an AC8B settles slowly: in 10 s it is still off by 5 %
    assert step.start == pytest.approx(STEP[direction], rel=0.06)


@pytest.mark.long
@pytest.mark.parametrize("direction", STEP)
@pytest.mark.parametrize("unit", UNITS)
def test_auto_ends_where_other_starts_end(tmp_path, unit, direction):
    """Of the unit as it was simulated; the step down of an AC8B began before it had settled."""
    content = {**config(UNITS[unit]), "validate": []}
    truth = json.loads((REFERENCE / f"reference_{unit}.json").read_text())["params_in_effect"]
    known = {NAMES.get(key, key): value for key, value in truth.items()}
    free = content["parameters"].pop("free")
    content["parameters"]["fixed"] |= {name: known[name] for name in [*free, "KA"]}
    content["record"]["file"] = str(SAMPLES / f"{unit}_{direction}.csv")
    size = STEP[direction]
    ends = []
    for at, step in (
        ({"start": "auto"}, {"start": "auto"}),
        (found_in(1.1, 0.7, 1.3), found_in(0.7 * size, *sorted((0.5 * size, 1.5 * size)))),
    ):
        content["test"] = {"vref": [{"at": at, "step": step}], "steady_until": 0.7}
        found = fit(case_of(content, tmp_path))
        ends.append((found.values["vref.at"], found.values["vref.step"] / size))
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)
    if unit == "ac1a" or direction == "up":
        assert ends[0][0] == pytest.approx(1.0, abs=1e-3)
        assert ends[0][1] == pytest.approx(1.0, abs=2e-3)


def test_auto_finds_the_step_beside_gaps_and_masked_stretches(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    shown[30:40], shown[200:210] = np.nan, 1e3
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    test = {"vref": [{"at": {"start": "auto"}, "step": {"start": "auto"}}]}
    case = case_of(one(test, gaps="skip", mask=[[2.0, 2.1]]), tmp_path)
    at, _ = build_experiments(case)[0].free
    assert at.start == pytest.approx(1.0, abs=0.1)


def test_auto_keeps_the_bounds_that_are_given(tmp_path):
    synthetic(tmp_path, TEST, TIME)
    test = {"vref": [{"at": {"start": "auto", "min": 0.5, "max": 1.5}, "step": 0.05}]}
    (at,) = build_experiments(case_of(one(test), tmp_path))[0].free
    assert (at.low, at.high) == (0.5, 1.5)
    test["vref"][0]["at"] = {"start": "auto", "min": 3.0}
    with pytest.raises(CaseError, match=r"test\.vref\[0\]\.at: the record shows .* outside 3"):
        build_experiments(case_of(one(test), tmp_path))


def test_auto_refuses_a_record_without_a_step_and_one_whose_step_comes_after_the_next(tmp_path):
    write(tmp_path / "record.csv", t=TIME, vt=np.ones_like(TIME))
    auto = {"at": {"start": "auto"}, "step": {"start": "auto"}}
    with pytest.raises(RecordError, match=r"record\.csv: .*test\.vref\[0\] has start: auto"):
        build_experiments(case_of(one({"vref": [auto]}), tmp_path))
    synthetic(tmp_path, {**TEST, "vref": [{"at": 3.0, "step": 0.05}]}, TIME)
    test = {"vref": [auto, {"at": 2.0, "step": 0.01}]}
    with pytest.raises(CaseError, match=r"test\.vref\[1\]\.at: 2 s is not after"):
        build_experiments(case_of(one(test), tmp_path))


def test_the_voltage_at_rest_starts_at_its_mean_and_is_found_with_an_error(tmp_path):
    """Its error is at most that of the mean before the step: 100 samples."""
    noise = 1e-3
    shown = synthetic(tmp_path, TEST, TIME, noise=noise)
    content = one({**TEST, "vt0": {"start": "auto"}}, free=["TE"])
    case = case_of(content, tmp_path)
    vt0 = build_experiments(case)[0].free[0]
    mean = float(np.mean(shown["vt"][TIME < 1.0]))
    assert (vt0.name, vt0.start) == ("vt0", pytest.approx(mean, abs=1e-9))
    assert (vt0.low, vt0.high) == (pytest.approx(0.98 * mean), pytest.approx(1.02 * mean))
    found = fit(case).parameters["vt0"]
    assert 0.0 < found.std_error < 1.2 * noise / np.sqrt(100)
    assert abs(found.value - 1.0) < 4.0 * found.std_error


def test_the_voltage_at_rest_keeps_the_bounds_that_are_given(tmp_path):
    synthetic(tmp_path, TEST, TIME)
    test = {**TEST, "vt0": {"start": "auto", "min": 0.9, "max": 1.1}}
    (vt0,) = build_experiments(case_of(one(test), tmp_path))[0].free
    assert (vt0.low, vt0.high) == (0.9, 1.1)
    test["vt0"]["min"] = 1.05
    with pytest.raises(CaseError, match=r"test\.vt0: the record shows .* outside 1\.05"):
        build_experiments(case_of(one(test), tmp_path))


def test_a_voltage_of_zero_at_rest_needs_the_bounds_of_the_case():
    """A share of zero on each side of it is no interval."""
    record = Record.from_arrays(SECONDS, {"vt": TRUTH})
    content = {**FIRST_ORDER, "test": {**FIRST_ORDER["test"], "vt0": {"start": "auto"}}}
    with pytest.raises(CaseError, match=r"test\.vt0: the record shows 0, .*: give min and max"):
        build_experiments(Case.from_dict(content, record))
    content["test"]["vt0"] |= {"min": -0.1, "max": 0.1}
    assert abs(fit(Case.from_dict(content, record)).parameters["vt0"].value) < 1e-6
