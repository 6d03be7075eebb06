"""What a model has from another before anything is fitted: values of the same quantities.

A limit is copied in proportion to what its signal is at rest: where a model leaves out the
demagnetising factor, its regulator gives less for the same field voltage.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf, isclose, isfinite, prod
from typing import Literal

from exfit.engine.system import System
from exfit.engine.trace import evaluate
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
    Counterpart,
    by_quantity,
    computed_if_zero,
    counterparts,
    has_effect,
    quantity,
)
from exfit.models.sheet import Model, Parameter
from exfit.simulation.limits import at_rest, equation_limits, traced

Values = Mapping[str, float]

SAME_AT_REST = 1e-9  # relative: signals that differ by rounding alone

Kind = Literal["copied", "computed", "fitted", "without effect", "typical"]


@dataclass(frozen=True)
class StartValue:
    """A value of the target model, and the parameters ``of`` the source that it is from."""

    value: float
    kind: Kind
    of: tuple[str, ...] = ()


@dataclass(frozen=True)
class Placed:
    """A model in a plant: its system, and all values of that by name."""

    model: Model
    system: System
    values: Values

    def resolved(self) -> dict[str, float]:
        """Return the values of the model's parameters, those computed at the start as computed."""
        start = self._at_rest()
        own = {row.symbol: self.values[row.symbol] for row in self.model.sheet}
        return {name: start.get(f"{name}0", value) for name, value in own.items()}

    def limited_signals(self) -> dict[str, float]:
        """Find the value at rest of the signal behind each limit, by the limit's name."""
        graph = traced(self.system)
        limiters = equation_limits(self.system)
        values = evaluate([limiter.value for limiter in limiters], at_rest(graph, self.values))
        return {limiter.limit: float(values[limiter.value]) for limiter in limiters}

    def at_least_zero(self) -> bool:
        """Tell whether the exciter's voltage cannot become negative, whatever the data say."""
        return any(limiter.limit == "0" for limiter in equation_limits(self.system))

    def _at_rest(self) -> dict[str, float]:
        graph = traced(self.system)
        start = at_rest(graph, self.values)
        return {
            name: float(start[node])
            for name, node in zip(self.system.setpoints, graph.r, strict=True)
        }


def starting_values(
    source: Placed, target: Model, place: Callable[[Values], Placed]
) -> dict[str, StartValue]:
    """Return a value for every parameter of the target, by what it is in the source.

    ``place`` puts values of the target into the source's plant. What the source does not have is
    without effect where that is possible, else typical.
    """
    resolved = source.resolved()
    pairs = counterparts(target.sheet, source.model.sheet)
    values = {pair.row.symbol: _value(pair, source, resolved) for pair in pairs}
    values |= _lead_and_lag(target, source.model, resolved)
    values |= _gains(target, source.model, resolved)
    return with_limits(values, source, target, place)


def with_limits(
    values: Mapping[str, StartValue],
    source: Placed,
    target: Model,
    place: Callable[[Values], Placed],
) -> dict[str, StartValue]:
    """Return values of the target with the limits of the source, at the same field voltage."""
    rows = by_quantity(target.sheet)
    theirs = by_quantity(source.model.sheet)
    # a self-excited exciter starts at a share of its ceiling
    limits = {
        row.symbol: source.values[theirs[name].symbol] if name in theirs else _far(row)
        for name, row in rows.items()
        if name in (*CEILINGS, *FLOORS)
    }
    placed = place({**{name: entry.value for name, entry in values.items()}, **limits})
    limited = dict(values)
    for names, tightest in ((CEILINGS, min), (FLOORS, max)):
        limited |= _limits(source, placed, names, tightest)
    floor = rows.get(OUTPUT_FLOOR)
    if floor is not None and source.at_least_zero():
        entry = limited[floor.symbol]
        limited[floor.symbol] = StartValue(max(entry.value, 0.0), "computed", entry.of)
    return limited


def lost_parameters(source: Placed, values: Mapping[str, StartValue]) -> tuple[Parameter, ...]:
    """Return the parameters of the source that act, and of which nothing is in the target."""
    used = {name for entry in values.values() for name in entry.of}
    return tuple(
        row
        for row in source.model.sheet
        if row.symbol not in used and has_effect(row, source.values[row.symbol])
    )


