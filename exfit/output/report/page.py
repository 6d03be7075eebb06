"""The page of a report: one HTML file that needs nothing beside it."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from exfit import __version__
from exfit.dsp.features import LABELS
from exfit.errors import ExfitError
from exfit.output.report.charts import drawing
from exfit.output.report.content import Report
from exfit.output.report.figures import data, figures

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).parent / "templates"
LIBRARY = ("bokeh.min.js", "bokeh-api.min.js")
LONG = 12  # lines of a history that a reader sees without asking for more
GENERATOR = '<meta name="generator" content="exfit '
HEAD = 2000  # characters at the beginning of a page, among which it says what made it


def html(report: Report) -> str:
    """Return the page of a report."""
    charts = figures(report)
    page: str = (
        _environment()
        .get_template("report.html.jinja")
        .render(
            report=report,
            charts=charts,
            data=data(charts.overlays),
            features=LABELS,
            long=LONG,
            version=__version__,
            css=(TEMPLATES / "report.css").read_text(encoding="utf-8"),
            scripts=[*library(), (TEMPLATES / "report.js").read_text(encoding="utf-8")],
        )
    )
    return page


def is_page(path: Path) -> bool:
    """Tell whether a file is a page that this module made."""
    with path.open(encoding="utf-8", errors="replace") as file:
        return GENERATOR in file.read(HEAD)


def library() -> list[str]:
    """Return the scripts of BokehJS, which the package bokeh brings.

    They are read as files: importing bokeh takes longer than all of a report.
    """
    found = find_spec("bokeh")
    if found is None or found.origin is None:
        raise ExfitError("the package bokeh is missing: pip install bokeh")
    folder = Path(found.origin).parent / "server" / "static" / "js"
    return [(folder / name).read_text(encoding="utf-8") for name in LIBRARY]


@cache
def _environment() -> "Environment":
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": _number, "drawing": drawing}
    return environment


def _number(value: float | None, digits: int = 5) -> str:
    """Return a number in a few digits, a dash for None."""
    return "–" if value is None else f"{value:.{digits}g}"
