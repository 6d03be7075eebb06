"""The report of a fit: one page that can be handed in."""

from pathlib import Path

from exfit.errors import ExfitError
from exfit.output.report.content import Report, report_of
from exfit.output.report.page import html, is_page
from exfit.results.io import read_saved
from exfit.util.files import write

__all__ = ["Report", "html", "report_of", "write_report"]

PAGE = "report.html"


def write_report(
    result: Path, output: Path | None = None, case: Path | None = None, force: bool = False
) -> Path:
    """Write the report of a fit, by default into the folder that the fit left; return where.

    ``result`` is a result.json or the folder that holds it. A report that stands there already is
    replaced, any other file only with ``force``. Raises ExfitError for what cannot be used.
    """
    place = output or read_saved(result).path.with_name(PAGE)
    if place.is_dir():
        raise ExfitError(f"{place}: cannot be written: it is a folder")
    if place.exists() and not force and not is_page(place):
        raise ExfitError(f"{place}: exists already, and is no report; --force writes over it")
    write(place, html(report_of(result, case)))
    return place
