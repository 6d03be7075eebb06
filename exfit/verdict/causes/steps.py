"""Steps that were not made as the case says: sign, size, instant, number."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.fitting.experiment import Experiment
from exfit.fitting.nuisances import Nuisance
from exfit.results.verdict import Cause
from exfit.simulation.inputs import InputStep
from exfit.simulation.simulator import Simulator
from exfit.verdict.causes.evidence import Evidence, FittedRecord, Suspicion
from exfit.verdict.causes.lines import delay_found, step_found
from exfit.verdict.causes.trials import (
    LinearFit,
    Opened,
    Trial,
    always,
    linear_fit,
    tried,
    with_experiment,
    with_opened,
)

Array = NDArray[np.float64]

LARGEST_FACTOR = 5.0  # of the size of a step
LEAST_CHANGE = 0.02  # of the size of a step: no one errs by less
USUAL_CHANGE = 0.05  # errors of a step's size are rarely less
RARE = 5.0  # log-likelihood of what is rare
FARTHEST_DELAY = 2.0  # s
INSTANTS = 60  # at which a further step is looked for
LEAST_REST = 0.1  # of the record: so much of it must follow a further step


def wrong_sign(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the sign of the steps."""
    for number, record in enumerate(evidence.records):
        experiment = evidence.residuals.experiments[number]
        way = moves_by(record)
        if way is None or not experiment.simulator.inputs.steps:
            continue
        steps = tuple(step._replace(step=-step.step) for step in experiment.simulator.inputs.steps)
        simulator = experiment.simulator.with_inputs(steps, experiment.simulator.delay)
        turned = replace(experiment, simulator=simulator)
        cause = Cause(
            f"the record{evidence.name_of(number)} goes the other way ({way:+.2g} pu) than the "
            "response",
            "turn the sign of the step, or check the polarity of vt",
        )
        residuals = with_experiment(evidence.residuals, number, turned)
        yield from tried(evidence, residuals, 0, always(cause))


def moves_by(record: FittedRecord) -> float | None:
    """Change of vt in a record, pu; None unless its response goes the other way."""
    measured = record.comparison.features.measured
    simulated = record.comparison.features.simulated
    if measured is None or simulated is None:
        return None
    way = measured.final_value - measured.initial_value
    return way if way * (simulated.final_value - simulated.initial_value) < 0.0 else None


