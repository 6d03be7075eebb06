"""What contradicts itself in a record: its file, its channels, what of it drives the simulation."""

from collections.abc import Collection, Iterator, Sequence

from exfit.case.checks.bump_test import driving_faults, instants_of, no_event
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import LIMITER_KINDS, PlantKind
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
COLUMNS_OF_A_PHASOR = (1, 3)
PER_UNIT = "pu"


def record_faults(
    test: ContentNode, record: ContentNode, with_voltage: bool = True
) -> Iterator[Fault]:
    """Check a record, and it against its test; ``with_voltage``: that at rest must be known."""
    channels, begin = record.at("channels"), test.at("begin")
    if "duration" in test:
        yield test.at("duration").fault("only without a record; record.window cuts a record")
    if "resample" in record and record.at("gaps").text == "skip":
        text = "not allowed with gaps: skip: a filter needs all samples"
        yield record.at("resample").fault(text)
    yield from _phasors_faults(record)
    if "vt0" not in test:
        if begin.number is not None:
            yield test.at("vt0").fault("is missing: it must be given with begin")
        known = "begin" in test or "vt" in channels
        if channels.content and with_voltage and not known:
            text = "is missing, and the record has no vt to take it from"
            yield test.at("vt0").fault(text)
    window = record.at("window").pair
    if window is not None and window[0] < window[1]:
        yield from _window_faults(test, *window)


def _window_faults(test: ContentNode, start: float, end: float) -> Iterator[Fault]:
    """Refuse instants outside the window of a record."""
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
    record: ContentNode, network: ContentNode, kind: PlantKind, compares: bool
) -> Iterator[Fault]:
    """Yield the faults of the channels of a record, one by one and together.

    ``network`` is that of its plant, ``compares``: a signal must be recorded that the simulation is
    compared with.
    """
    channels, possible = record.at("channels"), (*kind.signals, *kind.recorded_inputs)
    for key in () if kind.finds_rest else ("switchings", "filter"):
        if record.at(key).value is not None:
            yield record.at(key).fault(no_event(kind))
    for signal, channel in channels.sections:
        if signal not in possible:
            text = f"not allowed with plant {kind.name}, which has {', '.join(possible)}"
            yield channel.fault(text)
        if signal in kind.driving:
            idle = ("weight", "noise", "filter", "outliers", "sine")
            yield from driving_faults(channel, idle, fitted=True)
        yield from channel_faults(signal, channel, kind.per_unit)
    if channels.content:
        yield from _missing_faults(channels, network, kind, compares)


def _missing_faults(
    channels: ContentNode, network: ContentNode, kind: PlantKind, compares: bool
) -> Iterator[Fault]:
    """Yield the signals that are not recorded and that nothing else gives."""
    for signal in kind.required:
        if signal not in channels:
            yield channels.at(signal).fault(f"is missing: plant {kind.name} needs it")
    driving = [signal for signal in kind.required_one_of if signal in channels]
    if kind.required_one_of and not driving:
        lacking = f"neither {' nor '.join(kind.required_one_of)}"
        yield channels.fault(f"{lacking}: plant {kind.name} needs one of them")
    for signal in driving[1:]:
        yield channels.at(signal).fault(f"not allowed with {driving[0]}, which drives the unit")
    if compares and not {*kind.compared} & {*channels.content, *kind.required}:
        lacking = f"neither {' nor '.join(kind.compared)}"
        yield channels.fault(f"{lacking}: there is nothing to compare")
    for signal in ("p", "q") if kind.finds_rest else ():
        level = network.at(signal.upper())
        if signal not in channels and level.value is None:
            yield level.fault(f"is missing: the record has no {signal} to take it from")


def channel_faults(signal: str, channel: ContentNode, per_unit: bool) -> Iterator[Fault]:
    """Check a channel, whose signal may have to be ``per_unit``: its unit, its phases."""
    yield from _unit_faults(signal, channel, per_unit)
    kind = channel.at("kind").text if "phases" in channel else None
    if "phases" in channel and signal != "vt":
        yield channel.at("phases").fault("only allowed for vt")
    if kind == "rms" and "cycles" in channel:
        yield channel.at("cycles").fault("only with kind: waveform")
    if kind == "waveform" and "averaged" in channel:
        yield channel.at("averaged").fault("waveforms have a window of their own: cycles")


