"""What a recorder's file holds: its clock, its channels, their faults, the steps of the test."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.naming import guessed, known_unit, three_phases, unit_of
from exfit.onset import BEFORE, Onset, find_step, find_steps
from exfit.quality import mains_frequency, noise_of, quantum, spikes, stuck
from exfit.readers.table import Table
from exfit.sampling import Sampling, increasing, sampling_of

Array = NDArray[np.float64]
Places = NDArray[np.intp]

FEWEST = 2  # samples of a record, and rows of a file that show how its clock runs
COARSE = 20_000  # samples in which the steps of a longer record are looked for first
AROUND = 50  # of those samples, before and behind a step, in which its instant is then told
SAME_STEP = 0.25  # s: as far apart may channels show one step, beside their standard errors
ERRORS = 3.0  # standard errors
SHAPE = 0.1 * 3.0**-0.5  # of a rise: as far may its shape move the instant, evenly up to a tenth
LEVELS = 12  # that a switched signal has, at most
SETTLED = 0.1  # of a record, at its end
MARGIN = 0.005  # of a stretch between two steps
NOISELESS = 1e-6  # of the range: with less noise a channel at rest stands still, as simulated ones
LASTS = 3.0  # times the noise: a smaller change of a channel is none
SMALL_CHANGE = 8.0  # times the noise: what moves from the beginning by less has no step there
FIRST_PLACES = 5  # of spikes that are told one by one
ABOVE = 1.01  # times what rounding leaves: noise of its own
ROUNDING = 12.0**-0.5  # standard deviation of what is uniform, over its width
AT_REST_PU = (0.3, 1.7)  # a voltage in per unit lies between these before a step


@dataclass(frozen=True)
class Change:
    """A step of one channel: its instant and standard error (s), its size and level before it.

    Where the channel moves from its first sample on, the step was made there or before it; where it
    jumps between levels, it is no response.
    """

    at: float
    error: float
    size: float
    level: float
    from_start: bool = False
    jumps: bool = False


@dataclass(frozen=True)
class Step:
    """A step of the test, its instant told from all channels that show it, ``seen_in``.

    ``sizes`` is by how much each channel stands elsewhere at the end of it, those without a lasting
    change left out.
    """

    at: float
    error: float
    seen_in: tuple[str, ...]
    sizes: Mapping[str, float]
    from_start: bool


@dataclass(frozen=True)
class Channel:
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
    steps: tuple[Change, ...]
    remark: str
    signal: str | None = None
    why: str = ""

    @property
    def constant(self) -> bool:
        """Tell whether it never changes."""
        return self.low == self.high


@dataclass(frozen=True)
class Phases:
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
    clock: tuple[str, ...]
    sampling: Sampling
    backward_at: tuple[str, ...]
    channels: tuple[Channel, ...]
    phases: tuple[Phases, ...]
    steps: tuple[Step, ...]
    unreadable: Mapping[str, str]
    time: Array
    samples: Mapping[str, Array]

    def channel_of(self, signal: str) -> Channel | None:
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
            "clock": list(self.clock),
            "samples": len(self.time),
            "sampling": {**asdict(sampling), "rate": sampling.rate, "even": sampling.even},
            "channels": [asdict(one) for one in self.channels],
            "phases": [asdict(one) for one in self.phases],
            "steps": [asdict(one) for one in self.steps],
            "unreadable": dict(self.unreadable),
            "findings": list(self.findings),
        }


def inspect(table: Table, clock: Sequence[str] | None = None) -> Inspection:
    """Return what a recorder's file holds.

    Args:
        table: the file.
        clock: the columns of the time, or of date and time; None: those that the table tells.

    Raises:
        RecordError: no column seems to be the time or it cannot be read, fewer than two samples,
            or no column of numbers beside it.
    """
    columns = tuple(clock or table.clock)
    if not columns:
        names = ", ".join(table.names)
        raise RecordError(
            f"{table.path}: no column seems to be the time; --time names one: {names}"
        )
    stamps = table.instants(columns)
    if len(stamps) < FEWEST:
        raise RecordError(f"{table.path}: {len(stamps)} samples; at least {FEWEST} are needed")
    if not np.isfinite(stamps).all():
        row = int(np.flatnonzero(~np.isfinite(stamps))[0])
        raise RecordError(f"{table.place(row)}: no time: {', '.join(columns)}")
    sampling = sampling_of(stamps)
    forward = increasing(stamps)
    time = stamps[forward]
    read, unreadable = _numbers(table, [name for name in table.names if name not in columns])
    if not read:
        raise RecordError(f"{table.path}: no column of numbers beside the time")
    samples = {name: column if forward.all() else column[forward] for name, column in read.items()}
    units = {name: _unit(table, name) for name in samples}
    known = {name: unit for name, (unit, _) in units.items() if unit}
    groups = _phases(time, samples, known)
    courses = samples | {group.name: _effective(samples, group.columns) for group in groups}
    changes = {name: _changes(time, column) for name, column in courses.items()}
    steps = _together(changes)
    if not steps:
        changes |= _from_start(time, courses, changes)
        steps = _together(changes)
    described = tuple(
        _described(name, *units[name], time, column, changes[name], steps)
        for name, column in samples.items()
    )
    waves = {one.name for one in described if one.frequency}
    moving = {name: column for name, column in courses.items() if name not in waves}
    noises = {one.name: one.noise for one in described}
    noises |= {group.name: noise_of(courses[group.name]) for group in groups}
    steps = _with_sizes(steps, moving, noises, time)
    return Inspection(
        table.path,
        table.sha256,
        columns,
        sampling,
        tuple(table.place(row) for row in sampling.backward[:FIRST_PLACES]),
        _with_signals(tuple(_settled(one, steps) for one in described), groups, known),
        groups,
        steps,
        unreadable,
        time,
        samples,
    )


def _numbers(table: Table, names: Sequence[str]) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns of numbers, and why the others are none."""
    try:
        return table.numbers(names, frozenset(names)), {}
    except RecordError:
        read: dict[str, Array] = {}
        refused: dict[str, str] = {}
        for name in names:
            try:
                read |= table.numbers([name], frozenset([name]))
            except RecordError as fault:
                refused[name] = str(fault)
        return read, refused


