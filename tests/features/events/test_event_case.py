"""Cases of grid events from the files of phasor measurement units."""

import numpy as np
import pytest
import yaml
from pmu_records import KV, MVA, pmu_columns, smooth_course, write_table

from exfit.case.case_draft import CaseDraft
from exfit.case.load import record_section
from exfit.case.suggestion import RecordSettings, rated_bases
from exfit.features.events.suggestion import event_sections
from exfit.features.start.starting_case import starting_case, unit_with
from exfit.features.start.starting_tests import starting_tests
from exfit.fitting.recordings import read_section
from exfit.util.text import dotted

RATED = rated_bases({}, KV, MVA)


def inspected(folder, **changes):
    columns = {**pmu_columns(smooth_course()), **changes}
    return RecordSettings().inspect(write_table(folder / "event.csv", columns))


def section(inspection, bases):
    draft = CaseDraft(event_sections(inspection, "event.csv", bases))
    return draft, yaml.safe_load(draft.text)["record"]


def test_with_the_ratings_of_the_unit_the_suggested_record_can_be_read(tmp_path):
    draft, content = section(inspected(tmp_path), RATED)
    assert not draft.open_values()
    del content["channels"]["angle"]  # of no plant with a bump test
    record = read_section(record_section(content), tmp_path, per_unit=True)
    assert record.signals["p"][0] == pytest.approx(0.8, abs=1e-6)


def test_the_connection_is_that_of_the_rated_voltage_and_its_comment_says_so(tmp_path):
    draft, content = section(inspected(tmp_path), RATED)
    assert content["phasors"]["voltage"]["connection"] == "phase-to-ground"
    assert "rests at 0.583 = 1.01 / sqrt(3) of the rated kV" in draft.text
    line_to_line = {"UNIT1-PM1 (V)": 1e3 * KV * smooth_course().vt}
    _, content = section(inspected(tmp_path, **line_to_line), RATED)
    assert content["phasors"]["voltage"]["connection"] == "phase-to-phase"


@pytest.mark.parametrize("bases", [{}, rated_bases({}, 2.0 * KV, MVA)])
def test_without_a_fitting_rating_the_connection_is_asked_for(tmp_path, bases):
    draft, _ = section(inspected(tmp_path), bases)
    places = {dotted(value.place) for value in draft.open_values()}
    assert "record.phasors.voltage.connection" in places
    assert ("record.phasors.kV" in places) == (not bases)


def test_a_table_with_an_angle_and_no_reference_is_an_event_too(tmp_path):
    course = smooth_course(slip=0.3)
    columns = {
        "t": course.time,
        "vt": course.vt,
        "angle": np.degrees(course.angle) % 360.0,
        "p": course.p,
        "q": course.q,
    }
    inspection = RecordSettings().inspect(write_table(tmp_path / "event.csv", columns))
    _, content = section(inspection, {})
    assert content["channels"]["angle"] == {"column": "angle", "unit": "deg"}
    assert content["channels"]["p"] == "p"
    del columns["angle"]
    assert not RecordSettings().inspect(write_table(tmp_path / "other.csv", columns)).is_event


def test_spikes_are_left_out_of_what_is_compared_and_not_of_what_drives(tmp_path):
    course, rng = smooth_course(slip=0.3), np.random.default_rng(2)
    columns = {"t": course.time, "vt": course.vt, "p": course.p, "q": course.q}
    for name in ("vt", "p", "q"):
        columns[name] = columns[name] + 1e-5 * rng.standard_normal(len(course.time))
        columns[name][60] += 0.05
    columns["angle"] = np.degrees(course.angle) % 360.0
    _, content = section(RecordSettings().inspect(write_table(tmp_path / "e.csv", columns)), {})
    assert content["channels"]["p"] == {"column": "p", "outliers": 6.0}
    assert content["channels"]["vt"] == "vt"


@pytest.mark.parametrize("moved_by", ["grid", "reference", "line"])
def test_a_frequency_shows_an_event_where_q_falls_as_the_voltage_rises(tmp_path, moved_by):
    """Or where p moves more than q, as behind the loss of a line, and not if a reference moves."""
    course = smooth_course()
    less = 0.8 + (course.p - 0.8) / 3.0
    columns = {
        "t": course.time,
        "vt": course.vt,
        "frequency [Hz]": course.frequency,
        "p": course.p if moved_by == "line" else less,
        "q": 0.3 - course.q if moved_by == "grid" else course.q,
    }
    inspection = RecordSettings().inspect(write_table(tmp_path / "event.csv", columns))
    assert inspection.is_event == (moved_by != "reference")


@pytest.mark.parametrize(
    ("factor", "word"), [(-1.0, "turns against"), (57.3, "times as fast"), (0.01, "times as fast")]
)
def test_an_angle_that_contradicts_the_frequency_beside_it_is_named(tmp_path, factor, word):
    course = smooth_course()
    turned = {
        "UNIT1-PA1 (deg)": factor * np.degrees(0.3 * course.angle),
        "UNIT1-FQ (Hz)": 60.0 + 0.3 * (course.frequency - 60.0),
    }
    assert any(word in finding for finding in inspected(tmp_path, **turned).findings)
    assert not inspected(tmp_path).findings


def test_rows_that_the_flags_call_bad_are_named_with_their_line(tmp_path):
    flags = ["0"] * 700 + ["0x8000"] * 20
    (finding,) = inspected(tmp_path, **{"UNIT1-SF": flags}).findings
    assert "20 rows are not valid" in finding
    assert "event.csv:702: 0x8000, data error" in finding


def test_a_case_of_an_event_has_no_test_and_plays_its_record_back(tmp_path):
    tests = starting_tests([inspected(tmp_path)], {}, RATED)
    text = starting_case(unit_with("AC8B", None, None, tmp_path), tests, tmp_path).text
    content = yaml.safe_load(text)
    assert content["plant"]["type"] == "grid-playback"
    assert content["plant"]["network"]["f0"] == 60
    assert "test" not in content
    assert content["record"]["channels"]["vt"] == "phasors.vt"
