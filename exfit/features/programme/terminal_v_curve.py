"""Points of V-curves on the terminal: measured beside the model, and what was fitted."""

from collections.abc import Iterator

from rich.console import Console
from rich.table import Table

from exfit.features.programme.v_curve_result import VCurve
from exfit.results.model import FittedParameter
from exfit.show.terminal.terminal import (
    interval,
    notes,
    number,
    paragraph,
    plain_table,
    show_table,
    unresolved,
)
from exfit.signals import TERMINALS


def v_curve(console: Console, result: VCurve) -> None:
    """Show the verdict, each point with its field by record and model, and what was fitted."""
    paragraph(console, f"verdict: {result.verdict.sentence}")
    console.print()
    show_table(console, points_table(result))
    if result.parameters:
        console.print()
        show_table(console, parameters_table(result))
    if result.undetermined or result.notes or result.verdict.causes:
        console.print()
    unresolved(console, result.undetermined)
    notes(console, (*(cause.sentence for cause in result.verdict.causes), *result.notes))


def points_table(result: VCurve) -> Table:
    """Return the points: power, voltage, and each field signal, measured and simulated."""
    fields = [
        f"{signal} {words}"
        for signal in result.readings
        for words in ("measured", "simulated", "differs")
    ]
    heads = ("point", *TERMINALS, *fields)
    table = plain_table(*heads, "", numbers=heads)
    for row in range(len(result.p)):
        cells = [f"{value:.3f}" for value in (result.p[row], result.q[row], result.vt[row])]
        for reading in result.readings.values():
            cells += [f"{reading.measured[row]:.4f}", f"{reading.simulated[row]:.4f}"]
            cells.append(f"{100.0 * reading.residuals[row] / reading.measured[row]:+.2f} %")
        worst = [signal for signal, each in result.readings.items() if each.worst == row]
        table.add_row(str(row + 1), *cells, "largest" if worst else "")
    return table


def parameters_table(result: VCurve) -> Table:
    """Return what was fitted, with its interval."""
    numbers = ("start", "fitted", "95 % interval")
    marks = {name: ", ".join(_marks(each)) for name, each in result.parameters.items()}
    remark = ("",) if any(marks.values()) else ()
    table = plain_table("parameter", *numbers, "unit", *remark, numbers=numbers)
    no_interval = result.verdict.in_place_of_interval
    for name, parameter in result.parameters.items():
        values = (number(parameter.start), parameter.rounded(parameter.value))
        limits = no_interval or interval(parameter.interval, parameter.rounded)
        mark = (marks[name],) if remark else ()
        style = "" if parameter.determined and parameter.physical else "yellow"
        table.add_row(name, *values, limits, parameter.unit, *mark, style=style)
    return table


def _marks(parameter: FittedParameter) -> Iterator[str]:
    if parameter.at_bound:
        yield f"on its {parameter.at_bound}"
    if not parameter.physical:
        yield "not physical"
