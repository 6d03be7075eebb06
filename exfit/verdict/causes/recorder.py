"""What a recorder adds to a record: ripple, drift, spikes, averages, another clock."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

import numpy as np

from exfit.case.changes import between, changes_to_averages, number_text
from exfit.case.schema.values import TimeColumn
from exfit.dsp.lines import MAINS, Ripple, cosine_and_sine
from exfit.dsp.noise import NEIGHBOURS, noise
from exfit.dsp.quality import SPIKE_LIMIT
from exfit.fitting.channels import finds_instant, with_averages
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.nuisances import COSINE, FREQUENCY, SINE, Nuisance
from exfit.fitting.sines import Sine
from exfit.fitting.uncertainty import slices
from exfit.records.units import SECONDS
from exfit.results.cause import Cause
from exfit.util.arrays import Array, median, median_step
from exfit.verdict.causes.evidence import (
    CERTAIN,
    LAST,
    Evidence,
    FittedRecord,
    Suspicion,
    Trial,
    suspected,
)
from exfit.verdict.causes.trials import (
    Opened,
    linear_fit,
    refitted,
    with_experiment,
    with_opened,
)

FEWEST_PERIODS = 10.0  # of a ripple in a record: fewer may be a response
FEWEST_AT_REST = 20  # samples from which a drift at rest is taken
FINER = 8  # points of the spectrum for each of a transform without padding
INSIDE = 1e-4  # of a frequency: so far within what a record shows its bounds are, as written
LEAST_OF_PERIOD = 0.25  # of a folded ripple in a record: less of it is a drift
LARGEST = 0.01  # pu, of the mains in a record: a recorder's own filter leaves less
SLOW_FREQUENCIES = 40  # of a folded ripple, of which linear theory chooses where to start
MOST_SPIKES = 0.05  # of the samples: more are no spikes
NEAREST_RATIO = 0.1  # of a factor between the clocks
CYCLES = {1.0 / mains: f"cycles of {mains:g} Hz" for mains in MAINS}  # by their lengths, s
ENOUGH_SAMPLES = 30_000  # to tell windows of averages apart
WINDOWS = (0.01, 0.02, 0.04, 0.06, 0.1, 0.15, 0.2, 0.3, 0.5)  # s, of averages that are tried
LONGEST = 0.1  # of the record: a longer window hides the response
WIDE = 3  # windows: as far apart are those that are fitted first
LATE = Nuisance("cause.delay", "delay")


class ChannelErrors(NamedTuple):
    """The errors of one channel: where they are among all, their times (s), their weight."""

    number: int
    channel: Channel
    rows: slice
    time: Array

    def columns(self, count: int, own: Array) -> Array:
        """Return columns (count, C) that are those of this channel, (M, C) pu, weighted."""
        columns = np.zeros((count, own.shape[1]))
        columns[self.rows] = self.channel.weight * own
        return columns


def errors_of_channels(evidence: Evidence) -> Iterator[ChannelErrors]:
    """Yield the errors of each channel whose samples are compared one by one."""
    rows = iter(slices(evidence.residuals.sizes))
    for number, record, _, channel in evidence.channels:
        yield ChannelErrors(number, channel, next(rows), record.setup.record.time[channel.kept])


UNSTEADY = "check the recorder, and whether speed and voltage were steady; use a shorter window"
MOVED_IN_EVENT = (
    "the set power, the reference, or the tap of a transformer may have moved; use a shorter window"
)


def ripple(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the channels in whose errors a line of the spectrum stands out."""
    linear = linear_fit(evidence)
    if linear is None:
        return
    for own in errors_of_channels(evidence):
        frequency = _line(own, linear.errors[own.rows])
        if frequency is None:
            continue
        phase = 2.0 * np.pi * frequency * own.time
        columns = own.columns(len(linear.errors), np.column_stack([np.cos(phase), np.sin(phase)]))
        explained = linear.with_columns(columns)
        height = float(np.hypot(*explained.coefficients))
        folded = Ripple(frequency, height, 1.0 / median_step(own.time)).folded_from
        cause = Cause(
            f"a ripple of {frequency:.1f} Hz, {height:.1e} pu, in "
            f"{own.channel.signal}{evidence.name_of(own.number)}",
            "look for its source" if folded is None else "record it faster",
            "ripple",
            _sine_of(evidence, own, frequency),
        )
        yield from suspected(evidence, explained.cost, 3, cause)


