"""The report of a fit: one page that can be handed in."""

from pathlib import Path

from exfit.errors import ExfitError
from exfit.output.report.page import fit_page, html, is_page, page_html
from exfit.output.report.pdf import is_pdf, page_pdf
from exfit.results.io import load_result, result_file
from exfit.util.files import write

__all__ = ["html", "write_report"]

PAGE, PRINT = "report.html", "report.pdf"


def write_report(
    result: Path, output: Path | None = None, force: bool = False, pdf: bool = False
) -> Path:
    """Write the report of a fit, by default into the folder that the fit left; return where.

    ``result`` is a result.json or the folder that holds it; nothing else is read, and nothing is
    simulated. With ``pdf`` it is a PDF, else an HTML page. A report that is there already is
    replaced, any other file only with ``force``. Raises ExfitError for what cannot be used.
    """
    source = result_file(result)
    fit = load_result(source)
    place = output or source.with_name(PRINT if pdf else PAGE)
    is_report = is_pdf if pdf else is_page
    if place.is_dir():
        raise ExfitError(f"{place}: cannot be written: it is a folder")
    if place.exists() and not force and not is_report(place):
        raise ExfitError(f"{place}: exists already, and is no report; --force writes over it")
    page = fit_page(fit, source.parent)
    write(place, page_pdf(page) if pdf else page_html(page))
    return place
