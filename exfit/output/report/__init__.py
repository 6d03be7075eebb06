"""The report of a fit: one page that can be handed in."""

from pathlib import Path

from exfit.errors import ExfitError
from exfit.output.report.page import html, is_page
from exfit.results.io import load_result, result_file
from exfit.util.files import write

__all__ = ["html", "write_report"]

PAGE = "report.html"


def write_report(result: Path, output: Path | None = None, force: bool = False) -> Path:
    """Write the report of a fit, by default into the folder that the fit left; return where.

    ``result`` is a result.json or the folder that holds it; nothing else is read, and nothing is
    simulated. A report that is there already is replaced, any other file only with ``force``.
    Raises ExfitError for what cannot be used.
    """
    source = result_file(result)
    fit = load_result(source)
    place = output or source.with_name(PAGE)
    if place.is_dir():
        raise ExfitError(f"{place}: cannot be written: it is a folder")
    if place.exists() and not force and not is_page(place):
        raise ExfitError(f"{place}: exists already, and is no report; --force writes over it")
    write(place, html(fit, source.parent))
    return place
