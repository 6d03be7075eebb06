"""The report of a fit: one page that can be handed in, as HTML or PDF."""

import re
from pathlib import Path

from exfit.errors import ExfitError
from exfit.features.report.page import (
    CHART_STYLE,
    TEMPLATES,
    Page,
    fit_page,
    is_page,
    page_html,
    validation_page,
)
from exfit.results.io import load_result, load_validation, result_file
from exfit.results.model import FitResult
from exfit.util.file_names import VALIDATION, WHOLE_PROGRAMME
from exfit.util.files import write

PAGE, PRINT = "report.html", "report.pdf"
MARK = b"% report of exfit\n"  # a comment behind the end of a file
DRAWING = re.compile(r"<svg class=\"(?:static|sample)[^>]*>")


def write_report(
    result: Path,
    output: Path | None = None,
    force: bool = False,
    pdf: bool = False,
    against: Path | None = None,
) -> Path:
    """Write the report of a fit, validation or programme, by default to its folder; return where.

    ``result`` is a programme.json, result.json or validation.json, or a folder, of which the first
    of these is taken; nothing is read but results, and nothing is simulated. With ``pdf`` it is a
    PDF, else an HTML page. ``against`` is the result of another fit, of an earlier revision or
    another unit, to be shown beside it. A report that is there already is replaced, any other file
    only with ``force``. Raises ExfitError for what cannot be used.
    """
    page, folder = _page(result, None if against is None else load_result(against))
    place = output or folder / (PRINT if pdf else PAGE)
    is_report = _is_pdf if pdf else is_page
    if place.is_dir():
        raise ExfitError(f"{place}: cannot be written: it is a folder")
    if place.exists() and not force and not is_report(place):
        raise ExfitError(f"{place}: exists already, and is no report; --force writes over it")
    write(place, page_pdf(page) if pdf else page_html(page))
    return place


def _page(result: Path, other: FitResult | None) -> tuple[Page, Path]:
    """Return the page of a result that a file or folder holds, and its folder."""
    summary = result / WHOLE_PROGRAMME if result.is_dir() else result
    if summary.name == WHOLE_PROGRAMME and summary.is_file():
        from exfit.features.programme.folder import load_summary
        from exfit.features.programme.programme_page import programme_page

        if other is not None:
            raise ExfitError(f"{summary}: --against compares fits, and this is a programme")
        return programme_page(load_summary(summary.parent), summary.parent), summary.parent
    source = result_file(result)
    if result.is_dir() and not source.exists() and (result / VALIDATION).is_file():
        source = result / VALIDATION
    if source.name == VALIDATION:
        if other is not None:
            raise ExfitError(f"{source}: --against compares fits, and this is a validation")
        return validation_page(load_validation(source), source.parent), source.parent
    return fit_page(load_result(source), source.parent, other), source.parent


def page_pdf(page: Page) -> bytes:
    """Return a page as PDF.

    Raises ExfitError where WeasyPrint is missing, or the libraries that it draws with.
    """
    try:
        from weasyprint import CSS, HTML
    except ImportError:
        raise ExfitError(
            "a PDF needs WeasyPrint: pip install 'exfit[pdf]'; or print the HTML page in a browser"
        ) from None
    except OSError as error:  # Pango and its kin are no packages of Python
        raise ExfitError(
            f"WeasyPrint lacks a library of the system, Pango ({error}); see its page on "
            "installation, or print the HTML page in a browser"
        ) from None
    # WeasyPrint does not hand drawings the style of the page: each holds its own
    style = f"<style>{CHART_STYLE.read_text(encoding='utf-8')}</style>"
    text = page_html(page, interactive=False)
    html = HTML(string=DRAWING.sub(lambda drawing: drawing[0] + style, text))
    pdf: bytes = html.write_pdf(stylesheets=[CSS(TEMPLATES / "paged.css")])
    return pdf + MARK


def _is_pdf(path: Path) -> bool:
    """Tell by its end a PDF that this module made from other files."""
    return path.read_bytes().endswith(MARK)
