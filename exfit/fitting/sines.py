"""Periodic disturbances of channels: as a case names them, or as residuals show them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf, pi
from typing import NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import RecordFile, Unknown
from exfit.dsp.lines import Line, cosine_and_sine, largest_line
from exfit.errors import RecordError
from exfit.fitting.descents import descent_near
from exfit.fitting.experiment import Channel, ExperimentSetup, Values
from exfit.fitting.noise import noise_of
from exfit.fitting.nuisances import (
    COSINE,
    FREQUENCY,
    SINE,
    Nuisance,
    NuisanceKind,
    prefix_from,
)
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import slices
from exfit.inference.noise import SURPRISING, is_white, whiteness
from exfit.util.arrays import Array, median_step
from exfit.util.text import digits


class Sine(NamedTuple):
    """A disturbance of a signal: a cosine and a sine of one frequency about an instant (s).

    The amplitudes (pu) are found under ``name.cosine`` and ``name.sine``, and so is the
    ``frequency`` (Hz) where it is None, under ``name.frequency``. Amplitudes in place of an
    amplitude and a phase: the response is linear in them. About the middle of the record an error
    of the frequency is none of the phase.
    """

    name: str
    signal: str
    about: float
    frequency: float | None

    def samples(self, time: Array, values: Values) -> Array:
        """Return the disturbance (M,) at instants (M,) in s."""
        return np.asarray(self._pair(time, values) @ self._amplitudes(values))

    def slopes(self, time: Array, values: Values, moves: Sequence[Values]) -> Array:
        """Return its derivatives (M, N) along ``moves`` (N), which say what each changes."""
        pair = self._pair(time, values)
        cosine, sine = self._amplitudes(values)
        turned = sine * pair[:, 0] - cosine * pair[:, 1]
        columns = np.column_stack([pair, 2.0 * pi * (time - self.about) * turned])
        names = [f"{self.name}.{part}" for part in (COSINE, SINE, FREQUENCY)]
        changes = np.array([[move.get(name, 0.0) for name in names] for move in moves])
        return np.asarray(columns @ changes.reshape(-1, len(names)).T)

    def frequency_at(self, values: Values) -> float:
        """Return its frequency, Hz."""
        return values[f"{self.name}.{FREQUENCY}"] if self.frequency is None else self.frequency

    def amplitude_at(self, values: Values) -> float:
        """Return its amplitude, pu."""
        return float(np.hypot(*self._amplitudes(values)))

    def _pair(self, time: Array, values: Values) -> Array:
        return cosine_and_sine(self.frequency_at(values), time - self.about)

    def _amplitudes(self, values: Values) -> Array:
        return np.array([values[f"{self.name}.{part}"] for part in (COSINE, SINE)])


MOST_OF_LINE = 4.0  # times the amplitude of a line that was found: how large it may become

Place = tuple[str, str]  # a record and a signal


# ---- disturbances that a case names


def with_sines(
    case: Case, file: RecordFile, setup: ExperimentSetup, values: Values
) -> ExperimentSetup:
    """Return a test with the periodic disturbances that the section of its record names.

    Those whose frequency is automatic wait for the residuals of a fit, unless it is among the
    ``values`` or those given beside the case. Raises RecordError for a frequency that the record
    cannot show.
    """
    given = {**values, **{name: each.value for name, each in case.given_values.items()}}
    for channel in setup.channels:
        section = file.channels[channel.signal].sine
        if section is None:
            continue
        name, frequency = _name(setup, channel), section.frequency
        found: float | FreeParameter
        if not isinstance(frequency, Unknown):
            _refuse_unseen(name, setup, frequency)
            found = frequency
        elif frequency.start == "auto":
            start = given.get(f"{name}.{FREQUENCY}")
            if start is None:
                low, high = frequency.min or 0.0, inf if frequency.max is None else frequency.max
                waiting = {**setup.automatic_sines, channel.signal: (low, high)}
                setup = replace(setup, automatic_sines=waiting)
                continue
            found = _near(setup, name, start)
        elif frequency.min is None or frequency.max is None:
            raise TypeError(f"{name} has no bounds")
        else:
            _refuse_unseen(name, setup, frequency.min, frequency.max)
            bounds = (frequency.start, frequency.min, frequency.max)
            found = FreeParameter(f"{name}.{FREQUENCY}", *bounds, logarithmic=False)
        noise = noise_of(channel)
        largest = max(0.5 * float(np.ptp(channel.measured[channel.kept])), noise)
        setup = _with_sine(setup, channel, found, (noise, 0.0), largest)
    return setup


def _name(setup: ExperimentSetup, channel: Channel) -> str:
    return f"{prefix_from(setup.name)}{channel.signal}.sine"


def _refuse_unseen(name: str, setup: ExperimentSetup, *frequencies: float) -> None:
    """Raise RecordError for a frequency with no whole period, or fewer than two samples in one."""
    time = setup.record.time
    low, high = 1.0 / float(np.ptp(time)), 0.5 / median_step(time)
    for frequency in frequencies:
        if not low <= frequency <= high:
            raise RecordError(
                f"{setup.record.source}: {name}.{FREQUENCY}: {frequency:g} Hz: a record of this "
                f"length and sampling shows {low:.3g} ... {high:.4g} Hz"
            )


def _near(setup: ExperimentSetup, name: str, frequency: float) -> FreeParameter:
    """Return a frequency with bounds between which no other line can be told from it."""
    time = setup.record.time
    width = 1.0 / float(np.ptp(time))
    bounds = max(frequency - width, 0.5 * width), frequency + width
    return FreeParameter(f"{name}.{FREQUENCY}", frequency, *bounds, logarithmic=False)


def _with_sine(
    setup: ExperimentSetup,
    channel: Channel,
    frequency: float | FreeParameter,
    amplitudes: tuple[float, float],
    largest: float,
) -> ExperimentSetup:
    name, time, experiment = _name(setup, channel), setup.record.time, setup.experiment
    fixed = None if isinstance(frequency, FreeParameter) else frequency
    sine = Sine(name, channel.signal, 0.5 * float(time[0] + time[-1]), fixed)
    free = [frequency] if isinstance(frequency, FreeParameter) else []
    kinds: list[NuisanceKind] = ["frequency"] if free else []
    kinds += ["cosine", "sine"]
    for kind, start in zip((COSINE, SINE), amplitudes, strict=True):
        bounds = (start, -largest, largest)
        free.append(FreeParameter(f"{name}.{kind}", *bounds, logarithmic=False))
    nuisances = [Nuisance(f"{name}.{kind}", kind, signal=channel.signal) for kind in kinds]
    experiment = replace(
        experiment,
        nuisances=(*experiment.nuisances, *nuisances),
        sines=(*experiment.sines, sine),
    )
    return replace(setup, experiment=experiment, free=(*setup.free, *free))


# ---- those that residuals show


def with_found_lines(
    setups: Sequence[ExperimentSetup], residuals: Residuals, theta: Array
) -> tuple[tuple[ExperimentSetup, ...], tuple[str, ...]]:
    """Return the tests with the lines that stand out of their residuals at theta (N,), and notes.

    A sine is fitted only where a line stands out of residuals that are white beside it: of coloured
    noise it takes a part that looks like a response, and the parameters take what belongs to it.

    ``residuals`` are those of a fit without the lines. Raises KeyboardInterrupt at an interruption.
    """
    notes: dict[Place, str] = {}
    lines = dict(_candidates(setups, residuals, theta, notes))
    if lines:
        pairs = zip(setups, residuals.experiments, strict=True)
        fitted = [replace(setup, experiment=experiment) for setup, experiment in pairs]
        for place in _coloured(_disturbed(fitted, lines), residuals, theta):
            if place in lines:
                notes[place] = (
                    f"no sine is fitted: beside {_words(lines.pop(place))} the residuals are not "
                    "white, and a sine would also take up parts of coloured noise"
                )
    for place, line in lines.items():
        notes[place] = (
            f"{_words(line)} stands out of the residuals: a sine is fitted with the parameters"
        )
    texts = (f"{prefix_from(record)}{signal}: {text}" for (record, signal), text in notes.items())
    return _disturbed(setups, lines), tuple(texts)


def _candidates(
    setups: Sequence[ExperimentSetup], residuals: Residuals, theta: Array, notes: dict[Place, str]
) -> Iterator[tuple[Place, Line]]:
    """Find lines that are no chance of white noise; ``notes`` say why others are none."""
    errors, slopes = residuals.errors(theta)
    blocks = iter(slices(residuals.sizes))
    for setup, experiment in zip(setups, residuals.experiments, strict=True):
        for channel in experiment.channels:
            block = next(blocks)
            within = setup.automatic_sines.get(channel.signal)
            if within is None:
                continue
            place, weight = (setup.name, channel.signal), channel.weight
            own = errors[block] / weight, channel.kept, slopes[block] / weight
            try:
                line = largest_line(setup.record.time, *own, within)
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


def _coloured(
    setups: Sequence[ExperimentSetup], residuals: Residuals, theta: Array
) -> Iterator[Place]:
    """Yield the channels whose residuals are not white with the lines of the tests fitted."""
    known = {parameter.name for parameter in residuals.free}
    new = [own for setup in setups for own in setup.free if own.name not in known]
    experiments = [setup.experiment for setup in setups]
    disturbed = replace(residuals, experiments=experiments, free=(*residuals.free, *new))
    start = np.append(theta, [parameter.scaled(parameter.start) for parameter in new])
    errors = disturbed.errors(descent_near(disturbed, start).x)[0]
    places = [(setup.name, channel.signal) for setup in setups for channel in setup.channels]
    for place, block in zip(places, slices(disturbed.sizes), strict=True):
        if not is_white(whiteness(errors[block])):
            yield place


def _disturbed(
    setups: Sequence[ExperimentSetup], lines: Mapping[Place, Line]
) -> tuple[ExperimentSetup, ...]:
    """Return the tests with lines of their errors, simulated less measured; none waits any more."""
    disturbed = {setup.name: replace(setup, automatic_sines={}) for setup in setups}
    for (record, signal), line in lines.items():
        setup = disturbed[record]
        channel = next(channel for channel in setup.channels if channel.signal == signal)
        frequency = _near(setup, _name(setup, channel), line.frequency)
        amplitudes, largest = (-line.cosine, -line.sine), MOST_OF_LINE * line.amplitude
        disturbed[record] = _with_sine(setup, channel, frequency, amplitudes, largest)
    return tuple(disturbed.values())


def _words(line: Line) -> str:
    return f"the largest line, of {line.frequency:.4g} Hz and {line.amplitude:.2g} pu,"
