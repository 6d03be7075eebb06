"""Figures as files beside the numbers of their run."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from exfit.errors import ExfitError
from exfit.util.files import write

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

    from matplotlib.figure import Figure

Item = TypeVar("Item")
Version = tuple[int, ...]  # of a file: what changes when it is replaced


class PlannedFigure(NamedTuple):
    """A figure to be drawn, and in a few words what it shows."""

    shows: str
    draw: Callable[[], "Figure"]


PlannedFigures = Mapping[str, PlannedFigure]
Announce = Callable[[PlannedFigures, str], None]  # takes all, and the name of the one written


class FigureFiles(NamedTuple):
    """The figures of a run whose numbers are written; nothing is imported before they are drawn.

    ``main`` is the file of the numbers. Where another run replaces it meanwhile, that draws its
    own figures.
    """

    main: Path
    version: Version
    planned: Callable[[], PlannedFigures]

    @classmethod
    def beside(cls, main: Path, planned: Callable[[], PlannedFigures]) -> "FigureFiles":
        """Return the figures that belong to a main file as it is now."""
        return cls(main, _version_of(main), planned)

    def draw(self, announce: Announce = lambda *_: None) -> tuple[str, ...]:
        """Draw the figures, announce each that is written; return which are missing, and why.

        Raises KeyboardInterrupt at an interruption, which names the figures that are missing.
        """
        left: list[str] = []
        try:
            return tuple(self._missing(left, announce))
        except KeyboardInterrupt:
            names = f": {', '.join(left)}" if left else ""
            message = f"{self.main.parent}: all numbers are written, figures are missing{names}"
            raise KeyboardInterrupt(message) from None

    def _missing(self, left: list[str], announce: Announce) -> Iterator[str]:
        """Draw figures, and yield which are missing, and why; ``left`` holds what is not drawn.

        While one is drawn, a thread encodes the one before.
        """
        from concurrent.futures import ThreadPoolExecutor

        planned = self.planned()
        left += planned
        with ThreadPoolExecutor(1) as pool:
            pictures = ((name, _encoded(figure, pool)) for name, figure in planned.items())
            for name, picture in _one_behind(pictures):
                path = self.main.with_name(name)
                try:
                    content = picture.result()
                    if _version_of(self.main) != self.version:
                        folder = self.main.parent
                        yield f"{folder}: another run writes there: figures of this run are missing"
                        return
                    write(path, content)
                except ExfitError as fault:
                    yield str(fault)
                except Exception as fault:  # whatever: the numbers are valid without the figure
                    yield f"{path}: not drawn: {type(fault).__name__}: {fault}"
                else:
                    announce(planned, name)
                left.remove(name)


def _one_behind(items: Iterable[Item]) -> Iterator[Item]:
    """Yield items, each when the next has been made, or an interruption has kept it from that."""
    made: list[Item] = []
    try:
        for item in items:
            yield from made
            made = [item]
    except KeyboardInterrupt:
        yield from made
        raise
    yield from made


def _encoded(figure: PlannedFigure, pool: "ThreadPoolExecutor") -> "Future[bytes]":
    """Draw a figure, and have a thread encode it; what hinders that is raised by the result."""
    from concurrent.futures import Future

    from exfit.output import figures as plots

    try:
        return pool.submit(plots.encoded, plots.drawn(figure.draw()))
    except Exception as fault:
        failed = Future[bytes]()
        failed.set_exception(fault)
        return failed


def _version_of(path: Path) -> Version:
    """Identify a file: this changes when it is replaced."""
    try:
        state = path.stat()
    except OSError:
        return ()
    return state.st_ino, state.st_mtime_ns, state.st_size
