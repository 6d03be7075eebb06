"""What is wrong with a case or its records before anything is fitted, in sentences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import Recording, start_value
from exfit.dsp.quality import noise_of
from exfit.dsp.sampling import present_samples
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.nuisances import prefix_from
from exfit.plants import MACHINE
from exfit.registry import parts
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Overlay
from exfit.results.verdict import Cause
from exfit.signals import POSITIVE_AT_REST
from exfit.util.text import show
from exfit.verdict.run_quality import FAR_FROM_BASE, other_levels, unsteady_signals

Values = Mapping[str, float]
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CERTAIN = 8.0  # standard errors of a mean at rest: its sign is certain
AGAINST = -0.5  # of the product of both sizes: moves that go against each other, as a whole
FAR_FROM_FREE_MACHINE = 0.25  # of a level at rest: what data of the machine may still explain


def case_warnings(case: Case) -> Iterator[str]:
    """Warn of steps of no test, and of records that validate nothing, by the case alone."""
    from exfit.records.contradictions import LARGEST_STEP, size_in_words

    for recording in (*case.recordings, *case.validations):
        per_unit = case.seen_from(recording).kind.per_unit
        for k, event in enumerate(recording.test.events("vref") if per_unit else ()):
            size = start_value(event.step)
            if size is not None and abs(size) > LARGEST_STEP:
                yield f"{prefix_from(recording.name)}test.vref[{k}].step: {size_in_words(size)}"
    for fitted, validation in product(case.recordings, case.validations):
        (begin, end), (first, last) = (
            each.record.window or (-inf, inf) for each in (fitted, validation)
        )
        begin, end = max(begin, first), min(end, last)
        if fitted.record.file != validation.record.file or not begin < end:
            continue
        common = f"{show(begin)} ... {show(end)} s"
        if begin == -inf:
            common = "the whole" if end == inf else f"what is before {show(end)} s"
        elif end == inf:
            common = f"what is after {show(begin)} s"
        yield (
            f"validate {validation.name}: {common} of {validation.record.file} is fitted as well, "
            "and validates nothing: give both a window, [start, end] in s, that do not overlap"
        )


def causes_before_fit(case: Case, recording: Recording) -> Iterator[Cause]:
    """Ask features for faults of a record that drives a unit, which is read for that.

    Raises RecordError where it cannot be read.
    """
    if case.seen_from(recording).kind.finds_rest:
        for part in parts("CAUSES_BEFORE_FIT").values():
            yield from part.load()(case, recording)


def event_warnings(case: Case) -> Iterator[str]:
    """Warn of faults in the records of grid events that are fitted; they are read for that.

    Raises RecordError where one cannot be read.
    """
    for recording in case.recordings:
        place = f"{recording.name}: " if len(case.recordings) > 1 else ""
        for cause in causes_before_fit(case, recording):
            yield f"{place}{cause.cause}: {cause.remedy}"


def record_warnings(case: Case, setups: Sequence[ExperimentSetup], values: Values) -> Iterator[str]:
    """Warn of records that differ from the response to the start values.

    The setups have sub-steps enough for that. A level at rest does not depend on the exciter: where
    it is another, the base, the polarity or the data of the machine are.
    """
    free_machine = any(name.startswith(MACHINE) for name in case.free())
    for recording, setup in zip(case.recordings, setups, strict=True):
        if case.seen_from(recording).kind.finds_rest:
            continue  # the record of an event has causes of its own
        place = f"{setup.name}: " if len(setups) > 1 else ""
        steady = setup.test.steady if setup.test.begin is None else None
        beside = [] if steady is None else _beside_response(setup, values, steady, free_machine)
        for text in (*beside, *_ripples(recording, setup)):
            yield place + text


def _beside_response(
    setup: ExperimentSetup, values: Values, steady: float, free_machine: bool
) -> Iterator[str]:
    """Warn of channels that rest or move unlike the response, or are not at rest."""
    comparison = compare_with_record(setup, setup.name, values)
    given = {
        signal: overlay
        for signal, overlay in comparison.overlays.items()
        if not any(each.rescales(signal) for each in setup.experiment.nuisances)  # left to the fit
    }
    before = comparison.time < steady
    against = {name: text for name, y in given.items() if (text := _against(name, y, before))}
    # where vt goes the other way, the step has the other sign, and all follow it
    yield from [against["vt"]] if "vt" in against else against.values()
    sound = {name: y for name, y in given.items() if name not in against}
    far = FAR_FROM_FREE_MACHINE if free_machine else FAR_FROM_BASE
    for cause in (
        *other_levels(replace(comparison, overlays=sound), steady, far),
        *unsteady_signals(setup.record, steady, setup.channels),
    ):
        yield f"{cause.cause}: {cause.remedy}"


def _against(signal: str, overlay: Overlay, before: Mask) -> str:
    """Warn of a channel that is negative at rest or moves against the response; else ""."""
    known = np.isfinite(overlay.error)
    before, after = before & known, ~before & known
    if not (before.any() and after.any()):
        return ""
    rest, start = (float(np.mean(y[before])) for y in (overlay.measured, overlay.simulated))
    error = CERTAIN * noise_of(overlay.measured[known]) / sqrt(np.count_nonzero(before))
    if signal in POSITIVE_AT_REST and rest < -error and start > 0.0:
        return (
            f"{signal} rests at {rest:.4g} pu, the response at {start:.4g} pu: if the channel is "
            "inverted, scale: -1 turns it"
        )
    moves, simulated = overlay.measured[after] - rest, overlay.simulated[after] - start
    sizes = sqrt(float(moves @ moves) * float(simulated @ simulated))
    if float(moves @ simulated) >= AGAINST * sizes:
        return ""
    what = "step" if signal == "vt" else "channel: scale: -1 and an offset turn it"
    return (
        f"{signal} moves against the response, by up to {_farthest(moves):+.3g} pu where that "
        f"moves by {_farthest(simulated):+.3g} pu: check the sign of the {what}"
    )


def _farthest(moves: Array) -> float:
    """Return the largest of moves (M,), with its sign."""
    return float(moves[np.argmax(np.abs(moves))])


def _ripples(recording: Recording, setup: ExperimentSetup) -> Iterator[str]:
    """Yield the lines of channels at rest that the case does nothing about."""
    from exfit.dsp.lines import ripple_at_rest

    time, instants = setup.record.time, setup.test.instants
    if not instants:
        return
    middle = 0.5 * (instants[-1] + float(time[-1]))
    rests = [(float(time[0]), instants[0]), (middle, float(time[-1]))]
    for channel in setup.channels:
        section = recording.record.channels.get(channel.signal)
        if section is None or section.filter or section.averaged or section.sine:
            continue
        ripple = ripple_at_rest(*present_samples(time, channel.measured), rests)
        if ripple is not None:
            yield f"{channel.signal}: {ripple.in_words}: {ripple.remedy}"
