"""The report as PDF: with bookmarks, page numbers, and contents that name the pages."""

import re
from pathlib import Path

from exfit.errors import ExfitError
from exfit.features.report.page import CHART_STYLE, TEMPLATES, Page, page_html

MARK = b"% report of exfit\n"  # a comment behind the end of a file
DRAWING = re.compile(r"<svg class=\"(?:static|sample)[^>]*>")


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
    html = HTML(string=_styled_drawings(page_html(page, interactive=False)))
    pdf: bytes = html.write_pdf(stylesheets=[CSS(TEMPLATES / "paged.css")])
    return pdf + MARK


def is_pdf(path: Path) -> bool:
    """Tell by its end a PDF that this module made from other files."""
    return path.read_bytes().endswith(MARK)


def _styled_drawings(page: str) -> str:
    """Return a page whose drawings hold their own style, which WeasyPrint does not hand them."""
    style = f"<style>{CHART_STYLE.read_text(encoding='utf-8')}</style>"
    return DRAWING.sub(lambda drawing: drawing[0] + style, page)
