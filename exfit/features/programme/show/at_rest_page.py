"""Tests at rest: the saturation curve and the V-curves, beside their points."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from exfit.features.programme.steady.saturation_result import (
    FittedCurve,
    MeasuredValue,
    SaturationResult,
)
from exfit.features.programme.steady.v_curve_result import FieldReading, VCurve
from exfit.features.report.layout import COLOURS, TALL
from exfit.results.model import FittedParameter
from exfit.show.blocks import Chart, Panel, Series

HIGHEST_LINE = 1.05  # pu: as far as the air-gap line is drawn
MILLI = 1e3


@dataclass(frozen=True)
class MeasuredRow:
    """A value that a saturation test gives, under its name and in its unit."""

    name: str
    value: MeasuredValue
    unit: str
    meaning: str


@dataclass(frozen=True)
class SaturationView:
    """A saturation test: the numbers of its curve in the form that is used, and the curve."""

    form: str
    rows: tuple[MeasuredRow, ...]
    others: tuple[FittedCurve, ...]
    notes: tuple[str, ...]
    chart: Chart


@dataclass(frozen=True)
class VCurveView:
    """V-curves: the points beside the machine's model, and what was fitted."""

    machine: str
    verdict: str
    readings: Mapping[str, FieldReading]
    fitted: Mapping[str, FittedParameter]
    remarks: tuple[str, ...]
    charts: tuple[Chart, ...]


def saturation_view(result: SaturationResult, key: str) -> SaturationView:
    """View a saturation test; ``key`` begins the ids of its chart."""
    return SaturationView(
        form=result.form,
        rows=tuple(_rows(result)),
        others=tuple(curve for curve in result.curves if curve.form != result.form),
        notes=result.notes,
        chart=_saturation_chart(result, key),
    )


def v_curve_view(result: VCurve, key: str) -> VCurveView:
    """View points on load; ``key`` begins the ids of its charts."""
    return VCurveView(
        machine=result.machine,
        verdict=f"{result.verdict.verdict}: {result.verdict.reason}",
        readings=result.readings,
        fitted=result.parameters,
        remarks=(*result.undetermined, *result.notes),
        charts=tuple(
            _v_curve_chart(result, reading, f"{key}-{signal}")
            for signal, reading in result.readings.items()
        ),
    )


def _rows(result: SaturationResult) -> Iterator[MeasuredRow]:
    curve, unit = result.curve, result.unit
    current = "exciter field current" if result.exciter else "field current"
    yield MeasuredRow("ifd.base", curve.ifd_base, unit, f"{current} of 1 pu on the air-gap line")
    yield MeasuredRow("S10", curve.S10, "", "saturation at 1.0 pu")
    yield MeasuredRow("S12", curve.S12, "", "saturation at 1.2 pu")
    yield MeasuredRow("offset", curve.offset, "pu", "field current beside a line through zero")
    if curve.hysteresis is not None:
        yield MeasuredRow("hysteresis", curve.hysteresis, "pu", "rising less falling branch")
    if result.efd_base is not None:
        meaning = "field voltage of 1 pu on the air-gap line"
        yield MeasuredRow("efd.base", result.efd_base, result.efd_unit, meaning)
    if result.resistance is not None:
        unit = f"{result.efd_unit}/{result.unit}"
        yield MeasuredRow("resistance", result.resistance, unit, "of the hot field winding")


def _saturation_chart(result: SaturationResult, key: str) -> Chart:
    """Return the voltage over the field current: points, curve, air-gap line."""
    curve = result.curve
    base, offset = curve.ifd_base.value, curve.offset.value
    line = np.array([0.0, HIGHEST_LINE])
    branches = (("rising", 1, "p0"), ("falling", -1, "p3"))
    points = tuple(
        Series(f"points, {name} voltage", result.ifd[own], result.vt[own], style, dots=True)
        for name, sign, style in branches
        if (own := result.direction == sign).any()
    )
    return Chart(
        f"{key}-curve",
        "Open-circuit saturation curve",
        f"Terminal voltage over field current: the points, the curve in the form {result.form}, "
        f"and the air-gap line, which takes {base:.4g} {result.unit} at 1 pu.",
        f"field current ({result.unit})",
        (
            Panel(
                "vt (pu)",
                (
                    Series("curve", base * (curve.ifd + offset), curve.vt, "simulated"),
                    Series("air-gap line", base * (line + offset), line, "p4 dash1"),
                    *points,
                ),
                TALL,
            ),
        ),
    )


def _v_curve_chart(result: VCurve, reading: FieldReading, key: str) -> Chart:
    """Return a field signal over reactive power at each level of power, and its residuals."""
    curves, dots, residuals = [], [], []
    for k, level in enumerate(result.levels):
        own = np.array(level.points, dtype=np.int64)
        style = f"p{k % COLOURS}"
        name = f"p = {level.p:.2f} pu"
        curves.append(Series(name, level.q, level.ifd, style))
        dots.append(Series("", result.q[own], reading.measured[own], style, dots=True))
        errors = MILLI * reading.residuals[own]
        residuals.append(Series("", result.q[own], errors, style, dots=True))
    return Chart(
        key,
        f"V-curves: {reading.signal}",
        f"{reading.signal} over reactive power: the points, and the machine's model as lines; "
        f"below, simulated less measured, {reading.rms:.2e} pu rms.",
        "q (pu)",
        (
            Panel(f"{reading.signal} (pu)", (*curves, *dots), TALL),
            Panel("simulated - measured (1e-3 pu)", tuple(residuals), TALL / 2.0),
        ),
    )
