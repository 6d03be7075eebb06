"""The steps of the reference that determine chosen parameters best within limits of the plant.

The search is a coordinate exchange over times and levels, from several starts; what it makes
small is an alphabetic criterion of the Cramer-Rao bound at the values of the case.

Source: Atkinson, Donev & Tobias 2007, Optimum Experimental Designs, with SAS, chapters 10 and 17.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from math import inf
from os import PathLike
from typing import Any

import numpy as np

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.features.design.candidates import (
    LAST_DWELL,
    REST,
    Bench,
    Extremes,
    Limits,
    Moves,
    ReferenceMove,
    Stage,
    extremes_of,
)
from exfit.features.design.experiment_design import comparable, noise_levels, refuse_noise
from exfit.fitting.build import build_experiments, planned
from exfit.fitting.experiment import Channel, Experiment, with_enough_substeps
from exfit.fitting.memory import check_memory
from exfit.fitting.nuisances import OF_SYSTEM
from exfit.fitting.problem import free_parameters
from exfit.fitting.residuals import Residuals
from exfit.simulation.simulator import Run
from exfit.util.arrays import median_step
from exfit.util.text import near
from exfit.util.typed import plain
from exfit.workflows import loaded

MOST_STEPS_OF_TEST, MOST_CHANNELS = 4, 3
SHORTER = 0.5  # of the duration, for comparison
LONGEST = 600.0  # s of a test: the search simulates it a thousand times
SPREAD = 0.2  # by how much a parameter may be another than the case says
CRITERIA = ("A", "D")
DWELLS = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0)  # s between steps
SHARES = tuple(k / 5.0 for k in range(-5, 6))  # of the limit of the reference
REFINEMENTS = (0.1, 0.05, 0.025)  # of that limit, about the best of these
FIRST_DWELLS = (0.2, 1.0, 3.0)  # s, of a further step
MOST_SWEEPS = 6
LEAST_GAIN = 0.01  # of the criterion, for which a step or a channel is added
LEAST_GAIN_OF_SWEEP = 1e-3  # of the criterion

Cost = Callable[[Moves], float]


@dataclass(frozen=True, eq=False)
class OtherValues:
    """The outcome of a test where each free parameter in turn is ``spread`` of itself off.

    ``extremes`` are the least and the largest value of signals, ``ratios`` the largest standard
    errors in shares of those of the best single step; None where either test determines nothing.
    """

    spread: float
    extremes: Extremes
    ratios: Mapping[str, float | None]


@dataclass(frozen=True, eq=False)
class DesignedTest:
    """The test that determines the parameters ``of`` a case best, and the stages to it.

    ``single`` is the best single step with the same channels and duration. ``noise`` is that of
    each channel, per unit, ``rate`` in samples a second, ``vt0`` the voltage at the start.
    ``extremes`` are those of the planned response ``run``.
    """

    name: str
    of: tuple[str, ...]
    criterion: str
    limits: Limits
    stages: tuple[Stage, ...]
    single: Stage
    best: Stage
    noise: Mapping[str, float]
    rate: float
    vt0: float
    extremes: Extremes
    other_values: OtherValues
    run: Run = field(repr=False)

    @property
    def ratios(self) -> dict[str, float]:
        """The standard errors, in shares of those of the best single step."""
        return {name: self.best.errors[name] / self.single.errors[name] for name in self.of}

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings before the test is made."""
        if self.limits.allow(self.other_values.extremes, self.vt0):
            return ()
        spread = f"{100.0 * self.other_values.spread:g} %"
        text = f"with a parameter off by {spread} the test would exceed a limit"
        return (f"{text}: if the values are that uncertain, give a narrower one",)

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "of": list(self.of),
            "criterion": self.criterion,
            "limits": plain(self.limits.given),
            "noise": dict(self.noise),
            "rate": self.rate,
            "best": self.best.as_json(),
            "single_step": self.single.as_json(),
            "ratios": self.ratios,
            "notes": list(self.notes),
            "extremes": plain(self.extremes),
            "other_values": plain(self.other_values),
            "stages": [stage.as_json() for stage in self.stages],
        }


