"""The terminal, and what all that is shown on it shares."""

import re
import textwrap
from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len, set_cell_size
from rich.console import Console
from rich.table import Table
from rich.text import Text

from exfit.inference import Interval, Uncertainty

if TYPE_CHECKING:
    from exfit.output.run_figures import PlannedFigures

NARROW = 80  # columns where the width is unknown
UNBROKEN = re.compile(r"`[^`]*`|\d (?:%|pu|s|Hz)(?!\w)")  # commands, and figures with their units
NO_BREAK = "\N{NO-BREAK SPACE}"


def console() -> Console:
    """Return the terminal; a file or pipe is taken for a narrow one."""
    terminal = Console(highlight=False)
    return terminal if terminal.is_terminal else Console(highlight=False, width=NARROW)


def plain_table(*columns: str, numbers: Sequence[str] = ()) -> Table:
    """Return a table without frames; the named columns are numbers, aligned to the right."""
    table = Table(box=None, pad_edge=False, header_style="bold", show_edge=False)
    for column in columns[:-1]:
        table.add_column(column, justify="right" if column in numbers else "left", no_wrap=True)
    # the last column gives way where the terminal is narrow
    table.add_column(columns[-1], justify="right" if columns[-1] in numbers else "left")
    return table


def number(value: float | None, digits: int = 5) -> str:
    """Return a number in a few digits, a dash for None."""
    return "-" if value is None else f"{value:.{digits}g}"


def interval(limits: Interval | None) -> str:
    """Return an interval in a few digits, a dash for None; an open side by the other limit."""
    low, high = limits or (None, None)
    if low is not None and high is not None:
        return f"{number(low)} ... {number(high)}"
    if low is None:
        return "-" if high is None else f"below {number(high)}"
    return f"above {number(low)}"


def waiting(console: Console, paths: Iterable[Path]) -> None:
    """Say which files are watched."""
    names = ", ".join(path.name for path in paths)
    console.print()
    console.print(f"watching {names}; Ctrl-C ends", markup=False, style="dim")


def again(console: Console, paths: Iterable[Path]) -> None:
    """Draw a line between two runs, with what has changed and when."""
    names = ", ".join(path.name for path in paths)
    console.print()
    console.rule(Text(f"{names} changed, {datetime.now():%H:%M:%S}"))


def written(console: Console, folder: Path) -> None:
    """Say where the files are."""
    console.print(f"written to {folder}", soft_wrap=True, markup=False)


def figure(console: Console, planned: "PlannedFigures", name: str) -> None:
    """Say which of the figures is written now, and what it shows."""
    width = max(map(cell_len, planned))
    line = f"  {set_cell_size(name, width)}  {planned[name].shows}"
    console.print(line, markup=False, no_wrap=True, overflow="ellipsis")


def figures_of_fit(console: Console, name: str) -> None:
    """Say that the figures of a fit of several are written."""
    console.print(f"  {name}/*.png", markup=False, soft_wrap=True)


def error_of(uncertainty: Uncertainty, of_record: bool = False) -> str:
    """Return a standard error as it is shown: in percent, but of a record in its own unit."""
    if uncertainty.relative_error is not None and not of_record:
        return percent(uncertainty.relative_error)
    return "-" if uncertainty.std_error is None else f"{uncertainty.std_error:.1e}"


def notes(console: Console, texts: Iterable[str]) -> None:
    """Show what must be known beside the numbers."""
    remarks(console, "note:", texts)


def unresolved(console: Console, texts: Iterable[str]) -> None:
    """Show what the records do not determine."""
    remarks(console, "unresolved:", texts)


def percent(share: float) -> str:
    """Return a share in percent, two digits of it."""
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"


def remarks(console: Console, kind: str, texts: Iterable[str], style: str = "yellow") -> None:
    """Show sentences one below the other, each behind its kind; no figure leaves its unit."""
    indent = " " * (len(kind) + 1)
    for text in filter(None, texts):
        whole = UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), text)
        lines = textwrap.fill(
            whole,
            max(console.width, NARROW // 2),
            initial_indent=indent,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
        sentence = lines.replace(NO_BREAK, " ").removeprefix(indent)
        console.print(Text.assemble((kind, style), " ", sentence), soft_wrap=True)
