"""The result of a check."""

from rich.console import Console

from exfit.analysis.model_check import STEPS, Check
from exfit.output.terminal.terminal import notes, plain_table, remarks, show_table


def check(console: Console, result: Check) -> None:
    """Show what a check shows of a case."""
    if result.deviations:
        console.print("exact Jacobian against central differences, relative, by their step")
        heads = [f"{step:.0e}" for step in STEPS]
        table = plain_table("parameter", *heads, "best", numbers=[*heads, "best"])
        for name, row in result.deviations.items():
            table.add_row(name, *(f"{value:.0e}" for value in row), f"{min(row):.1e}")
        show_table(console, table)
        _verdict(console, result.agrees, "derivatives agree", "derivatives DISAGREE")
    else:
        console.print("no free parameter: no derivative to check")
    _verdict(
        console,
        result.flat,
        f"a run without a step stays flat: it drifts by {result.drift:.1e} pu in 60 s",
        f"a run without a step is NOT flat: it drifts by {result.drift:.1e} pu in 60 s",
    )
    step = f"{result.step:g} s"
    console.print(f"sub-steps: {result.substeps} in each step of {step}")
    console.print(f"halving every step moves the response by {result.step_error:.1e} pu")
    console.print(f"bypassed: {', '.join(result.bypassed) or 'nothing'}")
    remarks(console, "warning:", result.warnings)
    notes(console, result.notes)


def _verdict(console: Console, good: bool, yes: str, no: str) -> None:
    console.print(f"[green]{yes}[/]" if good else f"[bold red]{no}[/]")
