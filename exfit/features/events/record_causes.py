"""What is wrong with the record of a grid event: bases, signs, angle and clock, before any fit.

The unit's response to its recorded voltage depends, in swings, on its machine far more than on its
exciter: where the recorded power swings otherwise by far, the record is not that of the unit.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import hypot, inf, pi, sqrt
from types import MappingProxyType

import numpy as np

from exfit.case.case import Case
from exfit.case.changes import Changes, number_text
from exfit.case.schema import Recording
from exfit.dsp.quality import noise_of, present_median, spikes
from exfit.dsp.sampling import sampling_of
from exfit.errors import SimulationError
from exfit.fitting.build import build_experiment
from exfit.fitting.event import with_rest
from exfit.fitting.recordings import record_of
from exfit.plants import NETWORK
from exfit.records.record import Record
from exfit.results.cause import Cause
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison
from exfit.signals import SIGNALS
from exfit.util.arrays import Array, median_step
from exfit.verdict.causes.evidence import CERTAIN, Evidence, Suspicion

RATED_VOLTAGES = (0.85, 1.15)  # pu: a unit on load rests between these
ROOT = sqrt(3.0)
NEAR_ROOT = 0.12  # of a level: so near to the root of three it is that
MOST_POWER = 1.2  # pu, apparent: the rating, with what a machine may be overloaded by
LEAST_POWER = 0.02  # pu, apparent
MOST_REACTIVE = 0.75  # pu: beyond the capability of machines that feed active power
MOTORING = -0.02  # pu
SLOWEST = 0.1  # s between samples: a swing of 1 Hz has ten
HELD = 0.3  # s: so long a measurement does not stay the same while the unit swings
SAME = 1e-12  # of the largest sample: what is computed of equal samples differs by less
ANGLE_JUMP = 0.1  # rad from one sample to the next
ALONE, MOST_CHANGES = 5.0, 95.0  # times what so many per cent of the changes stay below
BESIDE_JUMP = 5  # samples on both sides, in which the power follows
LEAST_STIFFNESS = 0.5  # pu of power a rad of angle: machines have more than one
JUMP_AFTER_HOLD = 4.0  # times the usual change between samples
LOST_VOLTAGE, LONGEST_LOSS = 0.05, 3  # pu, samples
BESIDE_SPIKE, BEND = 2, 3.0  # samples; times what most bends stay below
SCALE = "record.channels.{}.scale"  # the place of a factor
COLUMN = "record.channels.{}.column"  # the place of a column; the change names its signal
SPIKE = 8.0  # times the noise
FEWEST_SWINGING = 10  # samples of an event, of which swings are compared
LEAST_SWING = 1e-3  # pu, rms: with less in record or response nothing can be compared
LEAST_OVER_NOISE = 4.0  # times the noise of the record: the same
SMOOTHED_OVER = 2.0  # s: what is slower is the work of regulators and turbine
LIKE_RESPONSE = (0.4, 2.5)  # times the swings of the response: what other data may explain
AGAINST = -0.5  # correlation of swings that go against each other
UNLIKE = 0.3  # correlation of swings that have little in common
LATEST = 0.25  # s: near its resonance a unit with other data is as late
AS_ALIKE = 0.05  # of the correlation: of delays that are as good the shortest one
LEAST_ALIKE = 0.85  # correlation of swings that are the same but for a delay
SIGN_BEFORE_DELAY = 0.05  # of the correlation: with as little to choose it is the sign
GAINED_BY_DELAY = 0.15  # of the correlation
DRIVING = ("vt", "angle", "frequency")
Values = Mapping[str, float]
DEGREES = 180.0 / pi
# fault of an angle -> the words for it, and the remedy
WRONG_ANGLES: Mapping[float, tuple[str, str]] = {
    -1.0: ("with the other sign", "scale: -1 on the channel angle turns it"),
    1.0 / DEGREES: (
        "divided by 57.3",
        "degrees are taken for radians: the unit of the angle is deg",
    ),
    DEGREES: ("times 57.3", "radians are taken for degrees: the unit of the angle is rad"),
}
FAR_BETTER = 0.25  # of the mismatch: what is left of it with another angle
STILL_UNLIKE = 0.2  # of the sizes of both: a better one is not right


def wrong_event(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the records of grid events of faults that they show themselves."""
    for number, record in enumerate(evidence.records):
        steady = record.steady_until
        if steady is not None:
            measured = record.setup.record
            rated = _rating(evidence.case)
            for cause in (*clock_causes(measured), *record_causes(measured, steady, rated)):
                changes = _of_record(evidence, number, cause.changes)
                yield Suspicion(cause._replace(changes=changes), CERTAIN)


