"""The page of a report: one HTML file that needs nothing beside it."""

import re
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exfit import __version__
from exfit.dsp.features import LABELS
from exfit.features.report.charts import drawing
from exfit.features.report.sections import AGAINST, OF_VALIDATION, SECTIONS, ReportSection
from exfit.features.report.sections.against import against
from exfit.features.report.sections.matches import MatchView, OverlayChart, live_data
from exfit.features.report.sections.texts import number
from exfit.features.report.verdict import Headline, headline, headline_of_validation
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported, ValidationResult
from exfit.show.blocks import Block
from exfit.show.html import html as blocks_html
from exfit.util.text import percentage, rounded

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

TEMPLATES = Path(__file__).parent / "templates"
CHART_STYLE = TEMPLATES / "chart.css"
CAPTIONS = {"caption": "Table", "figcaption": "Figure"}  # what each kind of caption counts
CAPTION = re.compile(r"<(caption|figcaption)>")  # those of small multiples have a class
LONG = 12  # lines of a history that a reader sees without asking for more
MOST_PRINTED = 8  # columns of parameters beside which a history is read on paper
GENERATOR = '<meta name="generator" content="exfit '
NO_BEHAVIOUR = "The result does not hold this: the fit was interrupted."
HEAD = 2000  # characters at the beginning of a page, among which it says what made it


@dataclass(frozen=True)
class Page:
    """What a page shows: its title, what it comes to, its sections with their content.

    ``folder`` is where the results lie, for the commands on the page.
    """

    title: str
    headline: Headline
    sections: Sequence[tuple[ReportSection, Any]]
    folder: Path


def html(result: FitResult, folder: Path, other: FitResult | None = None) -> str:
    """Return the page of a fit; ``folder`` is where the fit lies, for the commands on the page.

    With an ``other`` fit, an earlier revision or another unit, a section compares both.
    """
    return page_html(fit_page(result, folder, other))


def fit_page(result: FitResult, folder: Path, other: FitResult | None = None) -> Page:
    """Build the page of a fit, beside an ``other`` fit where there is one."""
    sections = [(section, _content(section, result)) for section in SECTIONS]
    if other is not None:
        sections.insert(len(sections) - 1, (AGAINST, against(result, other)))
    return Page(f"{result.model}: {result.name}", headline(result), sections, folder)


def validation_page(result: ValidationResult, folder: Path) -> Page:
    """Build the page of a validation: nothing of a search."""
    every = ((section, _content(section, result)) for section in OF_VALIDATION)
    sections = [(section, content) for section, content in every if content]
    title = f"{result.model}: {result.name}"
    return Page(title, headline_of_validation(result), sections, folder)


def _content(section: ReportSection, result: Reported) -> Any:
    content = section.content(result)
    return tuple(content) if isinstance(content, Iterator) else content


def page_html(page: Page, interactive: bool = True) -> str:
    """Return a page as HTML; without scripts, for a print, where it is not ``interactive``."""
    style = CHART_STYLE.read_text(encoding="utf-8") + _text("report.css")
    overlays = _overlays(content for _, content in page.sections) if interactive else []
    text: str = (
        environment()
        .get_template("report.html.jinja")
        .render(
            title=page.title,
            headline=page.headline,
            sections=page.sections,
            numbers={part.key: k for k, (part, _) in enumerate(page.sections, start=1)},
            folder=str(page.folder),
            data=list(live_data(overlays)),
            css=style,
            script=_text("report.js") if interactive else "",
        )
    )
    return _numbered(text)


def _text(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def _numbered(page: str) -> str:
    """Return a page whose figures and tables are numbered, in the order in which they stand."""
    counts = Counter[str]()

    def with_number(caption: re.Match[str]) -> str:
        kind = CAPTIONS[caption[1]]
        counts[kind] += 1
        return f'{caption[0]}<span class="number">{kind} {counts[kind]}.</span> '

    return CAPTION.sub(with_number, page)


def is_page(path: Path) -> bool:
    """Tell by its head a page that this module made from other files."""
    with path.open(encoding="utf-8", errors="replace") as file:
        return GENERATOR in file.read(HEAD)


def _overlays(contents: Iterable[Any]) -> list[OverlayChart]:
    """Return the overlays of all sections that have some."""
    return [
        overlay
        for content in contents
        if isinstance(content, tuple)
        for view in content
        if isinstance(view, MatchView)
        for overlay in view.overlays
    ]


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
    shared.filters |= {
        "number": number,
        "blocks": _blocks,
        "rounded": rounded,
        "percentage": percentage,
    }
    shared.filters |= {"drawing": drawing, "command": shlex.join}
    shared.tests |= {"finite": _is_finite}
    shared.globals |= {"version": __version__, "features": LABELS, "long": LONG}
    shared.globals |= {"most_printed": MOST_PRINTED}
    return shared


def _is_finite(value: float | None) -> bool:
    return value is not None and isfinite(value)


def _blocks(blocks: Iterable[Block]) -> "Markup":
    """Write the blocks of a section; their charts by the template of charts."""
    from markupsafe import Markup

    template: Any = environment().get_template("chart.jinja").module
    return Markup(blocks_html(blocks, template.chart))
