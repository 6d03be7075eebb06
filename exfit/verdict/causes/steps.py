"""Steps that were not made as the case says: sign, size, instant, number."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from exfit.case.changes import between, number_text, within
from exfit.case.schema import Unknown
from exfit.errors import SimulationError
from exfit.fitting.experiment import Experiment
from exfit.fitting.nuisances import Nuisance
from exfit.fitting.residuals import Residuals
from exfit.plants import REFERENCES, SPEED
from exfit.results.cause import Cause, Remedy
from exfit.simulation.inputs import InputStep
from exfit.verdict.causes.evidence import Evidence, FittedRecord, Suspicion, Trial, suspected
from exfit.verdict.causes.trials import (
    LinearFit,
    Opened,
    linear_fit,
    refitted,
    tried,
    with_experiment,
    with_opened,
)

LARGEST_FACTOR = 5.0  # of the size of a step
LEAST_CHANGE = 5e-3  # of the size of a step
USUAL_CHANGE = 0.05  # errors of a step's size are rarely less
RARE = 5.0  # log-likelihood of what is rare
FARTHEST_DELAY = 2.0  # s
RAMP_FACTOR, MOST_RAMPS = 1.5, 3
RAMPS = tuple(0.02 * RAMP_FACTOR**k for k in range(13))  # s, of the durations that are tried
INSTANTS = 60  # at which a further step is looked for
LEAST_FURTHER = 0.03  # of the largest step: smaller further ones are rare
LEAST_REST = 0.1  # of the record: so much of it must follow a further step


def wrong_sign(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the sign of the steps."""
    for number, record, experiment in evidence.tests:
        own, features = experiment.simulator, record.comparison.features
        measured, simulated = features.measured, features.simulated
        if measured is None or simulated is None or not own.inputs.steps:
            continue
        way = measured.final_value - measured.initial_value
        if not way * (simulated.final_value - simulated.initial_value) < 0.0:
            continue
        steps = tuple(step._replace(step=-step.step) for step in own.inputs.steps)
        turned = replace(experiment, simulator=own.with_inputs(steps, own.delay))
        cause = Cause(
            f"the record{evidence.name_of(number)} goes the other way ({way:+.2g} pu) than the "
            "response",
            "check the sign of the step, and the polarity of vt",
            "sign",
            _turned(evidence, number),
        )
        yield from tried(evidence, with_experiment(evidence.residuals, number, turned), cause)


