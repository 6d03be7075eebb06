"""The command compare, and what it shows."""

from collections.abc import Iterator
from functools import partial
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import Output, output_options
from exfit.errors import ExfitError
from exfit.output.blocks import Block, Mark, Table, columns, interval, notes, number, paragraph, row
from exfit.output.validations import table_of_criteria
from exfit.util.text import error_of_interval, percentage, rounded, rounded_value

if TYPE_CHECKING:
    from exfit.features.compare.agreement import Agreement
    from exfit.features.compare.revalidation import Revalidation


@click.command(short_help="Compare responses, from any program.")
@click.argument(
    "curves",
    type=GivenFile(Kind.RECORD, Kind.RESULT),
    nargs=-1,
    required=True,
    metavar="CURVE [CURVE]...",
)
@click.option(
    "--record",
    type=GivenFile(Kind.RECORD, Kind.RESULT),
    metavar="FILE",
    help="Measured curve: the reference in place of the first CURVE.",
)
@click.option(
    "--columns",
    multiple=True,
    metavar="vt=VOLT",
    help="Column of a signal, in the files that have it; may be repeated.",
)
@click.option(
    "--time",
    multiple=True,
    metavar="COLUMN",
    help="Column of the time, s, in the files that have it; may be repeated.",
)
@click.option(
    "--align",
    is_flag=True,
    help="Shift the clocks so that the detected steps coincide with that of the reference.",
)
@click.option(
    "--shift",
    "shifts",
    multiple=True,
    metavar="B=S",
    help="Seconds added to the time of a curve; without a name, to that of B. May be repeated.",
)
@click.option("--step", "step_at", type=float, metavar="S", help="Time of the step, s.")
@output_options
def compare(
    curves: tuple[Path, ...],
    record: Path | None,
    columns: tuple[str, ...],
    time: tuple[str, ...],
    align: bool,
    shifts: tuple[str, ...],
    step_at: float | None,
    output: Output,
) -> None:
    """Compare any number of responses, and all with a record.

    Each CURVE is the folder or the result.json of a fit or a simulation, or a CSV file of any
    program; they are named A, B, C and so on. The signals of A are compared over the time that all
    cover, on the finest of their clocks: with A, and with the record at its samples. f is half the
    sum of the squared differences. Clocks that differ are reported, and shifted with --align or
    --shift. Parameters of fits are shown side by side. Of two fits, OLD and NEW, it says which
    parameters moved beyond the intervals of both, and where their responses to the same records
    differ by more than the criteria of NEW allow.

    Writes compare.json, compare.csv and compare.png to runs/compare, or to DIR; with a record
    compare-record.csv too.
    """
    if len(curves) == 1 and record is None:
        raise click.UsageError("One CURVE alone can be compared only with a --record.")
    if align and shifts:
        raise click.UsageError("--align shifts all clocks: not allowed with --shift.")
    from exfit.features.compare.agreement import compare as compared
    from exfit.features.compare.files import FILES, write_agreement
    from exfit.output import run_folder

    folder = output.folder("compare", FILES)
    run_folder.refuse_inputs(FILES, [*curves, *([record] if record else ())], folder)
    agreement = compared(curves, record, _columns(columns), time, _shifts(shifts), align, step_at)
    figures = write_agreement(agreement, folder)
    output.show(agreement.as_json(), blocks_of(agreement), folder, figures)


def _shifts(texts: tuple[str, ...]) -> dict[str, float]:
    """Return the seconds of --shift B=0.5 by curve; raises ExfitError for other text."""
    shifts: dict[str, float] = {}
    for text in texts:
        name, given, seconds = text.rpartition("=")
        curve = name.strip() if given else "B"
        try:
            shift = float(seconds)
        except ValueError:
            shift = nan
        if not isfinite(shift):
            raise ExfitError(f"--shift {text}: not of the form B=0.5, in seconds")
        if curve in shifts:
            raise ExfitError(f"--shift {text}: the time of {curve} is shifted twice")
        shifts[curve] = shift
    return shifts


