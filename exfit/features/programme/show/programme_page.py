"""The report of a programme: the form, the tests of its machine, the fit of its bump tests."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from exfit.features.programme.result import FinishedTest, ProgrammeResult
from exfit.features.programme.show.at_rest_page import saturation_chart, v_curve_chart
from exfit.features.programme.show.programme_blocks import saturation, v_curve, values_table
from exfit.features.programme.steady.saturation_result import SaturationResult
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.features.report.page import Page, fit_page
from exfit.features.report.sections import FORM, ReportSection
from exfit.features.report.sections.findings import findings
from exfit.features.report.sections.form import form_without_bumps
from exfit.features.report.sections.matches import MatchView, fitted_matches
from exfit.features.report.sections.parameters import parameters
from exfit.features.report.sections.signatures import signatures
from exfit.features.report.sections.unit_and_test import unit_without_bumps
from exfit.features.report.verdict import Headline
from exfit.results.model import FitResult
from exfit.show.blocks import Block, Cell, Table, TableColumn, columns, remarks, row

Sections = Iterator[tuple[ReportSection, Any]]


def programme_page(result: ProgrammeResult, folder: Path) -> Page:
    """Build the page of a programme."""
    sections = [_section("programme", "Test programme", tuple(_overview(result)), "blocks")]
    for number, test in enumerate(result.tests, 1):
        if test.result is not result.fit:
            sections += _of_test(test, f"test-{number}")
    if result.fit is None:
        form = _section("form", FORM, form_without_bumps(result), "form")
        unit = _section("test", "Unit and test", tuple(unit_without_bumps(result)), "blocks")
        signed = _section("signatures", "Revision and signatures", signatures(result), "signatures")
        whole = [form, *sections, unit, signed]
        return Page(f"Programme {result.name}", _headline(result), whole, folder)
    page = fit_page(result.fit, folder)
    form, *others = page.sections
    return replace(page, sections=[form, *sections, *others])


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


def _of_test(test: FinishedTest, key: str) -> Sections:
    """Yield the sections of a test that is not among the bump tests."""
    result = test.result
    if isinstance(result, SaturationResult):
        blocks = (*saturation(result), saturation_chart(result, key))
        yield _section(key, f"Saturation test {test.name}", blocks, "blocks")
    elif isinstance(result, VCurve):
        charts = (
            v_curve_chart(result, reading, f"{key}-{signal}")
            for signal, reading in result.readings.items()
        )
        yield _section(key, f"Points on load {test.name}", (*v_curve(result), *charts), "blocks")
    else:
        yield from _of_machine_fit(test.name, result, key)


def _of_machine_fit(name: str, result: FitResult, key: str) -> Sections:
    """Yield the sections of a test that determines data of the machine."""
    views = tuple(_with_key(view, key) for view in fitted_matches(result))
    yield _section(key, f"Test {name}: record", views, "fit")
    for what, blocks in (("parameters", parameters(result)), ("findings", findings(result))):
        yield _section(f"{key}-{what}", f"Test {name}: {what}", tuple(blocks), "blocks")


def _section(key: str, heading: str, content: Any, template: str) -> tuple[ReportSection, Any]:
    return ReportSection(key, heading, lambda _: content, template), content


def _with_key(view: MatchView, key: str) -> MatchView:
    """Return a record whose charts have ids of their own on the page."""
    overlays = tuple(
        replace(overlay, chart=replace(overlay.chart, key=f"{key}-{overlay.chart.key}"))
        for overlay in view.overlays
    )
    return replace(view, overlays=overlays)
