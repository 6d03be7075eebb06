"""Periodic disturbances as parameters of a record: their starts, their bounds, their names."""

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import Recording, SineSection, Unknown
from exfit.dsp.lines import Line
from exfit.errors import RecordError
from exfit.fitting.experiment import Channel
from exfit.fitting.nuisances.kinds import Nuisance, NuisanceKind
from exfit.fitting.nuisances.parameters import prefix_of
from exfit.fitting.nuisances.sine import FREQUENCY, Sine
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.setup import ExperimentSetup

MOST_OF_LINE = 4.0  # times the amplitude of a line that was found: how large it may become


class Bounded(NamedTuple):
    """Start and bounds of a parameter of a disturbance."""

    start: float
    low: float
    high: float


def with_sines(
    case: Case, recording: Recording, setup: ExperimentSetup, values: Mapping[str, float]
) -> ExperimentSetup:
    """Return a test with the periodic disturbances that the section of its record names.

    Those whose frequency is automatic wait for the residuals of a fit, unless it is among the
    ``values`` or those given beside the case. Raises RecordError for a frequency that the record
    cannot show.
    """
    prefix, file = prefix_of(recording), recording.record
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
        from exfit.fitting.residuals import noise_of

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
