"""Steady tests of a programme: points from a file or in place, in the units of a test sheet."""

from pathlib import Path

import numpy as np
import pytest

from exfit.errors import RecordError
from exfit.features.programme.programme_schema import SteadyTest
from exfit.features.programme.tests_at_rest import points_of, steady
from exfit.features.programme.v_curve import field_on_load
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.results.verdict import NO_MATCH, NOT_CONVERGED

SALIENT = MACHINES["GENSAL"]
DATA = typical(SALIENT.sheet) | {"S10": 0.1, "S12": 0.4}
MVA, KV, AMPERES = 120.0, 13.8, 640.0
P = np.repeat([0.1, 0.5, 0.9], 4)
Q = np.tile([-0.3, 0.0, 0.2, 0.45], 3)
VT = 1.0 + 0.04 * Q
IFD = field_on_load(SALIENT, DATA, P, Q, VT)
COLUMNS = {
    "p": {"column": "P", "unit": "MW", "base": MVA},
    "q": {"column": "Q", "unit": "Mvar", "base": MVA},
    "vt": {"column": "U", "unit": "kV", "base": KV},
    "ifd": {"column": "If", "unit": "A", "base": AMPERES},
}


@pytest.fixture
def folder(tmp_path):
    rows = np.column_stack([P * MVA, Q * MVA, VT * KV, IFD * AMPERES])
    lines = [";".join(f"{number:.4f}".replace(".", ",") for number in row) for row in rows]
    text = "\n".join(["P (MW);Q (Mvar);U (kV);If (A)", *lines])
    (tmp_path / "vcurve.csv").write_text(text, encoding="utf-8")
    return tmp_path


def section_of(**changes):
    section = {"kind": "steady", "name": "v-curve", "file": "vcurve.csv"}
    names = {"p": "P (MW)", "q": "Q (Mvar)", "vt": "U (kV)", "ifd": "If (A)"}
    columns = {signal: {**COLUMNS[signal], "column": name} for signal, name in names.items()}
    return SteadyTest.model_validate({**section, "columns": columns, **changes})


def test_a_file_and_the_same_points_in_place_are_alike(folder):
    rows = np.column_stack([P, Q, VT, IFD]).round(6).tolist()
    in_place = SteadyTest.model_validate({"kind": "steady", "name": "v", "points": rows})
    test = section_of()
    by_file = steady(test, points_of(test, folder), SALIENT, DATA)
    by_numbers = steady(in_place, points_of(in_place, folder), SALIENT, DATA)
    for curve in (by_file, by_numbers):
        assert curve.verdict.verdict == "good"
        assert curve.readings["ifd"].rms < 1e-5
    assert by_file.p == pytest.approx(by_numbers.p, abs=1e-6)


def test_a_base_that_is_not_known_is_found(folder):
    column = {**COLUMNS["ifd"], "column": "If (A)", "base": {"start": "auto"}}
    columns = {**section_of().model_dump(exclude_unset=True)["columns"], "ifd": column}
    test = section_of(columns=columns)
    curve = steady(test, points_of(test, folder), SALIENT, DATA)
    assert curve.parameters["ifd.base"].value == pytest.approx(AMPERES, rel=1e-5)
    assert curve.parameters["ifd.base"].unit == "A"


def test_numbers_of_a_unit_need_a_base(folder):
    columns = {
        **section_of().model_dump(exclude_unset=True)["columns"],
        "ifd": {"column": "If (A)"},
    }
    test = section_of(columns=columns)
    with pytest.raises(RecordError, match=r"ifd: base: is missing: what is 1 pu in A\?"):
        steady(test, points_of(test, folder), SALIENT, DATA)


def test_a_column_in_another_unit_than_the_file_says_is_refused(folder):
    columns = dict(section_of().model_dump(exclude_unset=True)["columns"])
    columns["vt"] = {**columns["vt"], "unit": "V", "base": 13800.0}
    test = section_of(columns=columns)
    with pytest.raises(RecordError, match="in kV as the file says, not in V"):
        points_of(test, folder)


def test_the_file_is_that_of_the_programme(folder):
    with pytest.raises(RecordError, match="cannot be read"):
        points_of(section_of(), Path("nowhere"))


@pytest.mark.parametrize("number", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("signal", COLUMNS)
def test_a_cell_that_is_no_finite_number_is_refused_at_its_place(folder, signal, number):
    path = folder / "vcurve.csv"
    first, *rows = path.read_text(encoding="utf-8").splitlines()
    cells = rows[4].split(";")
    cells[[*COLUMNS].index(signal)] = number
    path.write_text("\n".join([first, *rows[:4], ";".join(cells), *rows[5:]]), encoding="utf-8")
    with pytest.raises(RecordError, match=r"vcurve\.csv:6: column .*: -?(nan|inf) is "):
        points_of(section_of(), folder)


@pytest.mark.parametrize("voltage", [0.0, -1.0])
def test_a_voltage_that_is_not_above_zero_is_refused(voltage):
    rows = np.column_stack([P, Q, VT, IFD])
    rows[3, 2] = voltage
    test = SteadyTest.model_validate({"kind": "steady", "name": "v", "points": rows.tolist()})
    with pytest.raises(RecordError, match=r"point 4: vt .* not above 0"):
        steady(test, points_of(test, Path()), SALIENT, DATA)


def test_as_many_different_points_as_values_determine_none():
    """Their fit has no errors, and its intervals no width."""
    rows = np.column_stack([P, Q, VT, IFD])[[0, 1] * 6].tolist()
    free = {"Xd": {"start": 1.0, "min": 0.5, "max": 3.0}}
    content = {"kind": "steady", "name": "v", "points": rows, "free": free}
    test = SteadyTest.model_validate(content)
    assert steady(test, points_of(test, Path()), SALIENT, DATA).readings["ifd"].matches
    free["Xq"] = {"start": 0.6, "min": 0.3, "max": 2.0}
    test = SteadyTest.model_validate(content)
    with pytest.raises(RecordError, match="2 different points do not determine Xd and Xq: 3 or"):
        steady(test, points_of(test, Path()), SALIENT, DATA)


def test_a_fit_that_ends_beside_data_that_contradict_each_other_has_derivatives():
    """S12 below S10 is no saturation: the errors beyond, and on one side of the end, are none."""
    ifd = [1.55, 1.74, 1.87, 2.17, 2.52, 2.90]
    q, vt = [-0.3, -0.1, 0.0, 0.2, 0.4, 0.6], [0.98, 0.99, 1.0, 1.01, 1.02, 1.03]
    free = {
        "Xd": {"start": 1.9, "min": 1.0, "max": 3.0},
        "S10": {"start": 0.12, "min": 0.01, "max": 0.5},
    }
    rows = np.column_stack([np.zeros(6), q, vt, ifd]).tolist()
    content = {"kind": "steady", "name": "v", "points": rows, "free": free}
    test, machine = SteadyTest.model_validate(content), MACHINES["GENROU"]
    data = typical(machine.sheet) | {"Xd": 1.8, "Xq": 1.72, "Xl": 0.2, "S10": 0.12, "S12": 0.4}
    found = steady(test, points_of(test, Path()), machine, data)
    assert found.machine_data["S10"] == pytest.approx(0.4, rel=1e-3)
    assert found.verdict.verdict in (NO_MATCH, NOT_CONVERGED)
