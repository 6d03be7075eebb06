"""The sections of a case that the file of a phasor measurement unit suggests: a grid event."""

from collections.abc import Iterator, Mapping
from math import sqrt
from textwrap import wrap

from exfit.case.draft.bases import Base
from exfit.case.draft.suggestion import (
    NO_BASES,
    WIDTH,
    channel_entry,
    clock_text,
    gap_lines,
    number_text,
    plain_text,
    reading_lines,
)
from exfit.case.open_values import FILL_IN
from exfit.case.templates import commented, in_comment
from exfit.records.angles import unit_by_range
from exfit.records.inspection import Inspection
from exfit.records.phasors import OF_POWER, PREFIX
from exfit.records.pmu_recognition import InspectedPhasor, PmuContent
from exfit.records.units import quantity_of, scale_between
from exfit.signals import COMPARED_IN_EVENT, SIGNALS

RATED_FREQUENCIES = (50.0, 60.0)  # Hz
NEAR_RATED = 1.0  # Hz: a grid is closer to its rated frequency
LIKE_RATED = (0.85, 1.15)  # of the rated voltage: where a unit rests on load


def event_section(
    inspection: Inspection, file: str, bases: Mapping[str, Base] = NO_BASES
) -> list[str]:
    """Return the lines of a ``record:`` section of a grid event, which needs no ``test:``.

    ``bases`` has the rated voltage under vt and the rated power under p; what is not known is to be
    filled in.
    """
    pmu = inspection.pmu
    return [
        "record:",
        f"  file: {plain_text(file)}",
        f"  time: {clock_text(inspection)}",
        *(() if pmu is None else _phasors(pmu, bases)),
        *(() if pmu is None else _status(pmu)),
        "  channels:",
        *(_plain_driving(inspection, bases) if pmu is None else _driving(inspection, pmu)),
        *_compared(inspection, bases),
        *gap_lines(inspection),
        *reading_lines(inspection),
    ]


def event_plant(inspection: Inspection) -> list[str]:
    """Return the first lines of a ``plant:`` section, on whose terminals an event is played."""
    return [
        "plant:",
        commented("  type: grid-playback", "the recorded voltage and angle drive the unit"),
        "  network:",
        commented(f"    f0: {_rated_frequency(inspection.pmu)}", "Hz, rated frequency"),
        commented("    R: 0.0", "pu, from the terminals to the recorded voltage"),
        commented("    X: 0.0", "pu, as of a step-up transformer; 0: recorded at the terminals"),
    ]


def _rated_frequency(pmu: PmuContent | None) -> str:
    """Return the rated frequency by the recorded one, to be filled in where it shows none."""
    level = None if pmu is None else pmu.frequency_level
    near = (f0 for f0 in RATED_FREQUENCIES if level is not None and abs(level - f0) < NEAR_RATED)
    return next((f"{f0:g}" for f0 in near), FILL_IN)


def _phasors(pmu: PmuContent, bases: Mapping[str, Base]) -> Iterator[str]:
    kv, mva = bases.get("vt"), bases.get("p")
    yield "  phasors:"
    yield from _about(pmu.voltage, "the voltage at the terminals of the unit")
    yield from _phasor(pmu.voltage, "voltage")
    yield from _connection(pmu.voltage, kv)
    if pmu.current is not None:
        yield from _about(pmu.current, "the current out of the unit")
        yield from _phasor(pmu.current, "current")
    scaled = pmu.voltage.unit != "pu"
    if scaled:
        value = FILL_IN if kv is None else number_text(kv.in_unit("kV", "kV"))
        yield commented(f"    kV: {value}", "rated, line to line")
    if pmu.current is not None and pmu.current.unit != "pu":
        value = FILL_IN if mva is None else number_text(mva.in_unit("MW", "MVA"))
        yield commented(f"    MVA: {value}", "rated")


def _about(phasor: InspectedPhasor, what: str) -> Iterator[str]:
    """Yield what to check of a phasor, as comments."""
    facts = [what]
    if phasor.rivals:
        facts.append(f"or is it {', '.join(phasor.rivals)}?")
    if phasor.angle_unit is not None and phasor.angle_unit_from != "file":
        facts.append(f"angle in {phasor.angle_unit} by its {phasor.angle_unit_from}")
    if phasor.wraps:
        facts.append(f"wrapped {phasor.wraps} times: its turns are counted")
    yield from wrap(
        in_comment("; ".join(facts)),
        WIDTH,
        initial_indent="    # ",
        subsequent_indent="    #   ",
    )


