"""The result of a check."""

from rich.console import Console

from exfit.show.terminal.terminal import notes, paragraph, plain_table, remarks, show_table
from exfit.workflows.model_check import STEPS, Check


def check(console: Console, result: Check) -> None:
    """Show what a check shows of a case."""
    if result.has_equations:
        _equations(console, result)
    else:
        paragraph(console, "without a twin there are no equations to check")
    other = "twin" if result.has_equations else "record"
    for record, differences in result.from_program.items():
        listed = ", ".join(f"{signal} {largest:.2g} pu" for signal, largest in differences.items())
        paragraph(
            console, f"largest difference of program and {other} at the start, {record}: {listed}"
        )
    remarks(console, "warning:", result.warnings)
    notes(console, result.notes)


def _equations(console: Console, result: Check) -> None:
    """Show what a check shows of the equations: derivatives, a flat run, sub-steps."""
    if result.deviations:
        paragraph(console, "exact Jacobian against central differences, relative, by their step")
        heads = [f"{step:.0e}" for step in STEPS]
        table = plain_table("parameter", *heads, "best", numbers=[*heads, "best"])
        for name, row in result.deviations.items():
            table.add_row(name, *(f"{value:.0e}" for value in row), f"{min(row):.1e}")
        show_table(console, table)
        _verdict(console, result.agrees, "derivatives agree", "derivatives DISAGREE")
    else:
        paragraph(console, "no free parameter: no derivative to check")
    _verdict(
        console,
        result.flat,
        f"a run without a step stays flat: it drifts by {result.drift:.1e} pu in 60 s",
        f"a run without a step is NOT flat: it drifts by {result.drift:.1e} pu in 60 s",
    )
    step = f"{result.step:g} s"
    paragraph(console, f"sub-steps: {result.substeps} in each step of {step}")
    paragraph(console, f"halving every step moves the response by {result.step_error:.1e} pu")
    paragraph(console, f"bypassed: {', '.join(result.bypassed) or 'nothing'}")


def _verdict(console: Console, good: bool, yes: str, no: str) -> None:
    paragraph(console, yes if good else no, "green" if good else "bold red")