def _of_record(evidence: Evidence, number: int, changes: Changes) -> Changes:
    """Return the changes of a record of a case, which may have factors and masks already."""
    given, own = evidence.case.recordings[number].record, dict[str, str]()
    for place, text in changes.items():
        signal = place.split(".")[2] if place.count(".") > 2 else ""
        factor = getattr(given.channels.get(signal), "scale", 1.0)
        if place == SCALE.format(signal) and isinstance(factor, float):
            text = number_text(factor * float(text))
        if place == COLUMN.format(signal):
            text = json.dumps(getattr(given.channels[text], "column", text))
        place = place.replace("mask[0]", f"mask[{len(given.mask)}]")
        own[evidence.place(number, place)] = text
    return own


def _rating(case: Case) -> float:
    """Sum the ratings of all units whose powers are recorded, pu of the case's unit."""
    values = case.values()
    return 1.0 + sum(values[f"{each.prefix}{NETWORK}base"] for each in case.parts.further)


def record_causes(record: Record, steady: float, rated: float = 1.0) -> tuple[Cause, ...]:
    """Find faults in the record of an event that begins after ``steady`` (s).

    ``rated`` is the rating of all units whose powers are recorded, pu.

    It is seen without a response: levels at which no unit runs, held and single samples, angles
    that jump while the power does not.
    """
    return (
        *rest_causes(record, steady, rated),
        *_held(record, steady),
        *_spiky(record),
        *_jumping_angle(record),
    )


def clock_causes(record: Record) -> Iterator[Cause]:
    """Yield gaps of the clock, in which the driving signals are unknown, and slow sampling."""
    sampling = sampling_of(record.time)
    for gap in sampling.gaps[:1]:
        more = f" ({len(sampling.gaps)} such gaps)" if len(sampling.gaps) > 1 else ""
        yield Cause(
            f"the clock jumps from {gap.start:g} to {gap.end:g} s, about {gap.lost} samples are "
            f"missing{more}",
            "the voltage and the angle that drive the unit are unknown there: use a record "
            "without the gap, or its longer part",
            "window",
            _longer_part(record, gap.start, gap.end),
        )
    if sampling.step > SLOWEST:
        yield Cause(
            f"samples are {sampling.step:g} s apart; swings of a unit need {SLOWEST:g} s at most",
            "check the unit of the time, or export the record at 30 samples per second or more",
        )


def _longer_part(record: Record, end: float, start: float) -> Changes:
    """Return the change that leaves the longer part of a record, until or from an instant (s)."""
    first, last = float(record.time[0]), float(record.time[-1])
    begin, until = (first, end) if end - first > last - start else (start, last)
    return {"record.window": f"[{begin:.9g}, {until:.9g}]"}


def _median_of(name: str, lost: int = 1) -> Changes:
    """Return the change that takes the median of a channel over more samples than are wrong."""
    return {f"record.channels.{name}.filter": f"{{median: {2 * lost + 1}}}"}


def rest_causes(record: Record, steady: float, rated: float = 1.0) -> Iterator[Cause]:
    """Yield levels before the event at which no generator runs."""
    level = {}
    for name, samples in record.signals.items():
        before = samples[(record.time < steady) & np.isfinite(samples)]
        if len(before):
            level[name] = float(np.mean(before))
    low, high = RATED_VOLTAGES
    if "vt" in level and not low <= level["vt"] <= high:
        text = f"vt rests at {level['vt']:.4g} pu, not between {low:g} and {high:g}"
        remedy = "check its unit, and its base: the rated voltage, line to line"
        factor = 1.0 / level["vt"] if level["vt"] else None
        for ratio, what in ((1.0 / ROOT, "1 / sqrt(3)"), (ROOT, "sqrt(3)")):
            if abs(level["vt"] / ratio - 1.0) < NEAR_ROOT:
                text, factor = f"{text}; it is about {what}", 1.0 / ratio
                remedy = (
                    "a voltage from phase to ground is taken for one from phase to phase, or the "
                    "reverse: check the base, or record.phasors.voltage.connection"
                )
        changes = {} if factor is None else {SCALE.format("vt"): number_text(factor)}
        yield Cause(text, remedy, "base", changes)
    p, q = level.get("p"), level.get("q", 0.0)
    if p is None:
        return
    p, q = p / rated, q / rated
    if p < MOTORING:
        yield Cause(
            f"p rests at {p:.3g} pu: a generator feeds power, p is above {MOTORING:g} pu",
            "if the channel counts power into the unit, give scale: -1 on p, and on q if the same "
            "meter measures it",
            "polarity",
            {SCALE.format("p"): "-1.0"},
        )
    apparent = hypot(p, q)
    if apparent > MOST_POWER:
        yield Cause(
            f"p and q rest at {p:.3g} and {q:.3g} pu, {apparent:.3g} pu of apparent power, above "
            f"{MOST_POWER:g}",
            "check the base of p and q, which is the rated MVA of the machine, and their units",
        )
    elif apparent < LEAST_POWER:
        yield Cause(
            f"p and q rest at {p:.2g} and {q:.2g} pu, below {LEAST_POWER:g} pu of apparent power",
            "check the base of p and q, which is the rated MVA of the machine, and their units",
        )
    elif abs(q) > MOST_REACTIVE and abs(q) > abs(p):
        yield Cause(
            f"q rests at {q:.3g} pu, above {MOST_REACTIVE:g}, and p at {p:.3g} pu",
            "check whether the columns of p and q are exchanged",
            "exchanged",
            {COLUMN.format("p"): "q", COLUMN.format("q"): "p"},
        )


