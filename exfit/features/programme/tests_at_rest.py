"""Tests at rest: their points, given in the programme or in a file, and what they measure."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from types import MappingProxyType

import numpy as np

from exfit.case.schema import Unknown
from exfit.errors import CaseError, RecordError
from exfit.features.programme.governor_curve import Answer, droop_curve, gate_curve
from exfit.features.programme.programme_schema import (
    CURVE_SIGNALS,
    POINT_SIGNALS,
    GovernorTest,
    PointColumn,
    SaturationTest,
    SteadyTest,
)
from exfit.features.programme.result import GovernorCurve, SaturationResult, VCurve
from exfit.features.programme.saturation import FieldWinding, saturation_curve
from exfit.features.programme.v_curve import (
    FieldMeasurement,
    PointsOnLoad,
    base_of,
    field_on_load,
    v_curve,
)
from exfit.fitting.parameters import FreeParameter, free_parameter
from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.records.clock import check_finite
from exfit.records.formats import open_table
from exfit.records.formats.table import column_error
from exfit.records.units import alike, needs_base
from exfit.signals import FIELDS, TERMINALS
from exfit.util.arrays import Array
from exfit.util.text import listed, show

Values = Mapping[str, float]

FARTHEST_BASE = 4.0  # times the base that fits best at the start: as far as one without bounds goes


@dataclass(frozen=True, eq=False)
class Points:
    """Columns (M,) of points by signal, in the units that they were read in.

    ``units`` are those that the source itself gives.
    """

    columns: Mapping[str, Array]
    units: Mapping[str, str]
    source: Path


def points_of(test: SaturationTest | SteadyTest | GovernorTest, folder: Path) -> Points:
    """Return the points of a test, by signal; its file, of any kind of a record, is in a folder.

    Raises RecordError for a file that cannot be read, a column that is missing or in another unit,
    or a cell that is no finite number.
    """
    if test.file is None and not isinstance(test, GovernorTest):
        signals = CURVE_SIGNALS if isinstance(test, SaturationTest) else POINT_SIGNALS
        rows = np.array(test.points or ()).T
        return Points(dict(zip(signals, rows, strict=False)), {}, Path(test.name))
    names = {signal: column.column or signal for signal, column in test.columns.items()}
    table = open_table(folder / (test.file or ""), test.sheet)
    numbers, units = table.numbers(dict.fromkeys(names.values())), dict[str, str]()
    for signal, column in test.columns.items():
        in_file = table.units.get(names[signal])
        if in_file is not None:
            units[signal] = in_file
            if column.unit is not None and not alike(in_file, column.unit):
                text = f"in {in_file} as the file says, not in {column.unit}"
                raise column_error(table.path, names[signal], text)
    for name, cells in numbers.items():
        check_finite(cells, f"column {name!r}", table.place)
    columns = {signal: numbers[name] for signal, name in names.items()}
    return Points(columns, units, table.path)


def _refuse_few(test: SteadyTest | GovernorTest, points: Points) -> None:
    """Raise RecordError where the points do not differ in more places than values are fitted."""
    different = len({*zip(*(column.tolist() for column in points.columns.values()), strict=True)})
    if test.free and different <= len(test.free):
        text = f"{different} different points do not determine {listed([*test.free])}"
        raise RecordError(f"{text}: {len(test.free) + 1} or more are needed")


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
    columns = {signal: _column_of(test, points, signal) for signal in points.columns}
    numbers = {signal: points.columns[signal] * columns[signal].scale for signal in columns}
    p, q, vt = (numbers[signal] / _given_base(columns[signal]) for signal in TERMINALS)
    for row in np.flatnonzero(vt <= 0.0)[:1]:
        raise RecordError(f"point {row + 1}: vt {show(vt[row])} pu: not above 0")
    _refuse_few(test, points)
    start = {**data, **{symbol: free.start for symbol, free in test.free.items()}}
    ifd = field_on_load(machine, start, p, q, vt)
    measurements = {
        signal: _measurement(signal, columns[signal], numbers[signal], ifd)
        for signal in FIELDS
        if signal in numbers
    }
    rows = {row.symbol: row for row in machine.sheet}
    free = [free_parameter(symbol, free, rows[symbol]) for symbol, free in test.free.items()]
    limit = None if test.accept is None else test.accept.rmse
    return v_curve(machine, data, PointsOnLoad(p, q, vt, measurements), free, limit, std_errors)


def governor(test: GovernorTest, points: Points, model: Model, data: Values) -> GovernorCurve:
    """Return a test of a governor beside its model, fitted where the test asks for it.

    ``data`` has a value for each symbol of its sheet. Raises ExfitError for input that cannot be
    used.
    """
    numbers = dict(points.columns)
    for signal in numbers.keys() - {"time"}:
        column = _column_of(test, points, signal)
        numbers[signal] = numbers[signal] * column.scale / _given_base(column)
    rows = {row.symbol: row for row in model.sheet}
    free = [free_parameter(symbol, each, rows[symbol]) for symbol, each in test.free.items()]
    limit = None if test.accept is None else test.accept.rmse
    _refuse_few(test, points)
    if "speed" not in numbers:
        return gate_curve(model, data, numbers["p"], numbers["gate"], free, limit)
    answer: Answer = "gate" if "gate" in numbers else "p"
    answered = answer, numbers[answer]
    return droop_curve(model, data, numbers["time"], numbers["speed"], answered, free, limit)


def _column_of(test: SteadyTest | GovernorTest, points: Points, signal: str) -> PointColumn:
    """Complete the conversion of a signal to per unit; raises RecordError for an unknown one."""
    column = test.columns.get(signal) or PointColumn()
    unit = column.unit or points.units.get(signal) or "pu"
    if column.base is None and column.scale == 1.0 and needs_base(unit):
        raise RecordError(f"{points.source}: {signal}: base: is missing: what is 1 pu in {unit}?")
    return column.model_copy(update={"unit": unit})


def _given_base(column: PointColumn) -> float:
    return column.base if isinstance(column.base, float) else 1.0


def _measurement(signal: str, column: PointColumn, measured: Array, ifd: Array) -> FieldMeasurement:
    """Return the readings of a field signal (M,), of which the model has ``ifd`` (M,) at the start.

    A base that is found starts from its own start or, with ``auto``, from the one that fits best.
    """
    unit, base = column.unit or "pu", column.base
    if not isinstance(base, Unknown):
        return FieldMeasurement(measured, unit, _given_base(column), column.noise)
    start = float(ifd @ measured / (ifd @ ifd)) if base.start == "auto" else base.start
    if not (isfinite(start) and start > 0.0):
        raise CaseError(f"columns.{signal}.base: {start:g} {unit} fits best, which is not a base")
    low = start / FARTHEST_BASE if base.min is None else base.min
    high = start * FARTHEST_BASE if base.max is None else base.max
    free = FreeParameter(base_of(signal), min(max(start, low), high), low, high, logarithmic=True)
    return FieldMeasurement(measured, unit, free.start, column.noise, free)


def saturation(test: SaturationTest, points: Points, machine: Machine | None) -> SaturationResult:
    """Evaluate a saturation test of a machine, whose model decides which form is used.

    Raises ExfitError for input that cannot be used.
    """
    given = {signal: column.unit for signal, column in test.columns.items()}
    units = {name: unit for name, unit in (*points.units.items(), *given.items()) if unit}
    vt, vt_unit = points.columns["vt"], units.get("vt", "pu")
    base = test.columns["vt"].base if "vt" in test.columns else None
    if base is None and needs_base(vt_unit):
        text = f"columns.vt.base: is missing: what is 1 pu in {vt_unit}, the unit of the file?"
        raise RecordError(f"{points.source}: {text}")
    winding = test.winding
    return saturation_curve(
        vt if base is None else vt / base,
        points.columns["ifd"],
        test.form or (machine.saturation if machine else "quadratic"),
        unit=units.get("ifd", "A"),
        efd=points.columns.get("efd"),
        efd_unit=units.get("efd", "V"),
        winding=FieldWinding(winding.resistance, winding.temperature, winding.hot),
        exciter=test.brushless,
    )
