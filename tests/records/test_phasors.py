"""Phasors of a PMU as columns per unit, angles that were wrapped, flags of rows."""

import numpy as np
import pytest
from pmu_records import KV, MVA, phasors_of, pmu_columns, smooth_course, write_table

from exfit.case.load import record_section
from exfit.errors import CaseError, RecordError
from exfit.fitting.recordings import read_section
from exfit.records.phasors import AngleError, in_radians, unit_by_range, unwrapped

ROUNDING = 1e-7  # of nine digits in a file
SIGNALS = ("vt", "p", "q")
VOLTAGE = {
    "magnitude": "UNIT1-PM1 (V)",
    "angle": "UNIT1-PA1 (deg)",
    "unit": "V",
    "angle_unit": "deg",
    "connection": "phase-to-ground",
}
CURRENT = {
    "magnitude": "UNIT1-PM2 (A)",
    "angle": "UNIT1-PA2 (deg)",
    "unit": "A",
    "angle_unit": "deg",
}


def section(path, voltage=None, current=None, **changes):
    phasors = {"voltage": voltage or VOLTAGE, "current": current or CURRENT, "kV": KV, "MVA": MVA}
    return {
        "file": str(path),
        "time": "Timestamp (UTC)",
        "phasors": phasors,
        "channels": {signal: f"phasors.{signal}" for signal in SIGNALS},
        **changes,
    }


def read(content, folder):
    return read_section(record_section(content), folder, per_unit=True)


def agree(record, course):
    for signal in SIGNALS:
        assert record.signals[signal] == pytest.approx(getattr(course, signal), abs=ROUNDING)


def test_voltage_and_power_of_phasors_are_those_that_made_them(tmp_path):
    course = smooth_course(slip=0.3)
    record = read(section(write_table(tmp_path / "pmu.csv", pmu_columns(course))), tmp_path)
    agree(record, course)
    assert record.time == pytest.approx(course.time, abs=1e-6)  # timestamps have microseconds


def test_a_voltage_from_phase_to_phase_is_larger_by_the_root_of_three(tmp_path):
    course = smooth_course()
    columns = pmu_columns(course)
    columns["UNIT1-PM1 (V)"] = columns["UNIT1-PM1 (V)"] * np.sqrt(3.0)
    path = write_table(tmp_path / "pmu.csv", columns)
    agree(read(section(path, {**VOLTAGE, "connection": "phase-to-phase"}), tmp_path), course)


def test_of_three_phases_the_positive_sequence_counts(tmp_path):
    course = smooth_course()
    columns = pmu_columns(course)
    a, _ = phasors_of(course)
    turn = np.exp(-2j * np.pi / 3.0)
    negative, zero = 0.03 * np.abs(a), 0.02 * np.abs(a)
    phases = [a * turn**k + negative * np.conj(turn) ** k + zero for k in range(3)]
    for name, phase in zip("ABC", phases, strict=True):
        columns[f"V{name} mag"], columns[f"V{name} ang"] = np.abs(phase), np.angle(phase)
    voltage = {
        "magnitude": ["VA mag", "VB mag", "VC mag"],
        "angle": ["VA ang", "VB ang", "VC ang"],
        "unit": "kV",
        "angle_unit": "rad",
        "connection": "phase-to-ground",
    }
    path = write_table(tmp_path / "pmu.csv", columns)
    agree(read(section(path, voltage), tmp_path), course)


def test_rows_that_their_flags_call_bad_are_refused_with_their_line(tmp_path):
    columns = pmu_columns(smooth_course())
    columns["UNIT1-SF"][30] = "8192"  # 0x2000
    content = section(write_table(tmp_path / "pmu.csv", columns), status={"column": "UNIT1-SF"})
    with pytest.raises(RecordError, match=r"pmu.csv:32: .*'8192'.*not in synchronism with UTC"):
        read(content, tmp_path)


def test_rows_that_their_flags_call_bad_are_missing_where_samples_may_be(tmp_path):
    columns = pmu_columns(smooth_course())
    columns["UNIT1-SF"][30] = "0x8000"
    columns["UNIT1-SF"][40] = "0x0810"  # a trigger: a measurement
    path = write_table(tmp_path / "pmu.csv", columns)
    record = read(section(path, status={"column": "UNIT1-SF"}, gaps="skip"), tmp_path)
    assert [*np.flatnonzero(np.isnan(record.signals["p"]))] == [30]


