"""Tables of samples, the history as CSV, and the file of parameters."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from math import floor, log10
from typing import TYPE_CHECKING

import numpy as np

from exfit.results.comparisons import Comparison, IterationResponses
from exfit.util.arrays import Array
from exfit.util.text import yaml_number
from exfit.util.vocabulary import NOT_STATED, SOURCES

if TYPE_CHECKING:
    from exfit.inference.identifiability import ParameterEffect
    from exfit.results.comparisons import PhaseEnd
    from exfit.results.model import FitResult


HISTORY = (
    "iteration", "phase", "f", "gradient_norm", "step_norm", "damping", "inner", "nfev", "njev",
    "quality", "capped", "trials",
)  # fmt: skip

MOST_ROWS = 100_000  # of a table of samples: of more, those of all extremes
ROWS_AT_ONCE = 20_000  # of a table, as text: more at a time need much memory
DIGITS = 9  # significant digits of a number in a table of samples
MOST_DIGITS = 17  # of a double


def table(header: Sequence[str], columns: Sequence[Array]) -> str:
    """Return samples as CSV, one column after the other, the time first.

    Of more than MOST_ROWS those stay that hold the least and greatest of each column in each of
    many segments.
    """
    from exfit.dsp.sampling import kept_rows

    signals = columns[1:]
    rows = kept_rows(signals, max(1, MOST_ROWS // (2 * len(signals))))
    return whole_table(header, [column[rows] for column in columns])


def whole_table(header: Sequence[str], columns: Sequence[Array]) -> str:
    """Return all samples as CSV, one column after the other, the time first.

    The time has as many digits as its instants need to stay apart.
    """
    out = io.StringIO()
    out.write(csv_text([header]))
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
    rows: list[list[object]] = [
        [
            line.number,
            line.phase,
            *map(number_text, (line.cost, line.gradient_norm, line.step_norm, line.damping)),
            *(line.inner, line.nfev, line.njev, f"{line.quality:.4g}"),
            yes_or_no(line.capped),
            line.trials,
            *(number_text(line.values[name]) for name in result.parameters),
        ]
        for line in result.history
    ]
    return csv_text([[*HISTORY, *result.parameters], *rows])


def yes_or_no(value: bool | None) -> str:
    """Return a truth in a word, none where it is not known."""
    return "" if value is None else "yes" if value else "no"


def effects_table(effects: "Sequence[ParameterEffect]") -> str:
    """Write the changes of the records for 1 % of each parameter as CSV, the strongest first."""
    labels = [*effects[0].rms] if effects else []
    columns = [f"{label.replace(' ', '_')}_rms" for label in labels]
    rows = [
        [each.parameter, *map(number_text, (*each.rms.values(), each.of_noise)), each.percent_of]
        for each in effects
    ]
    return csv_text([["parameter", *columns, "of_noise", "percent_of"], *rows])


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Write rows of cells as CSV."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def number_text(value: float) -> str:
    """Write a number in a table."""
    return f"{value:.{DIGITS}g}"


def parameter_file(result: "FitResult") -> str:
    """Return the values as YAML, to be read back by simulate and validate."""
    from exfit.results.side_by_side import outcome_of

    remarks = {**result.ties}
    for name, parameter in result.parameters.items():
        bound = f"on its {parameter.at_bound}" if parameter.at_bound else ""
        doubt = "" if parameter.physical else "not physical"
        remarks[name] = ", ".join(filter(None, (bound, doubt)))
    head = f"{result.model} fitted to {_matches(result.comparisons)}; {outcome_of(result)}"
    lines = _lines_of_unit(result, head, result.own_values, remarks)
    if result.of_records:
        lines += ["records:  # identified with the parameters"]
        lines += [f"  {name}: {yaml_number(value)}" for name, value in result.of_records.items()]
    return "\n".join(lines) + "\n"


def phase_end_file(result: "FitResult", end: "PhaseEnd") -> str:
    """Return the values at the end of a phase as YAML, to be read as those of `parameter_file`."""
    place = f"end of {end.phase}, iteration {end.iteration}, where {end.next_phase} continued"
    own = {name: end.values[name] for name in result.own_values if name in end.values}
    lines = _lines_of_unit(result, f"{result.model}, {_matches(end.comparisons)}; {place}", own, {})
    if result.of_records:
        lines += ["records:"]
        lines += [f"  {name}: {yaml_number(end.values[name])}" for name in result.of_records]
    return "\n".join(lines) + "\n"


def _matches(comparisons: "Iterable[Comparison]") -> str:
    return ", ".join(f"{match.record}: rmse {match.rmse:.4g} pu" for match in comparisons)


def _lines_of_unit(
    result: "FitResult", head: str, values: Mapping[str, float], remarks: Mapping[str, str]
) -> list[str]:
    """Write the model, the hashes of code that was run, values of the unit and their sources."""
    lines = [f"# {head}", f"model: {result.model}"]
    for label in ("model", "program"):
        if label in result.inputs:
            lines.append(f"{label}_sha256: {result.inputs[label]}")
    lines.append("parameters:")
    for name, value in values.items():
        remark = remarks.get(name)
        lines.append(f"  {name}: {yaml_number(value)}" + (f"  # {remark}" if remark else ""))
    stated = {name: result.sources.get(name, NOT_STATED) for name in values}
    sources = [f"  {name}: {word}" for name, word in stated.items() if word in SOURCES]
    return [*lines, "sources:", *sources] if sources else lines
