"""The model in the planner's base beside the verified one: parameters and responses."""

from collections.abc import Iterator
from dataclasses import dataclass

from exfit.dsp.decimation import envelope
from exfit.features.report.layout import BINS, LEVEL, LOW, MILLI, TALL, TIME
from exfit.results.comparisons import AsFound, Comparison
from exfit.results.validation_result import Reported, ValidationResult
from exfit.show.blocks import Chart, Panel, Series
from exfit.signals import label_of

UNCHANGED = "unchanged"


@dataclass(frozen=True)
class ChangedParameter:
    """A parameter before and after; None where the model does not have it.

    ``fitted`` is the verified value as tables print it, "" where it was not fitted.
    """

    name: str
    unit: str
    before: float | None
    verified: float | None
    fitted: str
    change: str
    source: str


@dataclass(frozen=True)
class MatchBefore:
    """How well a record was matched before and is now: rms of the difference, pu."""

    record: str
    signal: str
    before: float
    verified: float


@dataclass(frozen=True)
class AsFoundView:
    """What was in the planner's base, or what the fit started from, and what has changed.

    ``now`` is what the other model is called: verified, or compared where nothing was fitted.
    """

    unit: AsFound
    verified_model: str
    parameters: tuple[ChangedParameter, ...]
    same: tuple[str, ...]
    matches: tuple[MatchBefore, ...]
    charts: tuple[Chart, ...]
    now: str


def as_found(result: Reported) -> AsFoundView | None:
    """Return the model as found beside the verified one; None where the result does not hold it."""
    unit = result.as_found
    if unit is None:
        return None
    rows = tuple(_parameters(result, unit))
    word = "compared" if isinstance(result, ValidationResult) else "verified"
    pairs = [*zip(unit.comparisons, (*result.comparisons, *result.validation), strict=False)]
    return AsFoundView(
        unit=unit,
        verified_model=result.model,
        parameters=tuple(row for row in rows if row.change != UNCHANGED),
        same=tuple(row.name for row in rows if row.change == UNCHANGED),
        matches=tuple(match for before, now in pairs for match in _matches(before, now)),
        charts=tuple(
            chart
            for k, (before, now) in enumerate(pairs)
            for chart in _charts(f"before-{k}", before, now, word)
        ),
        now=word,
    )


def as_found_of_validation(result: ValidationResult) -> AsFoundView | None:
    """Return the model as found beside the one compared; None where they are the same."""
    view = as_found(result)
    return view if view is not None and view.parameters else None


def _matches(before: Comparison, now: Comparison) -> Iterator[MatchBefore]:
    """Yield the errors before and now of the signals that judge a record."""
    for signal in now.judging:
        if signal in before.channels:
            errors = before.channels[signal].rmse, now.channels[signal].rmse
            yield MatchBefore(now.name, signal, *errors)


def _charts(key: str, before: Comparison, now: Comparison, word: str) -> Iterator[Chart]:
    """Yield the signals of a record that judge it, as far as they are kept."""
    for signal in now.judging:
        if signal in before.overlays and signal in now.overlays:
            yield _chart(f"{key}-{signal}", signal, before, now, word)


def _parameters(result: Reported, unit: AsFound) -> Iterator[ChangedParameter]:
    """Yield the parameters of both models, those of records aside."""
    values, rows = result.values, _units(result)
    own = [name for name in values if name not in result.of_records and name in rows]
    for name in dict.fromkeys([*own, *unit.values]):
        before, verified = unit.values.get(name), values.get(name)
        fitted = result.parameters.get(name)
        yield ChangedParameter(
            name,
            rows.get(name, ""),
            before,
            verified,
            "" if fitted is None else fitted.rounded(fitted.value),
            _change(before, verified),
            result.source_of(name) if verified is not None else "",
        )


def _units(result: Reported) -> dict[str, str]:
    return {
        part.prefix + symbol: row.unit
        for part in result.parts
        for symbol, row in (part.sheet or {}).items()
    }


def _change(before: float | None, verified: float | None) -> str:
    """Word the change of a value."""
    if before is None:
        return "new"
    if verified is None:
        return "left out"
    if verified == before:
        return UNCHANGED
    share = "" if before == 0.0 else f" ({100.0 * (verified / before - 1.0):+.3g} %)"
    return f"{verified - before:+.3g}{share}"


def _chart(key: str, signal: str, before: Comparison, now: Comparison, word: str) -> Chart:
    """Return a signal of a record with the response of the model as found and of the verified."""
    old, new = before.overlays[signal], now.overlays[signal]
    errors_of = tuple(match.channels[signal].rmse for match in (before, now))
    lines = (
        Series("measured", *envelope(now.time, new.measured, BINS), "measured", dots=True),
        Series("as found", *envelope(before.time, old.simulated, BINS), "start"),
        Series(word, *envelope(now.time, new.simulated, BINS), "simulated"),
    )
    errors = (
        Series("", *envelope(before.time, MILLI * old.error, BINS), "start thin"),
        Series("", *envelope(now.time, MILLI * new.error, BINS), "simulated thin"),
    )
    return Chart(
        key=key,
        title=f"{now.name}: as found and {word}, {label_of(signal)}",
        text=f"Measured {signal}, simulated with the model as found and with that {word}, the "
        f"differences below: rmse {errors_of[0]:.3g} pu as found, {errors_of[1]:.3g} pu {word}.",
        x_title=TIME,
        panels=(
            Panel(label_of(signal), lines, TALL),
            Panel("simulated - measured (1e-3 pu)", errors, LOW, rules=(LEVEL,)),
        ),
        x_range=(float(now.time[0]), float(now.time[-1])),
    )
