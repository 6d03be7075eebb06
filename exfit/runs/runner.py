"""The runner of a plan: one run after the other in this process, whatever becomes of each."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, NamedTuple, Protocol, TypeVar

from exfit.errors import ExfitError
from exfit.util.interrupts import interrupted


class FitSettings(NamedTuple):
    """How cases are fitted, in place of what each says: None for the case's own."""

    strategy: str | None = None
    search: str | None = None


AS_CASES_SAY = FitSettings()


class Planned(Protocol):
    """A part of a plan, by a name that no other has: a fit of a case, a test of a programme."""

    @property
    def name(self) -> str:
        """Its name."""


class EndedRun(Planned, Protocol):
    """A part of a plan that has been run."""

    @property
    def interrupted(self) -> bool:
        """Whether its result is only the best point before an interruption."""


PlannedT = TypeVar("PlannedT", bound=Planned)
RunT = TypeVar("RunT", bound=EndedRun)


@dataclass(frozen=True, eq=False)
class Runs(Generic[RunT]):
    """The runs of a plan, in its order.

    ``failed`` holds the error of each that could not be run or written, by its name; ``not_run``
    names those that an interruption left out.
    """

    runs: tuple[RunT, ...]
    failed: dict[str, str]
    not_run: tuple[str, ...]
    interrupted: bool


def run_in_turn(
    plan: Sequence[PlannedT],
    run: Callable[[PlannedT], RunT],
    finished: Callable[[RunT], None],
) -> Runs[RunT]:
    """Run the parts of a plan; one that raises ExfitError keeps no other from running.

    ``finished`` is called with each that has ended, to show it and to write its files. A
    KeyboardInterrupt ends the plan, and so does a run that was interrupted.
    """
    runs: list[RunT] = []
    failed: dict[str, str] = {}
    ended_early = False
    try:
        for planned in plan:
            try:
                runs.append(run(planned))
                finished(runs[-1])
            except ExfitError as fault:
                failed[planned.name] = str(fault)
                continue
            if runs[-1].interrupted or interrupted():
                ended_early = True
                break
    except KeyboardInterrupt:
        ended_early = True
    ended = {*failed, *(done.name for done in runs)}
    left = tuple(planned.name for planned in plan if planned.name not in ended)
    return Runs(tuple(runs), failed, left, ended_early)


def distinct_names(paths: Sequence[Path]) -> list[str]:
    """Return the stem of each path, behind the name of its folder where several have one stem.

    What is the same even so is numbered; capitals make no difference, as on some disks.
    """
    stems = Counter(path.stem.casefold() for path in paths)
    return numbered(
        f"{path.absolute().parent.name}-{path.stem}"
        if stems[path.stem.casefold()] > 1
        else path.stem
        for path in paths
    )


def numbered(names: Iterable[str]) -> list[str]:
    """Return names with a number behind each that repeats an earlier one."""
    taken: dict[str, str] = {}
    for name in names:
        candidate, number = name, 1
        while candidate.casefold() in taken:
            number += 1
            candidate = f"{name}-{number}"
        taken[candidate.casefold()] = candidate
    return [*taken.values()]
