"""What the samples of one channel show: its level, its noise, and what the recorder did to it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.noise import UNIFORM_SPREAD, drift_at_rest
from exfit.dsp.quality import quantum, spikes, stuck
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import DetectedStep
from exfit.records.ripple import Ripple, ripple_at_rest
from exfit.records.steps import ChannelSteps, RecordedStep
from exfit.signals import POSITIVE_AT_REST

Array = NDArray[np.float64]

SPIKE_LIMIT = 6.0  # times the noise: a sample farther off the line through its neighbours is one
PLACES_LISTED = 5  # of spikes and of other faults, the first ones
NOISELESS = 1e-6  # of the range: with less noise a channel at rest stands still, as simulated ones
OWN_NOISE = 1.01  # times what rounding leaves: the noise of a channel that is not rounded coarsely
NEGATIVE = 5.0  # times the noise below zero: what is positive is inverted
LEAST_DRIFT = 0.01  # of all that a channel changes: with less it is at rest
LARGEST_PU = 30.0  # what a signal in per unit stays below: ceilings are lower
AT_REST_PU = (0.3, 1.7)  # a voltage in per unit lies between these before a step


@dataclass(frozen=True)
class InspectedChannel:
    """A column of numbers, in its own unit; the figures are 0 where it has no sample.

    ``level`` is where it rests before the first step, the median without one. ``spikes`` counts all
    of them, ``spikes_at`` are the instants (s) of the first; ``stuck`` are the intervals (s) in
    which it stands still; ``frequency`` (Hz) is that of a waveform, whose noise, spikes and steps
    are not looked for. ``drift`` is how far it moves before the first step, beyond chance, and
    ``ripple`` a line in its spectrum at rest. ``remark`` says why there is no step. ``unit_from``
    is the source of the unit: file or name. The ``signal`` that it seems to be is ``sure`` or a
    guess, by what is said under ``why``; ``question`` is what must be asked about it. With
    ``system_base`` 1 pu is that of the grid. With ``rejected_load`` the unit is on load until its
    breaker opens in the record.
    """

    name: str
    unit: str | None
    unit_from: str
    low: float = 0.0
    high: float = 0.0
    level: float = 0.0
    noise: float = 0.0
    quantum: float | None = None
    missing: int = 0
    spikes: int = 0
    spikes_at: tuple[float, ...] = ()
    stuck: tuple[tuple[float, float], ...] = ()
    frequency: float | None = None
    steps: tuple[DetectedStep, ...] = ()
    remark: str = ""
    drift: float = 0.0
    ripple: Ripple | None = None
    signal: str | None = None
    sure: bool = False
    why: str = ""
    question: str = ""
    system_base: bool = False
    rejected_load: bool = False

    @property
    def constant(self) -> bool:
        """Whether it never changes."""
        return self.low == self.high

    @property
    def missing_samples(self) -> str:
        """How many samples are missing, as a sentence; "" where none is."""
        return f"{self.name}: {self.missing} samples are missing" if self.missing else ""

    @property
    def findings(self) -> tuple[str, ...]:
        """What must be known before the channel is used, in sentences."""
        return tuple(f"{self.name}: {finding}" for finding in self._findings())

    def _findings(self) -> Iterator[str]:
        if self.question:
            yield self.question
        if self.missing:
            yield f"{self.missing} samples are missing"
        if self.constant:
            yield f"never changes: {self.low:.6g} throughout"
            return
        if self.spikes:
            instants = ", ".join(f"{at:.6g}" for at in self.spikes_at)
            more = ", ..." if self.spikes > len(self.spikes_at) else ""
            count = "1 spike" if self.spikes == 1 else f"{self.spikes} spikes"
            yield f"{count}, at {instants}{more} s"
        for start, end in self.stuck[:PLACES_LISTED]:
            yield f"does not change from {start:.6g} to {end:.6g} s"
        if self._is_implausible_voltage():
            yield f"{self.level:.5g} at rest cannot be a voltage in pu: what is its unit?"
        if self.inverted:
            yield (
                f"rests at {self.level:.5g}{self._unit}, but {self.signal} is positive at rest: if "
                "the channel is inverted, scale: -1 on it turns it"
            )
        if self.drift:
            yield (
                f"moves by {abs(self.drift):.2g}{self._unit} before the first step: it does not "
                "start at rest; begin the window later, or describe an earlier step by begin"
            )
        if self.ripple is not None:
            yield f"{self.ripple.in_words}: {self.ripple.remedy}"

    @property
    def _unit(self) -> str:
        return f" {self.unit}" if self.unit else ""

    @property
    def seems_per_unit(self) -> bool:
        """Whether it seems to be in per unit: it says so, or nothing, and looks so."""
        if self.unit is not None:
            return self.unit == "pu"
        if self.signal in ("vt", "vref"):
            return abs(self.level) <= AT_REST_PU[1]
        return max(abs(self.low), abs(self.high)) <= LARGEST_PU

    @property
    def inverted(self) -> bool:
        """Whether it is negative at rest although its signal is positive there."""
        return self.signal in POSITIVE_AT_REST and self.level < -NEGATIVE * self.noise

    def _is_implausible_voltage(self) -> bool:
        low, high = AT_REST_PU
        per_unit = self.signal == "vt" and self.unit in (None, "pu")
        return per_unit and (self.level > high or 0.0 < self.level < low)

    def change_at(self, step: RecordedStep) -> float | None:
        """Change that lasts at a step, pu or a share of the level at rest; None without one."""
        base = 1.0 if self.seems_per_unit else self.level
        return step.sizes[self.name] / base if self.name in step.sizes and base else None


@dataclass(frozen=True)
class InspectedPhases:
    """Three columns that are one voltage: its waveforms, or their effective values.

    ``level`` is the effective value at rest, in the unit of the columns.
    """

    columns: tuple[str, ...]
    kind: str
    level: float

    @property
    def name(self) -> str:
        """The name of the voltage that they are."""
        return ", ".join(self.columns)

    def change_at(self, step: RecordedStep) -> float | None:
        """Change that lasts at a step, as a share of the level at rest; None without one."""
        return step.sizes[self.name] / self.level if self.name in step.sizes else None


def inspect_channel(
    name: str,
    unit: tuple[str | None, str],
    time: Array,
    samples: Array,
    own_steps: ChannelSteps,
    steps: Sequence[RecordedStep],
) -> InspectedChannel:
    """Inspect the samples (M,) of one channel.

    ``unit`` is that of the channel and its source, ``own_steps`` are those that it shows, ``steps``
    those of the test.
    """
    t, y = present_samples(time, samples)
    missing = len(samples) - len(y)
    if not len(y):
        return InspectedChannel(name, *unit, missing=missing, remark=own_steps.remark)
    noise = own_steps.noise
    outlying = spikes(t, y, noise, SPIKE_LIMIT) if noise else np.zeros(0, np.intp)
    rounding = quantum(y)
    # what is rounded more coarsely than its noise stands still most of the time
    noisy = noise > max(
        NOISELESS * float(np.ptp(y)), OWN_NOISE * UNIFORM_SPREAD * (rounding or 0.0)
    )
    still = stuck(y) if noisy else ()
    return InspectedChannel(
        name,
        *unit,
        low=float(np.min(y)),
        high=float(np.max(y)),
        level=_level_at_rest(t, y, steps),
        noise=noise,
        quantum=rounding,
        missing=missing,
        spikes=len(outlying),
        spikes_at=tuple(float(t[row]) for row in outlying[:PLACES_LISTED]),
        stuck=tuple((float(t[first]), float(t[last])) for first, last in still),
        frequency=own_steps.frequency,
        steps=own_steps.changes,
        remark=own_steps.remark,
        drift=_drift(t, y, steps) if noise else 0.0,
        ripple=ripple_at_rest(t, y, _rests(t, steps)) if noise else None,
    )


def _drift(time: Array, samples: Array, steps: Sequence[RecordedStep]) -> float:
    """Measure the drift of a channel before the first step, 0 by chance or where it is little."""
    if not steps or steps[0].from_start:
        return 0.0
    drift = drift_at_rest(samples[time < _rests(time, steps)[0][1]])
    return drift if abs(drift) > LEAST_DRIFT * float(np.ptp(samples)) else 0.0


def _rests(time: Array, steps: Sequence[RecordedStep]) -> list[tuple[float, float]]:
    first, last = float(time[0]), float(time[-1])
    if not steps:
        return [(first, last)]
    return [
        (first, steps[0].at - steps[0].error),
        (0.5 * (steps[-1].at + last), last),
    ]


def _level_at_rest(time: Array, samples: Array, steps: Sequence[RecordedStep]) -> float:
    """Return the median before the first step; of all samples where none is before it."""
    if steps and steps[0].from_start:
        return float(samples[0])
    first = steps[0].at if steps else time[-1]
    before = samples[time < first]
    return float(np.median(before if len(before) else samples))
