"""Figures as files beside the numbers of their run."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from exfit.errors import ExfitError
from exfit.output.run_figures import PlannedFigures
from exfit.util.files import write

Version = tuple[int, ...]  # of a file: what changes when it is replaced
Announce = Callable[[PlannedFigures, str], None]  # takes all, and the name of the one written


@dataclass(frozen=True)
class FigureFiles:
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
            message = f"{self.main.parent}: the numbers are whole, figures are missing{names}"
            raise KeyboardInterrupt(message) from None

    def _missing(self, left: list[str], announce: Announce) -> Iterator[str]:
        """Draw figures, and yield which are missing, and why; ``left`` holds what is not drawn."""
        from exfit.output import plots

        planned = self.planned()
        left += planned
        for name, figure in planned.items():
            path = self.main.with_name(name)
            try:
                picture = plots.png(figure.draw())
                if _version_of(self.main) != self.version:
                    folder = self.main.parent
                    yield f"{folder}: another run writes there: figures of this one are missing"
                    return
                write(path, picture)
            except ExfitError as fault:
                yield str(fault)
            except Exception as fault:  # whatever it is: the numbers are valid without the figure
                yield f"{path}: not drawn: {type(fault).__name__}: {fault}"
            else:
                announce(planned, name)
            left.remove(name)


def _version_of(path: Path) -> Version:
    """Return what changes when a file is replaced."""
    try:
        state = path.stat()
    except OSError:
        return ()
    return state.st_ino, state.st_mtime_ns, state.st_size
