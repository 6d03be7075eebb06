"""An open-circuit saturation test on the terminal."""

from collections.abc import Iterator

from rich.console import Console

from exfit.features.programme.saturation_result import MeasuredValue, SaturationResult
from exfit.show.terminal.terminal import interval, notes, plain_table, show_table


def saturation(console: Console, result: SaturationResult) -> None:
    """Show the numbers of the curve that is used, those of each form, and what limits them."""
    table = plain_table("", "value", "95 %", "unit", numbers=("value", "95 %"))
    no_interval = result.verdict.in_place_of_interval
    for name, value, unit in _quantities(result):
        ends = no_interval or interval(value.interval, value.rounded)
        table.add_row(name, value.rounded(value.value), ends, unit)
    show_table(console, table)
    console.print()
    heads = (f"base ({result.unit})", "S(1.0)", "S(1.2)", "rms (pu)")
    forms = plain_table("form", *heads, "", numbers=heads)
    for curve in result.curves:
        values = (curve.ifd_base, curve.S10, curve.S12)
        cells = (value.rounded(value.value) for value in values)
        remarks = ["used"] * (curve.form == result.form) + ["refuted"] * curve.refuted
        forms.add_row(curve.form, *cells, f"{curve.rms:.2g}", ", ".join(remarks))
    show_table(console, forms)
    if result.notes:
        console.print()
        notes(console, result.notes)


def _quantities(result: SaturationResult) -> Iterator[tuple[str, MeasuredValue, str]]:
    """Yield what the test gives: its name, value and unit."""
    curve = result.curve
    name = "exciter field current" if result.exciter else "base of ifd"
    yield f"{name}, 1 pu on the air-gap line", curve.ifd_base, result.unit
    if result.efd_base is not None:
        yield "base of efd", result.efd_base, result.efd_unit
    if result.resistance is not None:
        yield "resistance of the field", result.resistance, f"{result.efd_unit}/{result.unit}"
    yield "S(1.0)", curve.S10, "pu"
    yield "S(1.2)", curve.S12, "pu"
    if curve.hysteresis is not None:
        yield "hysteresis, rising less falling", curve.hysteresis, "pu"
    if result.residual is not None:
        yield "residual voltage", MeasuredValue(result.residual, None, (None, None)), "pu"
