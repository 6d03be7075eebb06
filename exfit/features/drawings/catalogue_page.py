"""Models on a page: their block diagrams, and a step of the exciters' typical data."""

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path

import numpy as np

from exfit.features.drawings.diagram import block_diagram, document
from exfit.features.drawings.letters import diagram_and_remarks
from exfit.models import GOVERNORS
from exfit.models.machines import MACHINES, Machine
from exfit.models.sheet import Model, typical
from exfit.plants import MACHINE, SATURATION, VT0
from exfit.plants.alone import alone
from exfit.plants.open_circuit import open_circuit
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
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>exfit: the models</title>
<style>
body {{ font: 16px sans-serif; max-width: 60rem; margin: auto; padding: 1rem }}
img {{ max-width: 100% }}
.diagram {{ display: block }}
.wide {{ overflow-x: auto }}
@media print {{ .diagram {{ max-width: 100%; height: auto }} }}
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
    "Each exciter with its typical data on open circuit (GENROU, T'd0 6 s, saturation 0.12 and "
    "0.4), from 1.0 pu, the reference stepped up by 0.05 pu at 1 s."
)


def sample_response(model: Model) -> Response:
    """Simulate a model with its typical data, given a step of 5 %."""
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


def write_overview(folder: Path, models: Iterable[Model | Machine]) -> list[Path]:
    """Write the diagram of every model, a figure of every exciter, and a page that shows them."""
    from exfit.output import figures as plots

    written, sections = [], []
    for model in models:
        sections.append(f"<h2>{escape(model.name)}: {escape(model.title)}</h2>")
        files: dict[str, str | bytes] = {}
        diagram = block_diagram(model.drawing, model.name, model.title)
        if diagram:
            files[f"{model.name}.svg"] = document(diagram)
            sections.append(f'<div class="wide" tabindex="0">{diagram}</div>')
        _, remarks = diagram_and_remarks(model.drawing)
        sections += [f"<p>{escape(remark)}</p>" for remark in remarks]
        if isinstance(model, Model) and not model.inputs and model.name not in GOVERNORS:
            figure = plots.overview(f"{model.name}: {model.title}", sample_response(model))
            files[f"{model.name}.png"] = plots.png(figure)
            picture = f'<img src="{model.name}.png" alt="Response of {model.name}">'
            sections.append(f"<p>{picture}</p>")
        for name, content in files.items():
            write(folder / name, content)
            written.append(folder / name)
    page = PAGE.format(about=escape(ABOUT), models="\n".join(sections))
    write(folder / "index.html", page)
    return [*written, folder / "index.html"]
