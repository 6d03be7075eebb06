"""The gallery of the documentation: what the commands draw and print of the sample records.

    python tests/gallery.py

runs the commands, writes docs/img and puts the pictures with their captions into docs/gallery.md.
A picture that has only changed by what another machine would change stays as it is.
"""

import io
import math
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, chdir, contextmanager
from dataclasses import dataclass
from decimal import Decimal
from html import unescape
from pathlib import Path
from typing import ClassVar
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).parent / "support"))

from field_record import FILE, field_record
from film import film, lines_of
from matplotlib.figure import Figure
from rich.console import CONSOLE_SVG_FORMAT, Console
from rich.terminal_theme import DEFAULT_TERMINAL_THEME
from rich.text import Text
from small_svg import same_svg, small_svg

from exfit.cli import main
from exfit.output import figures as plots
from exfit.output import live, terminal

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "gallery.md"
FOLDER = PAGE.parent / "img"
OTHERS = ("thesis_", "verdict_", "app_")  # made by tests/studies, and by tests/benchmarks/slider.py
BEGIN, END = "<!-- gallery -->", "<!-- /gallery -->"

COLUMNS = 80  # of the terminal
PROMPT, EARLY, ITERATION, STAGE, RESULT = 0.7, 0.7, 0.25, 0.6, 4.0  # s: of a frame of a film
FEW = 5  # iterations that are shown as early ones: the response changes visibly
FRAME = ("rgba(255,255,255,0.35)", "#d0d7de")  # white on white, and a grey that is seen
# fonts of a server: a picture of its own has none
FORMAT = re.sub(r"@font-face \{\{.*?\}\}\s*", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL)

VANISHED = 1e-6  # a gradient or a step below it is what rounding leaves, and another machine rounds
NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?(?:e[+-]\d+)?")


@dataclass(frozen=True)
class Picture:
    """A file of the gallery: a figure that a command leaves in its folder, or its terminal."""

    name: str
    caption: str
    source: str | None = None


@dataclass(frozen=True)
class Run:
    """A command and its pictures; its terminal as it goes on, where that is of so many ``rows``."""

    command: str
    pictures: tuple[Picture, ...] = ()
    rows: int | None = None

    @property
    def terminal(self) -> Picture | None:
        return next((picture for picture in self.pictures if picture.source is None), None)

    @property
    def figures(self) -> set[str]:
        """The figures that become pictures, as the command names their files."""
        return {picture.source for picture in self.pictures if picture.source}

    @property
    def folder(self) -> Path:
        """Where the command leaves its files."""
        _, command, first, *_ = self.command.split()
        if command == "compare":
            return Path("runs") / command
        if self.command.count(".yaml") > 1:
            return Path("runs") / "fits"
        name = Path(first).name if command == "inspect" else Path(first).stem
        return Path("runs") / f"{name}-{command}"


CASES = ("ac1a_typical", "ac8b_unit1", "field_record", "grid_event")
FIT, UNIT, FIELD, EVENT = (f"configs/{name}.yaml" for name in CASES)
RECORD = FILE.relative_to(ROOT).as_posix()
RUNS = (  # in the order of the page
    Run(
        f"exfit fit {FIT}",
        (
            Picture(
                "fit.svg", "a fit as it goes on: the iterations, the response, the fitted values"
            ),
            Picture("overlay.svg", "measured, start values and fitted", "overlay.png"),
            Picture("iterations.svg", "the response after each iteration", "iterations.png"),
            Picture("convergence.svg", "cost, gradient and damping", "convergence.png"),
            Picture("correlation.svg", "correlation of the estimates", "correlation.png"),
            Picture(
                "sensitivity.svg", "effect of each parameter on the voltage", "sensitivity.png"
            ),
        ),
        rows=32,
    ),
    Run(
        f"exfit profile {FIT} KA KC KD",
        (Picture("profile.svg", "profiles of three parameters", "profile.png"),),
    ),
    Run(
        f"exfit identify {FIT}",
        (Picture("identify.svg", "which parameters a planned test identifies"),),
    ),
    Run(
        f"exfit identify {FIT} --design --limit vt=0.05 --limit efd=4 --channels vt,efd",
        (
            Picture(
                "designed_test.svg", "the test within limits that shows most", "designed_test.png"
            ),
        ),
    ),
    Run(
        f"exfit inspect {RECORD}",
        (
            Picture("inspect.svg", "contents of a recorder's file, and the sections of a case"),
            Picture("inspect_figure.svg", "step, spikes and gap of that record", "inspect.png"),
        ),
    ),
    Run(
        f"exfit fit {FIELD}",
        (Picture("field_overlay.svg", "voltage and field current in one fit", "overlay.png"),),
    ),
    Run(
        f"exfit fit {EVENT} --search local",
        (
            Picture(
                "grid_event.svg", "a grid event: what was played in, then P and Q", "overlay.png"
            ),
        ),
    ),
    Run(
        f"exfit simulate {FIT}",
        (Picture("response.svg", "every signal and state", "response.png"),),
    ),
    Run(
        f"exfit fit {FIT} {UNIT} --strategy dgn --strategy lm",
        (Picture("fits.svg", "two cases, each with two strategies", "fits.png"),),
    ),
    Run(
        "exfit compare runs/ac1a_typical-simulate runs/ac1a_typical-fit "
        "--record sample_data/ac1a_up.csv",
        (Picture("compare.svg", "two responses and a record", "compare.png"),),
    ),
)
# what a command draws beside its pictures
DRAWN = (
    "overlay", "iterations", "convergence", "trajectories", "sensitivity", "correlation", "response"
)  # fmt: skip


