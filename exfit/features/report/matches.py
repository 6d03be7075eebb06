"""Records beside their simulations: of the fit, as found before it, and of another fit."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from exfit.dsp.features import LABELS
from exfit.dsp.sampling import envelope, kept_rows
from exfit.features.report.charts import BINS, HALF, LEVEL, LOW, MILLI, TALL, TIME
from exfit.features.report.words import DASH, INTERRUPTED, number
from exfit.output.blocks import (
    Block,
    Cell,
    Chart,
    Heading,
    LiveSamples,
    Note,
    Panel,
    Range,
    Series,
    Table,
    columns,
    row,
)
from exfit.results.comparisons import REFERENCE, Comparison, Excursion
from exfit.results.criteria import judged_by_criteria
from exfit.results.facts import PLANT, REVISION, UNIT, stated
from exfit.results.model import FitResult
from exfit.results.side_by_side import ParameterValue, outcome_of, parameters_beside
from exfit.results.tables import clock_digits
from exfit.results.validation_result import Reported, ValidationResult
from exfit.signals import label_of
from exfit.util.arrays import Array
from exfit.util.text import percentage, show

FEWEST_BINS = 50  # a step can still be seen
PER_BIN = 8  # points of an overlay: the least and the greatest of its four lines
MOST_POINTS = 40_000  # drawn in all overlays: 400 KB
MOST_SENT = 16_000  # samples for the interactive overlays: 600 KB
DIGITS = 7  # of a sample: beyond what a recorder resolves
DIFFERENCE = "simulated - measured (1e-3 pu)"
NO_SAMPLES = "No figure: the result contains no samples."
NO_STEP = "No step features: the record shows no step of the reference in vt."
NOTHING_ALIKE = (
    "No test has the same name in both, or the samples are missing: no responses are shown."
)


def fitted_matches(result: Reported, key: str = "") -> Iterator[Block]:
    """Yield the records that were fitted, beside their simulations; ``key`` begins the ids."""
    return _matches(result, 0, result.comparisons, key)


def validation_matches(result: Reported) -> Iterator[Block]:
    """Yield the records that were not fitted, beside their simulations."""
    if not result.validation:
        yield Note("The case has no record for a validation.", mark="faint")
    yield from _matches(result, len(result.comparisons), result.validation, "")


def first_overlay(result: Reported) -> tuple[int, str] | None:
    """Name the record, by its place among all, and the signal that the first page shows."""
    every = (*result.comparisons, *result.validation)
    place = 0 if isinstance(result, FitResult) else len(result.comparisons)
    if place < len(every) and every[place].judged_by in every[place].overlays:
        return place, every[place].judged_by
    return None


def _matches(
    result: Reported, first: int, comparisons: Sequence[Comparison], key: str
) -> Iterator[Block]:
    count = sum(len(each.overlays) for each in (*result.comparisons, *result.validation))
    bins = max(FEWEST_BINS, min(BINS, MOST_POINTS // (PER_BIN * max(count, 1))))
    for k, match in enumerate(comparisons, first):
        yield Heading(match.name, 2)
        yield from _in_words(match)
        if not match.overlays:
            yield Note(NO_SAMPLES, mark="faint")
            continue
        if match.played is not None:
            yield played(f"{key}played-{k}", match, bins)
            yield from _departures(match)
        for signal in match.overlays:
            if not key and (k, signal) == first_overlay(result):
                yield Note(f"{label_of(signal).capitalize()}", see="result")
            else:
                yield overlay(f"{key}overlay-{k}-{signal}", match, signal, bins)
        if match.played is None:
            yield from _features(match)


def _in_words(match: Comparison) -> Iterator[Block]:
    """Say how well each signal is met, and whether that is accepted."""
    errors = []
    for name, signal in match.channels.items():
        text = f"{name} rmse {number(signal.rmse, 3)} pu, largest error "
        text += f"{number(signal.max_error, 3)} pu"
        fits = np.isfinite(signal.fit_percent)
        errors.append(text + (f", fit {percentage(signal.fit_percent)} %" if fits else ""))
    found = "; ".join(errors) if match.overlays else "no response"
    yield Note(f"Record {match.record}: {found}.")
    if match.reason:
        yield Note(f"{match.reason}.", "verdict", "Not accepted:", "bad")
    elif match.limit is not None:
        first, *others = match.judging
        also = f" in {first}, in {others[0]} by the same rule" if others else ""
        text = f"an rmse of up to {number(match.limit, 3)} pu is accepted{also}."
        yield Note(text, "verdict", "Accepted:", "ok")


def _departures(match: Comparison) -> Iterator[Block]:
    """Show how the signals of a record that was played in depart from it."""
    if match.played is None:
        return
    rows = [
        row(name, "played in", *[DASH] * 4, *_peak(signal.excursion), DASH, DASH, signal.unit)
        for name, signal in match.played.driving.items()
    ]
    for name, error in match.played.errors.items():
        rmse, largest = number(match.channels[name].rmse, 3), number(error.largest, 3)
        at, rest = number(error.largest_at, 4), number(error.at_rest, 2)
        peaks = (*_peak(error.measured), *_peak(error.simulated))
        rows.append(row(name, "compared", rmse, largest, at, rest, *peaks, "pu"))
    numbers = ("rms", "largest", "at (s)", "at rest", "recorded", "at (s)", "simulated", "at (s)")
    yield Table(
        columns("signal", "use", *numbers, "unit", numbers=numbers),
        tuple(rows),
        f"Simulated minus recorded, and the largest departures of both from rest: {match.name}",
    )
    yield Note(
        f"The record is at rest until {number(match.played.begins, 4)} s; recorded and simulated: "
        "the largest departure from the mean until then."
    )


def _peak(excursion: Excursion | None) -> tuple[str, str]:
    if excursion is None:
        return DASH, DASH
    return number(excursion.value, 3), number(excursion.at, 4)


def _features(match: Comparison) -> Iterator[Block]:
    """Show the features of the step, measured beside simulated."""
    measured, simulated = match.features.measured, match.features.simulated
    if measured is None and simulated is None:
        yield Note(NO_STEP, mark="faint")
        return
    rows = []
    for label, name, unit in LABELS:
        pair = (getattr(measured, name, None), getattr(simulated, name, None))
        known = [value for value in pair if value is not None and np.isfinite(value)]
        difference = number(round(known[1] - known[0], 9) + 0.0, 2) if len(known) > 1 else DASH
        cells = (DASH if cell == "-" else cell for cell in match.features.cells(name))
        rows.append(row(label, *cells, difference, unit))
    numbers = ("measured", "±", "simulated", "difference")
    yield Table(
        columns("feature", *numbers, "unit", numbers=numbers),
        tuple(rows),
        f"Features of the first step of the reference, in vt: {match.name}",
        style="features",
    )
    if measured is not None and measured.errors:
        without = f", without {measured.removed}" if measured.removed else ""
        missing = (
            f" {label.capitalize()}: not stated, {measured.why[name]}."
            for label, name, _ in LABELS
            if name in measured.why
        )
        yield Note(
            f"Measured: read off the smoothed record{without}; ± is half of the 95 % interval "
            f"that its noise leaves.{''.join(missing)}"
        )


def line(
    label: str, time: Array, samples: Array, style: str, bins: int = BINS, dots: bool = False
) -> Series:
    """Make a line of as many segments as a reader sees."""
    return Series(label, *envelope(time, samples, bins), style, dots)


def range_of(time: Array) -> Range:
    """Return the first and the last instant (s)."""
    return float(time[0]), float(time[-1])


def played(key: str, match: Comparison, bins: int) -> Chart:
    """Draw the driving signals of a record above those that are compared."""
    driving = {} if match.played is None else match.played.driving
    left_out = {} if match.played is None else match.played.left_out
    time = match.time
    panels = [
        Panel(f"{each.label}, played in", (line("", time, each.samples, "other thin", bins),), HALF)
        for each in driving.values()
    ]
    for name, samples in match.overlays.items():
        lines = [
            line("recorded", time, samples.measured, "measured", bins, dots=True),
            line("simulated", time, samples.simulated, "simulated", bins),
        ]
        if name in left_out:
            gaps, label = left_out[name], "simulated, not compared"
            lines.append(Series("", time, gaps.measured, "measured faint", dots=True))
            lines.append(Series(label, time, gaps.simulated, "simulated faint"))
        panels.append(Panel(label_of(name), tuple(lines), HALF))
    return Chart(
        key=key,
        title=f"{match.name}: {match.record} played into the unit",
        text=f"Recorded {', '.join(driving)} played in; recorded and simulated "
        f"{', '.join(match.overlays)} from {show(time[0])} to {show(time[-1])} s.",
        x_title=TIME,
        panels=tuple(panels),
        x_range=range_of(time),
    )


def overlay(key: str, match: Comparison, signal: str, bins: int = BINS) -> Chart:
    """Draw a signal measured and simulated, with the difference below."""
    time, samples, errors = match.time, match.overlays[signal], match.channels[signal]
    fit = "simulated" if samples.start is None else "fitted"
    lines = [line("measured", time, samples.measured, "measured", bins, dots=True)]
    live = {"measured": samples.measured, "simulated": samples.simulated}
    if samples.start is not None:
        lines.append(line("start values", time, samples.start, "start", bins))
        live["start"] = samples.start
    if samples.reference is not None:
        lines.append(line(REFERENCE, time, samples.reference, "reference thin", bins))
        live["reference"] = samples.reference
    lines.append(line(fit, time, samples.simulated, "simulated", bins))
    difference = line("", time, MILLI * samples.error, "simulated thin", bins)
    return Chart(
        key=key,
        title=f"{match.name}: {label_of(signal)}, {match.record}",
        text=f"Measured and {fit} {signal} from {show(time[0])} to {show(time[-1])} s, the "
        f"difference below: rmse {errors.rmse:.3g} pu, at most {errors.max_error:.3g} pu.",
        x_title=TIME,
        panels=(
            Panel(label_of(signal), tuple(lines), TALL),
            Panel(DIFFERENCE, (difference,), LOW, rules=(LEVEL,)),
        ),
        x_range=range_of(time),
        live=LiveSamples(match.name, time, live),
    )


def live_data(charts: Sequence[Chart]) -> Iterator[dict[str, Any]]:
    """Yield the samples of live charts for the script, thinned where they are many.

    A gap is None.
    """
    most = MOST_SENT // max(len(charts), 1)
    for chart in charts:
        if chart.live is not None:
            time, lines = chart.live.time, chart.live.lines
            error = lines["simulated"] - lines["measured"]
            rows = kept_rows([lines["measured"], error], max(1, most // 4))
            yield {
                "key": chart.key,
                "group": chart.live.record,
                "time": _numbers(time[rows], clock_digits(time, DIGITS)),
                **{name: _numbers(samples[rows], DIGITS) for name, samples in lines.items()},
            }


def _numbers(samples: Array, digits: int) -> list[float | None]:
    return [float(f"{x:.{digits}g}") if np.isfinite(x) else None for x in samples.tolist()]


# ---- as found


def as_found(result: Reported) -> Iterator[Block]:
    """Yield the model in the planner's base beside the verified one: parameters and responses."""
    unit, now = result.as_found, "verified"
    if unit is None:
        yield Note(INTERRUPTED, mark="faint")
        return
    if isinstance(result, ValidationResult):
        now = "compared"
    before = "as found" if unit.is_stated else "start"
    if unit.is_stated:
        text = f"As found: {unit.model}, {unit.source}. {now.capitalize()}: {result.model}."
        yield Note(text)
    else:
        yield Note(
            "The case does not state the model in the planner's base (its section `as_found`): "
            "the start values of the fit are shown in its place.",
            mark="faint",
        )
    rows, same = _changed_parameters(result)
    if rows:
        titles = ("parameter", before, now, "change", "unit", f"source of the value {now}")
        heads = columns(*titles, numbers=(before, now, "change"))
        title = f"{before} and {now}: the parameters that differ"
        yield Table(heads, tuple(rows), title, style="parameters")
    if same:
        yield Note(f"Unchanged: {', '.join(same)}.")
    if unit.why:
        which = "as found" if unit.is_stated else "at the start"
        yield Note(f"The model {which} has no response: {unit.why}.", mark="faint")
    yield from _responses_before(result, unit.comparisons, before, now)


