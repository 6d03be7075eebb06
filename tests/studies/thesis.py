"""The thesis that exfit began with, made again: its ten tables, its figures, its Jacobian.

    python tests/studies/thesis.py

fits the sample records from the thesis' starts by the thesis' methods, draws its figures to
docs/img and writes docs/thesis.md. It takes less than a minute. What the thesis prints stands in
tests/support/thesis_numbers.py; the text of the page in the template beside this file.
"""

import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import jinja2
import numpy as np
import yaml
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import thesis_figures as figures
import thesis_tables as tables
from gallery import same
from places import ROOT, SAMPLES
from small_svg import small_svg
from thesis_figures import Curve, Panel
from thesis_numbers import (
    APPROXIMATE,
    COSTS,
    DGN,
    FIRST_A,
    FIRST_K,
    INSTANTS,
    LM,
    LM_DGN,
    TOOLBOX,
    A,
    K,
)
from thesis_runs import (
    MOST_ITERATIONS,
    THESIS,
    first_order_fit,
    fits_of,
    gradient_ratios,
    jacobians_at,
    replays,
    simulated_twice,
)

import exfit
from exfit.models import MODELS
from exfit.output.figures.style import SIMULATED, START

PAGE = ROOT / "docs" / "thesis.md"
FOLDER = PAGE.parent / "img"
TEMPLATE = Path(__file__).with_suffix(".md.jinja")

# figures of a case: its start, then what each method came to
RESPONSES = {
    "ac1a_typical": ("4.3", {TOOLBOX: "4.6", DGN: "4.8", LM: "4.9", LM_DGN: "4.10"}),
    "ac1a_good": ("4.11", {TOOLBOX: "4.14", DGN: "4.15"}),
    "ac1a_low": ("4.16", {LM: "4.17", LM_DGN: "4.18"}),
    "ac1a_high": ("4.19", {LM: "4.20", LM_DGN: "4.21"}),
    "ac8b_unit1": ("4.23", {TOOLBOX: "4.27", DGN: "4.31"}),
    "ac8b_unit2": ("4.24", {TOOLBOX: "4.30", DGN: "4.32"}),
}
TOOLBOX_RUNS = {
    "4.4": "ac1a_typical",
    "4.12": "ac1a_good",
    "4.25": "ac8b_unit1",
    "4.28": "ac8b_unit2",
}
DIAGRAMS = {"3.1": "FIRST_ORDER", "4.2": "AC1A", "4.22": "AC8B"}


def responses_of(name: str) -> Figure:
    """Return the response to the start of a case, and those that each method ends with."""
    start, by_method = RESPONSES[name]
    fits = fits_of(name).by_method
    first = next(iter(fits.values()))
    return figures.responses(
        [
            figures.start_panel(f"{start} start", first),
            *(
                figures.fit_panel(f"{number} {tables.METHODS[method]}", fits[method])
                for method, number in by_method.items()
            ),
        ]
    )


def costs_and_steps() -> Figure:
    """Return f and the step size of the toolbox' searches."""
    searches = {
        f"{number} {fits_of(name).by_method[TOOLBOX].strategy}": fits_of(name).by_method[TOOLBOX]
        for number, name in TOOLBOX_RUNS.items()
    }
    return figures.costs_and_steps(searches)


def trajectories() -> Figure:
    """Return the parameters over the iterations of the toolbox' search in case 1."""
    result = fits_of("ac1a_typical").by_method[TOOLBOX]
    return figures.trajectories(f"4.7 AC1A, {result.strategy}", result)


def jacobian() -> Figure:
    """Return the fit of k/(s + a), and its Jacobian beside that of the thesis."""
    result = first_order_fit()
    match = result.comparison
    overlay = match.overlays["vt"]
    assert overlay.start is not None
    panel = Panel(
        f"k/(s + a) from k = {FIRST_K:g}, a = {FIRST_A:g}",
        figures.measured_of(match),
        [Curve("start values", match.time, overlay.start, START), figures.simulated_of(match)],
        begin=0.0,
        end=3.0,
    )
    printed = np.column_stack([np.array(text.split(), dtype=float) for text in APPROXIMATE])
    return figures.jacobian(panel, np.array(INSTANTS), jacobians_at(K, A).differences, printed)


