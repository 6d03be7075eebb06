"""The page of a report: one HTML file that needs nothing beside it."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from exfit import __version__
from exfit.features.report.behaviour import limits, small_signal, usability_table
from exfit.features.report.charts import drawing
from exfit.features.report.form import form, form_table, reproduction, signatures, unit_and_test
from exfit.features.report.matches import (
    against,
    as_found,
    differs_from_found,
    first_overlay,
    fitted_matches,
    live_data,
    overlay,
    validation_matches,
)
from exfit.features.report.model import criteria, dynamics, findings, model, parameters
from exfit.features.report.search import identifiability, search
from exfit.features.report.words import number
from exfit.output.blocks import Block, Chart, Note
from exfit.output.fits import fitted_table
from exfit.output.html import html as blocks_html
from exfit.output.html import sentence
from exfit.output.validations import in_a_line
from exfit.results.causes_in_words import causes_in_words
from exfit.results.comparisons import Comparison
from exfit.results.criteria import judged_by_criteria
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.results.validation_result import Reported
from exfit.results.verdict import GOOD, MATCHES

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).parent / "templates"
CHART_STYLE = TEMPLATES / "chart.css"
FORM = "Verification form"
CAPTIONS = {"caption": "Table", "figcaption": "Figure"}  # what each kind of caption counts
CAPTION = re.compile(r"<(caption|figcaption)>")  # those of small multiples have a class
SECTION_LINK = re.compile(r'<a href="#([\w-]+)"></a>')  # to be numbered
GENERATOR = '<meta name="generator" content="exfit '
LOWER = 0.75  # of the height of a figure: what the first page has room for
HEAD = 2000  # characters at the beginning of a page, among which it says what made it


@dataclass(frozen=True)
class Headline:
    """The outcome in brief: a word, a sentence, whether it is good, and the causes.

    ``good`` is None where it is neither good nor bad. ``criteria`` says whether the responses meet
    the limits of the report, ``passed`` as `CriteriaVerdict` has it.
    """

    word: str
    sentence: str
    good: bool | None
    causes: tuple[str, ...]
    criteria: str = ""
    passed: bool | None = None


class ReportSection(NamedTuple):
    """A section of a report: its id, its heading, what it shows."""

    key: str
    heading: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Page:
    """The content of a page: its title, its headline, its sections."""

    title: str
    headline: Headline
    sections: tuple[ReportSection, ...]


def html(result: FitResult, folder: Path, other: FitResult | None = None) -> str:
    """Return the page of a fit; ``folder`` is where the fit lies, for the commands on the page.

    With an ``other`` fit, an earlier revision or another unit, a section compares both.
    """
    return page_html(result_page(result, folder, other))


def result_page(result: Reported, folder: Path, other: FitResult | None = None) -> Page:
    """Build the page of a fit or a validation, first of all the result and its signatures.

    A fit may stand beside an ``other`` one.
    """
    sections: list[tuple[str, str, Iterable[Block]]] = [
        ("result", "Result", summary(result)),
        ("signatures", "Revision and signatures", signatures(result)),
        ("test", "Unit and test", unit_and_test(result)),
        ("criteria", "Criteria", criteria(result)),
        ("fit", "Fitted records", fitted_matches(result)),
    ]
    if isinstance(result, FitResult) or result.validation:
        sections.append(("validation", "Validation", validation_matches(result)))
    if isinstance(result, FitResult) or differs_from_found(result):
        sections.append(("as-found", "As found", as_found(result)))
    if isinstance(result, FitResult) and other is not None:
        sections.append(("against", "Comparison with another fit", against(result, other)))
    sections += [
        ("parameters", "Parameters", parameters(result)),
        ("findings", "Notes", findings(result)),
        ("model", "Model", model(result)),
        ("flat", "Usability", usability_table(result)),
        ("small", "Small-signal view", small_signal(result)),
        ("limits", "Limits that were reached", limits(result)),
    ]
    if isinstance(result, FitResult):
        sections += [
            ("search", "Search", search(result)),
            ("identifiability", "Identifiability", identifiability(result)),
            ("dyr", "PSS/E dynamics records", dynamics(result)),
        ]
    sections += [
        ("reproduction", "Reproduction", reproduction(result, folder)),
        ("form", FORM, form_table(form(result))),
    ]
    every = [ReportSection(key, heading, tuple(blocks)) for key, heading, blocks in sections]
    shown = tuple(section for section in every if section.blocks)
    return Page(f"{result.model}: {result.name}", headline(result), shown)


def summary(result: Reported) -> Iterator[Block]:
    """Yield what the first page shows: a response, the parameters, the validations in brief."""
    place = first_overlay(result)
    if place is not None:
        match = (*result.comparisons, *result.validation)[place[0]]
        chart = overlay(f"overlay-{place[0]}-{place[1]}", match, place[1])
        panels = (replace(panel, height=LOWER * panel.height) for panel in chart.panels)
        yield replace(chart, panels=tuple(panels))
    if isinstance(result, FitResult):
        title = "Fitted parameters with their 95 % intervals"
        yield replace(fitted_table(result, of_records=False), title=title, style="brief")
    yield from map(in_a_line, result.validation)
    if not result.validation:
        yield Note("The case has no record for a validation.", mark="faint")


def headline(result: Reported) -> Headline:
    """Word the outcome of a fit, or of a comparison of given values with records.

    The latter is neither good nor bad where nothing limits an error: the criteria then judge alone.
    """
    judged, causes = judged_by_criteria(result), tuple[str, ...]()
    if isinstance(result, FitResult):
        word, causes = outcome_of(result), tuple(causes_in_words(result))
        good = {GOOD: True, MATCHES: None}.get(word, False)
        explained = [*filter(None, [explanation_of(result)])]
    else:
        reasons = [match.reason for match in result.matches if match.reason]
        limits = (match.limit for match in result.validation)
        limited = result.criteria.given or all(limit is not None for limit in limits)
        word, good = ("accepted", True) if limited else ("compared", None)
        if reasons:
            word, good = "not accepted", False
        explained = [f"simulated with {result.origin}", *reasons]
    every = (*result.comparisons, *result.validation)
    errors = _rmse(match for match in every if match.overlays)
    sentence = "; ".join([*explained, *_validated(result), errors])
    return Headline(
        word=f"{word[:1].upper()}{word[1:]}",
        sentence=f"{sentence[:1].upper()}{sentence[1:]}.",
        good=good,
        causes=causes,
        criteria=judged.sentence,
        passed=judged.passed,
    )


def _rmse(matches: Iterable[Comparison]) -> str:
    """List the rms of the errors that records are judged by: of an event those of P and Q."""
    errors = []
    for match in matches:
        for signal in match.judging:
            of = f"{match.name}, {signal}" if len(match.judging) > 1 else match.name
            errors.append(f"{match.channels[signal].rmse:.2e} pu ({of})")
    return f"rmse {', '.join(errors)}"


def _validated(result: Reported) -> Iterator[str]:
    """Yield the limits that accepted validations keep."""
    if not result.validation:
        yield "the case has no record for a validation"
    elif result.accepted and not result.criteria.given:
        limits = [
            f"{match.limit:.2e} pu ({match.name})"
            for match in result.validation
            if match.limit is not None
        ]
        if len(limits) < len(result.validation):
            yield "nothing limits the error of its validations"
        else:
            yield f"every validation is within its limit of {', '.join(limits)}"


def page_html(page: Page, interactive: bool = True) -> str:
    """Return a page as HTML; without scripts, for a print, where it is not ``interactive``.

    Its figures, tables and sections are numbered in the order in which they stand.
    """
    live = [
        (section.key, chart)
        for section in page.sections
        for chart in section.blocks
        if isinstance(chart, Chart) and chart.live
    ]
    shared = environment()
    chart: Any = shared.get_template("chart.jinja").module
    text: str = shared.get_template("report.html.jinja").render(
        title=page.title,
        headline=page.headline,
        sections=[(each, blocks_html(each.blocks, chart.chart)) for each in page.sections],
        data=list(live_data([chart for _, chart in live])),
        hinted=live[0][0] if live else "",  # the section that says how figures are read
        css=CHART_STYLE.read_text(encoding="utf-8") + _text("report.css"),
        script=_text("report.js") if interactive else "",
    )
    counts, numbers = Counter[str](), {each.key: k for k, each in enumerate(page.sections, 1)}

    def with_number(caption: re.Match[str]) -> str:
        kind = CAPTIONS[caption[1]]
        counts[kind] += 1
        return f'{caption[0]}<span class="number">{kind} {counts[kind]}.</span> '

    def link(section: re.Match[str]) -> str:
        key = section[1]
        return f'<a href="#{key}">{numbers[key]}</a>' if key in numbers else ""

    return SECTION_LINK.sub(link, CAPTION.sub(with_number, text))


def _text(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def is_page(path: Path) -> bool:
    """Tell by its head a page that this module made from other files."""
    with path.open(encoding="utf-8", errors="replace") as file:
        return GENERATOR in file.read(HEAD)


@cache
def environment() -> "Environment":
    """Make the environment of the templates of pages: every text is escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    shared = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    shared.filters |= {"drawing": drawing, "number": number, "sentence": sentence}
    shared.tests |= {"finite": lambda value: value is not None and isfinite(value)}
    shared.globals |= {"version": __version__}
    return shared
