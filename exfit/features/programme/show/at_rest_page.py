"""Charts of tests at rest: the saturation curve and the V-curves, beside their points."""

import numpy as np

from exfit.features.programme.steady.saturation_result import (
    SaturationResult,
)
from exfit.features.programme.steady.v_curve_result import FieldReading, VCurve
from exfit.features.report.charts import COLOURS, TALL
from exfit.show.blocks import Chart, Panel, Series

HIGHEST_LINE = 1.05  # pu: as far as the air-gap line is drawn
MILLI = 1e3


def saturation_chart(result: SaturationResult, key: str) -> Chart:
    """Draw the voltage over the field current: points, curve, air-gap line.

    ``key`` begins the ids of the chart.
    """
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


def v_curve_chart(result: VCurve, reading: FieldReading, key: str) -> Chart:
    """Draw a field signal over reactive power at each level of power, and its residuals."""
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
