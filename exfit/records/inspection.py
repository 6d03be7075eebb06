"""What a recorder's file holds: its clock, its channels, their faults, the steps of the test."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.quality import mains_frequency, noise_of, quantum, spikes, stuck
from exfit.dsp.sampling import Sampling, increasing, sampling_of
from exfit.errors import RecordError
from exfit.records.channel_recognition import Guess, guessed, three_phases
from exfit.records.clock import Clock, check_finite
from exfit.records.formats.table import Table, listed, refuse_uneven
from exfit.records.steps import (
    ROUNDING,
    SAME_STEP,
    LevelChange,
    RecordedStep,
    changes_of,
    from_start,
    switches,
    together,
    with_sizes,
)
from exfit.records.units import unit_in, usual

Array = NDArray[np.float64]
Places = NDArray[np.intp]

REFERENCE = "vref"
FEWEST = 2  # samples of a record, and rows of a file that show how its clock runs
NOISELESS = 1e-6  # of the range: with less noise a channel at rest stands still, as simulated ones
FIRST_PLACES = 5  # of spikes that are told one by one
ABOVE = 1.01  # times what rounding leaves: noise of its own
AT_REST_PU = (0.3, 1.7)  # a voltage in per unit lies between these before a step


@dataclass(frozen=True)
class InspectedChannel:
    """A column of numbers, in its own unit.

    ``level`` is where it rests before the first step, the median without one. ``spikes`` are all
    of them, ``spikes_at`` the instants (s) of the first; ``stuck`` are stretches (s) that stand
    still; ``frequency`` (Hz) is that of a waveform, whose noise, spikes and steps are not told.
    ``remark`` says why there is no step. ``unit_from`` tells where the unit is from.
    """

    name: str
    unit: str | None
    unit_from: str
    low: float
    high: float
    level: float
    noise: float
    quantum: float | None
    missing: int
    spikes: int
    spikes_at: tuple[float, ...]
    stuck: tuple[tuple[float, float], ...]
    frequency: float | None
    steps: tuple[LevelChange, ...]
    remark: str
    signal: str | None = None
    why: str = ""

    @property
    def constant(self) -> bool:
        """Tell whether it never changes."""
        return self.low == self.high


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
        """The name under which their common course is told."""
        return ", ".join(self.columns)


@dataclass(frozen=True, eq=False)
class Inspection:
    """What a file holds; ``unreadable`` says by column why it has no numbers.

    ``time`` (M,) in s and ``samples``, each (M,), are those whose time increases.
    """

    path: Path
    sha256: str
    clock: Clock
    sampling: Sampling
    backward_at: tuple[str, ...]
    channels: tuple[InspectedChannel, ...]
    phases: tuple[InspectedPhases, ...]
    steps: tuple[RecordedStep, ...]
    unreadable: Mapping[str, str]
    time: Array
    samples: Mapping[str, Array]

    def channel_of(self, signal: str) -> InspectedChannel | None:
        """Return the channel that seems to be a signal, None without one."""
        return next((one for one in self.channels if one.signal == signal), None)

    @property
    def findings(self) -> tuple[str, ...]:
        """What must be known before the record is used, in sentences."""
        return (*_of_clock(self), *(text for one in self.channels for text in _of_channel(one)))

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        sampling = self.sampling
        return {
            "file": str(self.path),
            "sha256": self.sha256,
            "clock": list(self.clock.columns),
            "clock_unit": self.clock.unit,
            "samples": len(self.time),
            "sampling": {**asdict(sampling), "rate": sampling.rate, "even": sampling.even},
            "channels": [asdict(one) for one in self.channels],
            "phases": [asdict(one) for one in self.phases],
            "steps": [asdict(one) for one in self.steps],
            "unreadable": dict(self.unreadable),
            "findings": list(self.findings),
        }


def inspect(
    table: Table, clock: Sequence[str] | None = None, unit: str | None = None
) -> Inspection:
    """Return what a recorder's file holds.

    Args:
        table: the file.
        clock: the columns of the time, or of date and time; None: those that the table tells.
        unit: of the time's numbers: s, ms, us or min; None: as the file says, else s.

    Raises:
        RecordError: no column seems to be the time or it cannot be read, fewer than two samples,
            or no column of numbers beside it.
    """
    columns = tuple(clock or table.clock)
    if not columns:
        raise RecordError(
            f"{table.path}: no column seems to be the time; --time names one: {listed(table.names)}"
        )
    stamps = table.instants(columns, unit)
    if len(stamps) < FEWEST:
        raise RecordError(f"{table.path}: {len(stamps)} samples; at least {FEWEST} are needed")
    check_finite(stamps, Clock(columns, unit).label, table.place)
    sampling = sampling_of(stamps)
    forward = increasing(stamps)
    time = stamps[forward]
    own = {columns[0]: stamps}
    read, unreadable = _numbers(table, [name for name in table.names if name not in columns], own)
    if not read:
        raise RecordError(f"{table.path}: no column of numbers beside the time")
    samples = {name: column if forward.all() else column[forward] for name, column in read.items()}
    units = {name: _unit(table, name) for name in samples}
    known = {name: unit for name, (unit, _) in units.items() if unit}
    groups = _phases(time, samples, known)
    courses = samples | {group.name: _effective(samples, group.columns) for group in groups}
    guesses = _guesses(samples, groups, known)
    references = [name for name, guess in guesses.items() if guess.signal == REFERENCE]
    changes = {name: changes_of(time, y, name in references) for name, y in courses.items()}
    steps = together(changes)
    if not steps:
        changes |= from_start(time, courses, changes)
        steps = together(changes)
    described = tuple(
        _described(name, *units[name], time, column, changes[name], steps)
        for name, column in samples.items()
    )
    waves = {one.name for one in described if one.frequency}
    moving = {name: column for name, column in courses.items() if name not in waves}
    noises = {one.name: one.noise for one in described}
    noises |= {group.name: noise_of(courses[group.name]) for group in groups}
    steps = with_sizes(steps, moving, noises, time)
    return Inspection(
        table.path,
        table.sha256,
        Clock(columns, unit),
        sampling,
        tuple(table.place(row) for row in sampling.backward[:FIRST_PLACES]),
        tuple(_with_signal(_settled(one, steps), guesses) for one in described),
        groups,
        steps,
        unreadable,
        time,
        samples,
    )


def _numbers(
    table: Table, names: Sequence[str], time: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns of numbers, as long as the time, and why the others are none."""

    def numbers(asked: Sequence[str]) -> dict[str, Array]:
        found = table.numbers(asked, frozenset(asked))
        refuse_uneven(table.path, {**time, **found})
        return found

    try:
        return numbers(names), {}
    except RecordError:
        read: dict[str, Array] = {}
        refused: dict[str, str] = {}
        for name in names:
            try:
                read |= numbers([name])
            except RecordError as fault:
                refused[name] = str(fault)
        return read, refused


