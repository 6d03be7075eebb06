"""What contradicts itself in the phasors of a record."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.records.units import alike, quantity_of

COLUMNS_OF_A_PHASOR = (1, 3)
PER_UNIT = "pu"


def phasors_faults(record: ContentNode) -> Iterator[Fault]:
    """Yield what contradicts itself in the phasors of a record, or is missing there."""
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
    from exfit.records.phasors import OF_POWER, PREFIX, SIGNALS_OF_PHASORS

    for _, channel in record.at("channels").sections:
        name = channel.text if channel.text is not None else channel.at("column").text
        if name is None or not name.startswith(PREFIX):
            continue
        place = channel if channel.text is not None else channel.at("column")
        signal = name.removeprefix(PREFIX)
        if "phasors" not in record:
            yield place.fault(f"{name}: record.phasors is missing, of which it is computed")
        elif signal not in SIGNALS_OF_PHASORS:
            names = ", ".join(PREFIX + signal for signal in SIGNALS_OF_PHASORS)
            yield place.fault(f"{name} is not computed of phasors, only {names}")
        elif signal in OF_POWER and "current" not in record.at("phasors"):
            yield place.fault(f"{name} needs record.phasors.current, which is missing")


def _count(columns: ContentNode) -> int | None:
    if columns.text is not None:
        return 1
    return len(columns.entries) or None
