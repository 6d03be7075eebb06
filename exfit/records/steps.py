"""The steps of a test, told from all channels of a record together."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.quality import mains_frequency, noise_of
from exfit.dsp.step_detection import BEFORE, DetectedStep, find_step, find_steps

Array = NDArray[np.float64]

COARSE = 20_000  # samples in which the steps of a longer record are looked for first
AROUND = 50  # of those samples, before and behind a step, in which its instant is then told
SAME_STEP = 0.25  # s: as far apart may channels show one step, beside their standard errors
ERRORS = 3.0  # standard errors
SHAPE = 0.1 * 3.0**-0.5  # of a rise: as far may its shape move the instant, evenly up to a tenth
LEVELS = 12  # that a switched signal has, at most
SETTLED = 0.1  # of a record, at its end
MARGIN = 0.005  # of a stretch between two steps
LASTS = 3.0  # times the noise: a smaller change of a channel is none
SMALL_CHANGE = 8.0  # times the noise: what moves from the beginning by less has no step there
ROUNDING = 12.0**-0.5  # standard deviation of what is uniform, over its width


@dataclass(frozen=True)
class LevelChange:
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
class RecordedStep:
    """A step of the test, its instant told from all channels that show it, ``seen_in``.

    ``sizes`` is by how much each channel stands elsewhere at the end of it, those without a lasting
    change left out.
    """

    at: float
    error: float
    seen_in: tuple[str, ...]
    sizes: Mapping[str, float]
    from_start: bool


def changes_of(time: Array, column: Array, reference: bool) -> "tuple[LevelChange, ...] | str":
    """Return the steps of a channel, or why it shows none; what switches must be a reference."""
    seen = np.isfinite(column)
    t, y = (time, column) if seen.all() else (time[seen], column[seen])
    if not len(y):
        return "every sample is missing"
    if np.min(y) == np.max(y):
        return "never changes"
    frequency = mains_frequency(t, y)
    if frequency:
        return f"a waveform of {frequency:.4g} Hz"
    if switches(y):
        return _switched(t, y) if reference else "switches between a few levels"
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


def _finer(time: Array, samples: Array, found: DetectedStep, block: int) -> LevelChange:
    """Return a step whose instant is told from fewer, whole samples around it."""
    coarse = LevelChange(found.at, _error(found), found.size, found.level)
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


def _error(onset: DetectedStep) -> float:
    """Return the standard error of an instant: what noise leaves, and the shape of the rise."""
    return float(np.hypot(onset.spread, SHAPE * onset.rise))


def switches(samples: Array) -> bool:
    """Tell whether a channel jumps between a few levels, as a recorded reference does."""
    jumps = np.flatnonzero(np.diff(samples)) + 1
    ends = np.concatenate([[0], jumps, [len(samples)]])
    return 0 < len(jumps) < LEVELS and bool(np.min(np.diff(ends)) >= BEFORE)


def _switched(time: Array, samples: Array) -> tuple[LevelChange, ...]:
    """Return the steps of a channel that jumps: each between two samples."""
    return tuple(
        LevelChange(
            at=float(time[k] + time[k + 1]) / 2.0,
            error=float(time[k + 1] - time[k]) * ROUNDING,
            size=float(samples[k + 1] - samples[k]),
            level=float(samples[k]),
            jumps=True,
        )
        for k in np.flatnonzero(np.diff(samples))
    )


def from_start(
    time: Array, samples: Mapping[str, Array], found: Mapping[str, "tuple[LevelChange, ...] | str"]
) -> dict[str, tuple[LevelChange, ...]]:
    """Return the changes of channels that move from their first sample on and then settle."""
    changes: dict[str, tuple[LevelChange, ...]] = {}
    for name, column in samples.items():
        y = column[np.isfinite(column)]
        if not isinstance(found[name], str) or len(y) < 2 * BEFORE or mains_frequency(time, column):
            continue
        end = y[-max(round(SETTLED * len(y)), BEFORE) :]
        size = float(np.median(end) - y[0])
        settled = np.ptp(end) < SETTLED * abs(size)
        if settled and abs(size) > SMALL_CHANGE * noise_of(y):
            error = float(time[1] - time[0])
            changes[name] = (
                LevelChange(float(time[0]), error, size, float(y[0]), from_start=True),
            )
    return changes


def together(changes: Mapping[str, "tuple[LevelChange, ...] | str"]) -> tuple[RecordedStep, ...]:
    """Return the steps of the test: what several channels show at one time is one step."""
    shown = sorted(
        ((one.at, name, one) for name, some in changes.items() if isinstance(some, tuple)
         for one in some),
        key=lambda entry: entry[:2],
    )  # fmt: skip
    groups: list[list[tuple[str, LevelChange]]] = []
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


def _step(shown: Mapping[str, LevelChange]) -> RecordedStep:
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
    at_start = all(one.from_start for one in shown.values())
    return RecordedStep(mean, error, tuple(shown), sizes, at_start)


def with_sizes(
    steps: tuple[RecordedStep, ...],
    courses: Mapping[str, Array],
    noises: Mapping[str, float],
    time: Array,
) -> tuple[RecordedStep, ...]:
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


def _end(time: Array, column: Array, start: float, end: float, share: float) -> float:
    """Return the level of a channel in the last share of a stretch, nan without samples there.

    The samples nearest to the end are left out: a step may come a little before it is seen.
    """
    length = end - start
    first, last = np.searchsorted(time, [end - share * length, end - MARGIN * length])
    there = column[first : max(last, first + 1)]
    seen = there[np.isfinite(there)]
    return float(np.median(seen)) if len(seen) else float("nan")