def _unit(table: Table, name: str) -> tuple[str | None, str]:
    """Return the unit of a column and where it is from."""
    given = table.units.get(name)
    if given:
        return known_unit(given) or given, "file"
    unit = unit_of(name)
    return unit, "name" if unit else ""


def _described(
    name: str,
    unit: str | None,
    unit_from: str,
    time: Array,
    column: Array,
    changes: "tuple[Change, ...] | str",
    steps: Sequence[Step],
) -> Channel:
    """Return what there is to say of one channel."""
    seen = np.isfinite(column)
    t, y = (time, column) if seen.all() else (time[seen], column[seen])
    missing = len(column) - len(y)
    remark = changes if isinstance(changes, str) else ""
    own = () if isinstance(changes, str) else changes
    if not len(y):
        return Channel(
            name, unit, unit_from, 0.0, 0.0, 0.0, 0.0, None, missing, 0, (), (), None, (), remark
        )
    frequency = mains_frequency(t, y)
    scatter = 0.0 if frequency or _switches(y) else noise_of(y)
    off = np.zeros(0, np.intp) if frequency or not scatter else spikes(t, y, scatter)
    first = steps[0].at if steps else time[-1]
    before = y[:1] if steps and steps[0].from_start else y[t < first]
    rounding = quantum(y)
    # what is rounded more coarsely than its noise stands still most of the time
    noisy = scatter > max(NOISELESS * float(np.ptp(y)), ABOVE * ROUNDING * (rounding or 0.0))
    still = stuck(y) if noisy and not frequency else ()
    return Channel(
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


def _with_signals(
    channels: tuple[Channel, ...], groups: Sequence[Phases], units: Mapping[str, str]
) -> tuple[Channel, ...]:
    """Return the channels, each with the signal that it seems to be; phases are none alone."""
    phases = {name for group in groups for name in group.columns}
    alone = [one.name for one in channels if one.name not in phases and not one.constant]
    found = guessed(alone, units)
    return tuple(
        replace(one, signal=found[one.name].signal, why=found[one.name].why)
        if one.name in found
        else one
        for one in channels
    )


def _phases(
    time: Array, samples: Mapping[str, Array], units: Mapping[str, str]
) -> tuple[Phases, ...]:
    """Return the three-phase voltages among the columns."""
    found = []
    for group in three_phases(tuple(samples), units):
        waves = {mains_frequency(time, samples[name]) is not None for name in group}
        if len(waves) == 1:
            effective = _effective(samples, group)
            level = float(np.nanmedian(effective[: max(len(effective) // 10, 1)]))
            found.append(Phases(group, "waveform" if waves == {True} else "rms", level))
    return tuple(found)


def _effective(samples: Mapping[str, Array], columns: Sequence[str]) -> Array:
    """Return the effective value (M,) of three phases, waveforms or effective values each."""
    return np.asarray(np.sqrt(np.mean([samples[name] ** 2 for name in columns], axis=0)))


# ---- steps


def _changes(time: Array, column: Array) -> "tuple[Change, ...] | str":
    """Return the steps of a channel, or why it shows none."""
    seen = np.isfinite(column)
    t, y = (time, column) if seen.all() else (time[seen], column[seen])
    if not len(y):
        return "every sample is missing"
    if np.min(y) == np.max(y):
        return "never changes"
    frequency = mains_frequency(t, y)
    if frequency:
        return f"a waveform of {frequency:.4g} Hz"
    if _switches(y):
        return _switched(t, y)
    block = -(-len(y) // COARSE)
    try:
        return tuple(_finer(t, y, one, block) for one in find_steps(*_coarse(t, y, block)))
    except ValueError as fault:
        return str(fault)


def _coarse(time: Array, samples: Array, block: int) -> tuple[Array, Array]:
    """Return the medians of blocks of a record, and their mean instants; what is left over goes."""
    if block == 1:
        return time, samples
    whole = len(time) // block * block
    return (
        np.mean(time[:whole].reshape(-1, block), axis=1),
        np.median(samples[:whole].reshape(-1, block), axis=1),
    )


def _finer(time: Array, samples: Array, found: Onset, block: int) -> Change:
    """Return a step whose instant is told from fewer, whole samples around it."""
    coarse = Change(found.at, _error(found), found.size, found.level)
    if block == 1:
        return coarse
    at, far = int(np.searchsorted(time, found.at)), AROUND * block
    near = slice(max(at - far, 0), at + far)
    inner = -(-2 * far // COARSE)
    try:
        onset = find_step(*_coarse(time[near], samples[near], inner))
    except ValueError:
        return coarse
    same = abs(onset.at - found.at) <= 0.5 * (time[near][-1] - time[near][0])
    return replace(coarse, at=onset.at, error=_error(onset)) if same else coarse


def _error(onset: Onset) -> float:
    """Return the standard error of an instant: what noise leaves, and the shape of the rise."""
    return float(np.hypot(onset.spread, SHAPE * onset.rise))


def _switches(samples: Array) -> bool:
    """Tell whether a channel jumps between a few levels, as a recorded reference does."""
    jumps = np.flatnonzero(np.diff(samples)) + 1
    ends = np.concatenate([[0], jumps, [len(samples)]])
    return 0 < len(jumps) < LEVELS and bool(np.min(np.diff(ends)) >= BEFORE)


def _switched(time: Array, samples: Array) -> tuple[Change, ...]:
    """Return the steps of a channel that jumps: each between two samples."""
    return tuple(
        Change(
            at=float(time[k] + time[k + 1]) / 2.0,
            error=float(time[k + 1] - time[k]) * ROUNDING,
            size=float(samples[k + 1] - samples[k]),
            level=float(samples[k]),
            jumps=True,
        )
        for k in np.flatnonzero(np.diff(samples))
    )


def _from_start(
    time: Array, samples: Mapping[str, Array], found: Mapping[str, "tuple[Change, ...] | str"]
) -> dict[str, tuple[Change, ...]]:
    """Return the changes of channels that move from their first sample on and then settle."""
    changes: dict[str, tuple[Change, ...]] = {}
    for name, column in samples.items():
        y = column[np.isfinite(column)]
        if not isinstance(found[name], str) or len(y) < 2 * BEFORE or mains_frequency(time, column):
            continue
        end = y[-max(round(SETTLED * len(y)), BEFORE) :]
        size = float(np.median(end) - y[0])
        settled = np.ptp(end) < SETTLED * abs(size)
        if settled and abs(size) > SMALL_CHANGE * noise_of(y):
            error = float(time[1] - time[0])
            changes[name] = (Change(float(time[0]), error, size, float(y[0]), from_start=True),)
    return changes


def _together(changes: Mapping[str, "tuple[Change, ...] | str"]) -> tuple[Step, ...]:
    """Return the steps of the test: what several channels show at one time is one step."""
    shown = sorted(
        ((one.at, name, one) for name, some in changes.items() if isinstance(some, tuple)
         for one in some),
        key=lambda entry: entry[:2],
    )  # fmt: skip
    groups: list[list[tuple[str, Change]]] = []
    for at, name, one in shown:
        near = groups and any(
            at - other.at <= SAME_STEP + ERRORS * (one.error + other.error)
            for _, other in groups[-1]
        )
        if near and name not in dict(groups[-1]):
            groups[-1].append((name, one))
        else:
            groups.append([(name, one)])
    return tuple(_step(dict(group)) for group in groups)


def _step(shown: Mapping[str, Change]) -> Step:
    """Return the step that channels show, its instant their mean, weighted by standard errors.

    Where they scatter more than these say, so much more is the error of the mean (Birge 1932).
    A reference that was recorded tells it alone: it does not respond, it jumps.
    """
    told = {name: one for name, one in shown.items() if one.jumps} or shown
    at = np.array([one.at for one in told.values()])
    # an error of nothing at all is one that the clock cannot show
    errors = np.maximum([one.error for one in told.values()], 1e-9 + 1e-12 * np.abs(at))
    weights = errors**-2.0
    mean = float(weights @ at / np.sum(weights))
    error = float(np.sum(weights) ** -0.5)
    if len(at) > 1:
        error *= max(1.0, float(np.sqrt(weights @ (at - mean) ** 2 / (len(at) - 1))))
    sizes = {name: one.size for name, one in shown.items()}
    from_start = all(one.from_start for one in shown.values())
    return Step(mean, error, tuple(shown), sizes, from_start)


def _with_sizes(
    steps: tuple[Step, ...],
    courses: Mapping[str, Array],
    noises: Mapping[str, float],
    time: Array,
) -> tuple[Step, ...]:
    """Return the steps with the change of each channel: between the ends of what lies before and
    behind."""
    edges = [float(time[0]), *(one.at for one in steps), float(time[-1])]
    found = []
    for k, step in enumerate(steps):
        sizes = {}
        for name, column in courses.items():
            begins = step.from_start and k == 0
            rest = 1.0 if k == 0 else SETTLED
            before = (
                float(column[0]) if begins else _end(time, column, edges[k], edges[k + 1], rest)
            )
            size = _end(time, column, edges[k + 1], edges[k + 2], SETTLED) - before
            if abs(size) > LASTS * noises.get(name, 0.0):
                sizes[name] = size
        found.append(replace(step, sizes=sizes))
    return tuple(found)


def _settled(channel: Channel, steps: Sequence[Step]) -> Channel:
    """Return a channel whose steps have the size that lasts until the next step."""
    changes = []
    for one in channel.steps:
        step = min(steps, key=lambda step: abs(step.at - one.at))
        changes.append(replace(one, size=step.sizes.get(channel.name, one.size)))
    return replace(channel, steps=tuple(changes))


def _end(time: Array, column: Array, start: float, end: float, share: float) -> float:
    """Return the level of a channel in the last share of a stretch, nan without samples there.

    The samples nearest to the end are left out: a step may come a little before it is seen.
    """
    length = end - start
    first, last = np.searchsorted(time, [end - share * length, end - MARGIN * length])
    there = column[first : max(last, first + 1)]
    seen = there[np.isfinite(there)]
    return float(np.median(seen)) if len(seen) else float("nan")


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


def _of_channel(one: Channel) -> Iterable[str]:
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
