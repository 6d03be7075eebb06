"""Periodic disturbances that stand out of what a fit without them leaves of its records.

A sine is fitted only where a line stands out of residuals that are white beside it: of coloured
noise it takes a part that looks like a response, and the parameters take what belongs to it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.lines import Line, largest_line
from exfit.fitting.descents import minimum_near
from exfit.fitting.experiment import Channel
from exfit.fitting.nuisances.parameters import prefix_from
from exfit.fitting.nuisances.sine_parameters import with_line
from exfit.fitting.residuals import Residuals
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.uncertainty import slices
from exfit.inference.noise import SURPRISING, is_white, whiteness
from exfit.inference.wording import digits

Array = NDArray[np.float64]


class Place(NamedTuple):
    """A channel of a record."""

    record: str
    signal: str

    @property
    def label(self) -> str:
        """Its name in a note."""
        return f"{prefix_from(self.record)}{self.signal}"


Lines = Mapping[Place, Line]


def with_found_lines(
    setups: Sequence[ExperimentSetup], residuals: Residuals, theta: Array
) -> tuple[tuple[ExperimentSetup, ...], tuple[str, ...]]:
    """Return the tests with the lines that stand out of their residuals at theta (N,), and notes.

    ``residuals`` are those of a fit without the lines. Raises KeyboardInterrupt at an interruption.
    """
    notes: dict[Place, str] = {}
    lines = dict(_candidates(setups, residuals, theta, notes))
    if lines:
        fitted = [
            replace(setup, experiment=experiment)
            for setup, experiment in zip(setups, residuals.experiments, strict=True)
        ]
        for place in _coloured(_disturbed(fitted, lines), residuals, theta):
            if place in lines:
                notes[place] = (
                    f"no sine is fitted: beside {_words(lines.pop(place))} the residuals are not "
                    "white; of coloured noise a sine takes what is not periodic"
                )
    for place, line in lines.items():
        notes[place] = (
            f"{_words(line)} stands out of the residuals: a sine is fitted with the parameters"
        )
    texts = tuple(f"{place.label}: {text}" for place, text in notes.items())
    return _disturbed(setups, lines), texts


def _candidates(
    setups: Sequence[ExperimentSetup], residuals: Residuals, theta: Array, notes: dict[Place, str]
) -> Iterator[tuple[Place, Line]]:
    """Find lines that are no chance of white noise; ``notes`` say why others are none."""
    errors, slopes = residuals.errors(theta)
    blocks = iter(slices(residuals.sizes))
    for setup, experiment in zip(setups, residuals.experiments, strict=True):
        for channel in experiment.channels:
            block = next(blocks)
            if channel.signal not in setup.automatic_sines:
                continue
            place = Place(setup.name, channel.signal)
            try:
                line = _largest_line(setup, channel, errors[block], slopes[block])
            except ValueError as fault:
                notes[place] = f"no sine is fitted: {fault}"
                continue
            if line.p_value < SURPRISING:
                yield place, line
            else:
                notes[place] = (
                    f"no sine is fitted: {_words(line)} does not stand out of the residuals "
                    f"(Fisher's test, p {digits(line.p_value)})"
                )


def _largest_line(setup: ExperimentSetup, channel: Channel, errors: Array, slopes: Array) -> Line:
    within = setup.automatic_sines[channel.signal]
    weight = channel.weight
    time = setup.record.time
    return largest_line(time, errors / weight, channel.kept, slopes / weight, within)


def _coloured(
    setups: Sequence[ExperimentSetup], residuals: Residuals, theta: Array
) -> Iterator[Place]:
    """Yield the channels whose residuals are not white with the lines of the tests fitted."""
    known = {parameter.name for parameter in residuals.free}
    of_records = chain.from_iterable(setup.free for setup in setups)
    new = [parameter for parameter in of_records if parameter.name not in known]
    experiments = [setup.experiment for setup in setups]
    disturbed = replace(residuals, experiments=experiments, free=(*residuals.free, *new))
    start = np.append(theta, [parameter.scaled(parameter.start) for parameter in new])
    errors = disturbed.errors(minimum_near(disturbed, start))[0]
    places = [Place(setup.name, channel.signal) for setup in setups for channel in setup.channels]
    for place, block in zip(places, slices(disturbed.sizes), strict=True):
        if not is_white(whiteness(errors[block])):
            yield place


def _disturbed(setups: Sequence[ExperimentSetup], lines: Lines) -> tuple[ExperimentSetup, ...]:
    """Return the tests with lines in their channels; none of them waits for residuals any more."""
    disturbed = {setup.name: replace(setup, automatic_sines={}) for setup in setups}
    for place, line in lines.items():
        prefix = prefix_from(place.record)
        disturbed[place.record] = with_line(prefix, disturbed[place.record], place.signal, line)
    return tuple(disturbed.values())


def _words(line: Line) -> str:
    return f"the largest line, of {line.frequency:.4g} Hz and {line.amplitude:.2g} pu,"
