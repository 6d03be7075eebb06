"""What a planned test would tell of the parameters: the design of an experiment, without a record.

Source: Walter & Pronzato 1997, Identification of Parametric Models from Experimental Data,
chapter 6.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.dsp.noise import noise
from exfit.errors import CaseError
from exfit.fitting.build import build_experiments, free_parameters, planned, with_enough_substeps
from exfit.fitting.compression import problem_of
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis, linearisation, uncertainty_of
from exfit.inference import Confidence
from exfit.signals import NOISE
from exfit.simulation.simulator import Simulator
from exfit.util.text import near

Array = NDArray[np.float64]

STEPS = (0.02, 0.05, 0.10)  # pu, of the reference
LONGER = 2.0  # times as long


@dataclass(frozen=True, eq=False)
class Plan:
    """A test that could be made, and how well it would tell the parameters."""

    label: str
    confidence: Confidence


@dataclass(frozen=True, eq=False)
class Design:
    """What the test of a case would tell, and others beside it.

    ``noise`` is the standard deviation that was taken for each signal, per unit; of each record,
    where they differ.
    """

    name: str
    own: UncertaintyAnalysis
    plans: tuple[Plan, ...]
    noise: Mapping[str, float]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the test of the case would leave open, in words."""
        return self.own.open

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "noise": dict(self.noise),
            **self.own.as_json(),
            "plans": {plan.label: plan.confidence.as_json() for plan in self.plans},
        }


def identify(case: Case, given: Mapping[str, float]) -> Design:
    """Return how well tests would tell the free parameters of a case, at their start values.

    The case's own test comes first, on the clock of its record if it has one; beside it steps of
    2, 5 and 10 %, a test twice as long, and further signals. ``given`` is the noise of signals, per
    unit; else it is the case's, else the record's, else `NOISE`. Raises ExfitError for input that
    cannot be used.
    """
    trials = build_experiments(case) if case.recordings else ()
    free = free_parameters(case, trials)
    if not free:
        raise CaseError([f"{case.path}: parameters.free: empty: there is nothing to identify"])
    values = {**case.values(), **{one.name: one.start for one in free}}
    own = [trial.experiment for trial in trials] or [planned(case)]
    _refuse_noise(given)
    levels = [_noise(one, given) for one in own]
    finest = min(min(noises.values()) for noises in levels)
    fixed = {name: v for name, v in values.items() if name not in {one.name for one in free}}

    def told(experiments: Sequence[Experiment]) -> UncertaintyAnalysis:
        at = {**values, **_steps(experiments)}
        pairs = zip(experiments, levels, strict=True)
        seen = [
            with_enough_substeps(_seen(one, noises, finest), at, case.path) for one, noises in pairs
        ]
        problem = problem_of(Residuals(seen, _moved(free, experiments), fixed, case.ties))
        residuals = problem.residuals
        names = tuple(one.name for trial in trials for one in trial.free)
        still = np.zeros(residuals.count)
        linear = linearisation(problem, residuals.start, names, still)
        # a start on its bound is no result
        linear = replace(linear, held=(None,) * len(linear.names))
        return uncertainty_of(problem, residuals.start, linear)

    plans = [Plan(label, told(one).confidence) for label, one in _variants(case, own)]
    return Design(
        case.path.stem,
        told(own),
        tuple(plans),
        _told_noise(case, own, levels),
    )


def _refuse_noise(given: Mapping[str, float]) -> None:
    unknown = [name for name in given if name not in NOISE]
    if unknown:
        raise CaseError(f"--noise: {name}: not a signal; {near(name, NOISE)}" for name in unknown)
    wrong = {name: level for name, level in given.items() if not 0.0 < level < inf}
    if wrong:
        raise CaseError(
            f"--noise: {name}: {level:g}: must be finite and above 0"
            for name, level in wrong.items()
        )


def _steps(experiments: Sequence[Experiment]) -> dict[str, float]:
    """Return the sizes that the tests have of steps which a fit would find."""
    return {
        unknown.name: one.simulator.inputs.steps[unknown.step].step
        for one in experiments
        for unknown in one.nuisances
        if unknown.kind == "step"
    }