def _value(pair: Counterpart, source: Placed, resolved: Values) -> StartValue:
    """Return the value of a parameter that is no main limit."""
    row, same = pair
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
        return StartValue(1.0 if _fed_by_terminals(source.model) else 2.0, "computed")
    if name in REMOVABLE:
        return StartValue(_far(row), "without effect")
    if name in WITHOUT_EFFECT and row.low <= WITHOUT_EFFECT[name] <= row.high:
        return StartValue(WITHOUT_EFFECT[name], "without effect")
    return StartValue(row.typical, "typical")


def _fed_by_terminals(model: Model) -> bool:
    """Tell whether a model's largest field voltage falls with that of the terminals."""
    return any(words in row.meaning for row in model.sheet for words in FED_BY_TERMINALS)


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
        return _before_a_gain(ours, theirs[GAIN], values)
    lost = {*FACTORS} & theirs.keys() - ours.keys()
    if GAIN not in ours or not lost:
        return {}
    used = [row.symbol for name, row in theirs.items() if name in (GAIN, *lost)]
    return _computed(ours[GAIN], prod(values[symbol] for symbol in used), *used)


def _before_a_gain(
    ours: Mapping[str, Parameter], gain: Parameter, values: Values
) -> dict[str, StartValue]:
    """Return the source's gain as the proportional one of a PID, with 1 behind it."""
    proportional = _computed(ours[PROPORTIONAL], values[gain.symbol], gain.symbol)
    behind = [ours[GAIN].symbol] if GAIN in ours and proportional else []
    return proportional | {symbol: StartValue(1.0, "without effect") for symbol in behind}


def _computed(row: Parameter, value: float, *of: str) -> dict[str, StartValue]:
    """Return a value by its symbol; nothing where its data sheet excludes it."""
    if not row.low <= value <= row.high:
        return {}
    return {row.symbol: StartValue(value, "computed", of)}


def _limits(
    source: Placed,
    target: Placed,
    names: Iterable[str],
    tightest: Callable[..., float],
) -> dict[str, StartValue]:
    """Return the target's ceilings, or floors: each that of the source, or else the tightest.

    What the source's others would cut off earlier, which the target does not have, cuts there.
    """
    theirs, ours = _rows(source.model, names), _rows(target.model, names)
    shares, at_rest_here = _shares(source, theirs), target.limited_signals()
    limits = {}
    for name, row in ours.items():
        candidates = _candidates(name, shares, ours)
        at_rest_now = at_rest_here.get(row.symbol, 0.0)
        if candidates and at_rest_now > 0.0:
            share = tightest(candidates.values())
            chosen = next(name for name, value in candidates.items() if value == share)
            limits[row.symbol] = _limit(source, theirs[chosen], row, share, at_rest_now)
    return limits


def _rows(model: Model, names: Iterable[str]) -> dict[str, Parameter]:
    """Return those parameters of a model that are certain quantities."""
    return {name: row for name, row in by_quantity(model.sheet).items() if name in names}


def _candidates(name: str, shares: Values, ours: Iterable[str]) -> Values:
    """Return the limits of the source that one of the target may stand for."""
    if name in shares:
        lost = {other: share for other, share in shares.items() if other not in ours}
        return {name: shares[name], **lost}
    return {} if name in REMOVABLE else shares


def _shares(source: Placed, rows: Mapping[str, Parameter]) -> dict[str, float]:
    """Return the source's limits as multiples of what their signals are at rest."""
    signals, values = source.limited_signals(), source.resolved()
    return {
        name: values[row.symbol] / signals[row.symbol]
        for name, row in rows.items()
        if 0.0 < signals.get(row.symbol, 0.0) < inf and isfinite(values[row.symbol])
    }


def _limit(
    source: Placed, theirs: Parameter, row: Parameter, share: float, at_rest_now: float
) -> StartValue:
    given = source.values[theirs.symbol]
    resolved = source.resolved()[theirs.symbol]
    if computed_if_zero(theirs) and computed_if_zero(row) and given == 0.0:
        return StartValue(0.0, "copied", (theirs.symbol,))
    value = share * at_rest_now
    if isclose(value, resolved, rel_tol=SAME_AT_REST) or abs(resolved) >= NO_LIMIT:
        return StartValue(resolved, "copied", (theirs.symbol,))
    inside = min(max(value, row.low), row.high)
    return StartValue(inside, "computed", (theirs.symbol,))
