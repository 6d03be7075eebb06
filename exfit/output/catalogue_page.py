"""Every model of the catalogue on a page: its drawing, and a step of its typical data."""

from collections.abc import Mapping
from html import escape
from pathlib import Path

import numpy as np

from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import Model, typical
from exfit.plants import MACHINE, SATURATION, VT0, alone, open_circuit
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Response, Simulator
from exfit.util.files import write

MACHINE_DATA: Mapping[str, float] = {
    "Tpd0": 6.0, "Tppd0": 0.035, "Xd": 1.8, "Xpd": 0.3, "Xppd": 0.25, "Xl": 0.2,
    "S10": 0.12, "S12": 0.4,
}  # fmt: skip
WITHOUT_PLANT = ("FIRST_ORDER",)
STEP = InputStep(1.0, 0.05)
SECONDS = 10.0
SAMPLES = 2001
GRID = 0.001  # s

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>exfit: the models</title>
<style>
body {{ font: 16px sans-serif; max-width: 60rem; margin: auto }}
img {{ max-width: 100% }}
</style>
</head>
<body>
<h1>The models of exfit</h1>
<p>{about}</p>
{models}
</body>
</html>
"""
ABOUT = (
    "Each with its typical data on open circuit (GENROU, T'd0 6 s, saturation 0.12 and 0.4), "
    "from 1.0 pu, the reference stepped up by 0.05 pu at 1 s."
)


def sample_response(model: Model) -> Response:
    """Return the response of a model with its typical data to a step of 5 %."""
    inputs, times = Inputs(0.0, SECONDS, (STEP,)), np.linspace(0.0, SECONDS, SAMPLES)
    if model.name in WITHOUT_PLANT:
        values = {**typical(model.sheet), VT0: 1.0}
        return Simulator(alone(model), inputs, times, GRID).response(values)
    machine = MACHINES["GENROU"]
    of_machine = {**typical(machine.sheet), **MACHINE_DATA}
    values = {**typical(model.sheet), VT0: 1.0}
    values |= {MACHINE + symbol: value for symbol, value in of_machine.items()}
    system = open_circuit(model, machine, SATURATION["quadratic"])
    return Simulator(system, inputs, times, GRID).with_enough_substeps(values).response(values)


def write_overview(folder: Path) -> list[Path]:
    """Write a figure of every model, and a page that shows them all; return what was written."""
    from exfit.output import plots

    written, sections = [], []
    for model in MODELS.values():
        title = f"{model.name}: {model.title}"
        figure = plots.overview(title, model.drawing, sample_response(model))
        written.append(folder / f"{model.name}.png")
        write(written[-1], plots.png(figure))
        sections.append(f'<p><img src="{model.name}.png" alt="{escape(title)}"></p>')
    page = PAGE.format(about=escape(ABOUT), models="\n".join(sections))
    write(folder / "index.html", page)
    return [*written, folder / "index.html"]
