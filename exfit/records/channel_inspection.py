"""What a channel shows: its level, its noise, what the recorder did to it, which signal it is.

Of the signal some is sure, some a guess with its reasons, and some must be asked.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from exfit.dsp.lines import Ripple, ripple_at_rest
from exfit.dsp.noise import UNIFORM_SPREAD, drift_at_rest
from exfit.dsp.quality import MOVES, SPIKE_LIMIT, quantum, spikes, stuck
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import DetectedStep
from exfit.records.channel_names import (
    CONTROL_ERROR,
    OF_SHUNT,
    Clarity,
    Guess,
    NameReading,
    guess_signals,
)
from exfit.records.steps import ChannelSteps, RecordedStep
from exfit.records.units import quantity_of
from exfit.signals import FIELDS, OF_BUMP_TEST, OF_CURRENT_PHASOR, POSITIVE_AT_REST, SIGNALS
from exfit.util.arrays import Array

PLACES_LISTED = 5  # of spikes and of other faults, the first ones
NOISELESS = 1e-6  # of the range: with less noise a channel at rest stands still, as simulated ones
OWN_NOISE = 1.01  # times what rounding leaves: the noise of a channel that is not rounded coarsely
NEGATIVE = 5.0  # times the noise below zero: what is positive is inverted
LEAST_DRIFT = 0.01  # of all that a channel changes: with less it is at rest
LARGEST_PU = 30.0  # what a signal in per unit stays below: ceilings are lower
LARGEST_LOAD = 5.0  # what power or current in per unit stays below, in a fault too
AT_REST_PU = (0.3, 1.7)  # a voltage in per unit lies between these before a step
PERCENT = 100.0
ASKED_FOR = (*OF_BUMP_TEST, "p", "q")  # what an open column may be
RESPONDING = (*OF_BUMP_TEST, "vref")  # signals that move for good with a step of the reference
LARGEST_DEVIATION = 0.5  # pu: where a speed rests nearer to zero, it is a deviation
LARGEST_ERROR = 0.5  # of all that a control error moves: how far from zero it rests


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
    breaker opens in the record. With ``absolute`` its numbers are no per unit: others without a
    unit beside it are none.
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
    absolute: bool = False

    def as_json(self) -> dict[str, Any]:
        """Give the figures as plain data."""
        return {
            **vars(self),  # `asdict` copies each number: a third of a second for 1,000 channels
            "steps": [asdict(step) for step in self.steps],
            "ripple": None if self.ripple is None else asdict(self.ripple),
        }

    @property
    def constant(self) -> bool:
        """Whether it never changes."""
        return self.low == self.high

    @property
    def moves(self) -> bool:
        """Whether it moves beyond its noise."""
        return self.high - self.low > MOVES * self.noise

    @property
    def may_be_load(self) -> bool:
        """Whether it is open and may be active or reactive power."""
        return self.signal is None and " p " in self.question.replace("?", " ")

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
        if self._is_implausible_voltage:
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
        if self.absolute:
            return False
        if self.signal in ("vt", "vref"):
            return abs(self.level) <= AT_REST_PU[1]
        of_load = self.signal in OF_CURRENT_PHASOR
        return max(abs(self.low), abs(self.high)) <= (LARGEST_LOAD if of_load else LARGEST_PU)

    @property
    def inverted(self) -> bool:
        """Whether it is negative at rest although its signal is positive there."""
        return self.signal in POSITIVE_AT_REST and self.level < -NEGATIVE * self.noise

    @property
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
    noise, rounding = own_steps.noise, quantum(y)
    outlying = spikes(t, y, noise, SPIKE_LIMIT) if noise else np.zeros(0, np.intp)
    # what is rounded more coarsely than its noise stands still most of the time
    least = max(NOISELESS * float(np.ptp(y)), OWN_NOISE * UNIFORM_SPREAD * (rounding or 0.0))
    still = stuck(y) if noise > least else ()
    first, last = float(t[0]), float(t[-1])
    rests, drift = [(first, last)], 0.0
    if steps:
        rests = [(first, steps[0].at - steps[0].error), (0.5 * (steps[-1].at + last), last)]
    if noise and steps and not steps[0].from_start:
        drift = drift_at_rest(y[t < rests[0][1]])
    lasting = abs(drift) > LEAST_DRIFT * float(np.ptp(y))
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
        stuck=tuple((float(t[begin]), float(t[end])) for begin, end in still),
        frequency=own_steps.frequency,
        steps=own_steps.changes,
        remark=own_steps.remark,
        drift=drift if lasting else 0.0,
        ripple=ripple_at_rest(t, y, rests) if noise else None,
    )


def _level_at_rest(time: Array, samples: Array, steps: Sequence[RecordedStep]) -> float:
    """Return the median before the first step; of all samples where none is before it."""
    if steps and steps[0].from_start:
        return float(samples[0])
    before = samples[time < (steps[0].at if steps else time[-1])]
    return float(np.median(before if len(before) else samples))


def identified(
    channels: Sequence[InspectedChannel],
    steps: Sequence[RecordedStep],
    groups: Sequence[InspectedPhases],
    of_pmu: Collection[str],
    readings: Mapping[str, NameReading],
) -> tuple[InspectedChannel, ...]:
    """Return the channels with the signals that they are by ``readings``, level and steps.

    Those of ``groups`` are phases, and no signal by themselves; nor are those ``of_pmu``, the
    phasors of a measurement unit.
    """
    phases = {name for group in groups for name in group.columns}
    candidates = _candidates(channels, phases.union(of_pmu), readings)
    moving = {name for step in steps for name in step.sizes}
    guesses = guess_signals([*candidates], {}, moving, readings)
    taken = {guess.signal for guess in guesses.values()} | ({"vt"} if groups or of_pmu else set())
    known = {}
    for name, channel in candidates.items():
        if name in guesses:
            known[name] = _as_guessed(channel, guesses[name], name in moving, bool(steps))
        elif name in moving or channel.moves or not (moving & guesses.keys() and "vt" in taken):
            question = _open_question(channel, taken, candidates, readings, name in moving)
            known[name] = replace(channel, question=question)
    return tuple(known.get(channel.name, channel) for channel in channels)


def without_false_per_unit(
    channels: Sequence[InspectedChannel],
) -> tuple[InspectedChannel, ...]:
    """Return channels of which none without a unit is per unit where another certainly is not.

    So it is with those of load, and those of the field: q of 12 Mvar beside p of 150 MW.
    """
    plain = {each.signal: each for each in channels if each.unit is None and each.signal}
    voltage, absolute = plain.get("vt"), set[str | None]()
    for group in (OF_CURRENT_PHASOR, FIELDS):
        beside = [plain[signal] for signal in group if signal in plain]
        if any(not each.seems_per_unit for each in (voltage, *beside) if each is not None):
            absolute |= {*group}
    return tuple(
        replace(each, absolute=True) if each.unit is None and each.signal in absolute else each
        for each in channels
    )


def _candidates(
    channels: Sequence[InspectedChannel],
    excluded: Collection[str],
    readings: Mapping[str, NameReading],
) -> dict[str, InspectedChannel]:
    """Return the channels that may be a signal, by name; a control error rests at zero."""
    candidates = {}
    for channel in channels:
        at_zero = abs(channel.level) < LARGEST_ERROR * (channel.high - channel.low)
        if channel.name in excluded or channel.constant:
            continue
        if not (at_zero and CONTROL_ERROR in readings[channel.name].others):
            candidates[channel.name] = channel
    return candidates


def _as_guessed(
    channel: InspectedChannel, guess: Guess, moves: bool, tested: bool
) -> InspectedChannel:
    """Return a channel with its signal; ``tested`` says whether the record shows any step."""
    reading, signal = guess.reading, guess.signal
    still = tested and not moves and signal in RESPONDING
    low, high = AT_REST_PU
    reasons = [reading.why]
    if quantity_of(channel.unit):
        reasons.append(
            f"its unit: {channel.unit}{' alone' if reading.clarity is Clarity.UNIT else ''}"
        )
    if signal == "vt" and channel.seems_per_unit and low <= channel.level <= high:
        reasons.append(f"its level: {channel.level:.4g} pu at rest")
    if moves:
        reasons.append("its shape: it moves with the step")
    unit = (reading.unit, "level") if channel.unit is None else (channel.unit, channel.unit_from)
    return replace(
        channel,
        unit=unit[0],
        unit_from=unit[1] if unit[0] else "",
        signal=signal,
        sure=reading.clarity <= Clarity.WORDS and not (reading.others or guess.rivals or still),
        why="; ".join(filter(None, reasons)),
        question="; ".join(_questions(channel, guess, still)),
        system_base=reading.system_base,
    )


def _questions(channel: InspectedChannel, guess: Guess, still: bool) -> Iterator[str]:
    reading, signal = guess.reading, guess.signal
    what = SIGNALS[signal].name
    for other in reading.others:
        yield f"is it the {what}, or {other}? It is taken for {signal}, by {reading.why}"
    if reading.clarity is Clarity.QUANTITY and not _looks_terminal(channel):
        yield f"is it the {what}? {reading.why} does not say of what"
    if guess.rivals:
        rivals = " or ".join(guess.rivals)
        yield f"is it the {what}, or is {rivals}? The first is taken for {signal}"
    if still:
        yield f"is it the {what}? It does not move with the step"
    if signal == "speed" and abs(channel.level) < LARGEST_DEVIATION:
        yield f"is it the speed's deviation? It rests at {channel.level:.2g}: then offset: 1"
    if reading.question:
        yield reading.question
    if reading.system_base:
        yield (
            f"1 pu of {reading.why} is that of the grid, mostly 100 MVA: its base is the rated MVA "
            "divided by that"
        )


def _looks_terminal(channel: InspectedChannel) -> bool:
    """Check unit and level of a voltage for those of a generator's terminals."""
    low, high = AT_REST_PU
    level = channel.level / PERCENT if channel.unit == "%" else channel.level
    return channel.unit == "kV" or (channel.unit in ("%", "pu", None) and low <= level <= high)


def _open_question(
    channel: InspectedChannel,
    taken: Collection[str],
    candidates: Mapping[str, InspectedChannel],
    readings: Mapping[str, NameReading],
    steps: bool,
) -> str:
    """Question about a channel that is taken for no signal, "" for none."""
    reading = readings[channel.name]
    if reading.others and not {*reading.others} & {*taken}:
        return f"is it {' or '.join(reading.others)}? {reading.why} fits either"
    signal = reading.signal
    if signal is not None and signal not in taken:
        rivals = [
            name
            for name, other in candidates.items()
            if other is not channel and readings[name].signal == signal
        ]
        return f"is it {signal}, the {SIGNALS[signal].name}, or is {' or '.join(rivals)}?"
    quantity = "current" if channel.unit == OF_SHUNT else quantity_of(channel.unit)
    missing = [
        signal
        for signal in ASKED_FOR
        if signal not in taken and quantity in (None, SIGNALS[signal].quantity)
    ]
    if reading.why or not missing:
        return ""
    return f"is it {' or '.join(missing)}?" + " It moves with the step" * steps
