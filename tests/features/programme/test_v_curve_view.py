"""Points of V-curves on the terminal and as a figure."""

import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from exfit.features.programme import programme_figures
from exfit.features.programme.programme_blocks import points_table
from exfit.features.programme.programme_blocks import v_curve as blocks_of
from exfit.features.programme.result import VCurve
from exfit.features.programme.v_curve import (
    FieldMeasurement,
    PointsOnLoad,
    field_on_load,
    v_curve,
)
from exfit.fitting.parameters import FreeParameter
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.output import figures as plots
from exfit.output import terminal
from exfit.util.text import to_json
from exfit.util.typed import plain
from exfit.util.typed_reading import read

P, Q = np.repeat([0.1, 0.8], 3), np.tile([-0.3, 0.0, 0.4], 2)
MACHINE = MACHINES["GENSAL"]
DATA = typical(MACHINE.sheet) | {"S10": 0.1, "S12": 0.4}


@pytest.fixture(scope="module")
def result():
    ifd = field_on_load(MACHINE, DATA, P, Q, np.ones(6))
    ifd = ifd + 0.002 * np.array([1.0, -1.0, 0.5, -0.5, 1.0, -1.0])
    points = PointsOnLoad(P, Q, np.ones(6), {"ifd": FieldMeasurement(640.0 * ifd, "A", 640.0)})
    xd = FreeParameter("Xd", 1.0, 0.5, 3.0, logarithmic=True)
    return v_curve(MACHINE, DATA, points, [xd])


def test_the_terminal_shows_every_point_in_eighty_columns(result):
    console = Console(width=80, record=True, file=None, quiet=False)
    with console.capture() as capture:
        terminal.show(console, blocks_of(result))
    lines = capture.get().splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith("verdict: good: ifd differs by 0.00")
    rows = [line.split() for line in lines if line.strip()[:1].isdigit()]
    assert [row[0] for row in rows] == ["1", "2", "3", "4", "5", "6"]
    assert sum("largest" in line for line in lines) == 1
    assert any(line.startswith("Xd ") for line in lines)


def test_a_point_without_field_current_has_no_share(result):
    reading = result.readings["ifd"]
    tiny = replace(reading, measured=np.full(len(P), 1e-320))
    rows = points_table(replace(result, readings={"ifd": tiny})).rows
    assert all("-" in [cell.text for cell in row] for row in rows)


def test_the_figure_has_a_curve_and_points_for_each_power(result):
    figure = programme_figures.v_curve(result, "v-curve")
    above, below = figure.axes
    texts = [text.get_text() for text in above.get_legend().get_texts()]
    assert texts == ["P = 0.10 pu", "P = 0.80 pu", "power factor 1", "measured", "simulated"]
    assert above.get_xlabel() == "field current ifd (pu; 1 pu is 640 A)"
    assert above.get_ylabel() == "stator current it (pu)"
    assert below.get_xlabel() == "reactive power q (pu)"
    assert plots.png(figure).startswith(b"\x89PNG")


def test_the_result_is_read_back_as_it_was_written(result):
    text = to_json(plain(result, whole=True))
    again = read(VCurve, json.loads(text))
    assert to_json(plain(again, whole=True)) == text
