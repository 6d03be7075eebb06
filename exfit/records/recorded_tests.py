"""The tests that a recorder's file holds: each step, or steps and their return, with a window."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, inf

import numpy as np

from exfit.dsp.noise import noise
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import block_medians, running_median
from exfit.records.contradictions import sign_disputed_by
from exfit.records.inspection import Inspection, effective_value
from exfit.records.steps import INSTANT_WITHIN, RecordedStep
from exfit.util.arrays import Array

LONGEST_RESPONSE = 60.0  # s: what still moves then drifts
SETTLED = 0.01  # of a step: so near to where it ends, a response has settled
NOISE_OF_SETTLED = 2.0  # times the noise: their running median is no farther by chance
SMOOTHED_OVER = 0.1  # s
QUARTERS = 4  # of what is looked at: in the last two a response that has settled is level
REST = (3.0, 0.5)  # s, and of the response: so long a rest before a step is in its window
LONGEST_REST = 5.0  # s: more of it is simulated for nothing
LEAST_REST = 1.0  # s: with less of it before a step both are one test
SHORTEST_SHOWN = 10.0  # s after a step
LONGEST_AFTERWARDS = 10.0  # s: as long as the response takes, and no longer, is shown after it
FEWEST_SMOOTHED = 10  # samples of a smoothed response: with fewer it has no time to settle
WHOLE_RECORD = 2.0  # times a window: a record that is not longer is used as it is
DIGITS = 2  # of a size in a name


@dataclass(frozen=True)
class DetectedTest:
    """Steps of the reference from one rest to the next, and the window (s) to look at.

    ``changes`` are those of the reference, if it was recorded, else of the voltage, as shares of
    the level at the start of the record; None where neither shows a step, or the field moves
    against the voltage.
    """

    steps: tuple[RecordedStep, ...]
    window: tuple[float, float]
    changes: tuple[float | None, ...]

    @property
    def at(self) -> float:
        """The instant of the first step, s."""
        return self.steps[0].at

    def name(self, size: float | None = None) -> str:
        """Name it, as up-5%-at-312s; by a size (pu) that is known otherwise."""
        size = self.changes[0] if size is None else size
        words = ["pulse" if len(self.steps) == 2 else "steps"] if len(self.steps) > 1 else []
        if size:
            words += ["up" if size > 0.0 else "down", f"{abs(100.0 * size):.{DIGITS}g}%"]
        return "-".join([*(words or ["step"]), "at", f"{self.at:.0f}s"])


def tests_of(inspection: Inspection) -> tuple[DetectedTest, ...]:
    """Return the tests of a record in order of time; none where it shows no step."""
    steps = inspection.steps
    if not steps:
        return ()
    settled, tests = _settled(inspection), list[DetectedTest]()
    before, last = float(inspection.time[0]), float(inspection.time[-1])
    begins = [k for k, step in enumerate(steps) if k == 0 or step.at - settled[k - 1] >= LEAST_REST]
    for begin, end in zip(begins, [*begins[1:], len(steps)], strict=True):
        own = steps[begin:end]
        after = steps[end].at - INSTANT_WITHIN - steps[end].error if end < len(steps) else last
        response = settled[end - 1] - own[-1].at
        rest = min(max(REST[0], REST[1] * response), LONGEST_REST)
        shown = max(SHORTEST_SHOWN, response + min(response, LONGEST_AFTERWARDS))
        start, stop = max(before, own[0].at - rest), min(after, own[-1].at + shown)
        window = (
            start if start == before else ceil(10.0 * start) / 10.0,
            stop if stop == after else floor(10.0 * stop) / 10.0,
        )
        changes = tuple(_change(inspection, step) for step in own)
        tests.append(DetectedTest(own, window, changes))
        before = min(settled[end - 1], after)
    begins_at = [test.window[0] for test in tests[1:]]
    return tuple(
        replace(test, window=(test.window[0], min(test.window[1], begin)))
        for test, begin in zip(tests, [*begins_at, inf], strict=True)
    )


def is_whole_record(test: DetectedTest, inspection: Inspection) -> bool:
    """Check whether the record of a test needs no window: it has no other, and little beyond."""
    start, end = test.window
    alone = len(test.steps) == len(inspection.steps)
    return alone and float(np.ptp(inspection.time)) <= WHOLE_RECORD * (end - start)


def unique_names(names: Sequence[str], tests: Sequence[DetectedTest]) -> list[str]:
    """Return names of tests, with the tenth of a second or a number where two are the same."""
    finer = [
        name if Counter(names)[name] == 1 else name.rpartition("-")[0] + f"-{test.at:.1f}s"
        for name, test in zip(names, tests, strict=True)
    ]
    return [
        name if finer.count(name) == 1 else f"{name}-{finer[:k].count(name) + 1}"
        for k, name in enumerate(finer)
    ]


def _settled(inspection: Inspection) -> list[float]:
    """Find when the response to each step has settled, s; where the next begins at most."""
    present = present_samples(inspection.time, _voltage(inspection))
    block = max(round(SMOOTHED_OVER / inspection.sampling.step), 1)
    time, response = block_medians(*present, block)
    ends = [*(step.at for step in inspection.steps[1:]), float(inspection.time[-1])]
    settled = []
    for step, next_at in zip(inspection.steps, ends, strict=True):
        end = min(next_at, step.at + LONGEST_RESPONSE)
        first, last = np.searchsorted(time, [step.at, end])
        if last - first < FEWEST_SMOOTHED:
            settled.append(step.at)
            continue
        t, scatter = time[first:last], noise(response[first:last])
        y = running_median(response[first:last])
        before, level = (float(np.median(part)) for part in np.array_split(y, QUARTERS)[-2:])
        far = max(SETTLED * float(np.max(np.abs(y - level))), NOISE_OF_SETTLED * scatter)
        away = np.flatnonzero(np.abs(y - level) > far)
        if abs(level - before) > far:
            settled.append(end)
        else:
            settled.append(float(t[min(away[-1] + 1, len(t) - 1)]) if len(away) else step.at)
    return settled


def _voltage(inspection: Inspection) -> Array:
    """Voltage (M,), or what else shows the steps."""
    channel = inspection.channel_of("vt")
    if channel is not None:
        return inspection.samples[channel.name]
    for group in inspection.phases:
        return effective_value(inspection.samples, group.columns)
    shown = [name for step in inspection.steps for name in step.seen_in]
    names = [name for name in shown if name in inspection.samples] or [*inspection.samples]
    return inspection.samples[names[0]]


def _change(inspection: Inspection, step: RecordedStep) -> float | None:
    """Change of the reference at a step, else of the voltage where its sign is not disputed."""
    reference = inspection.channel_of("vref")
    if reference is not None and reference.name in step.sizes:
        return reference.change_at(step)
    if sign_disputed_by(inspection.channels, inspection.steps, step):
        return None
    return inspection.change_of_voltage(step)