def design_test(
    case: Case | str | PathLike[str],
    of: Sequence[str] = (),
    *,
    limits: Mapping[str, float] | None = None,
    duration: float | None = None,
    channels: Sequence[str] = (),
    criterion: str = "A",
    noise: Mapping[str, float] | None = None,
) -> DesignedTest:
    """Return the steps of the reference that determine parameters of a case best.

    Args:
        case: a case, or the path of its file; it needs no record.
        of: the parameters to determine best, all free ones by default; the others stay free.
        limits: how far vt and vref may deviate from their start (default 0.05), the largest efd
            and the least, efd_min; per unit.
        duration: of the test, s; by default that of the case.
        channels: what can be recorded, of which up to three are chosen; by default all signals.
        criterion: what is minimised: "A" the mean square of the relative standard errors, "D" the
            volume of their confidence ellipsoid.
        noise: as in `identify`.

    The errors are those of linear theory at the values of the case. Raises ExfitError for input
    that cannot be used.

    Example:
        >>> exfit.design_test("case.yaml", ["KA"], limits={"vt": 0.05, "efd": 4}).best.steps
    """
    case, of = loaded(case), [of] if isinstance(of, str) else of
    limits_of_test = Limits.of(limits or {})
    bench = _bench(case, of, limits_of_test, channels, criterion, noise or {})
    times = bench.base.simulator.times
    duration = float(times[-1] - times[0]) if duration is None else duration
    shortest = REST + LAST_DWELL
    if not shortest < duration <= LONGEST:
        limits_of_it = f"must exceed {shortest:g} s and be at most {LONGEST:g} s"
        raise CaseError(f"duration: {duration:g} s: {limits_of_it}")
    longest = replace(bench.base, simulator=bench.simulator((), duration))
    check_memory(case, [replace(longest, channels=bench.candidates)])
    stages = [*_stages(bench, duration)]
    moves, best = stages[-1]
    single = best_single_step(partial(bench.cost, signals=best.channels, duration=duration))
    simulator = with_enough_substeps(bench.simulator(moves, duration), bench.values(), case.path)
    run = simulator.run(bench.values())
    return DesignedTest(
        name=case.path.stem,
        of=bench.names,
        criterion=criterion,
        limits=limits_of_test,
        stages=tuple(stage for _, stage in stages),
        single=bench.stage("1 step", single, best.channels, duration),
        best=best,
        noise={channel.signal: 1.0 / channel.weight for channel in bench.candidates},
        rate=1.0 / median_step(times),
        vt0=float(run.outputs["vt"][0]),
        extremes=extremes_of(run),
        other_values=_at_other_values(bench, best, moves, single),
        run=run,
    )


def _bench(
    case: Case,
    of: Sequence[str],
    limits: Limits,
    channels: Sequence[str],
    criterion: str,
    noise: Mapping[str, float],
) -> Bench:
    """Prepare the basis of all candidates; raises CaseError for what the case does not have."""
    refuse_noise(noise)
    _refuse(case, of, channels, criterion)
    free = free_parameters(case)
    setups = build_experiments(case) if case.recordings else ()
    own = setups[0].experiment if setups else planned(case)
    starts = {parameter.name: parameter.start for parameter in free}
    fixed = {name: value for name, value in case.values().items() if name not in starts}
    of_records = {row.name: row.start for setup in setups for row in setup.free}
    base = _at_levels(case, own, of_records, {**fixed, **starts})
    chosen = tuple(k for k, parameter in enumerate(free) if parameter.name in (of or starts))
    problem = Residuals([base], free, fixed, case.ties)
    candidates = _candidates(case, own, channels, noise_levels(own, noise))
    return Bench(base, problem, candidates, chosen, criterion, limits)


def _candidates(
    case: Case, own: Experiment, channels: Sequence[str], noise: Mapping[str, float]
) -> tuple[Channel, ...]:
    """Return the channels that may be recorded; CaseError for one that the plant lacks."""
    possible = comparable(case, [own])
    if lacking := [signal for signal in channels if signal not in possible]:
        raise CaseError(f"channels: {', '.join(lacking)}: not of this plant, which has no governor")
    wanted = (signal for signal in possible if signal in (channels or possible))
    return tuple(Channel(signal, np.zeros(0), weight=1.0 / noise[signal]) for signal in wanted)


