"""Tests at rest: their points, given in the programme or in a file, and what they measure."""

from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from exfit.case.schema import Unknown
from exfit.errors import CaseError, RecordError
from exfit.features.programme.case.schema_at_rest import (
    CURVE_SIGNALS,
    POINT_SIGNALS,
    PointColumn,
    SaturationTest,
    SteadyTest,
)
from exfit.features.programme.steady.fields_on_load import (
    FieldMeasurement,
    PointsOnLoad,
    base_of,
    field_on_load,
)
from exfit.features.programme.steady.points import Points, given_points, read_points
from exfit.features.programme.steady.saturation import FieldWinding, saturation_curve
from exfit.features.programme.steady.saturation_result import MeasuredValue, SaturationResult
from exfit.features.programme.steady.v_curve import v_curve
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.fitting.parameters import FreeParameter, free_parameter
from exfit.models.machines import Machine
from exfit.records.units import needs_base
from exfit.signals import FIELDS, TERMINALS

Array = NDArray[np.float64]
Values = Mapping[str, float]

FARTHEST_BASE = 4.0  # times the base that fits best at the start: as far as one without bounds goes


def steady(
    test: SteadyTest,
    points: Points,
    machine: Machine,
    data: Values,
    std_errors: Values = MappingProxyType({}),
) -> VCurve:
    """Return the points of a test beside the machine's model, fitted where the test asks for it.

    ``data`` has a value for each symbol of the machine's sheet, ``std_errors`` the standard errors
    of some of them and of bases, for which the intervals allow. Raises ExfitError for input that
    cannot be used.
    """
    columns = {signal: column_of(test, points, signal) for signal in points.columns}
    numbers = {signal: points.columns[signal] * columns[signal].scale for signal in columns}
    p, q, vt = (numbers[signal] / given_base(columns[signal]) for signal in TERMINALS)
    start = {**data, **{symbol: free.start for symbol, free in test.free.items()}}
    ifd = field_on_load(machine, start, p, q, vt)
    measurements = {
        signal: measurement_of(signal, columns[signal], numbers[signal], ifd)
        for signal in FIELDS
        if signal in numbers
    }
    rows = {row.symbol: row for row in machine.sheet}
    free = [free_parameter(symbol, free, rows[symbol]) for symbol, free in test.free.items()]
    limit = None if test.accept is None else test.accept.rmse
    return v_curve(machine, data, PointsOnLoad(p, q, vt, measurements), free, limit, std_errors)


def given_base(column: PointColumn) -> float:
    """Read the base of a column, 1 where it is not given as a number."""
    return column.base if isinstance(column.base, float) else 1.0


def column_of(test: SteadyTest, points: Points, signal: str) -> PointColumn:
    """Complete the conversion of a signal to per unit; raises RecordError for an unknown one."""
    column = test.columns.get(signal) or PointColumn()
    unit = column.unit or points.units.get(signal) or "pu"
    if column.base is None and column.scale == 1.0 and needs_base(unit):
        raise RecordError(f"{points.source}: {signal}: base: is missing: what is 1 pu in {unit}?")
    return column.model_copy(update={"unit": unit})


def measurement_of(
    signal: str, column: PointColumn, measured: Array, ifd: Array
) -> FieldMeasurement:
    """Return the readings of a field signal (M,), of which the model has ``ifd`` (M,) at the start.

    A base that is found starts from its own start or, with ``auto``, from the one that fits best.
    """
    unit, base = column.unit or "pu", column.base
    if not isinstance(base, Unknown):
        return FieldMeasurement(measured, unit, given_base(column), column.noise)
    start = float(ifd @ measured / (ifd @ ifd)) if base.start == "auto" else base.start
    if not (isfinite(start) and start > 0.0):
        raise CaseError([f"columns.{signal}.base: {start:g} {unit} fits best, which is no base"])
    low = start / FARTHEST_BASE if base.min is None else base.min
    high = start * FARTHEST_BASE if base.max is None else base.max
    free = FreeParameter(base_of(signal), min(max(start, low), high), low, high, logarithmic=True)
    return FieldMeasurement(measured, unit, free.start, column.noise, free)


DEFAULT_UNITS = MappingProxyType({"vt": "pu", **dict(zip(FIELDS, ("A", "V"), strict=True))})


def saturation(test: SaturationTest, points: Points, machine: Machine | None) -> SaturationResult:
    """Evaluate a saturation test of a machine, whose model decides which form is used.

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
    """Select S10 and S12 for the machine's section; nothing of a brushless unit.

    They enter it with ``sources: measured``.
    """
    if result.exciter:
        return {}
    return {"S10": result.curve.S10, "S12": result.curve.S12}


def channel_bases(result: SaturationResult) -> Mapping[str, tuple[MeasuredValue, str]]:
    """Collect the bases of ifd and, where it is known, of efd, each with its unit.

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


def points_of(test: SaturationTest | SteadyTest, folder: Path) -> Points:
    """Return the points of a test, by signal; its file lies in a folder. Raises RecordError."""
    if test.file is None:
        signals = CURVE_SIGNALS if isinstance(test, SaturationTest) else POINT_SIGNALS
        return given_points(test.points or (), signals, Path(test.name))
    names = {signal: column.column or signal for signal, column in test.columns.items()}
    units = {names[signal]: column.unit for signal, column in test.columns.items()}
    read = read_points(folder / test.file, units, test.sheet)
    return Points(
        {signal: read.columns[name] for signal, name in names.items()},
        {signal: read.units[name] for signal, name in names.items() if name in read.units},
        read.source,
        read.sha256,
    )
