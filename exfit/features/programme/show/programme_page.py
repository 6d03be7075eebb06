"""The report of a programme: the form, the tests of its machine, the fit of its bump tests."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from exfit.features.programme.result import FinishedTest, ProgrammeResult
from exfit.features.programme.show.at_rest_page import saturation_chart, v_curve_chart
from exfit.features.programme.show.programme_blocks import saturation, v_curve, values_table
from exfit.features.programme.steady.saturation_result import SaturationResult
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.features.report.form import (
    form_table,
    form_without_bumps,
    signatures,
    unit_without_bumps,
)
from exfit.features.report.matches import fitted_matches
from exfit.features.report.model import findings, parameters
from exfit.features.report.page import FORM, Headline, Page, ReportSection, fit_page
from exfit.show.blocks import Block, Cell, Table, TableColumn, columns, remarks, row


def programme_page(result: ProgrammeResult, folder: Path) -> Page:
    """Build the page of a programme."""
    sections = [ReportSection("programme", "Test programme", tuple(_overview(result)))]
    for number, test in enumerate(result.tests, 1):
        if test.result is not result.fit:
            sections += _of_test(test, f"test-{number}")
    if result.fit is None:
        form = ReportSection("form", FORM, tuple(form_table(form_without_bumps(result))))
        unit = ReportSection("test", "Unit and test", tuple(unit_without_bumps(result)))
        signed = ReportSection("signatures", "Revision and signatures", tuple(signatures(result)))
        whole = (form, *sections, unit, signed)
        return Page(f"Programme {result.name}", _headline(result), whole)
    page = fit_page(result.fit, folder)
    form, *others = page.sections
    return replace(page, sections=(form, *sections, *others))


def _headline(result: ProgrammeResult) -> Headline:
    """Word the outcome of a programme without bump tests."""
    words = "; ".join(f"{test.name}: {test.verdict}" for test in result.tests)
    word = "All tests are matched" if result.holds else "Not all tests are matched"
    return Headline(f"{word}.", f"{words}.", result.holds, ())


def _overview(result: ProgrammeResult) -> Iterator[Block]:
    """Yield the outcome of each test, and the values that tests gave to those after them."""
    rows: list[tuple[Cell, ...]] = [
        row(
            "\n".join([test.name, *([", ".join(test.tests)] if len(test.tests) > 1 else [])]),
            test.kind,
            test.verdict,
            test.reason,
            mark="" if test.holds else "doubt",
        )
        for test in result.tests
    ]
    rows += [row(name, "", "failed", why, mark="doubt") for name, why in result.failed.items()]
    heads = (*columns("test", "kind", "verdict"), TableColumn("why", folds=True))
    yield Table(heads, tuple(rows), "Tests in the order in which one feeds the next")
    if result.values:
        yield values_table(result.values)
    yield from remarks("", result.warnings, "", "warning")


def _of_test(test: FinishedTest, key: str) -> Iterator[ReportSection]:
    """Yield the sections of a test that is not among the bump tests."""
    result, name = test.result, test.name
    if isinstance(result, SaturationResult):
        blocks = (*saturation(result), saturation_chart(result, key))
        yield ReportSection(key, f"Saturation test {name}", blocks)
    elif isinstance(result, VCurve):
        charts = (
            v_curve_chart(result, reading, f"{key}-{signal}")
            for signal, reading in result.readings.items()
        )
        yield ReportSection(key, f"Points on load {name}", (*v_curve(result), *charts))
    else:  # of data of the machine
        yield ReportSection(key, f"Test {name}: record", tuple(fitted_matches(result, f"{key}-")))
        for what, of_fit in (("parameters", parameters(result)), ("findings", findings(result))):
            yield ReportSection(f"{key}-{what}", f"Test {name}: {what}", tuple(of_fit))