def _held(record: Record, steady: float) -> Iterator[Cause]:
    """Yield signals that stay the same for a while in the event, and then jump."""
    for name, samples in record.signals.items():
        present = np.isfinite(samples) & (record.time >= steady)
        t, y = record.time[present], samples[present]
        hold = _longest_hold(t, y)
        if hold is not None:
            start, end = hold
            yield Cause(
                f"{name} does not change from {start:.4g} to {end:.4g} s, in the event, and then "
                "jumps",
                "the recorder held its last sample: mask that part, or use a record of the PMU "
                "itself, not of a historian that stores changes",
                "mask",
                {"record.mask[0]": f"[{start:.6g}, {end:.6g}]"},
            )


def _longest_hold(time: Array, samples: Array) -> tuple[float, float] | None:
    """Interval (s) in which a signal (M,) is held before a jump, None where it is not."""
    if len(samples) < 3:
        return None
    changes = np.abs(np.diff(samples))
    changes[changes < SAME * np.max(np.abs(samples))] = 0.0
    moving = changes[changes > 0.0]
    if not len(moving):
        return None
    usual = float(np.median(moving))
    starts = np.concatenate([[0], np.flatnonzero(changes) + 1])
    ends = np.concatenate([starts[1:] - 1, [len(samples) - 1]])
    apart = np.diff(time[starts])
    coarse = len(moving) < 0.5 * len(changes)  # a hold is usual there
    # a slow meter changes in even steps that are far apart
    stairs = coarse and len(apart) > 2 and float(np.ptp(apart)) < 0.5 * float(np.median(apart))
    for k in np.argsort(time[starts] - time[ends], kind="stable"):
        first, last = int(starts[k]), int(ends[k])
        if time[last] - time[first] < HELD:
            return None
        follows = last + 1 < len(samples)
        if follows and (stairs or changes[last] > JUMP_AFTER_HOLD * usual):
            return float(time[first]), float(time[last])
    return None


def _spiky(record: Record) -> Iterator[Cause]:
    """Yield driving and compared signals with outliers."""
    voltage = record.signals.get("vt", np.ones(0))
    lost = np.flatnonzero(voltage < LOST_VOLTAGE)
    if 0 < len(lost) <= LONGEST_LOSS:
        yield Cause(
            f"vt is {voltage[lost[0]]:.2g} pu at {record.time[lost[0]]:.4g} s, in {len(lost)} "
            f"of {len(voltage)} samples: below {LOST_VOLTAGE:g} pu",
            "the measurement was lost there: correct these samples, or give a median filter",
            "spikes",
            _median_of("vt", len(lost)),
        )
    for name, samples in record.signals.items():
        present = np.isfinite(samples)
        t, y = record.time[present], samples[present]
        scatter = noise_of(y)
        outlying = [
            row
            for row in (spikes(t, y, scatter, SPIKE) if scatter > 0.0 else ())
            if not _others_bend(record, name, float(t[row]))
        ]
        if outlying:
            at = ", ".join(f"{t[row]:.4g}" for row in outlying[:3])
            remedy = "outliers: 6 on the channel leaves them out"
            changes: Changes = {f"record.channels.{name}.outliers": "6"}
            if name in DRIVING:
                remedy = (
                    "it drives the unit: give a median filter on the channel, or correct these "
                    "samples"
                )
                changes = _median_of(name)
            count = "an outlier" if len(outlying) == 1 else f"{len(outlying)} outliers"
            yield Cause(f"{name} has {count}, at {at} s", remedy, "spikes", changes)