def _at_levels(
    case: Case, own: Experiment, of_records: Mapping[str, float], values: Mapping[str, float]
) -> Experiment:
    """Return the test of a case with the levels that a fit would find, at their starts."""
    levels = {
        OF_SYSTEM[nuisance.kind]: of_records[nuisance.name]
        for nuisance in own.nuisances
        if nuisance.kind in OF_SYSTEM
    }
    parameters = own.parameters({**values, **of_records})
    simulator = with_enough_substeps(own.simulator, parameters, case.path)
    return Experiment(simulator, own.channels, {**own.own, **levels})


def _refuse(case: Case, of: Sequence[str], channels: Sequence[str], criterion: str) -> None:
    """Raise CaseError for a plant without a reference, and for names that do not exist."""
    if not case.kind.closed_loop:
        text = "no test can be designed: the plant has no reference whose steps are simulated"
        raise CaseError(f"{case.path}: plant {case.kind.name}: {text}")
    names = [*case.free()]
    faults = [
        f"{key}: {name}: must be one of {', '.join(known)}; {near(name, known)}"
        for key, given, known in (("of", of, names), ("channels", channels, case.kind.compared))
        for name in given
        if name not in known
    ]
    if not names:
        faults.append(f"{case.path}: parameters.free: empty: there is nothing to identify")
    if criterion not in CRITERIA:
        faults.append(f"criterion: {criterion}: must be one of {', '.join(CRITERIA)}")
    if faults:
        raise CaseError(faults)


def _stages(bench: Bench, duration: float) -> Iterator[tuple[Moves, Stage]]:
    """Yield better and better tests: a longer one, with further channels, with further steps.

    Raises CaseError where no single step determines the parameters.
    """
    names = tuple(channel.signal for channel in bench.candidates)
    of_case = tuple(signal for signal in bench.base.signals if signal in names)
    signals = of_case[:MOST_CHANNELS] or names[:1]
    for span in (SHORTER * duration, duration):
        moves = best_single_step(partial(bench.cost, signals=signals, duration=span))
        cost = bench.cost(moves, signals, span)
        if cost < inf:
            yield moves, bench.stage(f"1 step, {span:g} s", moves, signals, span)
    if cost == inf:
        reach = f"a single step of the reference of up to {bench.limits.of_vref:g} pu"
        sought = ", ".join(bench.names)
        text = f"{reach} within the limits determines {sought} from {', '.join(signals)}"
        raise CaseError(f"no design: not even {text}")
    for more in _further_channels(bench, moves, signals, duration):
        signals = more
        yield moves, bench.stage(f"+ {signals[-1]}", moves, signals, duration)
    cost_of = partial(bench.cost, signals=signals, duration=duration)
    pool = [best_single_step(cost_of)]
    for count in range(2, MOST_STEPS_OF_TEST + 1):
        best, pool = pool[0], best_moves(cost_of, pool, duration)
        if not pool or not gains(cost_of(best), cost_of(pool[0])):
            return
        yield pool[0], bench.stage(f"{count} steps", pool[0], signals, duration)


def _further_channels(
    bench: Bench, moves: Moves, signals: tuple[str, ...], duration: float
) -> Iterator[tuple[str, ...]]:
    """Yield the channels with one more each time, the one that adds most, while one does."""
    cost = bench.cost(moves, signals, duration)
    while len(signals) < MOST_CHANNELS:
        others = [c.signal for c in bench.candidates if c.signal not in signals]
        costs = {other: bench.cost(moves, (*signals, other), duration) for other in others}
        if not costs or not gains(cost, min(costs.values())):
            return
        added = min(costs, key=lambda other: costs[other])
        signals, cost = (*signals, added), costs[added]
        yield signals