def simulators() -> Figure:
    """Return ANDES and exfit with the same values beside the record."""
    panels = []
    for number, name in tables.SHOWN.items():
        simulated = simulated_twice(name)
        time, (measured, ours) = simulated.exfit.time, simulated.exfit.values
        panels.append(
            Panel(
                f"{number} values of {tables.values_of(name)}",
                Curve("measured", time, measured),
                [
                    Curve("exfit", time, ours, SIMULATED),
                    Curve("ANDES", time, simulated.andes.values[1], START, "--"),
                ],
            )
        )
    return figures.responses(panels)


def validation() -> Figure:
    """Return the record up and down, the fit of the step up, and its replay on the step down."""
    result = fits_of("ac8b_unit1").default
    up, down = (
        exfit.read_record(SAMPLES / f"ac8b_unit1_{way}.csv", "t", {"vt": "vt"})
        for way in ("up", "down")
    )
    both = Curve(
        "measured",
        np.append(up.time, up.time[-1] + down.time),
        np.append(up.signals["vt"], down.signals["vt"]),
    )
    panels = [
        Panel("4.37 the record", both, [], begin=0.0, end=float(both.time[-1])),
        figures.fit_panel("4.38 step up, fitted", result),
    ]
    for label, match in list(replays("ac8b_unit1", result).items())[:3:2]:
        panels.append(
            Panel(
                f"4.39 step down, {label}, f = {match.cost:.2e}",
                figures.measured_of(match),
                [figures.simulated_of(match)],
            )
        )
    return figures.responses(panels)


PICTURES: Mapping[str, Callable[[], Figure]] = {
    "jacobian": jacobian,
    **{name: lambda name=name: responses_of(name) for name in RESPONSES},
    "costs_and_steps": costs_and_steps,
    "trajectories": trajectories,
    "simulators": simulators,
    "validation": validation,
}


def numbers_of(picture: str) -> str:
    """Return the figures of the thesis that a picture holds."""
    own = {
        "jacobian": ["3.1"],
        "costs_and_steps": list(TOOLBOX_RUNS),
        "trajectories": ["4.7"],
        "simulators": list(tables.SHOWN),
        "validation": ["4.37", "4.38", "4.39"],
    }
    if picture in own:
        return ", ".join(own[picture])
    start, by_method = RESPONSES[picture]
    return ", ".join([start, *by_method.values()])


def image(picture: str) -> str:
    """Return a picture as the page shows it."""
    numbers = numbers_of(picture)
    return f"![figure{'s' if ',' in numbers else ''} {numbers}](img/thesis_{picture}.svg)"


def diagram(number: str) -> str:
    """Return the block diagram of a model, as its page has it."""
    drawing, _, _ = MODELS[DIAGRAMS[number]].drawing.strip("\n").partition("\n\n")
    return f"```text\n{drawing}\n```"


def page() -> str:
    """Return the page."""
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    environment.filters["sci"] = tables.scientific
    environment.filters["abs_max"] = lambda values: float(np.max(np.abs(values)))
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    return template.render(
        tables=tables,
        image=image,
        diagram=diagram,
        fits=fits_of,
        settings=yaml.safe_dump({"estimate": THESIS}, sort_keys=False).strip(),
        most_iterations=MOST_ITERATIONS,
        costs=COSTS,
        jacobians=jacobians_at,
        gradient_ratios=gradient_ratios,
        simulated=simulated_twice,
    )


def drawn(picture: str) -> bytes:
    """Return a picture as the bytes of its file."""
    return small_svg(PICTURES[picture]())


def write() -> None:
    """Write the page and its pictures; one that has hardly changed stays as it is."""
    for picture in PICTURES:
        path, content = FOLDER / f"thesis_{picture}.svg", drawn(picture)
        if not (path.exists() and same(path.read_bytes(), content)):
            path.write_bytes(content)
            print(f"{path.relative_to(ROOT)}: {len(content) / 1e3:.0f} kB")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    write()