def _others_bend(record: Record, name: str, at: float) -> bool:
    """Test whether another signal bends near a time (s) more than noise does: a switching."""
    row = int(np.searchsorted(record.time, at))
    near = slice(max(row - BESIDE_SPIKE, 1), row + BESIDE_SPIKE + 1)
    for other, samples in record.signals.items():
        bends = np.abs(np.diff(samples, 2, prepend=samples[:1], append=samples[-1:]))
        least = BEND * _usual(bends)
        if other != name and np.nanmax(bends[near], initial=0.0) > least:
            return True
    return False


def _usual(sizes: Array) -> float:
    """Return the size that most of some (M,) do not exceed, inf where none is known."""
    known = sizes[np.isfinite(sizes)]
    return float(np.percentile(known, MOST_CHANGES)) if len(known) else inf


def _jumping_angle(record: Record) -> Iterator[Cause]:
    """Yield an angle that jumps while the power does not, as when a PMU's clock is set."""
    angle, p = record.signals.get("angle"), record.signals.get("p")
    if angle is None or p is None:
        return
    jumps = np.diff(angle)
    jumps = jumps - present_median(jumps)
    for k in np.flatnonzero(np.abs(jumps) > max(ANGLE_JUMP, ALONE * _usual(np.abs(jumps)))):
        near = p[max(k - BESIDE_JUMP, 0) : k + BESIDE_JUMP + 2]
        near, size = near[np.isfinite(near)], float(jumps[k])
        if len(near) and float(np.ptp(near)) < LEAST_STIFFNESS * abs(size):
            yield Cause(
                f"angle jumps by {size:+.2g} rad at {record.time[k + 1]:.4g} s, while p moves by "
                f"less than {LEAST_STIFFNESS:g} pu for each rad",
                "the clock of the PMU was set there, or the sample is wrong: correct the angle, or "
                "use the longer part",
                "window",
                _longer_part(record, float(record.time[k]), float(record.time[k + 1])),
            )
            return


def swing_causes(comparison: Comparison, steady: float) -> Iterator[Cause]:
    """Yield powers that swing unlike any unit with such a machine."""
    for name in ("p", "q"):
        if name in comparison.overlays:
            yield from _swing_cause(name, comparison, steady)


def both_swings(comparison: Comparison, name: str, steady: float) -> tuple[Array, Array, Array]:
    """Return the times (M,) of the event, the swings of a signal and those of its response."""
    overlay = comparison.overlays[name]
    known = np.isfinite(overlay.error)
    t = comparison.time[known]
    event = t >= steady
    measured, simulated = (swings(t, y[known]) for y in (overlay.measured, overlay.simulated))
    return t[event], measured[event], simulated[event]


def mismatch(comparison: Comparison, steady: float) -> float:
    """Difference of the swings of p from the response's, of the sizes of both; 1 at most."""
    _, measured, simulated = both_swings(comparison, "p", steady)
    size = float(np.sum(measured**2) + np.sum(simulated**2))
    return float(np.sum((measured - simulated) ** 2)) / size if size > 0.0 else 0.0


def _swing_cause(name: str, comparison: Comparison, steady: float) -> Iterator[Cause]:
    overlay = comparison.overlays[name]
    noise = noise_of(overlay.measured[np.isfinite(overlay.error)])
    if np.count_nonzero(comparison.time[np.isfinite(overlay.error)] >= steady) < FEWEST_SWINGING:
        return
    time, measured, simulated = both_swings(comparison, name, steady)
    sizes = [float(np.sqrt(np.mean(y * y))) for y in (measured, simulated)]
    least = max(LEAST_SWING, LEAST_OVER_NOISE * noise)
    if max(sizes) < least:
        return
    place = f"{name} swings by {sizes[0]:.2g} pu rms in the event, the response by {sizes[1]:.2g}"
    alike = _correlation(measured, simulated)
    ratio = sizes[0] / max(sizes[1], 1e-12)
    low, high = LIKE_RESPONSE
    if not low <= ratio <= high:
        remedy = (
            f"check the base of {SIGNALS['p'].name} and reactive power, the rated MVA of the "
            "machine, the unit of the angle, and H and the reactances"
        )
        if not 0.1 <= ratio <= 10.0:
            remedy = (
                "check the unit of the angle, 57.3 times too large where degrees are taken "
                "for radians, the unit of the frequency, and the bases of p, q and vt"
            )
        yield Cause(f"{place}: {ratio:.2g} times as far, not {low:g} ... {high:g}", remedy)
        return
    late, better = _delay(time, measured, simulated)
    if alike < AGAINST and -alike > better - SIGN_BEFORE_DELAY:
        yield Cause(
            f"{place}, in opposite directions (correlation {alike:.2f})",
            f"check the signs of {name} and of the angle: scale: -1 turns a channel",
        )
    elif abs(late) > LATEST and better > max(alike + GAINED_BY_DELAY, LEAST_ALIKE):
        order = "later" if late > 0.0 else "earlier"
        yield Cause(
            f"{name} moves {abs(late):.2g} s {order} than the response, beyond {LATEST:g} s",
            "check the clocks of its source and of the voltage, and the sign of the angle",
        )
    elif alike < UNLIKE and name == "p":
        yield Cause(
            f"{place}, hardly correlated ({alike:.2f}, above {UNLIKE:g} expected)",
            "check that the angle is that of the voltage of this unit, and H and the reactances "
            "those of its machine",
        )