def _at_other_values(bench: Bench, best: Stage, moves: Moves, single: Moves) -> OtherValues:
    """Assess a test, and the single step, with each parameter too small and too large in turn."""
    extremes: dict[str, tuple[float, float]] = {}
    ratios: dict[str, float | None] = dict.fromkeys(bench.names, 0.0)
    free = bench.problem.free
    limits = Limits(vt=inf, vref=bench.limits.of_vref)
    for k, sign in product(range(len(free)), (1.0, -1.0)):
        start = free[k].start * (1.0 + sign * SPREAD)
        moved = replace(free[k], start=min(max(start, free[k].low), free[k].high))
        problem = replace(bench.problem, free=[*free[:k], moved, *free[k + 1 :]])
        other = replace(bench, problem=problem, limits=limits, tried={})
        run = other.simulator(moves, best.duration).run(other.values())
        for signal, (low, high) in extremes_of(run).items():
            before = extremes.get(signal, (low, high))
            extremes[signal] = min(low, before[0]), max(high, before[1])
        errors = [other.errors(steps, best.channels, best.duration) for steps in (moves, single)]
        for name in bench.names:
            ours, theirs = (of_test.get(name, inf) for of_test in errors)
            ratio = ours / theirs if ours < inf and theirs < inf else None
            worst = ratios[name]
            ratios[name] = None if ratio is None or worst is None else max(ratio, worst)
    return OtherValues(SPREAD, extremes, ratios)


def best_single_step(cost: Cost) -> Moves:
    """Return the best single step: all levels of the finest ladder, up and down."""
    finest = REFINEMENTS[-1]
    levels = [sign * k * finest for k in range(1, round(1.0 / finest) + 1) for sign in (1.0, -1.0)]
    return min(((ReferenceMove(0.0, round(level, 6)),) for level in levels), key=cost)


def best_moves(cost: Cost, fewer: Sequence[Moves], duration: float) -> list[Moves]:
    """Return moves with one more than those given, the best first; none where none are allowed.

    The best of ``fewer`` is what the search begins with; where a further move gains nothing from
    there, as when it leaves no time for one, the others of them follow.
    """
    ends: list[Moves] = []
    for before in fewer:
        starts = [min(family, key=cost) for family in _families(before, duration)]
        exchanged = [_exchanged(cost, start) for start in starts if cost(start) < inf]
        ends = sorted(dict.fromkeys([*ends, *exchanged]), key=cost)
        if ends and gains(cost(fewer[0]), cost(ends[0])):
            break
    return ends


def _families(fewer: Moves, duration: float) -> Iterator[list[Moves]]:
    """Yield moves with one more behind those given, with one more before them, and pulses."""
    first, last, count = fewer[0], fewer[-1], len(fewer) + 1
    yield [
        (*fewer, ReferenceMove(dwell, share))
        for dwell in FIRST_DWELLS
        for share in _levels(last.share)
    ]
    yield [
        (ReferenceMove(0.0, share), ReferenceMove(dwell, first.share), *fewer[1:])
        for dwell in FIRST_DWELLS
        for share in _levels(first.share)
    ]
    even = max((d for d in DWELLS if d <= (duration - REST) / count), default=DWELLS[0])
    yield [
        tuple(ReferenceMove(dwell if k else 0.0, size * (-1) ** k) for k in range(count))
        for dwell in (even, DWELLS[1])
        for size in SHARES
    ]


def gains(before: float, after: float) -> bool:
    """Tell whether a criterion is so much smaller that an addition is worth it."""
    return after <= (1.0 - LEAST_GAIN) * before


def _exchanged(cost: Cost, moves: Moves) -> Moves:
    """Exchange coordinates, one at a time, for better ones until hardly any is."""
    least = cost(moves)
    for _ in range(MOST_SWEEPS):
        before = least
        for k in range(len(moves)):
            others = [moves[k]._replace(share=share) for share in _levels(moves[k].share)]
            if k > 0:
                others += [moves[k]._replace(dwell=dwell) for dwell in DWELLS]
            for other in others:
                trial = (*moves[:k], other, *moves[k + 1 :])
                if cost(trial) < least:
                    moves, least = trial, cost(trial)
        if least > (1.0 - LEAST_GAIN_OF_SWEEP) * before:
            break
    return moves


def _levels(share: float) -> Iterator[float]:
    """Yield the levels of the ladder, and finer ones about a level."""
    near_by = (share + sign * part for part in REFINEMENTS for sign in (1.0, -1.0))
    for level in (*SHARES, *near_by):
        if abs(level) <= 1.0:
            yield round(level, 6)
