"""The design of an experiment: how well a planned test would determine the parameters.

It needs no record.

Source: Walter & Pronzato 1997, Identification of Parametric Models from Experimental Data,
chapter 6.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from os import PathLike
from typing import Any

import numpy as np

from exfit.case.case import Case
from exfit.dsp.noise import noise as noise_of
from exfit.errors import CaseError
from exfit.fitting.build import build_experiments, planned
from exfit.fitting.experiment import Channel, Experiment, with_enough_substeps
from exfit.fitting.memory import check_memory
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import free_parameters, problem_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis, linearisation, uncertainty_of
from exfit.inference.confidence import Confidence
from exfit.plants import REFERENCES
from exfit.signals import NOISE
from exfit.simulation.inputs import grid_segments
from exfit.util.text import near
from exfit.util.typed import plain
from exfit.verdict.diagnostics import search_range_notes
from exfit.workflows import loaded

STEPS = (0.02, 0.05, 0.10)  # pu, of the reference


@dataclass(frozen=True, eq=False)
class Plan:
    """A test that could be made, and how well it would determine the parameters."""

    label: str
    confidence: Confidence


@dataclass(frozen=True, eq=False)
class Design:
    """How well the test of a case would determine its parameters, and others beside it.

    ``noise`` is the standard deviation that was assumed for each signal, per unit; of each record,
    where they differ.
    """

    name: str
    own: UncertaintyAnalysis
    plans: tuple[Plan, ...]
    noise: Mapping[str, float]
    notes: tuple[str, ...] = ()

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the test of the case would leave open, in words."""
        return self.own.open

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "noise": dict(self.noise),
            **plain(self.own),
            "notes": list(self.notes),
            "plans": {plan.label: plain(plan.confidence) for plan in self.plans},
        }


def identify(case: Case | str | PathLike[str], noise: Mapping[str, float] | None = None) -> Design:
    """Predict the standard errors of a case's free parameters in tests, at their start values.

    The test of the case comes first, on the clock of its record if it has one; then steps of 2, 5
    and 10 %, a test twice as long, and further signals.

    Args:
        case: a case, or the path of its file; it needs no record.
        noise: standard deviation of the noise by signal, per unit; what is missing: that of the
            case, else of its record, else a typical one.

    Raises ExfitError for input that cannot be used.

    Example:
        >>> exfit.identify("case.yaml", {"vt": 1e-4}).sentences
    """
    case = loaded(case)
    if case.has_no_equations:
        text = "plant.twin: missing; identify needs the equations of a plant of exfit"
        raise CaseError(f"{case.path}: {text}")
    given = noise or {}
    setups = build_experiments(case) if case.recordings else ()
    free = free_parameters(case, setups)
    if not free:
        raise CaseError(f"{case.path}: parameters.free: empty: there is nothing to identify")
    refuse_noise(given)
    own = [setup.experiment for setup in setups] or [planned(case)]
    levels = [noise_levels(experiment, given) for experiment in own]
    records = tuple(parameter.name for setup in setups for parameter in setup.free)
    uncertainty_after = partial(
        _uncertainty_after, case=case, free=free, levels=levels, records=records
    )
    plans = [
        Plan(label, uncertainty_after(experiments).confidence)
        for label, experiments in _variants(case, own)
    ]
    notes = [*search_range_notes(case)]
    if case.external is not None:
        twin, program = case.external.twin, case.external.simulator
        notes.insert(0, f"these are the standard errors of the twin {twin}: {program} is not run")
    return Design(
        case.path.stem,
        uncertainty_after(own),
        tuple(plans),
        _noise_by_signal(case, own, levels),
        tuple(notes),
    )


def _uncertainty_after(
    experiments: Sequence[Experiment],
    case: Case,
    free: Sequence[FreeParameter],
    levels: Sequence[Mapping[str, float]],
    records: tuple[str, ...],
) -> UncertaintyAnalysis:
    """Predict the standard errors of experiments with these levels of noise.

    ``records`` names what is found about the records themselves. Steps whose sizes a fit would
    find have those of the tests.
    """
    check_memory(case, experiments)
    starts = {parameter.name: parameter.start for parameter in free}
    fixed = {name: value for name, value in case.values().items() if name not in starts}
    sizes = {
        nuisance.name: experiment.simulator.inputs.steps[nuisance.step].step
        for experiment in experiments
        for nuisance in experiment.nuisances
        if nuisance.kind == "step"
    }
    pairs = [*zip(experiments, levels, strict=True)]
    finest = min(of_signal[name] for experiment, of_signal in pairs for name in experiment.signals)
    expected = []
    for experiment, of_signal in pairs:
        channels = tuple(
            replace(
                channel,
                noise=of_signal[channel.signal],
                weight=finest / of_signal[channel.signal],
            )
            for channel in experiment.channels
        )
        noisy = replace(experiment, channels=channels)
        expected.append(with_enough_substeps(noisy, {**fixed, **starts, **sizes}, case.path))
    moved = [replace(row, start=sizes.get(row.name, row.start)) for row in free]
    problem = problem_of(Residuals(expected, moved, fixed, case.ties))
    residuals = problem.residuals
    linear = linearisation(problem, residuals.start, records, np.zeros(residuals.count))
    # a start on its bound is no result
    linear = replace(linear, held=(None,) * len(linear.names))
    return uncertainty_of(problem, residuals.start, linear)