def _unit(table: Table, name: str) -> tuple[str | None, str]:
    """Return the unit of a column and where it is from."""
    given = table.units.get(name)
    if given is not None:
        return usual(given), "file"
    unit = unit_in(name)
    return (None, "") if unit is None else (usual(unit), "name")


def _described(
    name: str,
    unit: str | None,
    unit_from: str,
    time: Array,
    column: Array,
    changes: "tuple[LevelChange, ...] | str",
    steps: Sequence[RecordedStep],
) -> InspectedChannel:
    """Return what there is to say of one channel."""
    seen = np.isfinite(column)
    t, y = (time, column) if seen.all() else (time[seen], column[seen])
    missing = len(column) - len(y)
    remark = changes if isinstance(changes, str) else ""
    own = () if isinstance(changes, str) else changes
    if not len(y):
        return InspectedChannel(
            name, unit, unit_from, 0.0, 0.0, 0.0, 0.0, None, missing, 0, (), (), None, (), remark
        )
    frequency = mains_frequency(t, y)
    scatter = 0.0 if frequency or switches(y) else noise_of(y)
    off = np.zeros(0, np.intp) if frequency or not scatter else spikes(t, y, scatter)
    first = steps[0].at if steps else time[-1]
    before = y[:1] if steps and steps[0].from_start else y[t < first]
    rounding = quantum(y)
    # what is rounded more coarsely than its noise stands still most of the time
    noisy = scatter > max(NOISELESS * float(np.ptp(y)), ABOVE * ROUNDING * (rounding or 0.0))
    still = stuck(y) if noisy and not frequency else ()
    return InspectedChannel(
        name=name,
        unit=unit,
        unit_from=unit_from,
        low=float(np.min(y)),
        high=float(np.max(y)),
        level=float(np.median(before if len(before) else y)),
        noise=scatter,
        quantum=rounding,
        missing=missing,
        spikes=len(off),
        spikes_at=tuple(float(t[k]) for k in off[:FIRST_PLACES]),
        stuck=tuple((float(t[first]), float(t[last])) for first, last in still),
        frequency=frequency,
        steps=own,
        remark=remark,
    )