def _responses_before(
    result: Reported, found: Sequence[Comparison], before: str, now: str
) -> Iterator[Block]:
    """Yield the errors and the responses of the model as ``found`` and ``now``."""
    every = (*result.comparisons, *result.validation)
    pairs = [
        (k, signal, old, new)
        for k, (old, new) in enumerate(zip(found, every, strict=False))
        for signal in new.judging
        if signal in old.channels
    ]
    if pairs:
        numbers = (f"{before} (pu)", f"{now} (pu)")
        errors = (
            row(new.name, signal, *(number(m.channels[signal].rmse, 3) for m in (old, new)))
            for _, signal, old, new in pairs
        )
        title = f"{before} and {now}: rms of the difference from each record"
        yield Table(columns("record", "signal", *numbers, numbers=numbers), tuple(errors), title)
    for k, signal, old, new in pairs:
        if signal in old.overlays and signal in new.overlays:
            yield _before_and_now(f"before-{k}-{signal}", signal, old, new, now)


def differs_from_found(result: ValidationResult) -> bool:
    """Tell whether a validation has another model than was found."""
    return result.as_found is not None and bool(_changed_parameters(result)[0])


def _changed_parameters(result: Reported) -> tuple[list[tuple[Cell, ...]], list[str]]:
    """Make a row of each parameter of either model that changed, and name the others."""
    values, found = result.values, {} if result.as_found is None else result.as_found.values
    units = {
        part.prefix + symbol: sheet.unit
        for part in result.parts
        for symbol, sheet in part.sheet.items()
    }
    own = [name for name in values if name not in result.of_records and name in units]
    rows, same = [], []
    for name in dict.fromkeys([*own, *found]):
        before, now, parameter = found.get(name), values.get(name), result.parameters.get(name)
        if before == now:
            same.append(name)
            continue
        if before is None or now is None:
            change = "new" if before is None else "left out"
        else:
            share = "" if before == 0.0 else f" ({100.0 * (now / before - 1.0):+.3g} %)"
            change = f"{now - before:+.3g}{share}"
        value = number(now, 6) if parameter is None else parameter.rounded(parameter.value)
        source = "" if now is None else result.source_of(name)
        rows.append(row(name, number(before, 6), value, change, units.get(name, ""), source))
    return rows, same