def wrong_size(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the size of the steps of a record."""
    for number, experiment in enumerate(evidence.residuals.experiments):
        free = {nuisance.step for nuisance in experiment.nuisances if nuisance.kind == "step"}
        opened = [
            Opened(Nuisance(f"cause.step{place}", "step", place), step.step, *_sizes(step.step))
            for place, step in enumerate(experiment.simulator.inputs.steps)
            if place not in free and step.step
        ]
        if not opened:
            continue

        def cause(
            trial: Trial, opened: list[Opened] = opened, number: int = number
        ) -> Cause | None:
            changes = [trial.values[each.nuisance.name] / each.start - 1.0 for each in opened]
            if max(map(abs, changes)) < LEAST_CHANGE:
                return None
            sizes = ", ".join(f"{trial.values[each.nuisance.name]:+.4g}" for each in opened)
            given = ", ".join(f"{each.start:+.4g}" for each in opened)
            return Cause(
                f"the size of the step{evidence.name_of(number)}: {sizes} pu would match, the case "
                f"has {given} pu",
                correct_step([trial.values[each.nuisance.name] for each in opened]),
            )

        residuals = with_opened(evidence.residuals, number, opened)

        def prior(trial: Trial, opened: list[Opened] = opened) -> float:
            changes = [trial.values[each.nuisance.name] / each.start - 1.0 for each in opened]
            return -RARE if max(map(abs, changes)) < USUAL_CHANGE else 0.0

        yield from tried(evidence, residuals, len(opened), cause, prior)


def _sizes(size: float) -> tuple[float, float]:
    low, high = sorted((size / LARGEST_FACTOR, size * LARGEST_FACTOR))
    return low, high


def correct_step(sizes: Sequence[float]) -> str:
    """Word the remedy for steps of other sizes, those that would match."""
    return f"correct step, or let the fit find it, {', '.join(map(step_found, sizes))}"


def correct_instant(delay: float) -> str:
    """Word the remedy for a record that is late, by a delay (s) that would match."""
    line = delay_found(delay, FARTHEST_DELAY)
    return f"correct at, or let the fit find it, under vref: `at: {{start: auto}}`; or {line}"


def wrong_instant(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a record of being earlier or later than the case says."""
    for number, record in enumerate(evidence.records):
        experiment = evidence.residuals.experiments[number]
        if any(nuisance.kind in ("at", "shift", "delay") for nuisance in experiment.nuisances):
            continue
        delay = experiment.simulator.delay
        start = delay + float(np.clip(_detected_delay(record), -FARTHEST_DELAY, FARTHEST_DELAY))
        opened = Opened(
            Nuisance("cause.delay", "delay"), start, start - FARTHEST_DELAY, start + FARTHEST_DELAY
        )

        def cause(trial: Trial, delay: float = delay, number: int = number) -> Cause:
            late = trial.values["cause.delay"] - delay
            size = f"{1e3 * abs(late):.3g} ms {'later' if late > 0.0 else 'earlier'}"
            if evidence.case.kind.finds_rest:
                compared = f"what is compared{evidence.name_of(number)} is recorded {size}"
                return Cause(
                    f"the clocks: {compared} than what drives the unit",
                    "put all channels on one clock, or let the fit find it: "
                    f"{delay_found(delay + late, FARTHEST_DELAY)}; phasors and powers may be "
                    "filtered differently",
                )
            return Cause(
                f"the instant of the step{evidence.name_of(number)}, or a delay of the recorder: "
                f"the record is {size} than the case",
                correct_instant(delay + late),
            )

        residuals = with_opened(evidence.residuals, number, [opened])
        yield from tried(evidence, residuals, 1, cause)


def _detected_delay(record: FittedRecord) -> float:
    """Delay (s) of the step in the record after that in the response, 0 if unknown."""
    from exfit.dsp.step_detection import first_step

    overlays, time = record.comparison.overlays, record.comparison.time
    overlay = overlays.get("vt") or next(iter(overlays.values()))
    kept = np.isfinite(overlay.error)
    measured = first_step(time[kept], overlay.measured[kept])
    simulated = first_step(time[kept], overlay.simulated[kept])
    return 0.0 if measured is None or simulated is None else measured.at - simulated.at


def further_step(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a step of the reference in the record that the case does not have."""
    linear = linear_fit(evidence)
    if linear is None:
        return
    offset = 0
    for number, experiment in enumerate(evidence.residuals.experiments):
        rows = slice(offset, offset + sum(experiment.sizes))
        offset = rows.stop
        steps = experiment.simulator.inputs.steps
        if not any(step.signal == "vref" for step in steps):
            continue
        at = _likeliest_instant(evidence, linear, number, rows)
        if at is None:
            continue
        place, name = len(steps), ("cause.at", "cause.step")
        size = max(abs(step.step) for step in steps)
        own = experiment.simulator
        inputs = replace(own.inputs, steps=(*steps, InputStep(at, 0.0, smooth=True)))
        simulator = Simulator(own.system, inputs, own.times, own.step, own.least, own.delay)
        near = 2.0 * _spacing(experiment)
        opened = [
            Opened(Nuisance(name[0], "at", place), at, at - near, at + near),
            Opened(Nuisance(name[1], "step", place), 0.02 * size, -size, size),
        ]

        def cause(trial: Trial, number: int = number) -> Cause:
            return Cause(
                f"a further step{evidence.name_of(number)} that the case does not have: "
                f"{trial.values['cause.step']:+.2g} pu at {trial.values['cause.at']:.4g} s",
                "add it under vref, or end the record before it: window",
            )

        changed = replace(experiment, simulator=simulator)
        residuals = with_experiment(evidence.residuals, number, changed)
        yield from tried(evidence, with_opened(residuals, number, opened), 2, cause)


def _spacing(experiment: Experiment) -> float:
    """Distance (s) of the instants at which a further step is tried."""
    times = experiment.simulator.times
    return float(times[-1] - times[0]) / INSTANTS


def _likeliest_instant(
    evidence: Evidence, linear: LinearFit, number: int, rows: slice
) -> float | None:
    """Find the instant of a further step that explains most, by the response to the first one."""
    experiment = evidence.residuals.experiments[number]
    first = experiment.simulator.inputs.steps[0]
    unit = replace(experiment, nuisances=(*experiment.nuisances, Nuisance("cause.unit", "step", 0)))
    try:
        values = {**evidence.values, "cause.unit": first.step}
        samples, slopes = unit.response_with_derivatives(values, [{"cause.unit": 1.0}])
    except SimulationError:
        return None
    times = experiment.simulator.times
    lowest, instant = evidence.cost, None
    for at in np.linspace(times[0], times[-1], INSTANTS + 1)[1:]:
        if at < first.at + _spacing(experiment) or at > times[-1] - LEAST_REST * np.ptp(times):
            continue
        column = np.zeros((len(linear.errors), 1))
        column[rows, 0] = _moved(experiment, times, slopes[:, :, 0], samples, float(at - first.at))
        cost = linear.with_columns(column).cost
        if cost < lowest:
            lowest, instant = cost, float(at)
    return instant


def _moved(experiment: Experiment, times: Array, slopes: Array, samples: Array, by: float) -> Array:
    """Return weighted responses (errors,) to a unit step, made so much later (s)."""
    columns = []
    for k, channel in enumerate(experiment.channels):
        later = np.interp(times - by, times, slopes[:, k], left=0.0)
        filtered = channel.slopes(samples[:, k], later[:, None])
        columns.append(channel.weight * filtered[:, 0])
    return np.concatenate(columns)
