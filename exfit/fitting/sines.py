"""A periodic disturbance of a channel: what a fit finds of it, with exact derivatives."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import inf, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import RecordFile, SineSection, Unknown
from exfit.dsp.lines import Line, cosine_and_sine, largest_line
from exfit.errors import RecordError
from exfit.fitting.descents import descent_near
from exfit.fitting.experiment import Channel, ExperimentSetup
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
from exfit.util.text import digits

Array = NDArray[np.float64]
Values = Mapping[str, float]


@dataclass(frozen=True)
class Sine:
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


class Bounded(NamedTuple):
    """Start and bounds of a parameter of a disturbance."""

    start: float
    low: float
    high: float


def with_sines(
    case: Case, file: RecordFile, setup: ExperimentSetup, values: Mapping[str, float]
) -> ExperimentSetup:
    """Return a test with the periodic disturbances that the section of its record names.

    Those whose frequency is automatic wait for the residuals of a fit, unless it is among the
    ``values`` or those given beside the case. Raises RecordError for a frequency that the record
    cannot show.
    """
    prefix = prefix_from(setup.name)
    given = {**values, **{name: each.value for name, each in case.given_values.items()}}
    for channel in setup.channels:
        section = file.channels[channel.signal].sine
        if section is None:
            continue
        frequency = _frequency(f"{prefix}{channel.signal}.sine", section, setup, given)
        if frequency is None:
            waiting = {**setup.automatic_sines, channel.signal: _range(section)}
            setup = replace(setup, automatic_sines=waiting)
            continue
        from exfit.fitting.noise import noise_of

        measured = channel.measured[channel.kept]
        noise = noise_of(channel)
        largest = max(0.5 * float(np.ptp(measured)), noise)
        setup = _with_sine(prefix, setup, channel, frequency, (noise, 0.0), largest)
    return setup


def with_line(prefix: str, setup: ExperimentSetup, signal: str, line: Line) -> ExperimentSetup:
    """Return a test with a line of the errors of a signal, simulated less measured, in it."""
    channel = next(channel for channel in setup.channels if channel.signal == signal)
    frequency = _near(setup, line.frequency)
    amplitudes = (-line.cosine, -line.sine)
    largest = MOST_OF_LINE * line.amplitude
    return _with_sine(prefix, setup, channel, frequency, amplitudes, largest)


def _frequency(
    name: str, section: SineSection, setup: ExperimentSetup, given: Mapping[str, float]
) -> float | Bounded | None:
    """Return the frequency of a disturbance, None where residuals must show it first."""
    frequency = section.frequency
    if not isinstance(frequency, Unknown):
        _refuse_unseen(name, setup, frequency)
        return frequency
    if frequency.start == "auto":
        start = given.get(f"{name}.{FREQUENCY}")
        return None if start is None else _near(setup, start)
    if frequency.min is None or frequency.max is None:
        raise TypeError(f"{name} has no bounds")
    _refuse_unseen(name, setup, frequency.min)
    _refuse_unseen(name, setup, frequency.max)
    return Bounded(frequency.start, frequency.min, frequency.max)


def _range(section: SineSection) -> tuple[float, float]:
    """Return the range of a frequency that residuals show, Hz."""
    frequency = section.frequency
    if not isinstance(frequency, Unknown):
        return frequency, frequency
    low, high = frequency.min, frequency.max
    return 0.0 if low is None else low, inf if high is None else high


def _near(setup: ExperimentSetup, frequency: float) -> Bounded:
    """Return a frequency with bounds between which no other line can be told from it."""
    time = setup.record.time
    width = 1.0 / float(time[-1] - time[0])
    return Bounded(frequency, max(frequency - width, 0.5 * width), frequency + width)


def _refuse_unseen(name: str, setup: ExperimentSetup, frequency: float) -> None:
    """Raise RecordError for a frequency with no whole period, or fewer than two samples in one."""
    time = setup.record.time
    low, high = 1.0 / float(time[-1] - time[0]), 0.5 / float(np.median(np.diff(time)))
    if not low <= frequency <= high:
        raise RecordError(
            f"{setup.record.source}: {name}.{FREQUENCY}: {frequency:g} Hz: a record of this length "
            f"and sampling shows {low:.3g} ... {high:.4g} Hz"
        )


def _with_sine(
    prefix: str,
    setup: ExperimentSetup,
    channel: Channel,
    frequency: float | Bounded,
    amplitudes: tuple[float, float],
    largest: float,
) -> ExperimentSetup:
    name = f"{prefix}{channel.signal}.sine"
    time = setup.record.time
    fixed = frequency if isinstance(frequency, float) else None
    sine = Sine(name, channel.signal, 0.5 * float(time[0] + time[-1]), fixed)
    bounds: dict[NuisanceKind, Bounded] = {
        **({} if isinstance(frequency, float) else {"frequency": frequency}),
        "cosine": Bounded(amplitudes[0], -largest, largest),
        "sine": Bounded(amplitudes[1], -largest, largest),
    }
    experiment = setup.experiment
    nuisances = [Nuisance(f"{name}.{kind}", kind, signal=channel.signal) for kind in bounds]
    free = [
        FreeParameter(f"{name}.{kind}", *values, logarithmic=False)
        for kind, values in bounds.items()
    ]
    return replace(
        setup,
        experiment=replace(
            experiment,
            nuisances=(*experiment.nuisances, *nuisances),
            sines=(*experiment.sines, sine),
        ),
        free=(*setup.free, *free),
    )


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
    errors = disturbed.errors(descent_near(disturbed, start).x)[0]
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
