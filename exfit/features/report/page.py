"""The page of a report: one HTML file that needs nothing beside it."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
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
    fitted_matches,
    live_data,
    validation_matches,
)
from exfit.features.report.model import criteria, dynamics, findings, model, parameters
from exfit.features.report.search import identifiability, search
from exfit.features.report.words import number
from exfit.output.blocks import Block, Chart
from exfit.output.html import html as blocks_html
from exfit.output.html import sentence
from exfit.results.comparisons import Comparison
from exfit.results.criteria import judged_by_criteria
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.results.validation_result import Reported, ValidationResult
from exfit.results.verdict import GOOD, MATCHES

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).parent / "templates"
CHART_STYLE = TEMPLATES / "chart.css"
FORM = "The form of a verification report"
CAPTIONS = {"caption": "Table", "figcaption": "Figure"}  # what each kind of caption counts
CAPTION = re.compile(r"<(caption|figcaption)>")  # those of small multiples have a class
SECTION_LINK = re.compile(r'<a href="#([\w-]+)"></a>')  # to be numbered
GENERATOR = '<meta name="generator" content="exfit '
HEAD = 2000  # characters at the beginning of a page, among which it says what made it


@dataclass(frozen=True)
class Headline:
    """What the fit comes to: a word, a sentence, whether it is good, and the causes.

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
    """What a page shows: its title, what it comes to, its sections."""

    title: str
    headline: Headline
    sections: tuple[ReportSection, ...]


def html(result: FitResult, folder: Path, other: FitResult | None = None) -> str:
    """Return the page of a fit; ``folder`` is where the fit lies, for the commands on the page.

    With an ``other`` fit, an earlier revision or another unit, a section compares both.
    """
    return page_html(fit_page(result, folder, other))


def fit_page(result: FitResult, folder: Path, other: FitResult | None = None) -> Page:
    """Build the page of a fit, beside an ``other`` fit where there is one."""
    unseen = "Validation on records that were not fitted"
    beside = [] if other is None else [("against", "Beside another fit", against(result, other))]
    sections: list[tuple[str, str, Iterable[Block]]] = [
        *_first_sections(result),
        ("as-found", "As found and verified", as_found(result)),
        ("findings", "Notes and unresolved findings", findings(result)),
        ("fit", "Fitted records", fitted_matches(result)),
        ("validation", unseen, validation_matches(result)),
        ("flat", "Usability", usability_table(result)),
        ("search", "Search", search(result)),
        ("identifiability", "Identifiability", identifiability(result)),
        ("small", "Small-signal view", small_signal(result)),
        ("limits", "Limits that were hit", limits(result)),
        ("dyr", "PSS/E dynamics records", dynamics(result)),
        ("reproduction", "Reproduction", reproduction(result, folder)),
        *beside,
        ("signatures", "Revision and signatures", signatures(result)),
    ]
    return _page(result, headline(result), sections)


def validation_page(result: ValidationResult, folder: Path) -> Page:
    """Build the page of a validation: nothing of a search."""
    found = as_found(result) if differs_from_found(result) else ()
    unseen = validation_matches(result) if result.validation else ()
    sections: list[tuple[str, str, Iterable[Block]]] = [
        *_first_sections(result),
        ("as-found", "As found and compared", found),
        ("findings", "Notes", findings(result)),
        ("fit", "Records that the values were fitted to", fitted_matches(result)),
        ("validation", "Recorded and simulated", unseen),
        ("flat", "Usability", usability_table(result)),
        ("small", "Small-signal view", small_signal(result)),
        ("limits", "Limits that were hit", limits(result)),
        ("reproduction", "Reproduction", reproduction(result, folder)),
        ("signatures", "Revision and signatures", signatures(result)),
    ]
    return _page(result, headline_of_validation(result), sections)


def _first_sections(result: Reported) -> Iterator[tuple[str, str, Iterable[Block]]]:
    yield "form", FORM, form_table(form(result))
    yield "criteria", "Criteria", criteria(result)
    yield "test", "Unit and test", unit_and_test(result)
    yield "model", "Model", model(result)
    yield "parameters", "Parameters", parameters(result)


def _page(
    result: Reported, headline: Headline, sections: Iterable[tuple[str, str, Iterable[Block]]]
) -> Page:
    """Make a page of the sections that have something to show."""
    every = [ReportSection(key, heading, tuple(blocks)) for key, heading, blocks in sections]
    shown = tuple(section for section in every if section.blocks)
    return Page(f"{result.model}: {result.name}", headline, shown)


def headline(result: FitResult) -> Headline:
    """Word the outcome of a fit."""
    outcome, judged = outcome_of(result), judged_by_criteria(result)
    sentence = "; ".join([*filter(None, [explanation_of(result)]), *_validated(result)])
    rmse = _rmse((*result.comparisons, *result.validation))
    return Headline(
        word=f"{outcome[:1].upper()}{outcome[1:]}",
        sentence=f"{sentence[:1].upper()}{sentence[1:]}; {rmse}.",
        good={GOOD: True, MATCHES: None}.get(outcome, False),
        causes=tuple(cause.sentence for cause in result.verdict.causes),
        criteria=judged.sentence,
        passed=judged.passed,
    )


def headline_of_validation(result: ValidationResult) -> Headline:
    """Word the outcome of a comparison of given values with records.

    It is neither good nor bad where nothing limits an error: the criteria then judge alone.
    """
    judged = judged_by_criteria(result)
    reasons = [match.reason for match in result.validation if match.reason]
    limited = all(match.limit is not None for match in result.validation)
    word, good = ("Accepted", True) if limited else ("Compared", None)
    if reasons:
        word, good = "Not accepted", False
    sentence = "; ".join([f"Simulated with {result.origin}", *reasons, *_validated(result)])
    sentence = f"{sentence}; {_rmse(result.matches)}."
    return Headline(word, sentence, good, (), judged.sentence, judged.passed)


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
        yield "no record was kept for a validation"
    elif result.accepted:
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
    live: list[Chart] = []
    hinted, before = [], False  # the first of adjoining sections with live charts says what they do
    for section in page.sections:
        charts = [each for each in section.blocks if isinstance(each, Chart) and each.live]
        if charts and not before:
            hinted.append(section.key)
        live, before = [*live, *charts], bool(charts)
    shared = environment()
    chart: Any = shared.get_template("chart.jinja").module
    text: str = shared.get_template("report.html.jinja").render(
        title=page.title,
        headline=page.headline,
        sections=[(each, blocks_html(each.blocks, chart.chart)) for each in page.sections],
        data=list(live_data(live)),
        hinted=hinted,
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
