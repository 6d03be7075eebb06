"""What a model has from another before anything is fitted: values of the same quantities.

A limit is copied in proportion to what its signal is at rest: where a model leaves out the
demagnetising factor, its regulator gives less for the same field voltage.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf, isclose, isfinite, prod
from typing import Literal

from exfit.features.translate.steps import Placed, TranslationTask
from exfit.models.counterparts import (
    CEILINGS,
    FACTORS,
    FED_BY_TERMINALS,
    FLOORS,
    GAIN,
    LAG,
    LEAD,
    LEAD_AS_SHARE,
    NO_LIMIT,
    OUTPUT_FLOOR,
    PROPORTIONAL,
    REMOVABLE,
    SUPPLY_SWITCH,
    WITHOUT_EFFECT,
    by_quantity,
    computed_if_zero,
    counterparts,
    quantity,
)
from exfit.models.sheet import Model, Parameter

Values = Mapping[str, float]

SAME_AT_REST = 1e-9  # relative: signals that differ by rounding alone

Kind = Literal["copied", "computed", "fitted", "without effect", "typical"]


@dataclass(frozen=True)
class StartValue:
    """A value of the target model, and the parameters ``of`` the source that it is from."""

    value: float
    kind: Kind
    of: tuple[str, ...] = ()


def starting_values(task: TranslationTask) -> dict[str, StartValue]:
    """Return a value for every parameter of the target, by what it is in the source.

    What the source does not have is without effect where that is possible, else typical.
    """
    source, target = task.placed, task.target
    resolved = source.resolved()
    values = {
        row.symbol: _value(row, same, source, resolved)
        for row, same in counterparts(target.sheet, source.model.sheet)
    }
    values |= _lead_and_lag(target, source.model, resolved)
    values |= _gains(target, source.model, resolved)
    return with_limits(values, task)


def with_limits(values: Mapping[str, StartValue], task: TranslationTask) -> dict[str, StartValue]:
    """Return values of the target with the limits of the source, at the same field voltage."""
    source, rows = task.placed, by_quantity(task.target.sheet)
    theirs = by_quantity(source.model.sheet)
    # a self-excited exciter starts at a share of its ceiling
    limits = {
        row.symbol: source.values[theirs[name].symbol] if name in theirs else _far(row)
        for name, row in rows.items()
        if name in (*CEILINGS, *FLOORS)
    }
    placed = task.place({**{name: entry.value for name, entry in values.items()}, **limits})
    limited = dict(values)
    for names, tightest in ((CEILINGS, min), (FLOORS, max)):
        limited |= _limits(source, placed, names, tightest)
    floor = rows.get(OUTPUT_FLOOR)
    if floor is not None and source.at_least_zero():
        entry = limited[floor.symbol]
        limited[floor.symbol] = StartValue(max(entry.value, 0.0), "computed", entry.of)
    return limited


def _value(row: Parameter, same: Parameter | None, source: Placed, resolved: Values) -> StartValue:
    """Return the value of a parameter that is no main limit."""
    if same is not None:
        raw = computed_if_zero(row) and computed_if_zero(same)
        value = source.values[same.symbol] if raw else resolved[same.symbol]
        # a fit without bounds may have left the range of the data sheet
        if row.low <= value <= row.high or not same.low <= value <= same.high:
            return StartValue(value, "copied", (same.symbol,))
    return _without_counterpart(row, source)


def _without_counterpart(row: Parameter, source: Placed) -> StartValue:
    name = quantity(row)
    if name == "floor of the exciter voltage" and source.at_least_zero():
        return StartValue(0.0, "computed")
    if name == SUPPLY_SWITCH:
        meanings = [entry.meaning for entry in source.model.sheet]
        # its largest field voltage falls with that of the terminals
        fed_by_them = any(words in meaning for meaning in meanings for words in FED_BY_TERMINALS)
        return StartValue(1.0 if fed_by_them else 2.0, "computed")
    if name in REMOVABLE:
        return StartValue(_far(row), "without effect")
    if name in WITHOUT_EFFECT and row.low <= WITHOUT_EFFECT[name] <= row.high:
        return StartValue(WITHOUT_EFFECT[name], "without effect")
    return StartValue(row.typical, "typical")


def _far(row: Parameter) -> float:
    """Return a limit that no signal reaches."""
    far = NO_LIMIT if row.symbol.endswith("MAX") or row.symbol == "VLR" else -NO_LIMIT
    return min(max(far, row.low), row.high)


def _lead_and_lag(target: Model, source: Model, values: Values) -> dict[str, StartValue]:
    """Return lead and lag where one model gives the lead as a share of the lag."""
    ours, theirs = by_quantity(target.sheet), by_quantity(source.sheet)
    if LEAD_AS_SHARE in ours and {LEAD, LAG} <= theirs.keys():
        row, lead, lag = ours[LEAD_AS_SHARE], theirs[LEAD].symbol, theirs[LAG].symbol
        value = values[lead] / values[lag] if values[lag] > 0.0 else 1.0
        return _computed(row, value, lead, lag)
    if LEAD_AS_SHARE in theirs and LEAD in ours:
        share, lag = theirs[LEAD_AS_SHARE].symbol, theirs[LAG].symbol
        return _computed(ours[LEAD], values[share] * values[lag], share, lag)
    if LEAD_AS_SHARE in ours and LEAD_AS_SHARE not in theirs:  # lead and lag cancel
        return {ours[LEAD_AS_SHARE].symbol: StartValue(1.0, "without effect")}
    return {}


def _gains(target: Model, source: Model, values: Values) -> dict[str, StartValue]:
    """Return the regulator's gain where one model has it in several factors, as before a PID."""
    ours, theirs = by_quantity(target.sheet), by_quantity(source.sheet)
    if PROPORTIONAL in ours and PROPORTIONAL not in theirs and GAIN in theirs:
        gain = theirs[GAIN].symbol
        gains = _computed(ours[PROPORTIONAL], values[gain], gain)
        if GAIN in ours and gains:
            gains[ours[GAIN].symbol] = StartValue(1.0, "without effect")
        return gains
    lost = {*FACTORS} & theirs.keys() - ours.keys()
    if GAIN not in ours or not lost:
        return {}
    used = [row.symbol for name, row in theirs.items() if name in (GAIN, *lost)]
    return _computed(ours[GAIN], prod(values[symbol] for symbol in used), *used)