def _phasor(phasor: InspectedPhasor, key: str) -> Iterator[str]:
    unit = FILL_IN if phasor.unit is None else plain_text(phasor.unit)
    angle_unit = FILL_IN if phasor.angle_unit is None else phasor.angle_unit
    yield f"    {key}:"
    yield f"      magnitude: {_columns(phasor.magnitudes)}"
    yield f"      angle: {_columns(phasor.angles)}"
    yield commented(f"      unit: {unit}", f"{phasor.level:.5g} at rest")
    yield f"      angle_unit: {angle_unit}"


def _columns(names: tuple[str, ...]) -> str:
    texts = [plain_text(name) for name in names]
    return texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"


def _connection(voltage: InspectedPhasor, kv: Base | None) -> Iterator[str]:
    """Yield the connection of the voltage where its level and the rating show it."""
    if voltage.unit == "pu":
        return
    text, why = FILL_IN, "phase-to-ground or phase-to-phase: a factor of sqrt(3)"
    scale = None if voltage.unit is None else scale_between(voltage.unit, "kV")
    if kv is not None and scale is not None:
        share = voltage.level * scale / kv.in_unit("kV", "kV")
        low, high = LIKE_RATED
        if low <= share <= high:
            text, why = "phase-to-phase", f"rests at {share:.3g} of the rated kV"
        elif low <= share * sqrt(3.0) <= high:
            text = "phase-to-ground"
            why = f"rests at {share:.3g} = {share * sqrt(3.0):.3g} / sqrt(3) of the rated kV"
    yield commented(f"      connection: {text}", why)


def _status(pmu: PmuContent) -> Iterator[str]:
    if pmu.status is not None:
        yield f"  status: {{column: {plain_text(pmu.status)}}}"


def _driving(inspection: Inspection, pmu: PmuContent) -> Iterator[str]:
    """Yield the channels that drive the unit, of phasors."""
    yield f"    vt: {PREFIX}vt"
    yield f"    angle: {PREFIX}angle"
    if pmu.frequency is not None:
        unit = _unit(inspection, pmu.frequency) or FILL_IN
        entry = f"{{column: {plain_text(pmu.frequency)}, unit: {unit}}}"
        yield commented(f"    # frequency: {entry}", "drives in place of the angle")


def _plain_driving(inspection: Inspection, bases: Mapping[str, Base]) -> Iterator[str]:
    """Yield the channels that drive the unit, of columns of their own."""
    voltage, angle = (inspection.channel_of(signal) for signal in ("vt", "angle"))
    if voltage is not None:
        yield f"    vt: {channel_entry(voltage, bases.get('vt'))}"
    if angle is not None:
        shown = unit_by_range(inspection.samples[angle.name])
        unit = angle.unit or shown or FILL_IN
        why = "deg or rad" if unit == FILL_IN else "by its range" if angle.unit is None else ""
        entry = f"    angle: {{column: {plain_text(angle.name)}, unit: {unit}}}"
        yield commented(entry, why) if why else entry
    frequency = inspection.channel_of("frequency")
    if angle is None and frequency is not None:
        unit = frequency.unit or FILL_IN
        yield f"    frequency: {{column: {plain_text(frequency.name)}, unit: {unit}}}"


def _compared(inspection: Inspection, bases: Mapping[str, Base]) -> Iterator[str]:
    """Yield the channels that are compared: meters of their own first, else those of phasors."""
    if inspection.plays_in:
        return
    has_current = inspection.pmu is not None and inspection.pmu.current is not None
    for signal in COMPARED_IN_EVENT:
        channel = inspection.channel_of(signal)
        known = channel is not None and (
            signal not in OF_POWER
            or inspection.pmu is None
            or quantity_of(channel.unit) == SIGNALS[signal].quantity
        )
        if channel is not None and known:
            yield f"    {signal}: {channel_entry(channel, bases.get(signal))}"
        elif signal in OF_POWER and has_current:
            yield f"    {signal}: {PREFIX}{signal}"
        elif signal in OF_POWER:
            yield f"    {signal}: {{column: {FILL_IN}, unit: {FILL_IN}, base: {FILL_IN}}}"


def _unit(inspection: Inspection, name: str) -> str | None:
    """Return the unit of a channel by its name."""
    return next((channel.unit for channel in inspection.channels if channel.name == name), None)