def _before_and_now(key: str, signal: str, before: Comparison, now: Comparison, word: str) -> Chart:
    """Draw a signal of a record with the response of the model as found and of the other."""
    old, new = before.overlays[signal], now.overlays[signal]
    found, other = (match.channels[signal].rmse for match in (before, now))
    lines = (
        line("measured", now.time, new.measured, "measured", dots=True),
        line("as found", before.time, old.simulated, "start"),
        line(word, now.time, new.simulated, "simulated"),
    )
    errors = (
        line("", before.time, MILLI * old.error, "start thin"),
        line("", now.time, MILLI * new.error, "simulated thin"),
    )
    return Chart(
        key=key,
        title=f"{now.name}: as found and {word}, {label_of(signal)}",
        text=f"Measured {signal}, simulated with the model as found and with that {word}, the "
        f"differences below: rmse {found:.3g} pu as found, {other:.3g} pu {word}.",
        x_title=TIME,
        panels=(
            Panel(label_of(signal), lines, TALL),
            Panel(DIFFERENCE, errors, LOW, rules=(LEVEL,)),
        ),
        x_range=range_of(now.time),
    )


# ---- beside another fit


def against(result: FitResult, other: FitResult) -> Iterator[Block]:
    """Yield a fit beside another one: what each comes to, their parameters, their responses."""
    pair = (result, other)
    this, older = map(_name, pair)
    if this == older:
        this, older = f"{this} (this report)", f"{older} (the other)"
    matches = [{m.name: m for m in (*fit.comparisons, *fit.validation)} for fit in pair]
    facts = [
        row("case", *(fit.case.name for fit in pair)),
        row("model", *(fit.model for fit in pair)),
        row("verdict", *map(outcome_of, pair)),
        row("criteria", *(judged_by_criteria(fit).sentence for fit in pair)),
    ]
    for name in matches[0] | matches[1]:
        errors = (_error(own.get(name)) for own in matches)
        facts.append(row(f"rmse of {name} (pu)", *errors))
    yield Table(columns("fact", this, older), tuple(facts), f"Facts of {this} and {older}")
    yield _both_parameters(result, other, this, older)
    alike = False
    for k, (name, match) in enumerate(matches[0].items()):
        beside = matches[1].get(name)
        if beside is not None and match.overlays and match.judged_by in beside.overlays:
            alike = True
            yield _two_fits(f"against-{k}", match, beside, this, older)
    if not alike:
        yield Note(NOTHING_ALIKE, mark="faint")