def _computed(row: Parameter, value: float, *of: str) -> dict[str, StartValue]:
    """Return a value by its symbol; nothing where its data sheet excludes it."""
    if not row.low <= value <= row.high:
        return {}
    return {row.symbol: StartValue(value, "computed", of)}


def _limits(
    source: Placed, target: Placed, names: Iterable[str], tightest: Callable[..., float]
) -> dict[str, StartValue]:
    """Return the target's ceilings, or floors: each that of the source, or else the tightest.

    What the source's others would cut off earlier, which the target does not have, cuts there.
    """
    theirs, ours = (
        {name: row for name, row in by_quantity(model.sheet).items() if name in names}
        for model in (source.model, target.model)
    )
    at_target = target.limited_signals()
    shares = _shares(source, theirs)
    lost = {name: share for name, share in shares.items() if name not in ours}
    limits = {}
    for name, row in ours.items():
        if name in shares:
            candidates = {name: shares[name], **lost}
        else:
            candidates = {} if name in REMOVABLE else shares
        at_rest = at_target.get(row.symbol, 0.0)
        if candidates and at_rest > 0.0:
            share = tightest(candidates.values())
            same = theirs[next(name for name, value in candidates.items() if value == share)]
            limits[row.symbol] = _limit(source, same, row, share * at_rest)
    return limits


def _shares(source: Placed, rows: Mapping[str, Parameter]) -> dict[str, float]:
    """Return the source's limits as multiples of what their signals are at rest."""
    signals, values = source.limited_signals(), source.resolved()
    return {
        name: values[row.symbol] / signals[row.symbol]
        for name, row in rows.items()
        if 0.0 < signals.get(row.symbol, 0.0) < inf and isfinite(values[row.symbol])
    }


def _limit(source: Placed, same: Parameter, row: Parameter, value: float) -> StartValue:
    """Return a limit of the target, copied where the value is that of the source."""
    given = source.resolved()[same.symbol]
    if computed_if_zero(same) and computed_if_zero(row) and source.values[same.symbol] == 0.0:
        return StartValue(0.0, "copied", (same.symbol,))
    if isclose(value, given, rel_tol=SAME_AT_REST) or abs(given) >= NO_LIMIT:
        return StartValue(given, "copied", (same.symbol,))
    return StartValue(min(max(value, row.low), row.high), "computed", (same.symbol,))
