"""The page of a case in a notebook, `exfit.app`."""

import weakref
from html import escape
from math import inf
from os import PathLike
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

from exfit.case.case import Case
from exfit.results.model import FitResult

if TYPE_CHECKING:  # of exfit[app]
    from exfit.features.app.server import PageServer

NOTEBOOKS = "http://localhost:* http://127.0.0.1:* vscode-webview:"  # which may frame a page


class View:
    """A page that is served from this process as long as the object is there, or until `close`.

    A notebook shows it in its cell; ``address`` opens it in a browser.
    """

    def __init__(self, given: Path | FitResult | None, height: int) -> None:
        from exfit.features.app.server import page_server

        self.height = height
        self.server, self.address = page_server(given, inf, NOTEBOOKS)
        self.thread = Thread(target=self.server.serve_pages, name="exfit app", daemon=True)
        self._end = weakref.finalize(self, _end, self.server)
        self.thread.start()

    def __repr__(self) -> str:
        """Return the address."""
        return f"<exfit app: {self.address}>" if self._end.alive else "<exfit app: closed>"

    def _repr_html_(self) -> str:
        """Frame the page, as notebooks ask for it."""
        if not self._end.alive:
            return escape(repr(self))
        size = f'width="100%" height="{self.height}" style="border: 0"'
        return f'<iframe src="{escape(self.address)}" title="exfit app" {size}></iframe>'

    def close(self) -> None:
        """End the page; what it has changed is in the draft of its case."""
        self._end()
        self.thread.join()


def _end(server: "PageServer") -> None:
    server.should_exit = True


def app(given: str | PathLike[str] | Case | FitResult | None = None, *, height: int = 900) -> View:
    """Show a case, a record or a result in the page of ``exfit app``, as a cell of a notebook.

    Args:
        given: a case or its file, the result of a fit or its folder, or a recorder's file; None: a
            page on which one is chosen.
        height: of the cell, px.

    The page is served to this computer alone, and ends with the object or its ``close()``. Raises
    ExfitError for what cannot be shown, and without the packages of exfit[app].

    Example:
        >>> view = exfit.app("case.yaml")
        >>> view  # the last line of a cell shows it
        >>> view.close()
    """
    if isinstance(given, Case):
        given = given.path
    return View(Path(given) if isinstance(given, str | PathLike) else given, height)
