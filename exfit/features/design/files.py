"""The files of a planned test: what it would show; of a designed one its sheet for the plant."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from exfit.case.case_draft import CaseDraft
from exfit.features.design.designed_test import DesignedTest
from exfit.features.design.experiment_design import Design
from exfit.output.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.output.run_folder import figures_of_uncertainty
from exfit.results.tables import effects_table
from exfit.util.file_names import SENSITIVITIES
from exfit.util.files import write_together
from exfit.util.text import to_json

DESIGN, DESIGNED_TEST = "identify.json", "designed_test.json"
SHEET, STEPS, SECTION = "test_sheet.txt", "test_sheet.csv", "test_section.yaml"
FILES = (DESIGN, SENSITIVITIES, DESIGNED_TEST, SHEET, STEPS, SECTION)
NAMES = {"vt": "terminal voltage vt", "efd": "field voltage efd"}


def write_design(design: Design, folder: Path) -> FigureFiles:
    """Write what a planned test would show as JSON, its sensitivities as CSV; return figures."""
    numbers = {
        SENSITIVITIES: effects_table(design.own.effects),
        DESIGN: to_json(design.as_json()),
    }
    write_together(folder, numbers, ["sensitivity.png", "correlation.png"])
    return FigureFiles.beside(
        folder / DESIGN, partial(figures_of_uncertainty, design.own, design.name)
    )


def write_designed_test(design: DesignedTest, folder: Path) -> FigureFiles:
    """Write a designed test as JSON, its sheet and its section of a case; return its figure."""
    numbers = {
        SHEET: sheet_text(design),
        STEPS: sheet_table(design),
        SECTION: case_section(design),
        DESIGNED_TEST: to_json(design.as_json()),
    }
    write_together(folder, numbers, ["designed_test.png"])
    return FigureFiles.beside(folder / DESIGNED_TEST, partial(_figure, design))


def _figure(design: DesignedTest) -> PlannedFigures:
    from exfit.features.design import figure

    shows = "the reference, vt and efd of the designed test, with limits"
    return {"designed_test.png": PlannedFigure(shows, partial(figure.designed_test, design))}


def sheet_text(design: DesignedTest) -> str:
    """Write the sheet for the people at the plant: steps, channels, limits."""
    return "\n".join([f"Test sheet: {design.name}", "", *sheet_lines(design), ""])


def sheet_lines(design: DesignedTest) -> Iterator[str]:
    """Yield the lines of the sheet, none wider than 80 characters."""
    best = design.best
    yield f"{'at (s)':>8}  {'step (pu)':>10}  {'reference from its start (pu)':>30}"
    level = 0.0
    for step in best.steps:
        level += step.step
        yield f"{step.at:8.4g}  {step.step:+10.5f}  {level:+30.5f}"
    yield ""
    yield f"start       at rest, vt = {design.vt0:.4g} pu, all limiters out of reach"
    yield f"record      {', '.join(best.channels)} and the reference, to {best.duration:g} s,"
    yield f"            {design.rate:.6g} samples a second, in one file, with the times of steps"
    yield f"allowed     reference within {design.limits.of_vref:g} pu of its start"
    for signal, (low, high) in design.extremes.items():
        yield f"{'planned' if signal == 'vt' else '':<12}{_extreme(design, signal, low, high)}"
    for number, (signal, (low, high)) in enumerate(design.other_values.extremes.items()):
        if number == 0:
            spread = 100.0 * design.other_values.spread
            yield f"sensitivity with each parameter {spread:g} % off, in turn:"
        yield f"            {NAMES[signal]} {low:.4f} ... {high:.4f} pu"
    back = -level
    if abs(back) > 0.0:
        yield f"after it    return the reference to its start: {back:+.5f} pu"


def _extreme(design: DesignedTest, signal: str, low: float, high: float) -> str:
    limits = design.limits
    if signal == "vt":
        ends = (design.vt0 - limits.vt, design.vt0 + limits.vt)
        return f"{NAMES[signal]} {low:.4f} ... {high:.4f} pu; limits {ends[0]:.4f}, {ends[1]:.4f}"
    given = [
        f"{word} {limits.given[name]:g}"
        for word, name in (("at least", "efd_min"), ("at most", "efd"))
        if name in limits.given
    ]
    limit = f"limits {', '.join(given)}" if given else "no limit but the model's"
    return f"{NAMES[signal]} {low:.4f} ... {high:.4f} pu; {limit}"


def sheet_table(design: DesignedTest) -> str:
    """Return the steps as CSV: times in s, sizes and levels of the reference per unit."""
    rows, level = ["at_s,step_pu,reference_from_start_pu\n"], 0.0
    for step in design.best.steps:
        level += step.step
        rows.append(f"{step.at:.9g},{step.step:.9g},{level:.9g}\n")
    return "".join(rows)


def case_section(design: DesignedTest) -> str:
    """Write the section ``test`` of a case file that makes this test."""
    channels = ", ".join(design.best.channels)
    steps = [{"at": _digits(step.at), "step": _digits(step.step)} for step in design.best.steps]
    test = {"vt0": _digits(design.vt0), "duration": _digits(design.best.duration), "vref": steps}
    return CaseDraft(
        {"test": test},
        (f"the test that determines {', '.join(design.of)} best; record {channels}",),
    ).text


def _digits(value: float) -> float:
    return float(f"{value:.9g}")
