"""The terminal, and what all that is shown on it shares."""

import os
import re
import textwrap
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len, set_cell_size
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from exfit.show.blocks import NO_BREAK
from exfit.util.text import printable

if TYPE_CHECKING:
    from exfit.show.figure_files import PlannedFigures

NARROW = 80  # columns where the width is unknown
DEEPEST_INDENT = 14  # characters: more would leave a sentence a narrow column
UNIT = r"(?:%|pu|s|Hz)(?!\w)"
UNBROKEN = re.compile(  # commands, ranges, and figures with their units
    rf"`[^`]*`|\d \.\.\. -?[\d.]+(?:e-?\d+)?(?: {UNIT})?|\d {UNIT}"
)


class GuardedConsole(Console):
    """A console that texts of files cannot control: names, units and remarks come from others."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        """Render segments with codes in place of control characters that no style added."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))


def console() -> Console:
    """Make the console of the terminal, or of a file or pipe: as wide as COLUMNS says.

    Without COLUMNS the tables of a file are as on a narrow terminal, and no sentence is wrapped.
    """
    sized = {name: text for name, text in os.environ.items() if not _is_no_size(name, text)}
    terminal = GuardedConsole(highlight=False, _environ=sized)
    if wraps(terminal):
        return terminal
    return GuardedConsole(highlight=False, width=NARROW, soft_wrap=True)


def _is_no_size(name: str, text: str) -> bool:
    return name in ("COLUMNS", "LINES") and text.isdigit() and int(text) == 0


def wraps(console: Console) -> bool:
    """Tell whether sentences are wrapped: a person reads them, or COLUMNS is given."""
    columns = os.environ.get("COLUMNS")
    given = columns is not None and not _is_no_size("COLUMNS", columns)
    return console.is_terminal or given


def waiting(console: Console, paths: Iterable[Path]) -> None:
    """Say which files are watched."""
    names = ", ".join(path.name for path in paths)
    console.print()
    paragraph(console, f"watching {names}; Ctrl-C ends", "dim")


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
    paragraph(console, line, indent=width + 4)


def figures_of_fit(console: Console, name: str) -> None:
    """Say that the figures of a fit of several are written."""
    console.print(f"  {name}/*.png", markup=False, soft_wrap=True)


def remarks(console: Console, kind: str, texts: Iterable[str], style: str = "yellow") -> None:
    """Show sentences one below the other, each behind its kind; no figure leaves its unit."""
    indent = len(kind) + 1 if len(kind) < DEEPEST_INDENT else 2
    for text in filter(None, texts):
        lines = wrapped(console, f"{kind.replace(' ', NO_BREAK)} {text}", indent)
        sentence = Text(lines)
        sentence.stylize(style, 0, len(kind))
        console.print(sentence, soft_wrap=True)


def paragraph(console: Console, text: str, style: str = "", indent: int = 0) -> None:
    """Show a text, its further lines indented; no figure leaves its unit."""
    console.print(Text(wrapped(console, text, indent), style), soft_wrap=True)


def in_groups(groups: Iterable[str], between: str = "   ") -> str:
    """Join groups of words to a text that is wrapped between the groups alone."""
    return between.join(group.replace(" ", NO_BREAK) for group in groups)


def wrapped(console: Console, text: str, indent: int) -> str:
    """Break a text in lines that are as wide as the terminal, where sentences are wrapped."""
    lines = text
    if wraps(console):
        lines = textwrap.fill(
            UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), text),
            max(console.width, NARROW // 2),
            subsequent_indent=" " * indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
    return lines.replace(NO_BREAK, " ")