def _guesses(
    samples: Mapping[str, Array], groups: Sequence[InspectedPhases], units: Mapping[str, str]
) -> dict[str, Guess]:
    """Return the signals that channels seem to be; none for one that never changes or a phase."""
    phases = {name for group in groups for name in group.columns}
    moving = [name for name, y in samples.items() if np.fmax.reduce(y) > np.fmin.reduce(y)]
    return guessed([name for name in moving if name not in phases], units)


def _with_signal(channel: InspectedChannel, guesses: Mapping[str, Guess]) -> InspectedChannel:
    """Return a channel with the signal that it seems to be."""
    guess = guesses.get(channel.name)
    return channel if guess is None else replace(channel, signal=guess.signal, why=guess.why)


def _phases(
    time: Array, samples: Mapping[str, Array], units: Mapping[str, str]
) -> tuple[InspectedPhases, ...]:
    """Return the three-phase voltages among the columns."""
    found = []
    for group in three_phases(tuple(samples), units):
        waves = {mains_frequency(time, samples[name]) is not None for name in group}
        if len(waves) == 1:
            effective = _effective(samples, group)
            level = float(np.nanmedian(effective[: max(len(effective) // 10, 1)]))
            found.append(InspectedPhases(group, "waveform" if waves == {True} else "rms", level))
    return tuple(found)


def _effective(samples: Mapping[str, Array], columns: Sequence[str]) -> Array:
    """Return the effective value (M,) of three phases, waveforms or effective values each."""
    return np.asarray(np.sqrt(np.mean([samples[name] ** 2 for name in columns], axis=0)))


def _settled(channel: InspectedChannel, steps: Sequence[RecordedStep]) -> InspectedChannel:
    """Return a channel whose steps have the size that lasts until the next step."""
    changes = []
    for one in channel.steps:
        step = min(steps, key=lambda step: abs(step.at - one.at))
        changes.append(replace(one, size=step.sizes.get(channel.name, one.size)))
    return replace(channel, steps=tuple(changes))


# ---- sentences


def _of_clock(found: Inspection) -> Iterable[str]:
    sampling = found.sampling
    for gap in sampling.gaps[:FIRST_PLACES]:
        yield f"the clock jumps from {gap.start:.6g} to {gap.end:.6g} s: about {gap.lost} samples"
    if len(sampling.gaps) > FIRST_PLACES:
        yield f"the clock jumps {len(sampling.gaps) - FIRST_PLACES} more times"
    if sampling.backward:
        places = ", ".join(found.backward_at)
        more = len(sampling.backward) - len(found.backward_at)
        rest = f" and {more} more" if more else ""
        yield f"time repeats or goes back at {places}{rest}: left out here, refused by a fit"
    if sampling.step >= 1.0:
        yield f"samples {sampling.step:g} s apart: is the time in s?"
    for name, text in found.unreadable.items():
        yield f"{name}: no numbers: {text}"
    for before, after in pairwise(found.steps):
        if after.at - before.at < SAME_STEP:
            yield f"steps at {before.at:.4g} and {after.at:.4g} s: which is which?"


def _of_channel(one: InspectedChannel) -> Iterable[str]:
    if one.missing:
        yield f"{one.name}: {one.missing} samples are missing"
    if one.constant:
        yield f"{one.name}: never changes, {one.low:.6g} throughout"
        return
    if one.spikes:
        at = ", ".join(f"{at:.6g}" for at in one.spikes_at)
        more = ", ..." if one.spikes > len(one.spikes_at) else ""
        count = "1 spike" if one.spikes == 1 else f"{one.spikes} spikes"
        yield f"{one.name}: {count}, at {at}{more} s"
    for first, last in one.stuck[:FIRST_PLACES]:
        yield f"{one.name}: stands still from {first:.6g} to {last:.6g} s"
    if one.signal == "vt" and one.unit in (None, "pu"):
        low, high = AT_REST_PU
        if one.level > high or 0.0 < one.level < low:
            yield f"{one.name}: {one.level:.5g} at rest is no voltage in pu: what is its unit?"
