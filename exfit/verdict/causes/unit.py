"""What the case says of the unit: machine data, limits, bounds, the model itself."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import log

import numpy as np

from exfit.case.case import Case
from exfit.case.changes import freed, number_text, part_of
from exfit.errors import SimulationError
from exfit.estimate import Stop
from exfit.fitting.parameters import LARGEST_FACTOR, FreeParameter, freed_within
from exfit.fitting.residuals import with_freed
from exfit.plants import MACHINE
from exfit.results.cause import Cause, Remedy
from exfit.simulation.limits import Extreme, extremes
from exfit.util.text import dotted, listed
from exfit.verdict.causes.evidence import (
    CERTAIN,
    Evidence,
    Suspicion,
    suspected,
)
from exfit.verdict.causes.trials import (
    DEPENDENT,
    linear_fit,
    refitted,
)

MORE_ITERATIONS = 20  # times
WIDER = 10.0  # times: how much farther a bound is put
MOST_FIXED = 2  # values that are tried, those that would explain most
MOST_LIMITS = 4  # that are tried, those that were met first
CUT = 0.8  # of the way to its highest value: where a limit that was not met is tried
TPD0 = f"{MACHINE}Tpd0"
SATURATION = (f"{MACHINE}S10", f"{MACHINE}S12")
USUAL_ERROR = 0.5  # of the logarithm of a value that is given
RARE = 5.0  # log-likelihood: other fixed values are wrong less often than machine data


def machine_data(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a time constant or the saturation of the machine."""
    fixed = evidence.residuals.fixed
    for names in ((TPD0,), SATURATION):
        given = [name for name in names if fixed.get(name, 0.0) > 0.0]
        if given:
            yield from _other_values(evidence, given)