def _unit_faults(signal: str, channel: ContentNode, per_unit: bool) -> Iterator[Fault]:
    """Yield a base of no unit, and a unit that nothing makes per unit, or converts."""
    unit, base = channel.at("unit").text, channel.at("base")
    if signal in OF_EVENT:
        own = SIGNALS[signal].unit
        if "base" in channel:
            yield base.fault(f"not allowed: the signal is in {own}, and not per unit")
        if unit and base_of_own(unit, own) is None:
            yield channel.at("unit").fault(f"{unit!r} cannot be converted to {own}")
    elif "base" in channel:
        if "unit" not in channel:
            yield channel.at("unit").fault("is missing: in which unit is base?")
    elif unit and "scale" not in channel and per_unit and needs_base(unit):
        yield base.fault(f"is missing: what is 1 pu in {unit}?")


def weight_faults(
    recordings: Sequence[tuple[ContentNode, Collection[str]]], balanced: bool
) -> Iterator[Fault]:
    """Yield channels without noise where another has it, and weights that the fit is to find.

    Each of the ``recordings`` has with it the signals that drive its simulation. ``balanced``: the
    fit weights the channels by their residuals.
    """
    channels = [
        (signal in driving, channel)
        for recording, driving in recordings
        for signal, channel in recording.at("record", "channels").sections
    ]
    yield from _noise_faults([channel for drives, channel in channels if not drives])
    weights = [channel.at(key) for _, channel in channels for key in ("weight", "noise")]
    for node in weights if balanced else ():
        if node.value is not None and node.place[0] != "validate":
            yield node.fault("not allowed with estimate.weights: balanced")


def _noise_faults(compared: Sequence[ContentNode]) -> Iterator[Fault]:
    """Yield channels without noise where another has it, and channels with weight and noise."""
    for channel in compared:
        if "noise" in channel and "weight" in channel:
            text = "not allowed with noise: the weight is one over the noise"
            yield channel.at("weight").fault(text)
    fitted = [channel for channel in compared if channel.place[0] != "validate"]
    without = [channel for channel in fitted if "noise" not in channel]
    if len(without) < len(fitted):
        for channel in without:
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


def _phasors_faults(record: ContentNode) -> Iterator[Fault]:
    """Check the phasors of a record, and that none is missing of which a column is computed."""
    phasors, scaled = record.at("phasors"), list[str]()
    for quantity in ("voltage", "current"):
        phasor = phasors.at(quantity)
        unit = phasor.at("unit").text
        in_unit = None if unit is None or alike(unit, PER_UNIT) else unit
        scaled += [quantity] if in_unit else []
        yield from _phasor_faults(phasor, quantity, in_unit)
    if scaled and "kV" not in phasors:
        yield phasors.at("kV").fault("is missing: the rated voltage of the unit, line to line")
    if "current" in scaled and "MVA" not in phasors:
        yield phasors.at("MVA").fault("is missing: the rated power of the unit")
    for _, channel in record.at("channels").sections:
        yield from _computed_faults(channel, record)


def _phasor_faults(phasor: ContentNode, quantity: str, in_unit: str | None) -> Iterator[Fault]:
    """Check a voltage or a current, which is in a unit or per unit."""
    both = [phasor.at(key) for key in ("magnitude", "angle")]
    counts = [1 if each.text is not None else len(each.entries) or None for each in both]
    if None in counts:
        return
    if counts[0] != counts[1]:
        text = f"has {counts[1]} columns, magnitude has {counts[0]}"
        yield phasor.at("angle").fault(text)
    elif counts[0] not in COLUMNS_OF_A_PHASOR:
        yield phasor.at("magnitude").fault("must be one column, or those of the three phases")
    if in_unit is not None and quantity_of(in_unit) != quantity:
        yield phasor.at("unit").fault(f"{in_unit!r} is not a unit of {quantity}")
    elif in_unit is not None and quantity == "voltage" and "connection" not in phasor:
        text = (
            "is missing: phase-to-ground or phase-to-phase, which differ by sqrt(3); PMUs mostly "
            "send phase-to-ground"
        )
        yield phasor.at("connection").fault(text)


def _computed_faults(channel: ContentNode, record: ContentNode) -> Iterator[Fault]:
    """Yield a channel of a computed column that the phasors do not give."""
    place = channel if channel.text is not None else channel.at("column")
    name = place.text
    if name is None or not name.startswith(PHASOR_COLUMNS):
        return
    signal = name.removeprefix(PHASOR_COLUMNS)
    if "phasors" not in record:
        yield place.fault(f"{name}: record.phasors is missing, of which it is computed")
    elif signal not in OF_PHASORS:
        names = ", ".join(PHASOR_COLUMNS + signal for signal in OF_PHASORS)
        yield place.fault(f"{name} is not computed from phasors, only {names}")
    elif signal in OF_CURRENT_PHASOR and "current" not in record.at("phasors"):
        yield place.fault(f"{name} needs record.phasors.current, which is missing")
