"""Tables of samples, the history as CSV, and the file of parameters."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from math import floor, log10
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exfit.results.comparisons import Comparison, IterationResponses
from exfit.util.sources import NOT_STATED, SOURCES
from exfit.util.text import yaml_number

if TYPE_CHECKING:
    from exfit.inference.sensitivity import ParameterEffect
    from exfit.results.model import FitResult
    from exfit.results.other_values import PhaseEnd

Array = NDArray[np.float64]

MOST_ROWS = 100_000  # of a table of samples: of more, those of all extremes
ROWS_AT_ONCE = 20_000  # of a table, as text: more at a time need much memory
DIGITS = 9  # significant digits of a number in a table of samples
MOST_DIGITS = 17  # of a double


def table(header: Sequence[str], columns: Sequence[Array]) -> str:
    """Return samples as CSV, one column after the other, the time first.

    Of more than MOST_ROWS those stay that hold the least and greatest of each column in each of
    many segments.
    """
    from exfit.dsp.decimation import kept_rows

    signals = columns[1:]
    rows = kept_rows(signals, max(1, MOST_ROWS // (2 * len(signals))))
    return whole_table(header, [column[rows] for column in columns])


def whole_table(header: Sequence[str], columns: Sequence[Array]) -> str:
    """Return all samples as CSV, one column after the other, the time first.

    The time has as many digits as its instants need to stay apart.
    """
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerow(header)
    clock = f"%.{clock_digits(columns[0], DIGITS)}g"
    line = ",".join([clock, *[f"%.{DIGITS}g"] * (len(columns) - 1)]) + "\n"
    for first in range(0, len(columns[0]), ROWS_AT_ONCE):
        rows = np.column_stack([column[first : first + ROWS_AT_ONCE] for column in columns])
        out.write(line * len(rows) % tuple(rows.ravel().tolist()))
    return out.getvalue()


def clock_digits(time: Array, digits: int) -> int:
    """Count the digits that instants (M,) need to be as fine as so many digits from zero on."""
    span = float(np.ptp(time))
    if span == 0.0:
        return digits
    return min(digits + max(floor(log10(np.max(np.abs(time)) / span)), 0), MOST_DIGITS)


def comparison_table(comparison: Comparison) -> str:
    """Return measured, start, fitted and residual of every signal on the record's clock, as CSV."""
    header, columns = ["t"], [comparison.time]
    for signal, overlay in comparison.overlays.items():
        named = {
            "measured": overlay.measured,
            "start": overlay.start,
            "simulated": overlay.simulated,
            "residual": overlay.error,
        }
        for label, samples in named.items():
            if samples is not None:
                header.append(f"{signal}_{label}")
                columns.append(samples)
    return table(header, columns)


def iteration_responses_table(responses: IterationResponses) -> str:
    """Return the response after each iteration that is kept, on the record's clock, as CSV."""
    header = ["t", *(f"{responses.signal}_{number}" for number in responses.numbers)]
    return table(header, [responses.time, *responses.samples])


def history_table(result: "FitResult") -> str:
    """Return the history as CSV, a line per iteration."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    first = (
        "iteration",
        "phase",
        "f",
        "gradient_norm",
        "step_norm",
        "damping",
        "inner",
        "nfev",
        "njev",
        "quality",
        "capped",
        "trials",
    )
    writer.writerow([*first, *result.parameters])
    for line in result.history:
        numbers = (line.cost, line.gradient_norm, line.step_norm, line.damping)
        counts = (line.inner, line.nfev, line.njev)
        writer.writerow(
            [
                line.number,
                line.phase,
                *(f"{number:.{DIGITS}g}" for number in numbers),
                *counts,
                f"{line.quality:.4g}",
                yes_or_no(line.capped),
                line.trials,
                *(f"{line.values[name]:.{DIGITS}g}" for name in result.parameters),
            ]
        )
    return out.getvalue()


def yes_or_no(value: bool | None) -> str:
    """Return a truth in a word, none where it is not known."""
    return "" if value is None else "yes" if value else "no"


def effects_table(effects: "Sequence[ParameterEffect]") -> str:
    """Write the changes of the records for 1 % of each parameter as CSV, the strongest first."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    labels = [*effects[0].rms] if effects else []
    columns = [f"{label.replace(' ', '_')}_rms" for label in labels]
    writer.writerow(["parameter", *columns, "of_noise", "percent_of"])
    for effect in effects:
        numbers = (*effect.rms.values(), effect.of_noise)
        cells = (f"{number:.{DIGITS}g}" for number in numbers)
        writer.writerow([effect.parameter, *cells, effect.percent_of])
    return out.getvalue()


def parameter_file(result: "FitResult") -> str:
    """Return the values as YAML, to be read back by simulate and validate."""
    from exfit.results.side_by_side import outcome_of

    state = outcome_of(result)
    matches = (f"{match.record}: rmse {match.rmse:.4g} pu" for match in result.comparisons)
    lines = [
        f"# {result.model} fitted to {', '.join(matches)}; {state}",
        f"model: {result.model}",
        *_code_hashes(result),
        "parameters:",
    ]
    for name, value in result.own_values.items():
        remark = _remark(result, name)
        lines.append(f"  {name}: {yaml_number(value)}" + (f"  # {remark}" if remark else ""))
    lines += _sources(result, result.own_values)
    if result.of_records:
        lines += ["records:  # identified with the parameters"]
        lines += [f"  {name}: {yaml_number(value)}" for name, value in result.of_records.items()]
    return "\n".join(lines) + "\n"


def _code_hashes(result: "FitResult") -> list[str]:
    """Return the lines with the hashes of code that was run: of a user's model, of a program."""
    labels = (label for label in ("model", "program") if label in result.inputs)
    return [f"{label}_sha256: {result.inputs[label]}" for label in labels]


def phase_end_file(result: "FitResult", end: "PhaseEnd") -> str:
    """Return the values at the end of a phase as YAML, to be read as those of `parameter_file`."""
    matches = (f"{match.record}: rmse {match.rmse:.4g} pu" for match in end.comparisons)
    own = [name for name in result.own_values if name in end.values]
    lines = [
        f"# {result.model}, {', '.join(matches)}; end of {end.phase}, iteration {end.iteration}, "
        f"where {end.next_phase} went on",
        f"model: {result.model}",
        *_code_hashes(result),
        "parameters:",
        *(f"  {name}: {yaml_number(end.values[name])}" for name in own),
        *_sources(result, own),
    ]
    if result.of_records:
        lines += ["records:"]
        lines += [f"  {name}: {yaml_number(end.values[name])}" for name in result.of_records]
    return "\n".join(lines) + "\n"


def _remark(result: "FitResult", name: str) -> str:
    """Word the remarks on a value beside its source."""
    parameter = result.parameters.get(name)
    if parameter is None:
        return result.ties.get(name, "")
    marks = [f"on its {parameter.at_bound}"] if parameter.at_bound else []
    return ", ".join([*marks, *([] if parameter.physical else ["not physical"])])


def _sources(result: "FitResult", names: Iterable[str]) -> Iterator[str]:
    """Yield the lines that say where values come from, as far as that is stated."""
    stated = {name: result.sources.get(name, NOT_STATED) for name in names}
    lines = [f"  {name}: {word}" for name, word in stated.items() if word in SOURCES]
    if lines:
        yield "sources:"
        yield from lines
