"""The report of a fit: one page that can be handed in, as HTML or PDF."""

import re
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

from exfit.errors import ExfitError
from exfit.features.report.page import (
    CHART_STYLE,
    TEMPLATES,
    Page,
    is_page,
    page_html,
    result_page,
)
from exfit.results.io import load_result, load_validation, stored_file
from exfit.results.model import FitResult
from exfit.util.file_names import VALIDATION, WHOLE_PROGRAMME
from exfit.util.files import write

PAGE = "report.html"
MARK = b"% report of exfit\n"  # a comment behind the end of a file
COLOUR, VARIABLE = re.compile(r"--([\w-]+): (#\w+)"), re.compile(r"var\(--([\w-]+)\)")
DRAWING = re.compile(r"<svg class=\"(?:static|sample)[^>]*>")


def write_report(
    result: FitResult | str | PathLike[str],
    output: str | PathLike[str] | None = None,
    force: bool = False,
    pdf: bool = False,
    against: FitResult | str | PathLike[str] | None = None,
) -> tuple[Path, ...]:
    """Write the report of a fit, validation or programme as an HTML page; return its path.

    Nothing is read but results, and nothing is simulated.

    Args:
        result: a fit; or a programme.json, result.json or validation.json, or the folder of one.
        output: the file; by default report.html beside the result.
        force: replace files that are no reports.
        pdf: write a PDF too, beside the page with the same name; so does an output ``*.pdf``.
        against: the result of another fit, an earlier revision or another unit, to compare with.

    Raises ExfitError where results cannot be used, a place cannot be written, or WeasyPrint is
    missing, which makes the PDF; the HTML page is then there.

    Example:
        >>> html, pdf = exfit.report("runs/ac1a_typical-fit", pdf=True)
    """
    if against is not None and not isinstance(against, FitResult):
        against = load_result(against)
    page, folder = _page(result, against)
    places = _places(folder / PAGE if output is None else Path(output), pdf, force)
    for path, is_report in places.items():
        write(path, page_html(page) if is_report is is_page else page_pdf(page))
    return tuple(places)


def refuse_report(place: Path, force: bool) -> None:
    """Raise ExfitError where the report of a fit that is still to run could not be written."""
    if place.suffix.lower() not in (".html", ".htm", ".pdf"):
        raise ExfitError(f"{place}: a report is a page, .html, or a .pdf")
    if _is_pdf in _places(place, False, force).values():
        _weasyprint()


def _places(place: Path, pdf: bool, force: bool) -> dict[Path, Callable[[Path], bool]]:
    """Return the files of a report, and what recognises a former one.

    Raises ExfitError where it would replace what is none.
    """
    places: dict[Path, Callable[[Path], bool]] = {place: is_page}
    if pdf or place.suffix.lower() == ".pdf":
        page = place
        if place.suffix.lower() not in (".html", ".htm"):
            page = place.with_suffix(".html")
        places = {page: is_page, page.with_suffix(".pdf") if page == place else place: _is_pdf}
    for path, is_report in places.items():
        if path.is_dir():
            raise ExfitError(f"{path}: cannot be written: it is a folder")
        if path.exists() and not force and not is_report(path):
            raise ExfitError(f"{path}: exists already, and is no report; --force writes over it")
    return places


def _page(result: FitResult | str | PathLike[str], other: FitResult | None) -> tuple[Page, Path]:
    """Build the page of a result; return it with the folder of the result."""
    if isinstance(result, FitResult):
        return result_page(result, Path(), other), Path()
    source = stored_file(Path(result))
    if source.name == WHOLE_PROGRAMME and source.is_file():
        from exfit.features.programme.folder import load_summary
        from exfit.features.programme.programme_page import programme_page

        if other is not None:
            raise ExfitError(f"{source}: --against compares fits, and this is a programme")
        return programme_page(load_summary(source.parent), source.parent), source.parent
    if source.name == VALIDATION:
        if other is not None:
            raise ExfitError(f"{source}: --against compares fits, and this is a validation")
        return result_page(load_validation(source), source.parent), source.parent
    return result_page(load_result(source), source.parent, other), source.parent


def _weasyprint() -> Any:
    """Import WeasyPrint; raises ExfitError where it is missing, or what it draws with."""
    try:
        import weasyprint
    except ImportError:
        raise ExfitError(
            "a PDF needs WeasyPrint: pip install 'exfit[pdf]'; or print the HTML page in a browser"
        ) from None
    except OSError as error:  # Pango and its kin are no packages of Python
        raise ExfitError(
            f"WeasyPrint lacks a library of the system, Pango ({error}); see its page on "
            "installation, or print the HTML page in a browser"
        ) from None
    return weasyprint


def page_pdf(page: Page) -> bytes:
    """Return a page as PDF.

    Raises ExfitError where WeasyPrint is missing, or the libraries that it draws with.
    """
    printer = _weasyprint()
    # WeasyPrint does not hand drawings the style of the page: each holds its own, in light colours
    colours = dict(COLOUR.findall((TEMPLATES / "report.css").read_text(encoding="utf-8"))[::-1])
    charts = VARIABLE.sub(lambda used: colours[used[1]], CHART_STYLE.read_text(encoding="utf-8"))
    style = f"<style>{charts}</style>"
    text = page_html(page, interactive=False)
    html = printer.HTML(string=DRAWING.sub(lambda drawing: drawing[0] + style, text))
    pdf: bytes = html.write_pdf(stylesheets=[printer.CSS(TEMPLATES / "paged.css")])
    return pdf + MARK


def _is_pdf(path: Path) -> bool:
    """Tell by its end a PDF that this module made from other files."""
    return path.read_bytes().endswith(MARK)
