"""The section of a steady test: what it may hold, and what contradicts itself in it."""

import pytest

from exfit.case.checks.node import ContentNode
from exfit.features.programme.programme_checks import steady_test_faults
from exfit.features.programme.programme_schema import SteadyTest

COLUMNS = {
    "p": {"column": "MW", "unit": "MW", "base": 120.0},
    "q": {"column": "Mvar", "unit": "Mvar", "base": 120.0},
    "vt": {"column": "kV", "unit": "kV", "base": 13.8},
    "ifd": {"column": "If", "unit": "A", "base": {"start": "auto"}},
}
TEST = {
    "kind": "steady",
    "name": "v-curve",
    "file": "vcurve.csv",
    "columns": COLUMNS,
    "free": {"Xd": {"start": 1.0, "min": 0.5, "max": 2.0}},
}
INLINE = {
    "kind": "steady",
    "name": "v-curve",
    "points": [[0.1, 0.2, 1.0, 1.4], [0.5, 0.0, 1.0, 1.3]],
}


def faults(**changes):
    test = {key: value for key, value in {**TEST, **changes}.items() if value is not None}
    return {
        ".".join(map(str, fault.place)): fault.text
        for fault in steady_test_faults(ContentNode((), test))
    }


def columns(**changes):
    changed = {**COLUMNS, **changes}
    return {"columns": {signal: column for signal, column in changed.items() if column}}


def test_a_file_with_its_columns_and_points_in_place_of_it_are_valid():
    SteadyTest.model_validate(TEST)
    SteadyTest.model_validate(INLINE)
    assert faults() == {}
    assert faults(file=None, columns=None, points=INLINE["points"]) == {}


@pytest.mark.parametrize(
    ("changes", "place", "words"),
    [
        ({"file": None}, "file", "is missing: give a file, or points"),
        ({"points": [[0.0, 0.0, 1.0, 1.0]]}, "file", "not allowed with points"),
        (columns(q=None), "columns.q", "is missing"),
        (columns(ifd=None), "columns.ifd", "is missing: a column of ifd or efd"),
        (columns(vt={"column": "kV", "unit": "kV"}), "columns.vt.base", "what is 1 pu in kV"),
        (columns(vt={"column": "kV", "base": 13.8}), "columns.vt.unit", "in which unit"),
        (columns(p={"unit": "MW", "base": 9.0}), "columns.p.column", "is missing"),
        (
            columns(vt={"column": "kV", "unit": "kV", "base": {"start": "auto"}}),
            "columns.vt.base",
            "must be a number",
        ),
        (columns(ifd={"column": "If", "scale": 0.0}), "columns.ifd.scale", "must not be 0"),
        (
            columns(ifd={"column": "If", "unit": "A", "base": {"start": 600.0}}),
            "columns.ifd.base.min",
            "is missing",
        ),
        (columns(q={"column": "Mvar", "noise": 0.1}), "columns.q.noise", "only allowed for ifd"),
        (
            columns(ifd={"column": "If", "noise": 0.01}, efd={"column": "Uf"}),
            "columns.efd.noise",
            "is missing: the other one has it",
        ),
    ],
)
def test_a_contradiction_is_reported_at_its_place(changes, place, words):
    assert words in faults(**changes)[place]


@pytest.mark.parametrize("row", [[0.1, 0.2, 1.0], [0.1, 0.2, 1.0, 1.4, 1.4, 2.0]])
def test_a_point_in_place_has_four_or_five_numbers(row):
    found = faults(file=None, columns=None, points=[row])
    assert "[p, q, vt, ifd]" in found["points.0"]
