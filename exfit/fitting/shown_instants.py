"""When a record shows its steps: by how the response begins, not by how large or fast it becomes.

An instant that is fitted to the whole of a response absorbs errors of the model: a step that is
made later passes for a unit that is slower.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.fitting.experiment import ExperimentSetup, Values, compared
from exfit.fitting.noise import noise_of
from exfit.fitting.parameters import FreeParameter
from exfit.plants import BREAKER
from exfit.util.arrays import Array, median, median_step

TRIED, STAGES = 41, 2  # instants in an interval, first in that of the record, then about the best
REST_BEFORE = 2.0  # s: so long a rest before a step is looked at
LEAST_MOVE = 8.0  # times the noise: less shows no beginning
LEAST_ERROR = 1e-3  # of a sample: nothing is known better by samples without noise
BEGINNING = 0.95  # of the largest move: until there a response begins
SHAPES = 4  # level, response and two integrals of it: what is fitted for each instant


class Beginning(NamedTuple):
    """The samples (n,) of a channel, by its place, from before a step on, and their noise."""

    place: int
    inside: NDArray[np.intp]
    samples: Array
    noise: float


def with_shown_instants(setup: ExperimentSetup, values: Values) -> ExperimentSetup:
    """Return a test whose instants of steps start where its record shows them, each with bounds.

    To the beginning of a response that of the simulation is fitted, of any size, and its integrals
    with any factor: a wrong gain or time constant of the model does little more to a beginning.
    What is left is smallest at the start that is returned; the bounds are where it exceeds that by
    what chi-square does at 95 %, and never beyond those of ``setup``, which has sub-steps enough.
    An instant whose step moves nothing stays as it is, and so does one that the values have.
    """
    at, time = setup.with_start_values(values), setup.record.time
    names = instants_of(setup)
    simulator = setup.experiment.with_inputs(at)
    every = sorted(step.at + simulator.delay for step in simulator.inputs.steps)
    free = []
    for own in setup.free:
        if own.name in names and own.name not in values:
            # between these times its step is the only one
            before = max((each for each in every if each < own.low), default=float(time[0]))
            after = min((each for each in every if each > own.high), default=float(time[-1]))
            middle = 0.5 * (before + at[own.name])
            first = max(middle, at[own.name] - REST_BEFORE, float(time[0]))
            own = _shown(setup, at, own, first, after)
            at[own.name] = own.start
        free.append(own)
    return replace(setup, free=tuple(free))


def instants_of(setup: ExperimentSetup) -> frozenset[str]:
    """Return the names of the instants of steps that a record shows by how its response begins.

    None where other signals of the record drive the test: their noise has shapes of its own.
    """
    if setup.driving:
        return frozenset()
    steps = setup.experiment.simulator.inputs.steps
    return frozenset(
        nuisance.name
        for nuisance in setup.experiment.nuisances
        if nuisance.kind in ("at", "shift") and steps[nuisance.step].signal != BREAKER
    )


def _shown(
    setup: ExperimentSetup, values: Values, instant: FreeParameter, before: float, after: float
) -> FreeParameter:
    """Return an instant as the record shows it, as it was where nothing moves with its step."""
    beginnings = [*_beginnings(setup, values, instant.low, before, after)]
    freedom = sum(len(each.samples) - SHAPES for each in beginnings)
    # one at the last sample has no response
    low, high = instant.low, min(instant.high, float(np.mean(setup.record.time[-2:])))
    if freedom < 1 or not low < high:
        return instant
    from exfit.dsp.step_detection import CHI_SQUARE, interval_below

    for _ in range(STAGES):
        tried = np.linspace(low, high, TRIED)
        sets = [{**values, instant.name: float(at)} for at in tried]
        responses, _ = setup.experiment.samples_of_many(sets)
        costs = np.array([_left_of(setup, response, beginnings) for response in responses])
        best = int(np.argmin(costs))
        left = float(costs[best])
        if not (isfinite(left) and np.any(costs > left)):
            return instant
        interval = interval_below(tried, costs, left + CHI_SQUARE * max(1.0, left / freedom))
        beside = float(tried[1] - tried[0])
        low = max(low, interval.earliest - beside)
        high = min(high, interval.latest + beside)
    at = _vertex(tried, costs, best)
    least = LEAST_ERROR * median_step(setup.record.time)
    return replace(
        instant,
        start=at,
        low=max(instant.low, min(interval.earliest, at - least)),
        high=min(instant.high, max(interval.latest, at + least)),
    )


def _beginnings(
    setup: ExperimentSetup, values: Values, rest_until: float, before: float, after: float
) -> Iterator[Beginning]:
    """Yield the beginning of each compared channel that moves in an interval (s) after a rest."""
    from exfit.dsp.step_detection import MEDIAN_SAMPLES, running_median

    time = setup.record.time
    for place, channel in enumerate(setup.channels):
        measured = compared(channel, setup.experiment.measured(channel, values))
        inside = np.flatnonzero(np.isfinite(measured) & (time >= before) & (time < after))
        if len(inside) < MEDIAN_SAMPLES:
            continue
        samples, noise = measured[inside], noise_of(channel)
        rest = max(int(np.count_nonzero(time[inside] < rest_until)), 1)
        way = np.abs(running_median(samples) - median(samples[:rest]))
        way[:rest] = 0.0
        move = float(np.max(way))
        if move > LEAST_MOVE * noise:
            end = int(np.argmax(way >= BEGINNING * move)) + 1
            yield Beginning(place, inside[:end], samples[:end], noise)


def _left_of(setup: ExperimentSetup, response: Array, beginnings: Sequence[Beginning]) -> float:
    """Squares, in noise, left by a response (M, channels) of any size and its integrals."""
    total = 0.0
    for place, inside, samples, noise in beginnings:
        simulated = compared(setup.channels[place], response[:, place])[inside]
        if not np.isfinite(simulated).all():
            return inf
        shapes, between = [simulated - simulated[0]], np.diff(setup.record.time[inside])
        for _ in range(2):  # integrals by trapezoids
            means = 0.5 * (shapes[-1][1:] + shapes[-1][:-1])
            shapes.append(np.append(0.0, np.cumsum(means * between)))
        columns = np.column_stack([np.ones_like(simulated), *shapes])
        found = np.linalg.lstsq(columns, samples, rcond=None)[0]
        total += float(np.sum((samples - columns @ found) ** 2)) / noise**2
    return total


def _vertex(at: Array, costs: Array, best: int) -> float:
    """Place of the lowest point of a parabola through the least of evenly spaced costs (K,)."""
    if 0 < best < len(at) - 1:
        before, least, after = costs[best - 1 : best + 2]
        bend = float(before - 2.0 * least + after)
        if isfinite(bend) and bend > 0.0:
            return float(at[best] + 0.5 * (at[1] - at[0]) * (before - after) / bend)
    return float(at[best])
