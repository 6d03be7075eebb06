"""Channels that are not what the case takes them for: base, polarity, offset, start, clipping."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from exfit.case.changes import between, number_text, within
from exfit.case.schema import PhasesSection
from exfit.dsp.filtering import Filtering
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.nuisances import Nuisance
from exfit.plants import VT0
from exfit.results.cause import Cause, Remedy
from exfit.util.arrays import Array, Mask
from exfit.verdict.causes.evidence import (
    Evidence,
    FittedRecord,
    Suspicion,
    suspected,
)
from exfit.verdict.causes.trials import (
    Opened,
    refitted,
    tried,
    with_experiment,
    with_opened,
)
from exfit.verdict.run_quality import levels_at_rest

LEAST_CHANGE = 5e-3  # of vt's scale: the error of an instrument transformer of class 0.5
LEAST_ERROR_OF_BASE = 1e-3  # of another channel: less is no base, and no instrument's error
LARGEST_FACTOR = 3.0  # of a scale, about what the levels at rest say
FARTHEST_VOLTAGE = 0.2  # pu: how far vt0 may be from the case's
FEWEST_CLIPPED = 5  # samples at one extreme value: white noise has one, rounded noise a few
CLIPPED_RATIO = 4.0  # times as many as have the next value: rounded noise has fewer at its extreme
FARTHEST_OFFSET = 1.0  # pu
CHECK_BASE = "check its base, unit and, of phases, connection"
TESTED_AT = 0.02  # pu: how far from rated voltage units are tested, for the most part
RARE = 5.0  # log-likelihood: vt has a wrong base less often than other things are wrong


def wrong_scale(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the scale of channels: base, unit, connection or polarity."""
    for number, record, experiment, channel in evidence.channels:
        if not is_found(experiment, channel, "scale"):
            yield from _other_scale(evidence, number, record, channel)


def _other_scale(
    evidence: Evidence, number: int, record: FittedRecord, channel: Channel
) -> Iterator[Suspicion]:
    signal, place = channel.signal, f"{channel.signal}{evidence.name_of(number)}"
    match = record.comparison
    levels = levels_at_rest(match.time, match.overlays.get(signal), record.steady_until)
    factor = 1.0 if signal == "vt" or levels is None else _factor_between(*levels)
    start = channel.scale * factor
    scale = Nuisance("cause.scale", "scale", signal=signal)
    opened = [Opened.within(scale, start, LARGEST_FACTOR)]
    with_voltage = signal == "vt" and record.given_vt0 is None and levels is not None
    if with_voltage:
        opened.append(_voltage(evidence, number))
    trial = refitted(evidence, with_opened(evidence.residuals, number, opened))
    if trial is None:
        return
    starts = "" if levels is None else _starts(*levels)
    found, prior = trial.values["cause.scale"] / channel.scale, 0.0
    # the errors of a channel are so many times those of its recorder
    share = channel.samples / evidence.residuals.samples
    trial = trial._replace(cost=trial.cost / abs(found) ** (2.0 * share))
    if with_voltage and levels is not None:
        before, after = ((vt - 1.0) / TESTED_AT for vt in (levels[0], trial.values["cause.vt0"]))
        prior = 0.5 * (before**2 - after**2) - RARE
    if found < 0.0:
        turned = rescaled(evidence, number, channel, found).changes
        cause = Cause(f"{place} is inverted{starts}", "check the polarity", "polarity", turned)
    elif is_wrong_base(signal, found) and (
        not with_voltage or nearer_to_rated(levels, trial.values["cause.vt0"])
    ):
        text = f"the base of {place}{starts}; values {found:.4g} times as large would match"
        cause = Cause(text, *rescaled(evidence, number, channel, found))
    else:
        return
    yield from suspected(evidence, trial, len(opened), cause, prior)


def is_wrong_base(signal: str, factor: float) -> bool:
    """Test whether a factor may be that of a wrong base: one that is hardly more than 1 is none."""
    return abs(factor - 1.0) >= (LEAST_CHANGE if signal == "vt" else LEAST_ERROR_OF_BASE)


def _starts(measured: float, simulated: float) -> str:
    text = f": it starts from {measured:.4g} pu"
    if abs(_factor_between(measured, simulated) - 1.0) > LEAST_CHANGE:
        text += f", the response from {simulated:.4g} pu"
    return text


def _factor_between(measured: float, simulated: float) -> float:
    """Ratio of the simulated level to the measured one; 1 where one of them is zero."""
    return simulated / measured if measured and simulated else 1.0


def nearer_to_rated(levels: tuple[float, float] | None, matched: float) -> bool:
    """Test whether another base brings vt before the step nearer to 1 pu, as units are tested."""
    return levels is not None and abs(matched - 1.0) < abs(levels[0] - 1.0)


def _voltage(evidence: Evidence, number: int) -> Opened:
    vt0 = evidence.residuals.experiments[number].own.get(VT0, 1.0)
    return Opened.around(Nuisance("cause.vt0", "vt0"), vt0, FARTHEST_VOLTAGE)


