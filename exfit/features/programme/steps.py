"""The order of a programme's tests: what measures the machine comes before what needs it."""

from dataclasses import dataclass

from exfit.features.programme.case import FIT, Programme
from exfit.features.programme.schema import BUMP, ORDER


@dataclass(frozen=True)
class ProgrammeStep:
    """A test that is run by itself, or all bump tests, which are fitted together.

    ``name`` is that of its folder, ``tests`` are the names of its tests.
    """

    name: str
    kind: str
    tests: tuple[str, ...]


def steps_of(programme: Programme) -> tuple[ProgrammeStep, ...]:
    """Return what a programme runs, in this order; within a kind in that of the file."""
    case = programme.single
    if case is not None:
        names = (recording.name for recording in (*case.recordings, *case.validations))
        return (ProgrammeStep(FIT, BUMP, tuple(names)),)
    alone = [
        ProgrammeStep(test.name, kind, (test.name,))
        for kind in ORDER
        if kind != BUMP
        for test in programme.tests
        if test.kind == kind
    ]
    bumps = tuple(test.name for test in programme.bumps)
    return (*alone, *([ProgrammeStep(FIT, BUMP, bumps)] if bumps else []))
