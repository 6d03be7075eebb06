"""What is shown of a result, as data: each part yields blocks, and a renderer shows them.

Nothing here knows a terminal, a page or a picture: `exfit.show.terminal.render` writes blocks to
a terminal, the report writes the same ones as HTML.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Range = tuple[float, float]

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
    """The text of a cell, and how it stands out."""

    text: str
    mark: Mark = ""


@dataclass(frozen=True)
class Table:
    """Rows of cells; of a wide one that is shown in parts each begins with ``leading`` columns."""

    columns: tuple[TableColumn, ...]
    rows: tuple[tuple[Cell, ...], ...]
    title: str = ""
    leading: int = 1


@dataclass(frozen=True)
class Note:
    """A sentence of some kind behind its ``label``, such as "cause:"; ``mark`` is the label's.

    ``indent`` counts the levels that it stands further in.
    """

    text: str
    kind: Kind = "info"
    label: str = ""
    mark: Mark = ""
    indent: int = 0


@dataclass(frozen=True)
class Verbatim:
    """Lines that are shown letter by letter: a drawing in characters, a section of a case."""

    text: str


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

    ``key`` begins the ids of the drawing; it must be its alone on a page. Of a ``live`` chart a
    page has the samples, and says where its axes begin and end, so that it can be zoomed.
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
    live: bool = False

    @property
    def legend(self) -> tuple[Series, ...]:
        """A line of each kind, where there is more than one."""
        kinds = {
            series.label: series for panel in self.panels for series in panel.series if series.label
        }
        return tuple(kinds.values()) if len(kinds) > 1 else ()


@dataclass(frozen=True)
class NamedPicture:
    """A picture that has a name: the block diagram of a model."""

    name: str
    text: str = ""


Block = Heading | Facts | Table | Note | Verbatim | Chart | NamedPicture


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
    """Yield what must be known beside the numbers."""
    return remarks("note:", texts, kind="warning")


def unresolved(texts: Iterable[str]) -> Iterator[Note]:
    """Yield what the records do not determine."""
    return remarks("unresolved:", texts, kind="warning")


def facts(*pairs: tuple[str, str], between: str = "   ") -> Facts:
    """Make a line of figures by their names."""
    return Facts(pairs, between)


def listed_facts(texts: Sequence[str], between: str = ", ") -> Facts:
    """Make a line of groups of words that belong together, as "12 iterations"."""
    return Facts(tuple(("", text) for text in texts), between)
