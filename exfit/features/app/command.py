"""The command app: a page in the browser."""

import os
import sys
import webbrowser
from pathlib import Path

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.streams import echo


@click.command(short_help="Drag sliders, see the response, fit, in a page.")
@click.argument(
    "case",
    type=GivenFile(Kind.CASE, Kind.RECORD, Kind.RESULT),
    required=False,
    metavar="[CASE|RECORD|RESULT]",
)
@click.option("--browser/--no-browser", default=True, help="Open the browser (default: yes).")
def app(case: Path | None, browser: bool) -> None:
    """Open a page in the browser that shows CASE, or the RESULT of its fit.

    Of a RECORD it shows the channels, as exfit inspect reads them, to be corrected, and makes the
    case, as exfit new does. Such files, and a planner's (.dyr, .dyd), can be dropped on the page or
    chosen there, too: they are kept in the working folder.

    A slider for each free parameter moves the response beside the record. Fit shows each iteration,
    then the verdict, the intervals and the causes. Each change is stored in CASE-draft.yaml until
    the page saves the case; the page shows the command that does the same.

    The page is served to this computer alone, under the address that is printed. Ctrl-C ends it, or
    the last page when it has been closed for a minute. Needs: pip install 'exfit[app]'.
    """
    from exfit.features.app.server import page_server

    server, address = page_server(case)
    echo(f"{address}\nCtrl-C ends it", err=False)
    if browser and has_display():
        webbrowser.open(address)
    try:
        server.serve_pages()
    except KeyboardInterrupt:  # how it ends
        click.get_current_context().find_root().obj.clear()


def has_display() -> bool:
    """Tell if a browser can show itself."""
    names = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, names))