def fixed_values(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the fixed values another of which would match: those that linear theory prefers."""
    fixed = evidence.residuals.fixed
    rows = evidence.case.rows()
    own = (TPD0, *SATURATION)
    names = [
        name
        for name, value in fixed.items()
        if value > 0.0 and name in rows and name not in own
        if "MAX" not in name and "MIN" not in name  # those are limits
    ]
    for name in _most_explaining(evidence, names) if names else ():
        yield from _other_values(evidence, [name], RARE)


def _most_explaining(evidence: Evidence, names: list[str]) -> list[str]:
    """Return the fixed values that would explain most, the first first."""
    fixed, linear = evidence.residuals.fixed, linear_fit(evidence)
    if linear is None:
        return []
    freed = [freed_within(name, fixed[name], LARGEST_FACTOR) for name in names]
    residuals = with_freed(evidence.residuals, freed)
    theta = np.append(evidence.solution.x, [each.scaled(each.start) for each in freed])
    try:
        _, slopes = residuals.errors(theta)
    except SimulationError:
        return []
    columns = slopes[:, -len(freed) :]
    sizes = np.linalg.norm(columns, axis=0)
    costs = {
        name: linear.with_columns(columns[:, [k]]).cost
        for k, name in enumerate(names)
        if np.isfinite(sizes[k]) and sizes[k] > DEPENDENT * np.nanmax(sizes)
    }
    return sorted(costs, key=lambda name: costs[name])[:MOST_FIXED]


def _other_values(evidence: Evidence, names: list[str], rare: float = 0.0) -> Iterator[Suspicion]:
    fixed = evidence.residuals.fixed
    freed = [freed_within(name, fixed[name], LARGEST_FACTOR) for name in names]
    trial = refitted(evidence, with_freed(evidence.residuals, freed))
    if trial is None:
        return
    part = "machine data" if of_machine(names) else "fixed values"
    starts = {name: trial.values[name] for name in names}
    pairs = [f"{name} {start:.3g} (given {fixed[name]:g})" for name, start in starts.items()]
    cause = Cause(f"the {part}: {listed(pairs)} would match", *remedy_of(evidence.case, starts))
    ratios = [log(start / fixed[name]) for name, start in starts.items()]
    prior = -0.5 * sum((ratio / USUAL_ERROR) ** 2 for ratio in ratios) - rare
    yield from suspected(evidence, trial, len(names), cause, prior)


def of_machine(names: Sequence[str]) -> bool:
    """Test whether values are data of the machine."""
    return names[0].startswith(MACHINE)


def remedy_of(case: Case, starts: Mapping[str, float], check: str = "") -> Remedy:
    """Return the remedy for values that may be wrong; a fit of them begins with ``starts``.

    ``check`` is what to look at, by default where such values are from.
    """
    names, values = [*starts], case.values()
    source = "nameplate and test reports" if of_machine(names) else "the data sheet"
    part = part_of(case, names[0])
    if part is not None:
        given = {symbol: values[part.prefix + symbol] for symbol in part.symbols}
        if any(
            part.check(given | {name.removeprefix(part.prefix): starts[name] for name in names})
        ):
            starts = {name: values[name] for name in names}  # what matches best may be no machine's
    found = part is not None and part.free is not None
    words = check or f"check {source}{', or fit' if found else ''}"
    freed_names = tuple(names) if found else ()
    return Remedy(words, "-".join(names), freed(case, starts), freed_names)


def wrong_limit(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect limits: met too early, or never although those of the unit are."""
    fixed = evidence.residuals.fixed
    for _, record, experiment in evidence.tests:
        at = record.setup.with_start_values(evidence.values)
        try:
            reached = extremes(*experiment.at(at))
        except SimulationError:
            continue
        farthest: dict[str, Extreme] = {}
        for extreme in sorted(reached, key=lambda extreme: -extreme.share):
            if fixed.get(extreme.limit, 0.0) != 0.0:
                farthest.setdefault(extreme.limit, extreme)
        for extreme in [*farthest.values()][:MOST_LIMITS]:
            yield from _other_limit(evidence, extreme)


def _other_limit(evidence: Evidence, extreme: Extreme) -> Iterator[Suspicion]:
    name = extreme.limit
    given = evidence.residuals.fixed[name]
    start = given if extreme.share >= 1.0 else CUT * extreme.share * given
    low, high = sorted((start / LARGEST_FACTOR, LARGEST_FACTOR * max(given / start, 1.0) * start))
    freed = FreeParameter(name, start, low, high, logarithmic=given > 0.0)
    if trial := refitted(evidence, with_freed(evidence.residuals, [freed])):
        value = trial.values[name]
        text = (
            f"the limit {name} {given:g}, which the response meets and the record does not: "
            f"{value:.3g} or more would match"
        )
        if abs(value) < abs(given):
            text = f"a limit that the case does not have: {name} {value:.3g} would match"
            text += f" (given {given:g})"
        check = f"check {name} in the data sheet and the settings"
        cause = Cause(text, *remedy_of(evidence.case, {name: value}, check))
        yield from suspected(evidence, trial, 1, cause)


def narrow_bound(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect bounds that hold parameters although the record asks for more."""
    residuals, sides, wider = evidence.residuals, dict[str, str](), list[FreeParameter]()
    for each in residuals.free:
        side = each.bound(evidence.values[each.name])
        low, high = each.low, each.high
        if side is not None:
            sides[each.name] = side
            more = WIDER * (high - low)
            low, high = (
                (low / WIDER, high * WIDER) if each.logarithmic else (low - more, high + more)
            )
        wider.append(replace(each, low=low, high=high))
    if not sides:
        return
    if trial := refitted(evidence, replace(residuals, free=wider, counter=None)):
        held = [f"{name} on its {side}" for name, side in sides.items()]
        values = [f"{name} {trial.values[name]:.3g}" for name in sides]
        cause = Cause(
            f"the bounds: {listed(held)}; beyond, {listed(values)} would match",
            "widen the bounds where the data sheet allows it",
            "bounds",
            _wider_bounds(evidence.case, {each.name: each for each in wider}, sides),
        )
        yield from suspected(evidence, trial, len(sides), cause)


def _wider_bounds(
    case: Case, wider: Mapping[str, FreeParameter], sides: Mapping[str, str]
) -> Mapping[str, str]:
    """Return the changes that widen bounds, as far as the equations allow."""
    changes, free = {}, case.free()
    for name, side in sides.items():
        part = part_of(case, name)
        if part is None or part.free is None or getattr(free.get(name), side, None) is None:
            continue
        symbol = name.removeprefix(part.prefix)
        low, high = next(row.domain for row in part.sheet if row.symbol == symbol)
        bound = max(wider[name].low, low) if side == "min" else min(wider[name].high, high)
        changes[dotted((*part.free, symbol, side))] = number_text(bound)
    return changes


def not_ended(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the iterations of a case of being too few."""
    if evidence.solution.stop in (Stop.ITERATIONS, Stop.EVALUATIONS):
        given = evidence.case.estimate.most_iterations
        most = "" if isinstance(given, Mapping) else str(MORE_ITERATIONS * given)
        cause = Cause(
            "the search had too few iterations",
            "increase them, or use the default search",
            "iterations",
            {"estimate.iterations": most},
        )
        yield Suspicion(cause, CERTAIN)