def _moved(free: Sequence[FreeParameter], experiments: Sequence[Experiment]) -> list[FreeParameter]:
    """Return what is free, with the sizes of the tests' steps to start from."""
    sizes = _steps(experiments)
    return [replace(one, start=sizes.get(one.name, one.start)) for one in free]


def _noise(own: Experiment, given: Mapping[str, float]) -> dict[str, float]:
    """Return the noise of each signal in a test."""
    found = dict(NOISE)
    for channel in own.channels:
        recorded = noise(channel.measured[channel.kept]) if np.ptp(channel.measured) else 0.0
        known = channel.noise or recorded
        if known > 0.0:
            found[channel.signal] = known
    return {**found, **given}


def _told_noise(
    case: Case, own: Sequence[Experiment], levels: Sequence[Mapping[str, float]]
) -> dict[str, float]:
    """Return the noise of each signal, under the name of its record too where they differ."""
    found = {}
    for signal in _signals(case, own):
        if len({noises[signal] for noises in levels}) == 1:
            found[signal] = levels[0][signal]
        else:
            pairs = zip(own, levels, strict=True)
            found |= {f"{one.name} {signal}": noises[signal] for one, noises in pairs}
    return found


def _seen(one: Experiment, levels: Mapping[str, float], finest: float) -> Experiment:
    """Return an experiment whose channels have the noise that is expected of them."""
    channels = tuple(
        replace(channel, noise=levels[channel.signal], weight=finest / levels[channel.signal])
        for channel in one.channels
    )
    return replace(one, channels=channels)


def _variants(
    case: Case, own: Sequence[Experiment]
) -> Iterator[tuple[str, tuple[Experiment, ...]]]:
    """Yield tests beside the case's own; those of several records are varied together."""
    if not case.kind.closed_loop:
        return
    for size in STEPS:
        yield f"{100 * size:g} %", tuple(_scaled(one, size) for one in own)
    yield "longer", tuple(_longer(one) for one in own)
    present = {channel.signal for one in own for channel in one.channels}
    extra = [signal for signal in _signals(case, own) if signal not in present]
    for signal in extra:
        yield f"+ {signal}", tuple(_with(one, (signal,)) for one in own)
    if len(extra) > 1:
        yield "+ all", tuple(_with(one, extra) for one in own)


def _signals(case: Case, own: Sequence[Experiment]) -> tuple[str, ...]:
    """Return the signals that are recorded, then those that could be."""
    present = [channel.signal for one in own for channel in one.channels]
    possible = case.kind.compared if case.kind.closed_loop else ()
    return tuple(dict.fromkeys([*present, *possible]))


def _scaled(one: Experiment, size: float) -> Experiment:
    """Return a test whose first step of the reference has a given size, others in proportion."""
    steps = one.simulator.inputs.steps
    first = next((change.step for change in steps if change.signal == "vref"), None)
    if first is None:
        return one
    share = size / abs(first)
    moved = tuple(
        change._replace(step=share * change.step) if change.signal in ("vref", "vs") else change
        for change in steps
    )
    return replace(one, simulator=one.simulator.with_inputs(moved, one.simulator.delay))


def _longer(one: Experiment) -> Experiment:
    """Return a test that goes on as long as it is."""
    old = one.simulator
    times = np.concatenate([old.times, old.times[1:] + (old.times[-1] - old.times[0])])
    course = replace(old.inputs, end=float(times[-1]) + max(0.0, -old.delay))
    simulator = Simulator(old.system, course, times, old.step, old.least, old.delay)
    still = np.zeros(len(times))
    channels = tuple(replace(c, measured=still, filtering=None) for c in one.channels)
    return replace(one, simulator=simulator, channels=channels)


def _with(one: Experiment, signals: Sequence[str]) -> Experiment:
    """Return a test at which further signals are recorded."""
    still = np.zeros(len(one.simulator.times))
    more = tuple(Channel(signal, still) for signal in signals)
    return replace(one, channels=(*one.channels, *more))
