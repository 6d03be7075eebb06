"""The steps of the reference that make chosen parameters best known, within limits of the plant.

The search is a coordinate exchange over instants and levels, from several starts; what it makes
small is an alphabetic criterion of the Cramer-Rao bound at the values of the case.

Source: Atkinson, Donev & Tobias 2007, Optimum Experimental Designs, with SAS, chapters 10 and 17.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.features.design.candidates import LAST_DWELL, REST, Bench, Moves, Stage
from exfit.features.design.exchange import best_moves, best_single_step, gains
from exfit.features.design.experiment_design import noise_levels, refuse_noise
from exfit.features.design.limits import Extremes, Limits, extremes_of
from exfit.fitting.build import build_experiments, planned
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.nuisances.kinds import OF_SYSTEM
from exfit.fitting.problem import free_parameters
from exfit.fitting.residuals import Residuals
from exfit.fitting.setup import ExperimentSetup, with_enough_substeps
from exfit.simulation.simulator import Run
from exfit.util.text import near
from exfit.util.typed import plain

MOST_STEPS_OF_TEST, MOST_CHANNELS = 4, 3
SHORTER = 0.5  # of the duration, for comparison
LONGEST = 600.0  # s of a test: the search simulates it a thousand times
SPREAD = 0.2  # by how much a parameter may be another than the case says
CRITERIA = ("A", "D")


@dataclass(frozen=True, eq=False)
class OtherValues:
    """What becomes of a test where each free parameter in turn is ``spread`` of itself off.

    ``extremes`` are the least and the largest value of signals, ``ratios`` the largest standard
    errors in shares of those of the best single step; None where either test determines nothing.
    """

    spread: float
    extremes: Extremes
    ratios: Mapping[str, float | None]


@dataclass(frozen=True, eq=False)
class DesignedTest:
    """The test that makes the parameters ``of`` a case best known, and the ways to it.

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
        """What must be known before the test is made."""
        if self.limits.allow(self.other_values.extremes, self.vt0):
            return ()
        spread = f"{100.0 * self.other_values.spread:g} %"
        text = f"with a parameter {spread} off the test would exceed a limit"
        return (f"{text}: where the values are that uncertain, give a narrower one",)

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


def designed_test(
    case: Case,
    of: Sequence[str],
    limits: Limits,
    duration: float | None,
    channels: Sequence[str],
    criterion: str,
    noise: Mapping[str, float],
) -> DesignedTest:
    """Return the steps of the reference that make the parameters ``of`` a case best known.

    All free parameters by default, while the others stay free. Of ``channels``, all signals of the
    plant by default, up to three are chosen, those of the case first. Without ``duration`` (s) the
    test is as long as that of the case. Raises ExfitError for input that cannot be used, and where
    no single step within the limits determines the parameters.
    """
    refuse_noise(noise)
    bench = _bench(case, of, limits, channels, criterion, noise)
    times = bench.base.simulator.times
    duration = float(times[-1] - times[0]) if duration is None else duration
    shortest = REST + LAST_DWELL
    if not shortest < duration <= LONGEST:
        limits_of_it = f"must exceed {shortest:g} s and be at most {LONGEST:g} s"
        raise CaseError([f"duration: {duration:g} s: {limits_of_it}"])
    stages = [*_stages(bench, duration)]
    best = stages[-1].stage
    moves = best_single_step(bench, best.channels, duration)
    single = bench.stage("1 step", moves, best.channels, duration)
    run = _checked_run(case, bench, stages[-1].moves, duration)
    return DesignedTest(
        name=case.path.stem,
        of=bench.names,
        criterion=criterion,
        limits=limits,
        stages=tuple(candidate.stage for candidate in stages),
        single=single,
        best=best,
        noise={channel.signal: 1.0 / channel.weight for channel in bench.candidates},
        rate=1.0 / float(np.median(np.diff(times))),
        vt0=float(run.outputs["vt"][0]),
        extremes=extremes_of(run),
        other_values=_at_other_values(bench, best, stages[-1].moves, moves),
        run=run,
    )


class _Candidate(NamedTuple):
    """The moves of a test, and what it would show."""

    moves: Moves
    stage: Stage


def _stages(bench: Bench, duration: float) -> Iterator[_Candidate]:
    """Yield better and better tests: a longer one, with further channels, with further steps.

    Raises CaseError where no single step determines the parameters.
    """

    def candidate(label: str, moves: Moves, signals: tuple[str, ...], span: float) -> _Candidate:
        return _Candidate(moves, bench.stage(label, moves, signals, span))

    signals = _first_channels(bench)
    shorter = SHORTER * duration
    moves = best_single_step(bench, signals, shorter)
    if bench.cost(moves, signals, shorter) < inf:
        yield candidate(f"1 step, {shorter:g} s", moves, signals, shorter)
    moves = best_single_step(bench, signals, duration)
    if bench.cost(moves, signals, duration) == inf:
        reach = f"a single step of the reference of up to {bench.limits.of_vref:g} pu"
        names = ", ".join(bench.names)
        text = f"{reach} within the limits determines {names} from {', '.join(signals)}"
        raise CaseError([f"no design: not even {text}"])
    yield candidate(f"1 step, {duration:g} s", moves, signals, duration)
    for more in _further_channels(bench, moves, signals, duration):
        signals = more
        yield candidate(f"+ {signals[-1]}", moves, signals, duration)
    pool = [best_single_step(bench, signals, duration)]
    for count in range(2, MOST_STEPS_OF_TEST + 1):
        best, pool = pool[0], best_moves(bench, pool, signals, duration)
        if not pool or not gains(*(bench.cost(m, signals, duration) for m in (best, pool[0]))):
            return
        yield candidate(f"{count} steps", pool[0], signals, duration)


