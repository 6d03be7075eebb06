"""What a check found."""

from rich.console import Console

from exfit.analysis.model_check import STEPS, Check
from exfit.output.terminal.terminal import plain_table


def check(console: Console, found: Check) -> None:
    """Show what a check found."""
    if found.deviations:
        console.print("exact Jacobian against central differences, relative, by their step")
        heads = [f"{step:.0e}" for step in STEPS]
        table = plain_table("parameter", *heads, "best", numbers=[*heads, "best"])
        for name, row in found.deviations.items():
            table.add_row(name, *(f"{value:.0e}" for value in row), f"{min(row):.1e}")
        console.print(table)
        _verdict(console, found.agrees, "derivatives agree", "derivatives DISAGREE")
    else:
        console.print("no free parameter: no derivative to check")
    _verdict(
        console,
        found.flat,
        f"a run without a step stays flat: it drifts by {found.drift:.1e} pu in 60 s",
        f"a run without a step is NOT flat: it drifts by {found.drift:.1e} pu in 60 s",
    )
    step = f"{found.step:g} s"
    console.print(f"sub-steps: {found.substeps} to each step of {step}")
    console.print(f"halving every step moves the response by {found.step_error:.1e} pu")
    console.print(f"bypassed: {', '.join(found.bypassed) or 'nothing'}")
    for note in found.notes:
        console.print(note)


def _verdict(console: Console, good: bool, yes: str, no: str) -> None:
    console.print(f"[green]{yes}[/]" if good else f"[bold red]{no}[/]")