def swings(time: Array, samples: Array) -> Array:
    """Return a signal (M,) less its mean over two seconds about each time."""
    step = median_step(time)
    half = min(max(round(0.5 * SMOOTHED_OVER / step), 1), len(samples) // 2)
    padded = np.pad(samples, half, mode="edge")
    sums = np.cumsum(np.concatenate([[0.0], padded]))
    width = 2 * half + 1
    return np.asarray(samples - (sums[width:] - sums[:-width]) / width)


def _correlation(a: Array, b: Array) -> float:
    size = sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / size if size > 0.0 else 0.0


def _delay(time: Array, measured: Array, simulated: Array) -> tuple[float, float]:
    """Delay (s) of a signal after another where they are most alike, and that correlation."""
    step = median_step(time)
    most = min(round(1.0 / step), len(time) // 4)
    correlations = []
    for lag in range(-most, most + 1):
        a = measured[max(lag, 0) : len(measured) + min(lag, 0)]
        b = simulated[max(-lag, 0) : len(simulated) - max(lag, 0)]
        correlations.append((lag, _correlation(a, b)))
    best = max(alike for _, alike in correlations)
    peaks = [
        (lag, alike)
        for (_, before), (lag, alike), (_, after) in zip(
            correlations, correlations[1:], correlations[2:], strict=False
        )
        if before <= alike >= after and alike >= best - AS_ALIKE
    ]
    lag, alike = min(peaks, key=lambda peak: abs(peak[0]), default=(0, best))
    return lag * step, alike


def event_causes(case: Case, recording: Recording) -> tuple[Cause, ...]:
    """Find faults of the record of an event: its clock, its levels, its swings.

    Each of these hides what comes after it.
    """
    record = record_of(case, recording)
    of_clock = tuple(clock_causes(record))
    if of_clock:
        return of_clock
    steady = with_rest(recording.test, record).steady
    if steady is None:
        return ()
    of_record = record_causes(record, steady, _rating(case))
    if of_record:
        return of_record
    comparison = _compared(case, recording)
    if comparison is None:
        return ()
    of_swings = tuple(swing_causes(comparison, steady))
    if of_swings and "p" in comparison.overlays and "angle" in record.signals:
        of_angle = _other_angle(case, recording, record, steady, mismatch(comparison, steady))
        return of_angle or of_swings
    return of_swings


def _compared(case: Case, recording: Recording) -> Comparison | None:
    """Return the match with the response to the start values, None where there is none."""
    values = case.values()
    try:
        setup = build_experiment(case, recording, values)
        ready = setup.with_enough_substeps(setup.with_start_values(values))
        return compare_with_record(ready, values)
    except SimulationError:  # a fit reports it
        return None


def _other_angle(
    case: Case, recording: Recording, record: Record, steady: float, before: float
) -> tuple[Cause, ...]:
    """Try other angles, and name one with which the power matches far better."""
    for factor, (words, remedy) in WRONG_ANGLES.items():
        signals = {**record.signals, "angle": factor * record.signals["angle"]}
        turned = replace(record, signals=MappingProxyType(signals))
        comparison = _compared(case.with_record(turned, recording.name), recording)
        if comparison is None:
            continue
        after = mismatch(comparison, steady)
        if after < min(FAR_BETTER * before, STILL_UNLIKE):
            return (
                Cause(
                    f"with the angle {words}, p swings like the response: they differ by "
                    f"{100.0 * after:.2g} %, with the angle as recorded by {100.0 * before:.2g} %",
                    remedy,
                ),
            )
    return ()
