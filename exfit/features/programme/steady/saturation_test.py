"""A saturation test of a programme: its points read, its curve, and what it gives the machine."""

from collections.abc import Mapping
from types import MappingProxyType

from exfit.errors import RecordError
from exfit.features.programme.case.schema_at_rest import CURVE_SIGNALS, SaturationTest
from exfit.features.programme.steady.saturation import FieldWinding, saturation_curve
from exfit.features.programme.steady.saturation_result import MeasuredValue, SaturationResult
from exfit.models.machines import Machine
from exfit.records.points import Points
from exfit.records.units import needs_base
from exfit.signals import FIELDS

DEFAULT_UNITS = MappingProxyType({"vt": "pu", **dict(zip(FIELDS, ("A", "V"), strict=True))})


def saturation(test: SaturationTest, points: Points, machine: Machine | None) -> SaturationResult:
    """Return what a saturation test shows of a machine, whose model decides which form is used.

    Raises ExfitError for input that cannot be used.
    """
    units = {signal: _unit(test, points, signal) for signal in CURVE_SIGNALS}
    vt = points.columns["vt"]
    section = test.columns.get("vt")
    base = None if section is None else section.base
    if base is None and needs_base(units["vt"]):
        text = f"columns.vt.base: is missing: what is 1 pu in {units['vt']}, the unit of the file?"
        raise RecordError(f"{points.source}: {text}")
    winding = test.winding
    return saturation_curve(
        vt if base is None else vt / base,
        points.columns["ifd"],
        test.form or (machine.saturation if machine else "quadratic"),
        unit=units["ifd"],
        efd=points.columns.get("efd"),
        efd_unit=units["efd"],
        winding=FieldWinding(winding.resistance, winding.temperature, winding.hot),
        exciter=test.brushless,
    )


def machine_values(result: SaturationResult) -> Mapping[str, MeasuredValue]:
    """Return what the test gives the machine's section: S10 and S12, nothing of a brushless unit.

    They enter it with ``sources: measured``.
    """
    if result.exciter:
        return {}
    return {"S10": result.curve.S10, "S12": result.curve.S12}


def channel_bases(result: SaturationResult) -> Mapping[str, tuple[MeasuredValue, str]]:
    """Return what 1 pu is of ifd and, where it is known, of efd, each with its unit.

    It is the base of channels of later records that are in that unit and give none.
    """
    if result.exciter:
        return {}
    bases = {"ifd": (result.curve.ifd_base, result.unit)}
    if result.efd_base is not None:
        bases["efd"] = (result.efd_base, result.efd_unit)
    return bases


def _unit(test: SaturationTest, points: Points, signal: str) -> str:
    section = test.columns.get(signal)
    given = None if section is None else section.unit
    return given or points.units.get(signal) or DEFAULT_UNITS[signal]
