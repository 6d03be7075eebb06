"""What is shown of a result, as data: each part yields blocks, and a renderer shows them.

Nothing here knows a terminal, a page or a picture: `exfit.output.terminal` writes blocks to
a terminal, the report writes the same ones as HTML.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

from exfit.util.arrays import Array
from exfit.util.text import rounded

if TYPE_CHECKING:
    from exfit.inference.confidence import Interval, Uncertainty

Range = tuple[float, float]

NO_BREAK = "\N{NO-BREAK SPACE}"  # between words that stay in one line
WIDE = 560.0  # units of a chart across: few, so that its text is read on a telephone

Mark = Literal["", "ok", "doubt", "bad", "strong", "faint"]
Kind = Literal["info", "warning", "remedy", "verdict"]


@dataclass(frozen=True)
class Heading:
    """A title of what follows; ``level`` 1 is that of a part."""

    text: str
    level: int = 1


@dataclass(frozen=True)
class Facts:
    """Figures by their names, few enough to be read in a line; a name may be empty."""

    pairs: tuple[tuple[str, str], ...]
    between: str = "   "


@dataclass(frozen=True)
class TableColumn:
    """A column of a table.

    number      aligned to the right
    group       what heads it together with its neighbours of the same group, which it stays with
    folds       whether its heading and cells may take several lines
    expendable  how early it is left out where there is little room, 1 first; 0 never
    """

    title: str
    number: bool = False
    unit: str = ""
    group: str = ""
    folds: bool = False
    expendable: int = 0

    @property
    def heading(self) -> str:
        """The title with the unit, below the group."""
        title = f"{self.title} ({self.unit})" if self.unit else self.title
        return f"{self.group}\n{title}" if self.group else title


class Cell(NamedTuple):
    """The text of a cell, and how it stands out.

    ``see`` is the key of a section of its page, whose number follows; ``shade`` (-5 to 5) colours
    it by a value between two extremes.
    """

    text: str
    mark: Mark = ""
    see: str = ""
    shade: int | None = None


@dataclass(frozen=True)
class Table:
    """Rows of cells; of a wide one that is shown in parts each begins with ``leading`` columns.

    A page has its ``style``, the name of one in its style sheet; with a ``summary`` it can be
    folded behind that, together with a ``legend``: what its headings mean.
    """

    columns: tuple[TableColumn, ...]
    rows: tuple[tuple[Cell, ...], ...]
    title: str = ""
    leading: int = 1
    style: str = ""
    summary: str = ""
    legend: str = ""


@dataclass(frozen=True)
class Note:
    """A sentence of some kind behind its ``label``, such as "cause:"; ``mark`` is the label's.

    ``indent`` counts the levels that it stands further in; ``see`` is the key of a section of its
    page, whose number follows.
    """

    text: str
    kind: Kind = "info"
    label: str = ""
    mark: Mark = ""
    indent: int = 0
    see: str = ""


@dataclass(frozen=True)
class Verbatim:
    """Lines that are shown letter by letter: a drawing in characters, a section of a case.

    A page calls them by their ``title``, which is not shown.
    """

    text: str
    title: str = "Text"


@dataclass(frozen=True)
class Series:
    """A line of a chart, or dots: ``style`` names what it stands for, as "measured"."""

    label: str
    x: Array
    y: Array
    style: str
    dots: bool = False


@dataclass(frozen=True)
class Rule:
    """A straight line across a panel at a level of y, or of x, and what it says."""

    at: float
    label: str = ""
    upright: bool = False
    style: str = "rule"


@dataclass(frozen=True)
class Panel:
    """A panel of a chart: what its y axis shows with its unit, its lines, its height."""

    title: str
    series: tuple[Series, ...]
    height: float
    logarithmic: bool = False
    rules: tuple[Rule, ...] = ()


@dataclass(frozen=True)
class Chart:
    """Panels above each other on one x axis; ``text`` says what a reader would see there.

    ``key`` begins the ids of the drawing; it must be its alone on a page. Charts of one ``group``
    that follow each other are a figure of that title. Of a ``live`` chart a page has the samples,
    and says where its axes begin and end, so that it can be zoomed.
    """

    key: str
    title: str
    text: str
    x_title: str
    panels: tuple[Panel, ...]
    logarithmic: bool = False
    width: float = WIDE
    x_range: Range | None = None
    whole: bool = False
    group: str = ""
    live: "LiveSamples | None" = None

    @property
    def legend(self) -> tuple[Series, ...]:
        """A line of each kind, where there is more than one."""
        kinds = {
            series.label: series for panel in self.panels for series in panel.series if series.label
        }
        return tuple(kinds.values()) if len(kinds) > 1 else ()


@dataclass(frozen=True, eq=False)
class LiveSamples:
    """The samples (M,) of a chart's lines by their names, at ``time`` (M,) in s.

    The charts of one ``record`` are zoomed together.
    """

    record: str
    time: Array
    lines: Mapping[str, Array]


@dataclass(frozen=True)
class Diagram:
    """A drawing that is SVG already: the block diagram of a model."""

    title: str
    svg: str


Block = Heading | Facts | Table | Note | Verbatim | Chart | Diagram


def columns(*titles: str, numbers: Iterable[str] = ()) -> tuple[TableColumn, ...]:
    """Make columns by their titles; those named in ``numbers`` are aligned to the right."""
    right = {*numbers}
    return tuple(TableColumn(title, title in right) for title in titles)


def row(*texts: str, mark: Mark = "") -> tuple[Cell, ...]:
    """Make a row of cells that all stand out alike."""
    return tuple(Cell(text, mark) for text in texts)


def remarks(
    label: str, texts: Iterable[str], mark: Mark = "doubt", kind: Kind = "info"
) -> Iterator[Note]:
    """Yield a note for each sentence that is not empty, all behind the same label."""
    for text in filter(None, texts):
        yield Note(text, kind, label, mark)


def notes(texts: Iterable[str]) -> Iterator[Note]:
    """Yield notes on the numbers."""
    return remarks("note:", texts, kind="warning")


def unresolved(texts: Iterable[str]) -> Iterator[Note]:
    """Yield notes on parameters that the records do not determine."""
    return remarks("unresolved:", texts, kind="warning")


def figures(*texts: str, between: str = "   ") -> Facts:
    """Make a line of figures that say themselves what they are, as "12 iterations"."""
    return Facts(tuple(("", text) for text in texts), between)


def paragraph(text: str, mark: Mark = "") -> Note:
    """Make a sentence without a label."""
    return Note(text, mark=mark)


def number(value: float | None, digits: int = 5) -> str:
    """Write a number in a few digits, a dash for None."""
    return "-" if value is None else f"{value:.{digits}g}"


def interval(limits: "Interval | None", digits: Callable[[float], str] = rounded) -> str:
    """Write an interval, its limits in some ``digits``; an open side by the other limit."""
    low, high = limits or (None, None)
    if low is not None and high is not None:
        return f"{digits(low)} ... {digits(high)}"
    if low is None:
        return "-" if high is None else f"below {digits(high)}"
    return f"above {digits(low)}"


def percent(share: float) -> str:
    """Write a share in percent, two digits of it."""
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"


def error_of(uncertainty: "Uncertainty", of_record: bool = False) -> str:
    """Write a standard error: in percent, but of a record in its own unit."""
    if uncertainty.relative_error is not None and not of_record:
        return percent(uncertainty.relative_error)
    return "-" if uncertainty.std_error is None else f"{uncertainty.std_error:.1e}"
