"""Responses to other values than the fitted ones: on the way to them, and before the test."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Annotated

from exfit.results.comparisons import Comparison
from exfit.util.typed import KEY


@dataclass(frozen=True, eq=False)
class AsFound:
    """The model before the test and its responses; ``source`` is "" for the case's own start.

    ``bus``, ``machine_id`` and ``file``, whose path is relative to the case, are its place in a
    planner's base, None where the case does not say it.
    ``values`` are all of its parameters, named as in the system; ``comparisons`` those with the
    fitted records and then with the others, empty for the reason ``why``.
    """

    source: str
    model: str
    values: Mapping[str, float]
    comparisons: tuple[Comparison, ...] = field(default=(), metadata={KEY: "records"})
    why: str = ""
    bus: int | None = None
    machine_id: str | None = field(default=None, metadata={KEY: "id"})
    file: str | None = None

    @property
    def is_stated(self) -> bool:
        """Whether the case says what was in the planner's base."""
        return bool(self.source)


@dataclass(frozen=True, eq=False)
class PhaseEnd:
    """Where a phase of the descent from the start of the case handed over to the next.

    ``iteration`` is its number in the history, ``values`` are those of the free parameters and of
    all others of the exciter there, ``comparisons`` the response to them beside each record.
    """

    phase: str
    next_phase: str
    iteration: int
    cost: Annotated[float, nan]
    values: Mapping[str, float]
    comparisons: tuple[Comparison, ...] = field(default=(), metadata={KEY: "records"})
