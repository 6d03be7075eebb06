"""The result of a check as blocks."""

from collections.abc import Iterator

from exfit.show.blocks import Block, Table, columns, notes, paragraph, remarks, row
from exfit.workflows.model_check import STEPS, Check


def check(result: Check) -> Iterator[Block]:
    """Yield the result of a check."""
    if result.has_equations:
        yield from _equations(result)
    else:
        yield paragraph("without a twin there are no equations to check")
    other = "twin" if result.has_equations else "record"
    for record, differences in result.from_program.items():
        listed = ", ".join(f"{signal} {largest:.2g} pu" for signal, largest in differences.items())
        yield paragraph(
            f"largest difference of program and {other} at the start, {record}: {listed}"
        )
    yield from remarks("warning:", result.warnings, kind="warning")
    yield from notes(result.notes)


def _equations(result: Check) -> Iterator[Block]:
    """Yield the checks of the equations: derivatives, a flat run, sub-steps."""
    if result.deviations:
        heads = [*(f"{step:.0e}" for step in STEPS), "best"]
        yield Table(
            columns("parameter", *heads, numbers=heads),
            tuple(
                row(name, *(f"{value:.0e}" for value in values), f"{min(values):.1e}")
                for name, values in result.deviations.items()
            ),
            "exact Jacobian against central differences, relative, by their step",
        )
        agrees = "agree" if result.agrees else "DISAGREE"
        yield paragraph(f"derivatives {agrees}", "ok" if result.agrees else "bad")
    else:
        yield paragraph("no free parameter: no derivative to check")
    stays = "stays" if result.flat else "is NOT"
    text = f"a run without a step {stays} flat: it drifts by {result.drift:.1e} pu in 60 s"
    yield paragraph(text, "ok" if result.flat else "bad")
    yield paragraph(f"sub-steps: {result.substeps} in each step of {result.step:g} s")
    yield paragraph(f"halving every step moves the response by {result.step_error:.1e} pu")
    yield paragraph(f"bypassed: {', '.join(result.bypassed) or 'nothing'}")