def _columns(texts: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the columns of --columns vt=VOLT by signal; raises ExfitError for other text."""
    columns: dict[str, list[str]] = {}
    for text in texts:
        signal, given, column = (part.strip() for part in text.partition("="))
        if not (signal and given and column):
            raise ExfitError(f"--columns {text}: not of the form vt=VOLT")
        columns.setdefault(signal, []).append(column)
    return columns


def blocks_of(result: "Agreement") -> Iterator[Block]:
    """Yield the differences of responses and a record, features of their step, fitted values."""
    from exfit.dsp.features import LABELS
    from exfit.features.compare.curves import RECORD
    from exfit.output.series import rows_table, side_by_side

    files = []
    for curve in result.curves:
        moved = f", shifted by {curve.shift:.6g} s" if curve.shift else ""
        files.append(row(curve.name, f"{curve.path}{moved}"))
    yield Table(columns("curve", "file"), tuple(files))
    differences = []
    for entry in result.differences:
        value, at = entry.largest
        finals = ", ".join(number(value) for value in reversed(entry.finals))
        sizes = (f"{entry.rms:.3e}", f"{value:+.3e}", f"{at:.4g} s", finals)
        differences.append(row(entry.signal, f"{entry.second} - {entry.first}", *sizes))
    heads = ("rms", "largest", "at")
    columns_of_both = columns("signal", "pu", *heads, "final values", numbers=heads)
    yield Table(columns_of_both, tuple(differences))
    matches = []
    for entry in result.from_reference:
        texts = (f"{entry.f:.4e}", f"{entry.rmse:.3e}", percentage(entry.fit_percent))
        matches.append(row(entry.second, entry.signal, *texts, str(entry.count)))
    whose = "the record" if result.from_reference[0].first == RECORD else "A"
    counted = ("f, pu²", "rmse, pu", "fit, %", "samples")
    yield Table(
        columns("", "signal", *counted, numbers=counted),
        tuple(matches),
        f"against {whose}: f, half the sum of squares over the samples",
    )
    if result.features and result.step_at is not None:
        rows = []
        for label, key, unit in LABELS:
            cells = []
            for features in result.features.values():
                half = features.errors.get(key)  # of the 95 % interval, of a record
                text = rounded(getattr(features, key), half)
                cells.append(text if half is None else f"{text} +- {half:.2g}")
            rows.append((label, unit, tuple(cells)))
        title = f"{result.judged} after the step at {result.step_at:.4g} s"
        yield rows_table([*result.features], rows, title)
    if len(result.results) > 1:
        yield from side_by_side(result.results, models=True)
    if result.revalidation is not None:
        yield from _revalidation(result.revalidation)
    yield from notes(result.notes)
    time = result.differences[0].time
    yield paragraph(f"compared over {time[0]:g} ... {time[-1]:g} s at {len(time)} samples")
    worst = max(result.differences, key=lambda difference: difference.interpolation)
    if worst.interpolation:
        yield paragraph(
            f"between samples: a cubic, up to {worst.interpolation:.1e} pu from a straight line "
            f"({worst.signal})"
        )


def _revalidation(found: "Revalidation") -> Iterator[Block]:
    """Yield the parameters of two fits that moved or did not, and their responses by criteria."""
    rows = []
    for each in found.parameters:
        cells = []
        for value, limits in zip(each.values, each.intervals, strict=True):
            digits = partial(rounded_value, error=error_of_interval(*(limits or (None, None))))
            cells += [digits(value), interval(limits, digits)]
        mark: Mark = "bad" if each.outcome == "moved" else ""
        rows.append(row(each.name, *cells, each.unit, each.outcome, mark=mark))
    heads = columns("", "A", "95 %", "B", "95 %", "unit", "result", numbers=("A", "B"))
    yield Table(heads, tuple(rows), "moved: each value lies beyond the interval of the other fit")
    if found.criteria:
        yield table_of_criteria(found.criteria, None, "Criteria, B minus A")
        yield paragraph(f"source of the criteria: {found.source}", "faint")