def test_flags_zero_and_one_need_the_word_which_is_good(tmp_path):
    columns = pmu_columns(smooth_course())
    columns["UNIT1-SF"] = ["1"] * len(columns["UNIT1-SF"])
    path = write_table(tmp_path / "pmu.csv", columns)
    with pytest.raises(RecordError, match=r"the one that means valid under record\.status\.accept"):
        read(section(path, status={"column": "UNIT1-SF"}), tmp_path)
    read(section(path, status={"column": "UNIT1-SF", "accept": [1]}), tmp_path)


@pytest.mark.parametrize(
    ("phasors", "place"),
    [
        ({"voltage": {**VOLTAGE, "connection": None}}, "phasors.voltage.connection: is missing"),
        ({"voltage": {**VOLTAGE, "unit": "A"}}, "phasors.voltage.unit: 'A' is not a unit of"),
        ({"kV": None}, "phasors.kV: is missing"),
        ({"MVA": None}, "phasors.MVA: is missing"),
        ({"current": None}, "phasors.p needs record.phasors.current"),
        ({"voltage": {**VOLTAGE, "angle": ["a", "b", "c"]}}, "phasors.voltage.angle: has 3"),
    ],
)
def test_what_phasors_lack_is_named_with_its_place(tmp_path, phasors, place):
    content = section(tmp_path / "pmu.csv")
    given = {**content["phasors"], **phasors}
    if given["voltage"].get("connection", "") is None:
        given["voltage"] = {k: v for k, v in given["voltage"].items() if k != "connection"}
    content["phasors"] = {key: value for key, value in given.items() if value is not None}
    with pytest.raises(CaseError, match=place.replace(".", r"\.")):
        record_section(content)


def test_a_column_in_another_unit_than_its_phasor_is_refused(tmp_path):
    path = write_table(tmp_path / "pmu.csv", pmu_columns(smooth_course()))
    with pytest.raises(RecordError, match="in V as the file says, not in kV"):
        read(section(path, {**VOLTAGE, "unit": "kV"}), tmp_path)


def test_a_negative_magnitude_is_refused_with_its_line(tmp_path):
    columns = pmu_columns(smooth_course())
    columns["UNIT1-PM1 (V)"] = np.array(columns["UNIT1-PM1 (V)"])
    columns["UNIT1-PM1 (V)"][10] *= -1.0
    path = write_table(tmp_path / "pmu.csv", columns)
    with pytest.raises(RecordError, match=r"pmu.csv:12: .* no magnitude"):
        read(section(path), tmp_path)


# ---- angles

TIME = np.arange(0.0, 10.0, 1.0 / 30.0)
ANGLE = 2.0 * np.pi * 0.4 * TIME + 0.2 * np.sin(TIME)  # rad


def wrapped(angle, turn):
    return (angle + 0.5 * turn) % turn - 0.5 * turn


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2.0 * np.pi)])
@pytest.mark.parametrize("from_zero", [True, False])
def test_a_wrapped_angle_becomes_the_smooth_one_less_whole_turns(unit, turn, from_zero):
    recorded = ANGLE * turn / (2.0 * np.pi)
    recorded = recorded % turn if from_zero else wrapped(recorded, turn)
    smooth = unwrapped(in_radians(recorded, unit))
    turns = (smooth - ANGLE) / (2.0 * np.pi)
    assert np.ptp(turns) < 1e-12
    assert turns[0] == pytest.approx(round(turns[0]), abs=1e-12)


def test_an_angle_that_moves_too_far_between_samples_is_refused_with_its_row():
    angle = np.array(ANGLE)
    angle[40:] += 2.0  # rad
    with pytest.raises(AngleError, match="degrees") as fault:
        unwrapped(angle)
    assert fault.value.row == 40


def test_missing_samples_stay_missing_and_those_beside_them_are_counted_on():
    angle = wrapped(ANGLE, 2.0 * np.pi)
    angle[50:53] = np.nan
    smooth = unwrapped(angle)
    assert np.isnan(smooth[50:53]).all()
    assert smooth[53:] == pytest.approx(ANGLE[53:], abs=1e-12)


def test_the_jumps_of_a_wrapped_angle_show_its_unit():
    assert unit_by_range(wrapped(np.degrees(ANGLE), 360.0)) == "deg"
    assert unit_by_range(wrapped(ANGLE, 2.0 * np.pi)) == "rad"


def test_the_range_of_an_angle_that_is_not_wrapped_shows_nothing():
    assert unit_by_range(np.degrees(ANGLE)) is None
    assert unit_by_range(ANGLE) is None
