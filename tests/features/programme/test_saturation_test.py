"""A saturation test of a programme: its section, its points, and what it gives the machine."""

from pathlib import Path

import numpy as np
import pytest

from exfit.case.checks.node import ContentNode
from exfit.errors import RecordError
from exfit.features.programme.programme_checks import saturation_test_faults
from exfit.features.programme.programme_schema import SaturationTest
from exfit.features.programme.tests_at_rest import points_of, saturation
from exfit.models.machines import MACHINES

BASE, RATED = 850.0, 15.75  # A, kV
VT = np.concatenate([np.linspace(0.2, 1.2, 9), np.linspace(1.1, 0.2, 7)])
IFD = BASE * (VT + 2.0 * np.maximum(VT - 0.8, 0.0) ** 2)
SHUFFLED = np.random.default_rng(1).permutation(IFD)
COLUMNS = {
    "vt": {"column": "Ug", "unit": "kV", "base": RATED},
    "ifd": "If (A)",
    "efd": {"column": "Uf", "unit": "V"},
}


def section(**keys):
    return SaturationTest.model_validate({"kind": "saturation", "name": "saturation", **keys})


@pytest.fixture
def file(tmp_path):
    rows = zip(RATED * VT, IFD, 0.2 * IFD, strict=True)
    lines = ["Ug;If (A);Uf", *(f"{vt:.6f};{ifd:.6f};{efd:.6f}" for vt, ifd, efd in rows)]
    path = tmp_path / "saturation.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def test_a_file_without_a_time_gives_the_machine_its_saturation_and_the_channels_their_bases(file):
    test = section(file=file.name, columns=COLUMNS)
    result = saturation(test, points_of(test, file.parent), MACHINES["GENROU"])
    values, bases = result.machine_values, result.channel_bases
    # of the file's six digits after the point
    assert values["S10"].value == pytest.approx(2.0 * 0.2**2, abs=1e-4)
    assert values["S12"].value == pytest.approx(2.0 * 0.4**2 / 1.2, abs=1e-4)
    assert bases["ifd"][0].value == pytest.approx(BASE, rel=1e-5)
    assert bases["efd"][0].value == pytest.approx(0.2 * BASE, rel=1e-5)
    assert (bases["ifd"][1], bases["efd"][1]) == ("A", "V")


@pytest.mark.parametrize("efd", [0.0 * IFD, 0.0 * IFD + 40.0, -0.2 * IFD, SHUFFLED])
def test_a_field_voltage_that_does_not_rise_with_its_current_gives_no_base(efd):
    test = section(points=np.column_stack([VT, IFD, efd]).tolist())
    result = saturation(test, points_of(test, Path()), MACHINES["GENROU"])
    assert result.efd_base is result.resistance is None
    assert "efd" not in result.channel_bases
    assert any("efd does not rise with ifd" in note for note in result.notes)
    assert result.machine_values["S10"].value == pytest.approx(2.0 * 0.2**2, abs=1e-4)


@pytest.mark.parametrize("level", [1.0, 300.0, 1e12])
def test_a_field_current_that_stays_the_same_gives_no_resistance(level):
    ifd = level + 0.0 * IFD
    test = section(points=np.column_stack([VT, ifd, 0.2 * IFD]).tolist())
    assert saturation(test, points_of(test, Path()), MACHINES["GENROU"]).resistance is None


def test_points_in_place_are_the_same_as_in_a_file(file):
    in_file = section(file=file.name, columns=COLUMNS)
    rows = [[float(vt), float(ifd)] for vt, ifd in zip(VT, IFD, strict=True)]
    in_place = section(points=rows)
    curves = [
        saturation(test, points_of(test, file.parent), None).curve for test in (in_file, in_place)
    ]
    assert curves[0].S12.value == pytest.approx(curves[1].S12.value, rel=1e-4)


@pytest.mark.parametrize(
    ("machine", "form"),
    [("GENROU", "quadratic"), ("GENSAL", "quadratic"), ("GENROE", "exponential"),
     ("GENSAE", "exponential"), ("ONE_AXIS", "quadratic")],
)  # fmt: skip
def test_the_form_is_that_of_the_machine_unless_another_is_given(machine, form):
    assert MACHINES[machine].saturation == form


def test_a_brushless_unit_gives_the_machine_nothing(file):
    test = section(file=file.name, columns=COLUMNS, brushless=True, form="exponential-se")
    result = saturation(test, points_of(test, file.parent), MACHINES["GENROU"])
    assert result.form == "exponential-se"
    assert (result.machine_values, result.channel_bases) == ({}, {})


def test_a_unit_of_the_file_needs_a_base(tmp_path):
    path = tmp_path / "points.csv"
    lines = [f"{RATED * vt:.4f},{ifd:.4f}" for vt, ifd in zip(VT, IFD, strict=True)]
    path.write_text("\n".join(["Ug (kV),If (A)", *lines]), encoding="utf-8")
    test = section(file=path.name, columns={"vt": "Ug (kV)", "ifd": "If (A)"})
    with pytest.raises(RecordError, match="what is 1 pu in kV"):
        saturation(test, points_of(test, tmp_path), None)


@pytest.mark.parametrize(
    ("content", "place", "text"),
    [
        ({}, ("file",), "give a file, or points"),
        ({"file": "a.csv", "columns": {"vt": "Ug"}}, ("columns", "ifd"), "is missing"),
        ({"points": [[0.2, 1.0]], "file": "a.csv"}, ("file",), "not allowed with points"),
        ({"points": [[0.2, 1.0], [0.3]]}, ("points", 1), "1 numbers"),
        ({"points": [[0.2, 1.0], [0.3, 1.0, 2.0]]}, ("points", 1), "the first point has 2"),
        ({"points": [[0.2, 1.0]], "columns": {"vt": {"unit": "kV"}}}, ("columns", "vt", "base"),
         "what is 1 pu in kV"),
        ({"points": [[0.2, 1.0]], "columns": {"ifd": {"base": 3.0}}}, ("columns", "ifd", "base"),
         "the test measures it"),
        ({"points": [[0.2, 1.0]], "winding": {"hot": 100.0}}, ("winding", "temperature"),
         "is missing"),
        ({"points": [[0.2, 1.0]], "winding": {"hot": 100.0, "temperature": 20.0},
          "brushless": True}, ("winding",), "not allowed with brushless"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_in_a_section_is_named_at_its_place(content, place, text):
    faults = [*saturation_test_faults(ContentNode((), content))]
    assert [fault.place for fault in faults if text in fault.text] == [place]
    assert len(faults) == 1
