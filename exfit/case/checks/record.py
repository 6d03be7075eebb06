"""What contradicts itself in a record: its file, its channels, what of it drives the simulation."""

from collections.abc import Collection, Iterator, Sequence

from exfit.case.checks.bump_test import instants_of
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import LIMITER_KINDS, REFERENCES, PlantKind
from exfit.records.units import alike, base_of_own, needs_base, quantity_of
from exfit.signals import OF_CURRENT_PHASOR, OF_EVENT, OF_PHASORS, PHASOR_COLUMNS, SIGNALS
from exfit.util.file_names import taken_names
from exfit.util.text import show

BEFORE_RECORD = (
    "leave this step out, then the simulation begins at rest from the level that the record has "
    "there; or, if the unit had not settled, give begin before this step, and vt0 at that time"
)
AFTER_WINDOW = "leave this step out, or end the window after it"
PREFIXES_OF_PARTS = ("machine", "network", "stabiliser", "governor", *LIMITER_KINDS)


def event_faults(test: ContentNode, record: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Refuse keys of the record of a grid event where the plant plays none."""
    if kind.finds_rest:
        return
    for node in (record.at("switchings"), record.at("filter"), test.at("frequency_offset")):
        if node.value is not None:
            yield node.fault(f"not allowed with plant {kind.name}: no grid event drives it")


def record_faults(test: ContentNode, record: ContentNode) -> Iterator[Fault]:
    """Check a record, and it against its test."""
    if "duration" in test:
        text = "only without a record; record.window cuts a record"
        yield test.at("duration").fault(text)
    if "resample" in record and record.at("gaps").text == "skip":
        text = "not allowed with gaps: skip: a filter needs all samples"
        yield record.at("resample").fault(text)
    for interval in record.at("mask").entries:
        yield from _order_faults(interval)
    yield from phasors_faults(record)
    yield from _start_faults(test, record.at("channels"))
    yield from _order_faults(record.at("window"))
    yield from _window_faults(test, record.at("window").pair)


def _order_faults(interval: ContentNode) -> Iterator[Fault]:
    if interval.pair is not None and interval.pair[0] >= interval.pair[1]:
        start, end = map(show, interval.pair)
        yield interval.fault(f"start {start} is not below end {end}")


def _start_faults(test: ContentNode, channels: ContentNode) -> Iterator[Fault]:
    """Yield the voltage before the first step, where nothing gives it."""
    if "vt0" in test:
        return
    if test.at("begin").number is not None:
        yield test.at("vt0").fault("is missing: it must be given with begin")
    if channels.content and "begin" not in test and "vt" not in channels:
        text = "is missing, and the record has no vt to take it from"
        yield test.at("vt0").fault(text)


def _window_faults(test: ContentNode, window: tuple[float, float] | None) -> Iterator[Fault]:
    """Refuse instants outside the window of a record."""
    if window is None or window[0] >= window[1]:
        return
    start, end = window
    begin = test.at("begin")
    if begin.number is not None and begin.number > start:
        text = f"{show(begin.number)} s is after {show(start)} s, where the record's window starts"
        yield begin.fault(text)
        return
    start = start if begin.number is None else begin.number
    for place, at in instants_of(test):
        if not start <= at < end:
            limits = f"{show(start)} ... {show(end)} s"
            text = f"{show(at)} s lies outside the window {limits} of the record"
            yield place.fault(f"{text}: {BEFORE_RECORD if at < start else AFTER_WINDOW}")


def channels_faults(
    channels: ContentNode, kind: PlantKind, compares: bool = True
) -> Iterator[Fault]:
    """Yield the faults of the channels of a record, one by one and together.

    ``compares``: a signal must be recorded that the simulation is compared with.
    """
    for signal, channel in channels.sections:
        if signal not in (*kind.signals, *kind.recorded_inputs):
            signals = ", ".join((*kind.signals, *kind.recorded_inputs))
            yield channel.fault(f"not allowed with plant {kind.name}, which has {signals}")
        if signal in kind.driving:
            yield from driving_faults(channel)
        yield from channel_faults(signal, channel, kind.per_unit)
    if not channels.content:
        return
    for signal in kind.required:
        if signal not in channels:
            yield channels.at(signal).fault(f"is missing: plant {kind.name} needs it")
    yield from _either_faults(channels, kind)
    if compares and not {*kind.compared} & {*channels.content, *kind.required}:
        lacking = f"neither {' nor '.join(kind.compared)}"
        yield channels.fault(f"{lacking}: there is nothing to compare")


def _either_faults(channels: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Demand exactly one of some signals."""
    driving = [signal for signal in kind.required_one_of if signal in channels]
    if kind.required_one_of and not driving:
        lacking = f"neither {' nor '.join(kind.required_one_of)}"
        yield channels.fault(f"{lacking}: plant {kind.name} needs one of them")
    for signal in driving[1:]:
        yield channels.at(signal).fault(f"not allowed with {driving[0]}, which drives the unit")


def level_faults(channels: ContentNode, network: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the powers at the start of an event that neither its record nor its network gives."""
    for signal in ("p", "q") if kind.finds_rest and channels.content else ():
        symbol = signal.upper()
        if signal not in channels and symbol not in network:
            yield network.at(symbol).fault(
                f"is missing: the record has no {signal} to take it from"
            )


def channel_faults(signal: str, channel: ContentNode, per_unit: bool) -> Iterator[Fault]:
    """Check a channel, whose signal may have to be ``per_unit``."""
    yield from _scale_faults(channel)
    yield from _unit_faults(channel, signal, per_unit)
    yield from _phase_faults(channel, signal)


def driving_faults(channel: ContentNode) -> Iterator[Fault]:
    """Yield the keys of a channel that have no effect where it drives the simulation."""
    for key in ("weight", "noise", "filter", "outliers", "sine"):
        if key in channel:
            text = "has no effect: the signal drives the simulation and is not compared"
            yield channel.at(key).fault(text)


def _scale_faults(channel: ContentNode) -> Iterator[Fault]:
    median = channel.at("filter", "median")
    if median.number is not None and median.number % 2 == 0:
        yield median.fault(f"{show(median.number)} is not an odd number")
    if channel.at("scale").number == 0.0:
        yield channel.at("scale").fault("must not be 0")


def _unit_faults(channel: ContentNode, signal: str, per_unit: bool) -> Iterator[Fault]:
    """Yield a base of no unit, and a unit that nothing makes per unit, as a machine's must be."""
    unit = channel.at("unit").text
    if signal in OF_EVENT:
        yield from _own_unit_faults(channel, SIGNALS[signal].unit)
        return
    if "base" in channel and "unit" not in channel:
        yield channel.at("unit").fault("is missing: in which unit is base?")
    if "base" in channel or "scale" in channel or not unit:
        return
    if per_unit and needs_base(unit):
        yield channel.at("base").fault(f"is missing: what is 1 pu in {unit}?")


def _own_unit_faults(channel: ContentNode, own: str) -> Iterator[Fault]:
    """Yield a unit of an angle or a frequency that is none, and a base, which it does not have."""
    unit = channel.at("unit").text
    if "base" in channel:
        yield channel.at("base").fault(f"not allowed: the signal is in {own}, and not per unit")
    if unit and base_of_own(unit, own) is None:
        yield channel.at("unit").fault(f"{unit!r} cannot be converted to {own}")


def _phase_faults(channel: ContentNode, signal: str) -> Iterator[Fault]:
    """Yield three phases of what is no voltage of the machine, and keys of the other kind."""
    if "phases" not in channel:
        return
    kind = channel.at("kind").text
    if signal != "vt":
        yield channel.at("phases").fault("only allowed for vt")
    if kind == "rms" and "cycles" in channel:
        yield channel.at("cycles").fault("only with kind: waveform")
    if kind == "waveform" and "averaged" in channel:
        yield channel.at("averaged").fault("waveforms have a window of their own: cycles")


def noise_faults(recordings: Sequence[tuple[ContentNode, Collection[str]]]) -> Iterator[Fault]:
    """Yield channels without noise where another has it, and channels with weight and noise.

    Each of the ``recordings`` has with it the signals that drive its simulation.
    """
    channels = [
        channel
        for recording, driving in recordings
        for signal, channel in recording.at("record", "channels").sections
        if signal not in driving
    ]
    for channel in channels:
        if "noise" in channel and "weight" in channel:
            text = "not allowed with noise: the weight is one over the noise"
            yield channel.at("weight").fault(text)
    yield from _missing_noise([node for node in channels if node.place[0] != "validate"])


def weight_faults(recordings: Sequence[ContentNode]) -> Iterator[Fault]:
    """Yield the weights of channels that the fit is to weight by their residuals."""
    for recording in recordings:
        for _, channel in recording.at("record", "channels").sections:
            for key in ("weight", "noise"):
                if key in channel:
                    yield channel.at(key).fault("not allowed with estimate.weights: balanced")


def _missing_noise(channels: Sequence[ContentNode]) -> Iterator[Fault]:
    if any("noise" in channel for channel in channels):
        for channel in channels:
            if "noise" not in channel:
                yield channel.at("noise").fault("is missing: other channels have it")


def name_faults(recordings: Sequence[ContentNode]) -> Iterator[Fault]:
    """Yield the names of records that cannot be used: files and values are named after them."""
    names = [recording.at("name") for recording in recordings]
    for index, reason in taken_names([name.text for name in names]):
        yield names[index].fault(f"{names[index].text!r} {reason}")
    for name in names:
        if name.text is not None and name.text.casefold().partition(".")[0] in PREFIXES_OF_PARTS:
            text = f"{name.text!r} is taken: names of a part of the plant begin with it"
            yield name.fault(text)


COLUMNS_OF_A_PHASOR = (1, 3)
PER_UNIT = "pu"


def phasors_faults(record: ContentNode) -> Iterator[Fault]:
    """Check the phasors of a record, and that none is missing."""
    phasors = record.at("phasors")
    if "phasors" in record:
        for quantity in ("voltage", "current"):
            if quantity in phasors:
                yield from _phasor_faults(phasors.at(quantity), quantity)
        yield from _rating_faults(phasors)
    yield from _column_faults(record)


def _phasor_faults(phasor: ContentNode, quantity: str) -> Iterator[Fault]:
    counts = [_count(phasor.at(key)) for key in ("magnitude", "angle")]
    if None in counts:
        return
    if counts[0] != counts[1]:
        text = f"has {counts[1]} columns, magnitude has {counts[0]}"
        yield phasor.at("angle").fault(text)
    elif counts[0] not in COLUMNS_OF_A_PHASOR:
        yield phasor.at("magnitude").fault("must be one column, or those of the three phases")
    unit = phasor.at("unit").text
    if unit is None or alike(unit, PER_UNIT):
        return
    if quantity_of(unit) != quantity:
        yield phasor.at("unit").fault(f"{unit!r} is not a unit of {quantity}")
    elif quantity == "voltage" and "connection" not in phasor:
        text = (
            "is missing: phase-to-ground or phase-to-phase, which differ by sqrt(3); PMUs mostly "
            "send phase-to-ground"
        )
        yield phasor.at("connection").fault(text)


def _rating_faults(phasors: ContentNode) -> Iterator[Fault]:
    """Yield the ratings that are missing."""
    voltage, current = (phasors.at(key, "unit").text for key in ("voltage", "current"))
    scaled = [unit for unit in (voltage, current) if unit and not alike(unit, PER_UNIT)]
    if scaled and "kV" not in phasors:
        yield phasors.at("kV").fault("is missing: the rated voltage of the unit, line to line")
    if current and not alike(current, PER_UNIT) and "MVA" not in phasors:
        yield phasors.at("MVA").fault("is missing: the rated power of the unit")


def _column_faults(record: ContentNode) -> Iterator[Fault]:
    """Yield the channels of computed columns that the phasors do not give."""
    for _, channel in record.at("channels").sections:
        name = channel.text if channel.text is not None else channel.at("column").text
        if name is None or not name.startswith(PHASOR_COLUMNS):
            continue
        place = channel if channel.text is not None else channel.at("column")
        signal = name.removeprefix(PHASOR_COLUMNS)
        if "phasors" not in record:
            yield place.fault(f"{name}: record.phasors is missing, of which it is computed")
        elif signal not in OF_PHASORS:
            names = ", ".join(PHASOR_COLUMNS + signal for signal in OF_PHASORS)
            yield place.fault(f"{name} is not computed of phasors, only {names}")
        elif signal in OF_CURRENT_PHASOR and "current" not in record.at("phasors"):
            yield place.fault(f"{name} needs record.phasors.current, which is missing")


def _count(columns: ContentNode) -> int | None:
    if columns.text is not None:
        return 1
    return len(columns.entries) or None


RECORDED = "recorded"  # in place of steps: the channel of the record


def recorded_reference_faults(
    test: ContentNode, record: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what a test takes from a channel of its record, or from a file."""
    for signal in REFERENCES:
        given, channel = test.at(signal), record.at("channels", signal)
        if given.text == RECORDED:
            yield from _recorded_faults(test, signal, channel, kind, has_record)
            if "resample" in record:
                text = f"not allowed with test.{signal}: {RECORDED}: its filter smears the jumps"
                yield record.at("resample").fault(text)
        elif channel.value is not None and signal in kind.recorded_inputs:
            yield channel.fault(_not_used(signal, given))
        elif channel.value is not None and given.value is not None and signal in kind.driving:
            text = f"the record's channel {signal} gives the signal as well: leave one of them out"
            yield given.fault(text)
        if signal in kind.recorded_inputs:
            yield from _driving_faults(channel)
        if "file" in given:
            if kind.plays_back:
                text = f"not allowed with plant {kind.name}: give the record a channel {signal}"
                yield given.fault(text)
            yield from channel_faults(signal, given, kind.per_unit)


def stabiliser_channel_faults(
    channels: ContentNode, stabiliser: ContentNode, kind: PlantKind
) -> Iterator[Fault]:
    """Yield the recorded output of a stabiliser beside the stabiliser itself."""
    if kind.plays_back and "vs" in channels and stabiliser.content:
        text = "not allowed with a stabiliser, whose output it is: leave one of them out"
        yield channels.at("vs").fault(text)


def _not_used(signal: str, given: ContentNode) -> str:
    """Advise on a channel that drives nothing."""
    if given.value is None:
        return f"drives nothing: give test.{signal}: {RECORDED}"
    return (
        f"test.{signal} gives the signal as well: give {RECORDED} there, or leave this channel out"
    )


def _recorded_faults(
    test: ContentNode, signal: str, channel: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    given = test.at(signal)
    if kind.plays_back:
        text = f"not allowed with plant {kind.name}: record.channels.{signal} drives it without"
        yield given.fault(text)
    elif not has_record:
        yield given.fault(f"{RECORDED} needs a record")
    elif channel.value is None:
        yield channel.fault(f"is missing: test.{signal} is {RECORDED}")
    if "begin" in test and not kind.plays_back:
        text = f"not allowed with {signal}: {RECORDED}: the record shows it from its start only"
        yield test.at("begin").fault(text)


def _driving_faults(channel: ContentNode) -> Iterator[Fault]:
    """Yield the keys of a channel that are of use only where it is compared."""
    for key in ("weight", "noise", "outliers", "averaged"):
        if key in channel:
            text = "has no effect: the signal drives the simulation and is not compared"
            yield channel.at(key).fault(text)
    for key in ("scale", "offset"):
        if channel.at(key).is_section:
            yield channel.at(key).fault("must be a number: the signal drives the simulation")