def wrong_size(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the size of the steps of a record."""
    for number, record, experiment in evidence.tests:
        opened = [*_open_sizes(experiment)]
        trial = opened and refitted(evidence, with_opened(evidence.residuals, number, opened))
        if not trial:
            continue
        found = {each.nuisance.step: trial.values[each.nuisance.name] for each in opened}
        change = max(abs(found[each.nuisance.step] / each.start - 1.0) for each in opened)
        if change < LEAST_CHANGE:
            continue
        sizes = ", ".join(f"{size:+.4g}" for size in found.values())
        given = ", ".join(f"{each.start:+.4g}" for each in opened)
        # of a linear unit: the level does not tell, where it is that of the record
        alone = experiment.signals == ("vt",) and record.given_vt0 is None
        cause = Cause(
            f"the size of the step{evidence.name_of(number)}: {sizes} pu would match, the case "
            f"has {given} pu{'; a wrong base of vt looks the same' if alone else ''}",
            *correct_step(evidence, number, found),
        )
        prior = -RARE if change < USUAL_CHANGE else 0.0
        yield from suspected(evidence, trial, len(opened), cause, prior)


def _open_sizes(experiment: Experiment) -> Iterator[Opened]:
    """Leave open the sizes of the steps that the case gives."""
    free = {nuisance.step for nuisance in experiment.nuisances if nuisance.kind == "step"}
    for k, step in enumerate(experiment.simulator.inputs.steps):
        if k not in free and step.step and step.signal != SPEED:
            yield Opened.within(Nuisance(f"cause.step{k}", "step", k), step.step, LARGEST_FACTOR)


def _listed(evidence: Evidence, number: int) -> Iterator[tuple[str, float | Unknown]]:
    """Yield the steps of a test in the order of its inputs, with their places in the file.

    Steps of a table have none.
    """
    test = evidence.records[number].test
    for signal in REFERENCES:
        listed = isinstance(test.reference(signal), tuple)
        for k, event in enumerate(test.events(signal)):
            place = evidence.place(number, f"test.{signal}[{k}].step")
            yield place if listed else "", event.step


def _turned(evidence: Evidence, number: int) -> Mapping[str, str]:
    """Return the changes that reverse the steps of a test."""
    changes = {}
    for place, step in _listed(evidence, number):
        if isinstance(step, Unknown):
            start, low, high = step.start, step.min, step.max
            if start != "auto" and low is not None and high is not None:
                changes[place] = between(-start, -high, -low)
        elif place:
            changes[place] = repr(-step)
    return changes


def correct_step(evidence: Evidence, number: int, sizes: Mapping[int, float]) -> Remedy:
    """Return the remedy for steps of other sizes, by their places in the inputs."""
    places = [place for place, _ in _listed(evidence, number)]
    changes = {
        places[k]: within(size, LARGEST_FACTOR)
        for k, size in sizes.items()
        if k < len(places) and places[k]
    }
    return Remedy("correct the step, or let the fit find it", "step", changes)


def correct_instant(evidence: Evidence, number: int, delay: float) -> Remedy:
    """Return the remedy for a record that is late, by a delay (s) that would match."""
    found = between(delay, delay - FARTHEST_DELAY, delay + FARTHEST_DELAY)
    changes = {evidence.place(number, "record.delay"): found}
    return Remedy("correct the time, or let the fit find the delay", "delay", changes)


def wrong_instant(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a record of being earlier or later than the case says."""
    for number, record, experiment in evidence.tests:
        if any(nuisance.kind in ("at", "shift", "delay") for nuisance in experiment.nuisances):
            continue
        delay, of_record = experiment.simulator.delay, evidence.name_of(number)
        start = delay + float(np.clip(_detected_delay(record), -FARTHEST_DELAY, FARTHEST_DELAY))
        opened = Opened.around(Nuisance("cause.delay", "delay"), start, FARTHEST_DELAY)
        trial = refitted(evidence, with_opened(evidence.residuals, number, [opened]))
        if trial is None:
            continue
        late = trial.values["cause.delay"] - delay
        size = f"{1e3 * abs(late):.3g} ms {'later' if late > 0.0 else 'earlier'}"
        cause = Cause(
            f"the time of the step{of_record}, or a delay of the recorder: the record is {size} "
            "than the case",
            *correct_instant(evidence, number, delay + late),
        )
        if evidence.case.kind.finds_rest:
            cause = cause._replace(
                cause="the clocks: the compared channels"
                f"{of_record} are {size} than the driving ones",
                remedy="put all channels on one clock, which may be filtered differently, or let "
                "the fit find the delay",
            )
        yield from suspected(evidence, trial, 1, cause)


def _detected_delay(record: FittedRecord) -> float:
    """Delay (s) of the step in the record after that in the response, 0 if unknown."""
    from exfit.dsp.step_detection import first_step

    overlays, time = record.comparison.overlays, record.comparison.time
    overlay = overlays.get("vt") or next(iter(overlays.values()))
    kept = np.isfinite(overlay.error)
    measured = first_step(time[kept], overlay.measured[kept])
    simulated = first_step(time[kept], overlay.simulated[kept])
    return 0.0 if measured is None or simulated is None else measured.at - simulated.at


def ramped_step(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect steps of the reference of being ramps, of the duration that matches best.

    Of a linear unit a ramp cannot be told from averages that are half of it late.
    """
    for number, _, experiment in evidence.tests:
        own = experiment.simulator
        steps = own.inputs.steps
        places = [k for k, each in enumerate(steps) if each.signal == "vref" and not each.ramp]
        if not places or evidence.case.kind.finds_rest:
            continue
        if ramp := _fitted_ramp(evidence, number, experiment, places):
            best, duration = ramp
            listed = [place for place, _ in _listed(evidence, number)]
            cause = Cause(
                f"the step{evidence.name_of(number)} is a ramp of {1e3 * duration:.3g} ms, or the "
                "recorder averages over as long before each sample",
                "look how the regulator makes it",
                "ramp",
                {
                    listed[k].replace(".step", ".ramp"): number_text(duration)
                    for k in places
                    if k < len(listed) and listed[k]
                },
            )
            yield from suspected(evidence, best, 1, cause)


def _fitted_ramp(
    evidence: Evidence, number: int, experiment: Experiment, places: Sequence[int]
) -> tuple[Trial, float] | None:
    """Return the trial with ramps in place of steps, and their duration (s); None without one."""
    best, values = None, evidence.values
    for _ in range(MOST_RAMPS):  # linear theory is nearer to the best one each time
        duration = _likeliest_ramp(evidence.residuals, values, experiment, places)
        if duration is None:
            break
        changed = _ramped(experiment, places, duration)
        trial = refitted(evidence, with_experiment(evidence.residuals, number, changed))
        if trial is None or (best is not None and trial.cost >= best[0].cost):
            break
        best, values = (trial, duration), trial.values
    return best


def _ramped(experiment: Experiment, places: Sequence[int], duration: float) -> Experiment:
    """Return an experiment whose steps at some places are ramps (s)."""
    own = experiment.simulator
    steps = tuple(
        step._replace(ramp=duration) if k in places else step
        for k, step in enumerate(own.inputs.steps)
    )
    return replace(experiment, simulator=own.remade(inputs=replace(own.inputs, steps=steps)))


def _likeliest_ramp(
    residuals: Residuals, values: Mapping[str, float], experiment: Experiment, places: Sequence[int]
) -> float | None:
    """Find the duration (s) of ramps that matches best by linear theory, among factors of 1.5."""
    instants = [experiment.simulator.inputs.steps[k].at for k in places]
    longest = 0.5 * min(np.diff([*instants, experiment.simulator.times[-1]]), default=0.0)
    theta = np.array([free.scaled(values[free.name]) for free in residuals.free])
    moves = [*residuals.moves(theta)]

    def left_with(duration: float) -> float:
        errors, slopes = _ramped(experiment, places, duration).tangents(values, moves)
        if not np.isfinite(slopes).all():
            return np.inf
        coefficients, *_ = np.linalg.lstsq(slopes, errors, rcond=None)
        left = errors - slopes @ coefficients
        return float(left @ left)

    durations = [each for each in RAMPS if each < longest]
    try:
        costs = [left_with(each) for each in durations]
        if not costs or not np.isfinite(costs).any():
            return None
        k = int(np.argmin(costs))
        if not 0 < k < len(costs) - 1:
            return durations[k]
        # of the parabola through the lowest and its neighbours
        before, lowest, after = costs[k - 1 : k + 2]
        way = 0.5 * (before - after) / (before - 2.0 * lowest + after)
        between_them = durations[k] * RAMP_FACTOR**way
        return between_them if left_with(between_them) < lowest else durations[k]
    except SimulationError:
        return None


def further_step(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a step of the reference in the record that the case does not have."""
    linear = linear_fit(evidence)
    if linear is None:
        return
    offset = 0
    for number, _, experiment in evidence.tests:
        rows = slice(offset, offset + sum(experiment.sizes))
        offset = rows.stop
        own = experiment.simulator
        steps = own.inputs.steps
        if not any(step.signal == "vref" for step in steps):
            continue
        spacing = float(own.times[-1] - own.times[0]) / INSTANTS
        at = _likeliest_instant(evidence, linear, experiment, rows, spacing)
        if at is None:
            continue
        place, size = len(steps), max(abs(step.step) for step in steps)
        inputs = replace(own.inputs, steps=(*steps, InputStep(at, 0.0, smooth=True)))
        opened = [
            Opened.around(Nuisance("cause.at", "at", place), at, 2.0 * spacing),
            Opened(Nuisance("cause.step", "step", place), 0.02 * size, -size, size),
        ]
        changed = replace(experiment, simulator=own.remade(inputs=inputs))
        residuals = with_experiment(evidence.residuals, number, changed)
        if trial := refitted(evidence, with_opened(residuals, number, opened)):
            cause = Cause(
                f"a further step{evidence.name_of(number)} that the case does not have: "
                f"{trial.values['cause.step']:+.2g} pu at {trial.values['cause.at']:.4g} s",
                "add it, or end the record before it: window",
                "further-step",
                _added(evidence, number, trial.values),
            )
            small = abs(trial.values["cause.step"]) < LEAST_FURTHER * size
            yield from suspected(evidence, trial, 2, cause, -RARE if small else 0.0)


def _added(evidence: Evidence, number: int, found: Mapping[str, float]) -> Mapping[str, str]:
    """Return the changes that add a further step to the reference; none to a table or a file."""
    given, at = evidence.records[number].test.vref, found["cause.at"]
    if not isinstance(given, tuple):
        return {}
    step = within(found["cause.step"], LARGEST_FACTOR)
    place = evidence.place(number, f"test.vref[{len(given)}]")
    return {place: f"{{at: {number_text(at)}, step: {step}}}"}


def _likeliest_instant(
    evidence: Evidence, linear: LinearFit, experiment: Experiment, rows: slice, spacing: float
) -> float | None:
    """Find the instant of a further step that explains most, by the response to the first one."""
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
        if at < first.at + spacing or at > times[-1] - LEAST_REST * np.ptp(times):
            continue
        by, moved = float(at - first.at), []
        for k, channel in enumerate(experiment.channels):
            later = np.interp(times - by, times, slopes[:, k, 0], left=0.0)
            moved.append(channel.weight * channel.slopes(samples[:, k], later[:, None])[:, 0])
        column = np.zeros((len(linear.errors), 1))
        column[rows, 0] = np.concatenate(moved)
        cost = linear.with_columns(column).cost
        if cost < lowest:
            lowest, instant = cost, float(at)
    return instant