def wrong_offset(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the channels beside vt that an offset would match."""
    for number, record, experiment, channel in evidence.channels:
        if channel.signal == "vt" or is_found(experiment, channel, "offset"):
            continue
        match = record.comparison
        overlay = match.overlays.get(channel.signal)
        levels = levels_at_rest(match.time, overlay, record.steady_until)
        start = channel.offset + (0.0 if levels is None else levels[1] - levels[0])
        offset = Nuisance("cause.offset", "offset", signal=channel.signal)
        opened = [Opened.around(offset, start, FARTHEST_OFFSET)]
        if trial := refitted(evidence, with_opened(evidence.residuals, number, opened)):
            more = trial.values["cause.offset"] - channel.offset
            place = f"{channel.signal}{evidence.name_of(number)}"
            text = f"an offset of {place}: {more:+.3g} pu more would match"
            cause = Cause(text, *check_zero(evidence, number, channel, more))
            yield from suspected(evidence, trial, 1, cause)


def check_zero(evidence: Evidence, number: int, channel: Channel, more: float = 0.0) -> Remedy:
    """Return the remedy for the offset of a channel, which ``more`` of it would match."""
    offset = channel.offset + more
    found = between(offset, offset - FARTHEST_OFFSET, offset + FARTHEST_OFFSET)
    changes = {evidence.place(number, f"record.channels.{channel.signal}.offset"): found}
    return Remedy("check the zero of the recorder, or let the fit find it", "zero", changes)


def rescaled(evidence: Evidence, number: int, channel: Channel, factor: float = 1.0) -> Remedy:
    """Return the remedy for the base of a channel, whose values are to be ``factor`` times it."""
    place = evidence.place(number, f"record.channels.{channel.signal}")
    section = evidence.case.recordings[number].record.channels[channel.signal]
    with_level = channel.signal == "vt" and evidence.records[number].given_vt0 is None
    if isinstance(section, PhasesSection):
        changes = {f"{place}.base": number_text(section.base / factor)}
    elif with_level and factor != 1.0:  # the record shows its level with a base alone
        changes = {f"{place}.scale": number_text(channel.scale * factor)}
    else:
        changes = {f"{place}.scale": within(channel.scale * factor, LARGEST_FACTOR)}
        if with_level:
            level = _voltage(evidence, number)
            found = between(level.start, level.low, level.high)
            changes[evidence.place(number, "test.vt0")] = found
    return Remedy(CHECK_BASE, "base", changes)


def other_level(
    evidence: Evidence, number: int, experiment: Experiment, signal: str, ratio: float, text: str
) -> Cause:
    """Return the cause of a channel whose level is ``ratio`` times what it should be."""
    channel = next((each for each in experiment.channels if each.signal == signal), None)
    if channel is None:  # it drives the unit
        return Cause(text, CHECK_BASE)
    return Cause(text, *rescaled(evidence, number, channel, 1.0 / ratio))


def measured_vt0(evidence: Evidence, number: int) -> Remedy:
    """Return the remedy for a voltage before the step that is not that of the record."""
    changes = {evidence.place(number, "test.vt0"): ""}
    return Remedy("leave it out: it is then the mean of the record", "vt0", changes)


def is_found(experiment: Experiment, channel: Channel, kind: str) -> bool:
    """Test whether a fit finds this about a channel already."""
    return any(
        nuisance.kind == kind and nuisance.signal == channel.signal
        for nuisance in experiment.nuisances
    )


def wrong_start(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield a voltage before the first step that is not that of the record."""
    for number, record, experiment in evidence.tests:
        given = record.given_vt0
        if given is None or VT0 not in experiment.own or "vt" not in record.comparison.overlays:
            continue
        residuals = with_opened(evidence.residuals, number, [_voltage(evidence, number)])
        if trial := refitted(evidence, residuals):
            text = (
                f"vt0 is {given:.5g} pu, but the record{evidence.name_of(number)} starts from "
                f"{trial.values['cause.vt0']:.5g} pu"
            )
            yield from suspected(evidence, trial, 1, Cause(text, *measured_vt0(evidence, number)))


def clipped_channel(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the channels whose record stays at its highest or lowest value while it would go on."""
    for number, record, experiment, channel in evidence.channels:
        flat = clipped_samples(channel.measured, channel.kept)
        if flat is None:
            continue
        time = record.setup.record.time
        masks = len(evidence.case.recordings[number].record.mask)
        value, first, last = float(channel.measured[flat][0]), time[flat][0], time[flat][-1]
        cause = Cause(
            f"{channel.signal}{evidence.name_of(number)} is clipped: flat at {value:.4g} pu, "
            f"{first:.4g} ... {last:.4g} s",
            "leave that part out; widen the range of the recorder",
            "clipped",
            {evidence.place(number, f"record.mask[{masks}]"): f"[{first:.6g}, {last:.6g}]"},
        )
        kept = channel.kept & ~flat
        own = channel.filtering
        filtering = Filtering(time, kept) if own is None else replace(own, kept=kept)
        without = replace(channel, filtering=filtering)  # what is left keeps the weight of all
        channels = tuple(without if each is channel else each for each in experiment.channels)
        changed = replace(experiment, channels=channels)
        residuals = with_experiment(evidence.residuals, number, changed)
        yield from tried(evidence, residuals, cause, 1)


def clipped_samples(measured: Array, kept: Mask) -> Mask | None:
    """Mask of the samples (M,) that stay at an extreme value; None where it is not clipped."""
    values, counts = np.unique(measured[kept], return_counts=True)
    if len(values) < FEWEST_CLIPPED:
        return None
    for end, next_one in ((-1, -2), (0, 1)):
        if counts[end] >= max(FEWEST_CLIPPED, CLIPPED_RATIO * counts[next_one]):
            return np.asarray(kept & (measured == values[end]))
    return None