def refuse_noise(noise: Mapping[str, float]) -> None:
    """Raise CaseError for a signal that does not exist, or a level that is none."""
    unknown = [name for name in noise if name not in NOISE]
    if unknown:
        raise CaseError(f"noise: {name}: not a signal; {near(name, NOISE)}" for name in unknown)
    wrong = {name: level for name, level in noise.items() if not 0.0 < level < inf}
    if wrong:
        raise CaseError(
            f"noise: {name}: {level:g}: must be finite and above 0" for name, level in wrong.items()
        )


def noise_levels(experiment: Experiment, given: Mapping[str, float]) -> dict[str, float]:
    """Return the noise of each signal in a test."""
    levels = dict(NOISE)
    for channel in experiment.channels:
        recorded = noise_of(channel.measured[channel.kept]) if np.ptp(channel.measured) else 0.0
        level = channel.noise or recorded
        if level > 0.0:
            levels[channel.signal] = level
    return {**levels, **given}


def _noise_by_signal(
    case: Case, own: Sequence[Experiment], levels: Sequence[Mapping[str, float]]
) -> dict[str, float]:
    """Return the noise of each signal, under the name of its record too where they differ."""
    by_signal = {}
    for signal in _signals(case, own):
        if len({of_signal[signal] for of_signal in levels}) == 1:
            by_signal[signal] = levels[0][signal]
        else:
            by_signal |= {
                f"{experiment.name} {signal}": of_signal[signal]
                for experiment, of_signal in zip(own, levels, strict=True)
            }
    return by_signal


def _variants(case: Case, own: Sequence[Experiment]) -> Iterator[tuple[str, list[Experiment]]]:
    """Yield tests beside the case's own; those of several records are varied together."""
    if not case.kind.closed_loop:
        return
    for size in STEPS:
        yield f"{100 * size:g} %", [_scaled(experiment, size) for experiment in own]
    yield "longer", [_longer(experiment) for experiment in own]
    present = {signal for experiment in own for signal in experiment.signals}
    extra = [signal for signal in _signals(case, own) if signal not in present]
    for signal in extra:
        yield f"+ {signal}", [_with_signals(experiment, [signal]) for experiment in own]
    if len(extra) > 1:
        yield "+ all", [_with_signals(experiment, extra) for experiment in own]


def _signals(case: Case, own: Sequence[Experiment]) -> tuple[str, ...]:
    """Return the signals that are recorded, then those that could be."""
    present = [signal for experiment in own for signal in experiment.signals]
    possible = comparable(case, own) if case.kind.closed_loop else ()
    return tuple(dict.fromkeys([*present, *possible]))


def comparable(case: Case, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """Return the signals that a record of a case could have; the gate only of a governor."""
    outputs = set[str]().union(*(each.simulator.system.outputs for each in experiments))
    return tuple(signal for signal in case.kind.compared if signal in outputs)


def _scaled(experiment: Experiment, size: float) -> Experiment:
    """Return a test whose first move of the reference has a given size, others in proportion.

    Of a recorded reference it is the largest move.
    """
    old = experiment.simulator
    inputs, moves = old.inputs, old.inputs.moves("vref")
    if "vref" in inputs.recorded:
        grid = grid_segments(inputs, old.step)
        largest = max(float(np.max(np.abs(inputs.input("vref", part)))) for part in grid)
    elif moves:
        largest = moves[0].largest
    else:
        return experiment
    share = size / largest
    steps = tuple(
        step._replace(step=share * step.step) if step.signal in REFERENCES else step
        for step in old.inputs.steps
    )
    recorded = {
        signal: replace(given, samples=share * given.samples) if signal in REFERENCES else given
        for signal, given in old.inputs.recorded.items()
    }
    if not recorded:
        return replace(experiment, simulator=old.with_inputs(steps, old.delay))
    inputs = replace(old.inputs, steps=steps, recorded=recorded)
    return replace(experiment, simulator=old.remade(inputs=inputs))


def _longer(experiment: Experiment) -> Experiment:
    """Return a test that goes on as long as it is."""
    old = experiment.simulator
    times = np.concatenate([old.times, old.times[1:] + (old.times[-1] - old.times[0])])
    inputs = replace(old.inputs, end=float(times[-1]) + max(0.0, -old.delay))
    zeros = np.zeros(len(times))
    channels = tuple(
        replace(channel, measured=zeros, filtering=None) for channel in experiment.channels
    )
    simulator = old.remade(inputs=inputs, times=times)
    return replace(experiment, simulator=simulator, channels=channels)


def _with_signals(experiment: Experiment, signals: Sequence[str]) -> Experiment:
    zeros = np.zeros(len(experiment.simulator.times))
    further = tuple(Channel(signal, zeros) for signal in signals)
    return replace(experiment, channels=(*experiment.channels, *further))
