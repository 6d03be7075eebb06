"""The sections of a case that the file of a phasor measurement unit suggests: a grid event."""

from collections.abc import Mapping
from math import sqrt

from exfit.case.case_draft import Noted, Remark, Section, in_braces
from exfit.case.suggestion import Base, channel_entry, record_of, rounded
from exfit.case.yaml import QUESTION
from exfit.records.inspection import Inspection
from exfit.records.phasors import unit_by_range
from exfit.records.pmu_recognition import InspectedPhasor, PmuContent
from exfit.records.units import quantity_of, scale_between
from exfit.signals import COMPARED_IN_EVENT, OF_CURRENT_PHASOR, PHASOR_COLUMNS, SIGNALS

RATED_FREQUENCIES = (50.0, 60.0)  # Hz
NEAR_RATED = 1.0  # Hz: a grid is closer to its rated frequency
LIKE_RATED = (0.85, 1.15)  # of the rated voltage: where a unit rests on load


def event_sections(inspection: Inspection, file: str, bases: Mapping[str, Base]) -> Section:
    """Suggest ``plant`` and ``record`` of a grid event, which needs no ``test``; else nothing.

    ``bases`` has the rated voltage under vt and the rated power under p; what is not known is to be
    filled in.
    """
    if not inspection.is_event:
        return {}
    pmu, turning = inspection.pmu, inspection.channel_of("frequency")
    level = None if pmu is None else pmu.frequency_level
    if turning is not None and turning.unit == "Hz":
        level = turning.level
    near = (f0 for f0 in RATED_FREQUENCIES if level is not None and abs(level - f0) < NEAR_RATED)
    network = {
        "f0": Noted(next(near, QUESTION), "Hz, rated frequency"),
        "R": Noted(0.0, "pu, from the terminals to the recorded voltage"),
        "X": Noted(0.0, "pu, as of a step-up transformer; 0: recorded at the terminals"),
    }
    kind = Noted("grid-playback", "the recorded voltage and angle drive the unit")
    channels = {**_driving(inspection, bases), **_compared(inspection, bases)}
    phasors = {} if pmu is None else {"phasors": _phasors(pmu, bases)}
    if pmu is not None and pmu.status is not None:
        phasors["status"] = {"column": pmu.status}
    return {
        "plant": {"type": kind, "network": network},
        "record": record_of(inspection, file, channels, extra=phasors),
    }


def _phasors(pmu: PmuContent, bases: Mapping[str, Base]) -> Section:
    kv, mva = bases.get("vt"), bases.get("p")
    voltage = {**_phasor(pmu.voltage), **_connection(pmu.voltage, kv)}
    about = "the voltage at the terminals of the unit"
    section: Section = {"voltage": Noted(voltage, above=_about(pmu.voltage, about))}
    if pmu.current is not None:
        about = _about(pmu.current, "the current out of the unit")
        section["current"] = Noted(_phasor(pmu.current), above=about)
    if pmu.voltage.unit != "pu":
        value = QUESTION if kv is None else rounded(kv.in_unit("kV", "kV"))
        section["kV"] = Noted(value, "rated, line to line")
    if pmu.current is not None and pmu.current.unit != "pu":
        value = QUESTION if mva is None else rounded(mva.in_unit("MW", "MVA"))
        section["MVA"] = Noted(value, "rated")
    return section


def _about(phasor: InspectedPhasor, what: str) -> str:
    facts = [what]
    if phasor.rivals:
        facts.append(f"or is it {', '.join(phasor.rivals)}?")
    if phasor.angle_unit is not None and phasor.angle_unit_from != "file":
        facts.append(f"angle in {phasor.angle_unit} by its {phasor.angle_unit_from}")
    if phasor.wraps:
        facts.append(f"wrapped {phasor.wraps} times: its turns are counted")
    return "; ".join(facts)


def _phasor(phasor: InspectedPhasor) -> Section:
    columns = {"magnitude": phasor.magnitudes, "angle": phasor.angles}
    return {
        **{key: names[0] if len(names) == 1 else list(names) for key, names in columns.items()},
        "unit": Noted(phasor.unit or QUESTION, f"{phasor.level:.5g} at rest"),
        "angle_unit": phasor.angle_unit or QUESTION,
    }


def _connection(voltage: InspectedPhasor, kv: Base | None) -> Section:
    """Find the connection of the voltage where its level and the rating show it."""
    if voltage.unit == "pu":
        return {}
    text, why = QUESTION, "phase-to-ground or phase-to-phase: a factor of sqrt(3)"
    scale = None if voltage.unit is None else scale_between(voltage.unit, "kV")
    if kv is not None and scale is not None:
        share = voltage.level * scale / kv.in_unit("kV", "kV")
        low, high = LIKE_RATED
        if low <= share <= high:
            text, why = "phase-to-phase", f"rests at {share:.3g} of the rated kV"
        elif low <= share * sqrt(3.0) <= high:
            text = "phase-to-ground"
            why = f"rests at {share:.3g} = {share * sqrt(3.0):.3g} / sqrt(3) of the rated kV"
    return {"connection": Noted(text, why)}


def _driving(inspection: Inspection, bases: Mapping[str, Base]) -> Section:
    """Suggest the channels that drive the unit: of phasors, or separate columns."""
    if inspection.pmu is not None:
        return _driving_phasors(inspection, inspection.pmu)
    voltage, angle, frequency = map(inspection.channel_of, ("vt", "angle", "frequency"))
    which = Noted({"column": QUESTION}, "which column is it?")
    section: Section = {"vt": which}
    if voltage is not None:
        section["vt"] = channel_entry(voltage, bases.get("vt"), drives=True)
    if angle is not None:
        unit = angle.unit or unit_by_range(inspection.samples[angle.name]) or QUESTION
        why = "deg or rad" if unit == QUESTION else "by its range" if angle.unit is None else ""
        section["angle"] = Noted({"column": angle.name, "unit": unit}, why)
    elif frequency is not None:
        section["frequency"] = {"column": frequency.name, "unit": frequency.unit or QUESTION}
    else:
        section["frequency"] = which
    return section


def _driving_phasors(inspection: Inspection, pmu: PmuContent) -> Section:
    section: Section = {signal: f"{PHASOR_COLUMNS}{signal}" for signal in ("vt", "angle")}
    if pmu.frequency is not None:
        units = (each.unit for each in inspection.channels if each.name == pmu.frequency)
        entry = {"column": pmu.frequency, "unit": next(units, None) or QUESTION}
        remark = f"frequency: {in_braces(entry)}  # drives in place of the angle"
        section[Remark(remark)] = None
    return section


def _compared(inspection: Inspection, bases: Mapping[str, Base]) -> Section:
    """Suggest the channels that are compared: separate meters first, else those of phasors."""
    section: Section = {}
    if inspection.plays_in:
        return section
    has_current = inspection.pmu is not None and inspection.pmu.current is not None
    for signal in COMPARED_IN_EVENT:
        channel = inspection.channel_of(signal)
        known = channel is not None and (
            signal not in OF_CURRENT_PHASOR
            or inspection.pmu is None
            or quantity_of(channel.unit) == SIGNALS[signal].quantity
        )
        if channel is not None and known:
            section[signal] = channel_entry(channel, bases.get(signal))
        elif signal in OF_CURRENT_PHASOR and has_current:
            section[signal] = f"{PHASOR_COLUMNS}{signal}"
        elif signal in OF_CURRENT_PHASOR:
            section[signal] = {"column": QUESTION, "unit": QUESTION, "base": QUESTION}
    return section
