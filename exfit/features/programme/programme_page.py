"""The report of a programme: the form, the tests of its machine, the fit of its bump tests."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from exfit.features.programme.programme_blocks import governor, saturation, v_curve, values_table
from exfit.features.programme.result import (
    FieldReading,
    FinishedTest,
    GovernorCurve,
    ProgrammeResult,
    SaturationResult,
    VCurve,
)
from exfit.features.report.charts import COLOURS, TALL
from exfit.features.report.form import (
    form_table,
    form_without_bumps,
    signatures,
    unit_without_bumps,
)
from exfit.features.report.matches import fitted_matches
from exfit.features.report.model import findings, parameters
from exfit.features.report.page import FORM, Headline, Page, ReportSection, result_page
from exfit.output.blocks import (
    Block,
    Cell,
    Chart,
    Mark,
    Panel,
    Series,
    Table,
    TableColumn,
    columns,
    remarks,
    row,
)

HIGHEST_LINE = 1.05  # pu: as far as the air-gap line is drawn
MILLI = 1e3


def programme_page(result: ProgrammeResult, folder: Path) -> Page:
    """Build the page of a programme."""
    tests = [ReportSection("programme", "Test programme", tuple(_overview(result)))]
    for number, test in enumerate(result.tests, 1):
        if test.result is not result.fit:
            tests += _of_test(test, f"test-{number}")
    if result.fit is not None:
        page = result_page(result.fit, folder)
        first, signed, *others = page.sections
        return replace(page, sections=(first, signed, *tests, *others))
    sections = (
        tests[0],
        ReportSection("signatures", "Revision and signatures", tuple(signatures(result))),
        *tests[1:],
        ReportSection("test", "Unit and test", tuple(unit_without_bumps(result))),
        ReportSection("form", FORM, tuple(form_table(form_without_bumps(result)))),
    )
    words = "; ".join(f"{test.name}: {test.verdict}" for test in result.tests)
    word = "All tests are matched" if result.holds else "Not all tests are matched"
    headline = Headline(f"{word}.", f"{words}.", result.holds, ())
    return Page(f"Programme {result.name}", headline, sections)


def _overview(result: ProgrammeResult) -> Iterator[Block]:
    rows: list[tuple[Cell, ...]] = []
    for test in result.tests:
        tests = f"\n{', '.join(test.tests)}" if len(test.tests) > 1 else ""
        mark: Mark = "" if test.holds else "doubt"
        rows.append(row(test.name + tests, test.kind, test.verdict, test.reason, mark=mark))
    rows += [row(name, "", "failed", why, mark="doubt") for name, why in result.failed.items()]
    heads = (*columns("test", "kind", "verdict"), TableColumn("why", folds=True))
    yield Table(heads, tuple(rows), "Tests in their order")
    if result.values:
        yield values_table(result.values)
    yield from remarks("", result.warnings, "", "warning")


def _of_test(test: FinishedTest, key: str) -> Iterator[ReportSection]:
    result, name = test.result, test.name
    if isinstance(result, SaturationResult):
        blocks = (*saturation(result), _saturation_chart(result, key))
        yield ReportSection(key, f"Saturation test {name}", blocks)
    elif isinstance(result, VCurve):
        charts = (_v_curve_chart(result, reading, key) for reading in result.readings.values())
        yield ReportSection(key, f"Points on load {name}", (*v_curve(result), *charts))
    elif isinstance(result, GovernorCurve):
        blocks = (*governor(result), _governor_chart(result, key))
        yield ReportSection(key, f"Test of the governor {name}", blocks)
    else:  # of data of the machine
        yield ReportSection(key, f"Test {name}: record", tuple(fitted_matches(result, f"{key}-")))
        for what, of_fit in (("parameters", parameters(result)), ("findings", findings(result))):
            yield ReportSection(f"{key}-{what}", f"Test {name}: {what}", tuple(of_fit))


def _governor_chart(result: GovernorCurve, key: str) -> Chart:
    """Draw gate or power over power or speed: the readings, and the governor's model."""
    reading, order = result.reading, np.argsort(result.x, kind="stable")
    x, signal = result.x[order], reading.signal
    readings = Series("measured", x, reading.measured[order], "p0", dots=True)
    model = Series("simulated", x, reading.simulated[order], "simulated", dots=result.over != "p")
    return Chart(
        f"{key}-{signal}",
        f"{result.governor}: {signal} over {result.over}",
        f"{signal} over {result.over}, by the readings and the governor's model; simulated minus "
        f"measured {reading.rms:.2e} pu rms.",
        f"{result.over} (pu)",
        (Panel(f"{signal} (pu)", (readings, model), TALL),),
    )


def _saturation_chart(result: SaturationResult, key: str) -> Chart:
    """Draw the voltage over the field current: points, curve, air-gap line."""
    curve = result.curve
    base, offset = curve.ifd_base.value, curve.offset.value
    line = np.array([0.0, HIGHEST_LINE])
    points = tuple(
        Series(f"points, {name} voltage", result.ifd[own], result.vt[own], style, dots=True)
        for name, sign, style in (("rising", 1, "p0"), ("falling", -1, "p3"))
        if (own := result.direction == sign).any()
    )
    lines = (
        Series("curve", base * (curve.ifd + offset), curve.vt, "simulated"),
        Series("air-gap line", base * (line + offset), line, "p4 dash1"),
    )
    return Chart(
        f"{key}-curve",
        "Open-circuit saturation curve",
        f"Terminal voltage over field current: the points, the curve in the form {result.form}, "
        f"and the air-gap line, which takes {base:.4g} {result.unit} at 1 pu.",
        f"field current ({result.unit})",
        (Panel("vt (pu)", (*lines, *points), TALL),),
    )


def _v_curve_chart(result: VCurve, reading: FieldReading, key: str) -> Chart:
    """Draw a field signal over reactive power at each level of power, and its residuals."""
    curves, dots, residuals = [], [], []
    for k, level in enumerate(result.levels):
        own, style = np.array(level.points, dtype=np.int64), f"p{k % COLOURS}"
        q, errors = result.q[own], MILLI * reading.residuals[own]
        curves.append(Series(f"p = {level.p:.2f} pu", level.q, level.ifd, style))
        dots.append(Series("", q, reading.measured[own], style, dots=True))
        residuals.append(Series("", q, errors, style, dots=True))
    return Chart(
        f"{key}-{reading.signal}",
        f"V-curves: {reading.signal}",
        f"{reading.signal} over reactive power: the points, and the machine's model as lines; "
        f"below, simulated minus measured, {reading.rms:.2e} pu rms.",
        "q (pu)",
        (
            Panel(f"{reading.signal} (pu)", (*curves, *dots), TALL),
            Panel("simulated - measured (1e-3 pu)", tuple(residuals), TALL / 2.0),
        ),
    )
