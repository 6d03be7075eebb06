"""Typical values that a fit rests on: how far what it found would move if they were wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from exfit.case.case import Case
from exfit.fitting.system import system_of
from exfit.simulation.kernels import parameters_used

if TYPE_CHECKING:
    pass

DEVIATION = 0.2  # of a typical value: as far as units of one kind lie apart
MOST_NAMED = 3  # parameters, and values, of a sentence


@dataclass(frozen=True)
class TypicalValue:
    """A typical value that the responses depend on, and what it moves.

    ``shifts`` is by how much each fitted parameter would move, in its own unit, if the value were
    larger by DEVIATION: to first order. ``matters_to`` names those of the unit that would move by
    more than half the width of their interval (twice the standard error, where there is none),
    with that shift in shares of the half width, the largest first.
    """

    value: float
    shifts: Mapping[str, float]
    matters_to: Mapping[str, float]


def parameters_of(case: Case) -> set[str]:
    """Return the parameters that a response of any of the records depends on."""
    own = [system_of(case.seen_from(recording), recording) for recording in case.recordings]
    return {name for system in own or [system_of(case)] for name in parameters_used(system)}


def typical_values_used(case: Case) -> dict[str, float]:
    """Return the typical values that a response of any of the records depends on."""
    used, values = parameters_of(case), case.values()
    return {name: values[name] for name in case.typical() if name in used}


def moved_parameters(typical: TypicalValue, fitted: Mapping[str, float]) -> str:
    """Word the shifts that a typical value would cause where they matter."""
    return first_of(
        [f"{name} by {_share(typical.shifts[name], fitted[name])}" for name in typical.matters_to]
    )


def by_weight(values: Mapping[str, TypicalValue]) -> dict[str, TypicalValue]:
    """Return the typical values that matter, the one that exceeds an interval the most first."""
    mattering = {name: value for name, value in values.items() if value.matters_to}
    order = sorted(mattering, key=lambda name: -max(mattering[name].matters_to.values()))
    return {name: mattering[name] for name in order}


def first_of(names: Sequence[str]) -> str:
    """Return the first few names as "A, B and 3 more"."""
    from exfit.inference.wording import listed

    others = len(names) - MOST_NAMED
    if others <= 1:  # one more is as short as its name
        return listed(names)
    return listed([*names[:MOST_NAMED], f"{others} more"])


def _share(shift: float, value: float) -> str:
    """Return a shift in percent of a value, or as it is where that is 0.

    One of the first order that exceeds the value itself says no more than that it is large.
    """
    from exfit.inference.wording import digits

    if not value:
        return digits(abs(shift))
    share = abs(shift / value)
    return f"{digits(100.0 * share)} %" if share <= 1.0 else "more than 100 %"