def _both_parameters(result: FitResult, other: FitResult, this: str, older: str) -> Table:
    units = {name: each.unit for fit in (other, result) for name, each in fit.parameters.items()}
    rows = []
    for name, (one, two) in parameters_beside((result, other)).items():
        difference = None if one is None or two is None else one.value - two.value
        rows.append(row(name, _value(one), _value(two), number(difference, 3), units[name]))
    numbers = (this, older, "difference")
    heads = columns("parameter", *numbers, "unit", numbers=numbers)
    return Table(heads, tuple(rows), "Fitted parameters of either fit", style="parameters")


def _name(fit: FitResult) -> str:
    """Name a fit by plant, unit and revision, else by its case."""
    words = {fact: stated(fit.about, fact) for fact in (PLANT, UNIT, REVISION)}
    texts = (
        text if fact is PLANT else f"{fact.key.lower()} {text}"
        for fact, text in words.items()
        if text is not None
    )
    return ", ".join(texts) or fit.name


def _error(match: Comparison | None) -> str:
    return DASH if match is None else f"{match.rmse:.3g} ({match.judged_by}, {match.record})"


def _value(value: ParameterValue | None) -> str:
    if value is None:
        return DASH
    bound = f", on its {value.at_bound}" if value.at_bound else ""
    text = value.text if value.fitted else f"{number(value.value, 6)} (not fitted)"
    return f"{text}{bound}{'' if value.resolved else ', not determined'}"


def _two_fits(key: str, match: Comparison, beside: Comparison, this: str, other: str) -> Chart:
    """Draw both responses: over one record where it is the same, else above each other."""
    signal, same = match.judged_by, match.sha256 == beside.sha256
    both = [
        (
            line("measured", one.time, one.overlays[signal].measured, "measured", dots=True),
            line(name, one.time, one.overlays[signal].simulated, style),
        )
        for one, name, style in ((match, this, "simulated"), (beside, other, "other"))
    ]
    label = label_of(signal)
    panels = [Panel(label, (*both[0], both[1][1]), TALL)]
    if not same:
        titles = (f"{label}, {this}", f"{label}, {other}")
        panels = [Panel(title, own, TALL) for title, own in zip(titles, both, strict=True)]
    first, last = zip(range_of(match.time), range_of(beside.time), strict=True)
    records = (
        ", of one record." if same else f", of the records {match.record} and {beside.record}."
    )
    return Chart(
        key=key,
        title=f"{match.name}: {this} and {other}",
        text=f"{label}: rmse {match.rmse:.3g} pu and {beside.rmse:.3g} pu{records}",
        x_title=TIME,
        panels=tuple(panels),
        x_range=(min(first), max(last)),
    )
