"""A steady test of a programme: its points read, and compared with the machine of the unit."""

from collections.abc import Mapping
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit.analysis.steady.field_on_load import field_on_load
from exfit.analysis.steady.v_curve import (
    FIELD_SIGNALS,
    FieldMeasurement,
    PointsOnLoad,
    base_of,
    v_curve,
)
from exfit.case.bounds import search_bounds
from exfit.case.schema import FreeSection, PointColumn, SteadyTest, Unknown
from exfit.errors import CaseError
from exfit.fitting.parameters import FreeParameter, Prior
from exfit.models.machines import Machine
from exfit.models.sheet import Parameter
from exfit.records.points import Points, read_points, table_points
from exfit.results.v_curve import VCurve

Array = NDArray[np.float64]
Values = Mapping[str, float]

FARTHEST_BASE = 4.0  # times the base that fits best at the start: as far as one without bounds goes


def points_of(test: SteadyTest, folder: Path) -> Points:
    """Return the points of a test, whose file lies in a folder; raises RecordError."""
    units = {column.column: column.unit for column in test.columns.values()}
    if test.file is not None:
        return read_points(folder / test.file, units, test.sheet)
    return table_points(test.table or (), units, Path(test.name))


def steady(test: SteadyTest, points: Points, machine: Machine, data: Values) -> VCurve:
    """Return the points of a test beside the machine's model, fitted where the test asks for it.

    ``data`` has a value for each symbol of the machine's sheet. Raises ExfitError for input that
    cannot be used.
    """
    signals = {
        signal: points.columns[column.column] * column.scale
        for signal, column in test.columns.items()
    }
    p, q, vt = (signals[signal] / _given_base(test.columns[signal]) for signal in ("p", "q", "vt"))
    start = {**data, **{symbol: free.start for symbol, free in test.free.items()}}
    ifd = field_on_load(machine, start, p, q, vt)
    readings = {
        signal: reading_of(signal, test.columns[signal], signals[signal], ifd)
        for signal in FIELD_SIGNALS
        if signal in signals
    }
    rows = {row.symbol: row for row in machine.sheet}
    free = [free_parameter(symbol, free, rows[symbol]) for symbol, free in test.free.items()]
    limit = None if test.accept is None else test.accept.rmse
    return v_curve(machine, data, PointsOnLoad(p, q, vt, readings), free, limit)


def _given_base(column: PointColumn) -> float:
    return column.base if isinstance(column.base, float) else 1.0


def reading_of(signal: str, column: PointColumn, measured: Array, ifd: Array) -> FieldMeasurement:
    """Return readings of a field signal (M,), of which the model has ``ifd`` (M,) at the start.

    A base that is found starts from its own start or, with ``auto``, from the one that fits best.
    """
    unit, base = column.unit or "pu", column.base
    if not isinstance(base, Unknown):
        return FieldMeasurement(measured, unit, base or 1.0, column.noise)
    start = float(ifd @ measured / (ifd @ ifd)) if base.start == "auto" else base.start
    if not (isfinite(start) and start > 0.0):
        raise CaseError([f"columns.{signal}.base: {start:g} {unit} fits best, which is no base"])
    low = start / FARTHEST_BASE if base.min is None else base.min
    high = start * FARTHEST_BASE if base.max is None else base.max
    free = FreeParameter(base_of(signal), min(max(start, low), high), low, high, logarithmic=True)
    return FieldMeasurement(measured, unit, free.start, column.noise, free)


def free_parameter(symbol: str, section: FreeSection, row: Parameter) -> FreeParameter:
    """Return a parameter of a machine as a fit moves it."""
    prior = None if section.prior is None else Prior(section.prior.mean, section.prior.sigma)
    bounds = search_bounds(section.min, section.max, row)
    return FreeParameter(symbol, section.start, *bounds, section.scale == "log", prior)
