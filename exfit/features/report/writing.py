"""The report of a fit: one page that can be handed in."""

from pathlib import Path

from exfit.errors import ExfitError
from exfit.features.report.page import Page, fit_page, html, is_page, page_html, validation_page
from exfit.features.report.pdf import is_pdf, page_pdf
from exfit.results.io import load_result, load_validation, result_file
from exfit.results.model import FitResult
from exfit.util.file_names import VALIDATION, WHOLE_PROGRAMME
from exfit.util.files import write

__all__ = ["html", "write_report"]

PAGE, PRINT = "report.html", "report.pdf"


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
    page = _page(result, None if against is None else load_result(against))
    place = output or page.folder / (PRINT if pdf else PAGE)
    is_report = is_pdf if pdf else is_page
    if place.is_dir():
        raise ExfitError(f"{place}: cannot be written: it is a folder")
    if place.exists() and not force and not is_report(place):
        raise ExfitError(f"{place}: exists already, and is no report; --force writes over it")
    write(place, page_pdf(page) if pdf else page_html(page))
    return place


def _page(result: Path, other: FitResult | None) -> Page:
    """Return the page of a result that a file or folder holds."""
    summary = result / WHOLE_PROGRAMME if result.is_dir() else result
    if summary.name == WHOLE_PROGRAMME and summary.is_file():
        from exfit.features.programme.kept import load_summary
        from exfit.features.programme.show.programme_page import programme_page

        if other is not None:
            raise ExfitError(f"{summary}: --against compares fits, and this is a programme")
        return programme_page(load_summary(summary.parent), summary.parent)
    source = result_file(result)
    if result.is_dir() and not source.exists() and (result / VALIDATION).is_file():
        source = result / VALIDATION
    if source.name == VALIDATION:
        if other is not None:
            raise ExfitError(f"{source}: --against compares fits, and this is a validation")
        return validation_page(load_validation(source), source.parent)
    return fit_page(load_result(source), source.parent, other)