def _near(frequency: float, time: Array) -> str:
    """Write the entry of a frequency (Hz) that is fitted as closely as a record shows it."""
    away = 1.0 / float(np.ptp(time))
    low, high = away * (1.0 + INSIDE), 0.5 / median_step(time) * (1.0 - INSIDE)
    least, most = max(frequency - away, low), min(frequency + away, high)
    return between(min(max(frequency, least), most), least, most)


def _line(own: ChannelErrors, errors: Array) -> float | None:
    """Return the frequency (Hz) at which the errors of a channel have most, None if too few."""
    if len(errors) < FEWEST_PERIODS:
        return None
    step, length = median_step(own.time), FINER * len(errors)
    even = np.interp(own.time[0] + step * np.arange(len(errors)), own.time, errors)
    power = np.abs(np.fft.rfft(even - np.mean(even), length)) ** 2
    frequencies = np.fft.rfftfreq(length, step)
    slowest = FEWEST_PERIODS / np.ptp(own.time)
    power[frequencies < slowest] = 0.0
    return float(frequencies[np.argmax(power)])


def aliased_ripple(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a ripple of the mains that the rate of sampling folds to a slow oscillation."""
    linear = None if evidence.case.kind.finds_rest else linear_fit(evidence)
    if linear is None:  # the phasors of an event hold none
        return
    for own in errors_of_channels(evidence):
        rate, slowest = 1.0 / median_step(own.time), FEWEST_PERIODS / np.ptp(own.time)
        has_one = any(
            sine.signal == own.channel.signal
            for sine in evidence.residuals.experiments[own.number].sines
        )
        if has_one or not any(is_folded(mains, rate, slowest) for mains in MAINS):
            continue
        middle = 0.5 * float(own.time[0] + own.time[-1])

        def explained(frequency: float, own: ChannelErrors = own, middle: float = middle) -> float:
            pair = cosine_and_sine(frequency, own.time - middle)
            return linear.with_columns(own.columns(len(linear.errors), pair)).cost

        least = LEAST_OF_PERIOD / float(np.ptp(own.time))
        start = min(np.linspace(least, slowest, SLOW_FREQUENCIES), key=explained)
        name, signal, number = "cause", own.channel.signal, own.number
        experiment = evidence.residuals.experiments[number]
        sine = Sine(name, signal, middle, None)
        wavy = replace(experiment, sines=(*experiment.sines, sine))
        of_frequency = Nuisance(f"{name}.{FREQUENCY}", "frequency", signal=signal)
        opened = [
            Opened(of_frequency, start, least, slowest),
            Opened.around(Nuisance(f"{name}.{COSINE}", "cosine", signal=signal), 0.0, LARGEST),
            Opened.around(Nuisance(f"{name}.{SINE}", "sine", signal=signal), 0.0, LARGEST),
        ]
        residuals = with_experiment(evidence.residuals, number, wavy)
        if trial := refitted(evidence, with_opened(residuals, number, opened)):
            frequency, height = sine.frequency_at(trial.values), sine.amplitude_at(trial.values)
            cause = Cause(
                f"a ripple of the mains in {signal}{evidence.name_of(number)}, {height:.1e} pu, "
                f"which {rate:.4g} samples a second show at {frequency:.2g} Hz",
                "record it faster",
                "ripple",
                _sine_of(evidence, own, frequency),
            )
            yield from suspected(evidence, trial, len(opened), cause)


def is_folded(frequency: float, rate: float, slowest: float) -> bool:
    """Test whether a rate of sampling folds a frequency to a slow one (all in Hz)."""
    times = round(frequency / rate)
    return times > 0 and abs(frequency - times * rate) < slowest


def _sine_of(evidence: Evidence, own: ChannelErrors, frequency: float) -> Mapping[str, str]:
    """Return the change by which a fit finds a sine (Hz); none for less than a period."""
    if frequency < 1.0 / np.ptp(own.time):
        return {}
    place = evidence.place(own.number, f"record.channels.{own.channel.signal}.sine")
    return {place: f"{{frequency: {_near(frequency, own.time)}}}"}


def drift(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect channels that drift all along the record.

    One that a record does not show at rest may as well be slow parts of a response.
    """
    linear = linear_fit(evidence)
    if linear is None:
        return
    for own in errors_of_channels(evidence):
        way = (own.time - own.time[0]) / np.ptp(own.time)
        columns = own.columns(len(linear.errors), np.column_stack([way, np.ones_like(way)]))
        explained = linear.with_columns(columns)
        change = float(explained.coefficients[0])
        of_event = evidence.case.kind.finds_rest  # its phasors hold no ripple of the mains
        cause = Cause(
            f"a drift of {own.channel.signal}{evidence.name_of(own.number)}: {change:+.1e} pu from "
            "start to end",
            MOVED_IN_EVENT if of_event else UNSTEADY,
            "shorter",
            _shorter_window(evidence, own.number),
        )
        shown = _shows_at_rest(evidence, own, linear.errors[own.rows], change)
        yield from suspected(evidence, explained.cost, 2, cause, 0.0 if shown else LAST)


def _shorter_window(evidence: Evidence, number: int) -> Mapping[str, str]:
    """Return the change by which a record ends half as long after its last step."""
    record = evidence.records[number].setup
    begin, end = float(record.record.time[0]), float(record.record.time[-1])
    last = max((at for at in record.test.instants if at < end), default=begin)
    ends = f"[{begin:.6g}, {0.5 * (last + end):.6g}]"
    return {evidence.place(number, "record.window"): ends}


def _shows_at_rest(evidence: Evidence, own: ChannelErrors, errors: Array, change: float) -> bool:
    """Test whether a record drifts before its step, rather so than not at all.

    ``errors`` (M,) are those of its channel, ``change`` is that of all the record, pu. It is so
    where the record does not begin at rest.
    """
    until = evidence.records[own.number].steady_until
    at_rest = own.time < (-np.inf if until is None else until)
    if np.count_nonzero(at_rest) < FEWEST_AT_REST:
        return True
    slope = np.polyfit(own.time[at_rest], -errors[at_rest] / own.channel.weight, 1)[0]
    return bool(slope * np.ptp(own.time) / change > 0.5)


def spiky_channel(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect channels with spikes, which count as errors of the model."""
    if evidence.residuals.robust is not None:
        return
    for number, record, _, channel in evidence.channels:
        error = record.comparison.overlays[channel.signal].error
        kept = np.isfinite(error)
        time, own = record.comparison.time[kept], error[kept]
        if len(own) < NEIGHBOURS:
            continue
        far = np.abs(own - median(own)) > SPIKE_LIMIT * noise(own)
        places = np.flatnonzero(far)
        # far beyond the noise, few and alone
        alone = not np.any(far[1:-1] & far[:-2] & far[2:])
        if not alone or not 0 < len(places) <= MOST_SPIKES * len(own):
            continue
        square = channel.weight**2 * float(np.sum(own[places] ** 2))
        at = f"{time[places[0]]:.4g} s" + (" and later" if len(places) > 1 else "")
        cause = Cause(
            f"{len(places)} samples of {channel.signal}{evidence.name_of(number)} are spikes, "
            f"at {at}",
            "leave them out",
            "spikes",
            {
                evidence.place(number, f"record.channels.{channel.signal}.outliers"): number_text(
                    SPIKE_LIMIT
                )
            },
        )
        cost = max(evidence.cost - 0.5 * square, 0.0)
        yield from suspected(evidence, cost, len(places), cause)


def averaging(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a recorder that averages, by the window that matches best.

    Where the fit finds the instant of the step, that makes up for the delay of averages.
    """
    for number, record, experiment in evidence.tests:
        if any(channel.filtering is not None for channel in experiment.channels):
            continue
        best = _fitted_window(evidence, number, record, experiment)
        if best is None:
            continue
        trial, window = best
        late, after = trial.values.get(LATE.name), ""
        if late is not None:
            after = f", and is {1e3 * late:.0f} ms late"
        what = f"averages, or filters, over some {1e3 * window:.0f} ms{after}"
        cause = Cause(
            f"the recorder{evidence.name_of(number)} {what}",
            "ask for its setting",
            "averaged",
            changes_to_averages(evidence.case, number, experiment.signals, window, late),
        )
        yield from suspected(evidence, trial, 1 if late is None else 2, cause)


def _fitted_window(
    evidence: Evidence, number: int, record: FittedRecord, experiment: Experiment
) -> tuple[Trial, float] | None:
    """Return the trial with averages over the best window, and that (s); None without one.

    Linear theory at a fit without averages may miss the best by far: some others are fitted, too,
    and then the neighbours of the best, until it is better than both.
    """
    windows = windows_of(record)
    likeliest = _likeliest_window(evidence, windows, experiment)
    if likeliest is None:
        return None
    trials = dict[int, Trial | None]()
    found, delay = finds_instant(experiment), experiment.simulator.delay

    def cost(k: int) -> float:
        if k not in trials:
            window = windows[k]
            residuals = with_experiment(
                evidence.residuals, number, with_averages(experiment, window)
            )
            late = Opened(LATE, delay + 0.5 * window, delay - window, delay + window)
            trials[k] = refitted(evidence, with_opened(residuals, number, [] if found else [late]))
        trial = trials[k]
        return inf if trial is None else trial.cost

    places = {windows.index(likeliest)}
    if not evidence.case.kind.finds_rest:  # an event takes too long for others
        places |= {*range(len(windows) - 1, 0, -WIDE)}
    best = min(places, key=cost)
    while len(places) > 1:
        near = min(range(max(best - 1, 0), min(best + 2, len(windows))), key=cost)
        if near == best:
            break
        best = near
    trial = trials[best]
    return None if trial is None else (trial, windows[best])


def windows_of(record: FittedRecord) -> list[float]:
    """Return the windows (s) of averages that are tried: between samples, and usual ones."""
    time = record.setup.record.time
    step, longest = median_step(time), LONGEST * float(np.ptp(time))
    return [each for each in (step, *(w for w in WINDOWS if w > step)) if each < longest]


def _likeliest_window(
    evidence: Evidence, windows: Sequence[float], experiment: Experiment
) -> float | None:
    """Return the window (s) of the average that matches best, by linear theory."""
    time = experiment.simulator.times
    found, costs = finds_instant(experiment), dict[float, float]()
    every = slice(None, None, -(-len(time) // ENOUGH_SAMPLES))
    thinned = [replace(each, measured=each.measured[every]) for each in experiment.channels]
    simulator = experiment.simulator.at_times(experiment.simulator.times[every])
    experiment = replace(experiment, simulator=simulator, channels=tuple(thinned))
    for window in windows:
        averaged = with_averages(experiment, window)
        values, moves = evidence.values, [*evidence.residuals.moves(evidence.solution.x)]
        if not found:
            averaged = replace(averaged, nuisances=(*averaged.nuisances, LATE))
            values = {**values, LATE.name: experiment.simulator.delay + 0.5 * window}
            moves.append({LATE.name: 1.0})
        errors, slopes = averaged.tangents(values, moves)
        if not np.isfinite(slopes).all():
            return None
        coefficients, *_ = np.linalg.lstsq(slopes, errors, rcond=None)
        left = errors - slopes @ coefficients
        costs[window] = float(left @ left)
    return min(costs, key=lambda window: costs[window], default=None)


def other_clock(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect another unit of the time, by the instant at which the record shows the first step."""
    from exfit.dsp.step_detection import first_step

    for number, record, _ in evidence.tests:
        overlay = record.comparison.overlays.get("vt")
        instants = record.setup.test.instants
        if overlay is None or not instants or instants[0] <= 0.0:
            continue
        detected = first_step(record.comparison.time, overlay.measured)
        if detected is None:
            continue
        given = evidence.case.recordings[number].record.time
        own = SECONDS[given.unit] if isinstance(given, TimeColumn) else 1.0
        units = {seconds: unit for unit, seconds in SECONDS.items()} | CYCLES
        for seconds, unit in units.items():
            near = abs(detected.at * seconds / (own * instants[0]) - 1.0) < NEAREST_RATIO
            if near and seconds != own:
                named = unit in SECONDS and isinstance(given, str | TimeColumn)
                cause = Cause(
                    f"the time column{evidence.name_of(number)} may be in {unit}: it shows the "
                    f"step at {detected.at:.4g} s, the case has it at {instants[0]:g} s",
                    "check its unit",
                    "clock",
                    {evidence.place(number, "record.time.unit"): unit} if named else {},
                )
                yield Suspicion(cause, CERTAIN)