class Filmed(live.LiveIterations):
    """Keeps what a terminal shows after each iteration, and at the end of what follows them."""

    frames: ClassVar[list[tuple[list[Text], float]]] = []

    @contextmanager
    def running(self) -> Iterator["Filmed"]:
        self.frames[:] = [(lines_of(self.console), PROMPT)]
        self.console.print(self.title, markup=False)
        yield self
        self.console.print(self.picture())

    def __call__(self, line):
        self.lines.append(line)
        self._keep_frame(EARLY if len(self.lines) <= FEW else ITERATION)

    def starts(self, progress):
        self._starts = progress
        if progress.done == progress.total:
            self._keep_frame(STAGE)

    def _keep_frame(self, seconds):
        self.frames.append(([*lines_of(self.console)[:2], *self.picture().split("\n")], seconds))


def drawn() -> dict[str, bytes]:
    """Return every picture by its name, of commands that run in a copy of cases and records."""
    pictures: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as room, chdir(room):
        shutil.copytree(ROOT / "configs", "configs")
        shutil.copytree(ROOT / "sample_data", "sample_data")
        for run in RUNS:
            screen = ran(run)
            for picture in run.pictures:
                source = run.folder / picture.source if picture.source else None
                pictures[picture.name] = source.read_bytes() if source else screen
    return pictures


def ran(run: Run) -> bytes:
    """Run a command; return its terminal as SVG, which is empty where no picture is made of it."""
    console = Console(
        record=True,
        file=io.StringIO(),
        force_terminal=True,
        color_system="truecolor",
        no_color=False,
        highlight=False,
        legacy_windows=False,
        width=COLUMNS,
        height=run.rows,
    )
    console.print(f"$ {run.command}", style="bold", soft_wrap=True)
    words = run.command.split()[1:]
    with ExitStack() as changes:
        changes.enter_context(patch.object(plots, "drawn", small_svg))
        changes.enter_context(patch.object(plots, "encoded", bytes))
        changes.enter_context(patch.object(terminal, "console", lambda: console))
        changes.enter_context(patch.object(live, "LiveIterations", Filmed))
        changes.enter_context(patch.object(live, "QUIET", math.inf))
        for name in DRAWN:
            if f"{name}.png" not in run.figures:
                changes.enter_context(patch.object(plots, name, lambda *_: Figure()))
        main([*words, *([] if run.terminal else ["-q"])], "exfit", standalone_mode=False)
    if run.terminal is None:
        return b""
    if run.rows is not None:
        frames = [*Filmed.frames, (lines_of(console), RESULT)]
        return film(frames, COLUMNS, run.rows).encode()
    console.print()  # below the last line letters would be cut off
    name = Path(run.terminal.name).stem
    svg = console.export_svg(
        title="", theme=DEFAULT_TERMINAL_THEME, code_format=FORMAT, unique_id=name
    )
    return svg.replace(*FRAME).encode()


def same(one: bytes, other: bytes) -> bool:
    """Return whether two pictures differ by no more than another machine or version does."""
    figures = all(b"<!-- Matplotlib" in content for content in (one, other))
    return same_svg(one, other, same_word) if figures else same_words(one, other)


def same_words(one: bytes, other: bytes) -> bool:
    """Return whether two terminals say the same, numbers up to one of their last digit."""
    first, second = words_of(one), words_of(other)
    return len(first) == len(second) and all(map(same_word, first, second))


def words_of(svg: bytes) -> list[str]:
    """Return the words of a terminal."""
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", svg.decode())
    return " ".join(unescape(text) for text in texts).split()


def same_word(one: str, other: str) -> bool:
    if one == other:
        return True
    if not (NUMBER.fullmatch(one) and NUMBER.fullmatch(other)):
        return False
    first, second = Decimal(one), Decimal(other)
    if max(abs(first), abs(second)) < VANISHED:
        return True
    last = max(Decimal((0, (1,), number.as_tuple().exponent)) for number in (first, second))
    return abs(first - second) <= last


def section() -> str:
    """Return the gallery of the page: the command of each picture, and the picture."""
    pictures = [(run, picture) for run in RUNS for picture in run.pictures]
    return "\n\n".join(
        f"{picture.caption[0].upper()}{picture.caption[1:]}:<br>`{run.command}`\n\n"
        f"![{picture.caption}](img/{picture.name})"
        for run, picture in pictures
    )


def with_section(page: str) -> str:
    """Return the page with the gallery in its place."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{section()}\n\n{END}{after}"


def own_files() -> list[Path]:
    """Return the pictures in the folder that are no other page's."""
    return [path for path in FOLDER.iterdir() if not path.name.startswith(OTHERS)]


def write() -> None:
    """Write the gallery and its page; what is no part of it any more goes."""
    FOLDER.mkdir(exist_ok=True)
    pictures = drawn()
    for path in own_files():
        if path.name not in pictures:
            path.unlink()
    for name, content in pictures.items():
        path = FOLDER / name
        if not (path.exists() and same(path.read_bytes(), content)):
            path.write_bytes(content)
            print(f"{path}: {len(content) / 1e3:.0f} kB")
    PAGE.write_text(with_section(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    FILE.write_text(field_record(), encoding="utf-8")
    write()