def _first_channels(bench: Bench) -> tuple[str, ...]:
    """Return the channels of the case that can be recorded, or the first that can."""
    names = tuple(channel.signal for channel in bench.candidates)
    return tuple(s for s in bench.base.signals if s in names)[:MOST_CHANNELS] or names[:1]


def _further_channels(
    bench: Bench, moves: Moves, first: tuple[str, ...], duration: float
) -> Iterator[tuple[str, ...]]:
    """Yield the channels with one more each time, the one that adds most, while one does."""
    signals, cost = first, bench.cost(moves, first, duration)
    while len(signals) < MOST_CHANNELS:
        others = [c.signal for c in bench.candidates if c.signal not in signals]
        costs = {signal: bench.cost(moves, (*signals, signal), duration) for signal in others}
        if not costs or not gains(cost, min(costs.values())):
            return
        added = min(costs, key=lambda signal: costs[signal])
        signals, cost = (*signals, added), costs[added]
        yield signals


def _checked_run(case: Case, bench: Bench, moves: Moves, duration: float) -> Run:
    """Return the response to a test, with sub-steps enough all along it."""
    simulator = bench.simulator(moves, duration)
    return with_enough_substeps(simulator, bench.values(), case.path).run(bench.values())


def _at_other_values(bench: Bench, best: Stage, moves: Moves, single: Moves) -> OtherValues:
    """Assess a test, and the single step, with other values of the parameters."""
    extremes: dict[str, tuple[float, float]] = {}
    ratios: dict[str, float | None] = dict.fromkeys(bench.names, 0.0)
    for other in _benches_beside(bench):
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


def _benches_beside(bench: Bench) -> Iterator[Bench]:
    """Yield the bench with each parameter too small and too large, within its bounds; no limits."""
    free = bench.problem.free
    for k, parameter in enumerate(free):
        for sign in (1.0, -1.0):
            start = parameter.start * (1.0 + sign * SPREAD)
            moved = replace(parameter, start=min(max(start, parameter.low), parameter.high))
            problem = replace(bench.problem, free=[*free[:k], moved, *free[k + 1 :]])
            limits = Limits(vt=inf, vref=bench.limits.of_vref)
            yield replace(bench, problem=problem, limits=limits, tried={})


def _bench(
    case: Case,
    of: Sequence[str],
    limits: Limits,
    channels: Sequence[str],
    criterion: str,
    noise: Mapping[str, float],
) -> Bench:
    """Prepare the basis of all candidates; raises CaseError for what the case does not have."""
    _refuse(case, of, channels, criterion)
    free = free_parameters(case)
    setups = build_experiments(case) if case.recordings else ()
    own = setups[0].experiment if setups else planned(case)
    levels = noise_levels(own, noise)
    candidates = tuple(
        Channel(signal, np.zeros(0), weight=1.0 / levels[signal])
        for signal in case.kind.compared
        if signal in (channels or case.kind.compared)
    )
    starts = {parameter.name: parameter.start for parameter in free}
    fixed = {name: value for name, value in case.values().items() if name not in starts}
    base = _rested(case, own, {**fixed, **starts}, setups)
    chosen = tuple(k for k, parameter in enumerate(free) if parameter.name in (of or starts))
    problem = Residuals([base], free, fixed, case.ties)
    return Bench(base, problem, candidates, chosen, criterion, limits)


def _rested(
    case: Case, own: Experiment, values: Mapping[str, float], setups: Sequence[ExperimentSetup]
) -> Experiment:
    """Return the test of a case with the levels that a fit would find, at their starts."""
    of_records = {row.name: row.start for setup in setups for row in setup.free}
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
        raise CaseError([f"{case.path}: plant {case.kind.name}: {text}"])
    names = [*case.free()]
    faults = [*_unknown("of", of, names), *_unknown("channels", channels, case.kind.compared)]
    if not names:
        faults.append(f"{case.path}: parameters.free: empty: there is nothing to identify")
    if criterion not in CRITERIA:
        faults.append(f"criterion: {criterion}: must be one of {', '.join(CRITERIA)}")
    if faults:
        raise CaseError(faults)


def _unknown(key: str, given: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    """Yield a fault for each name that is given and not among those that there are."""
    for name in given:
        if name not in names:
            yield f"{key}: {name}: must be one of {', '.join(names)}; {near(name, names)}"
