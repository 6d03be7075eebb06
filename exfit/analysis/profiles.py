"""The profile likelihood of a case's parameters: how far each can move if the others follow."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.nuisance import unit_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import UNIT, fitted, names_of_records, search
from exfit.fitting.uncertainty import UncertaintyAnalysis, uncertainty_at
from exfit.inference import LEVEL
from exfit.util.text import near

Array = NDArray[np.float64]

LOWER = "a lower minimum was met on the way: the profiles are about that one"
ALIKE = 6  # digits: rises that differ less are equal but for rounding
MOST_MINIMA = 3  # that lie each below the other by more than rounding: two are rare

ENDS = {
    estimate.ProfileEnd.RISE: "",
    estimate.ProfileEnd.BOUND: "the record refutes no value down or up to its bound",
    estimate.ProfileEnd.FLAT: "the cost hardly rises",
    estimate.ProfileEnd.FAILED: "there is no response beyond",
    estimate.ProfileEnd.INTERRUPTED: "interrupted",
}


@dataclass(frozen=True, eq=False)
class Profile:
    """The least cost (K,) for given values ``at`` (K,) of a parameter, the others fitted anew.

    ``low`` and ``high`` end the interval, None where the cost does not rise as far before what
    ``ends`` says: at the ends of the interval the cost is ``rise`` above the minimum.
    ``linear`` is the interval of the linear theory, if it has one.
    """

    name: str
    unit: str
    value: float
    at: Array
    costs: Array
    low: float | None
    high: float | None
    ends: tuple[str, str]
    rise: float
    linear: tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles of some parameters about the minimum ``cost``."""

    name: str
    cost: float
    profiles: tuple[Profile, ...]
    notes: tuple[str, ...]
    interrupted: bool

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "cost": self.cost,
            "level": LEVEL,
            "interrupted": self.interrupted,
            "notes": list(self.notes),
            "parameters": {
                one.name: {
                    "value": one.value,
                    "low": one.low,
                    "high": one.high,
                    "ends": list(one.ends),
                    "rise": one.rise,
                    "linear": one.linear,
                    "at": one.at.tolist(),
                    "costs": one.costs.tolist(),
                }
                for one in self.profiles
            },
        }


def profile(
    case: Case,
    names: Iterable[str] = (),
    watch: Callable[[estimate.Progress], None] = lambda _: None,
) -> Profiles:
    """Fit a case and return the profiles of some of its free parameters, all by default.

    ``watch`` is told the progress; an interruption keeps what is done of the profiles, one of the
    fit before them is passed on. Raises ExfitError for input that cannot be used.

    Source: Venzon & Moolgavkar 1988.
    """
    setups, problem = fitted(case)
    residuals = problem.residuals
    free = [one.name for one in residuals.free]
    wanted = tuple(names) or tuple(free)
    unknown = [name for name in wanted if name not in free]
    if unknown:
        raise CaseError(f"{case.path}: {name}: not free; {near(name, free)}" for name in unknown)
    found, minima = search(case, problem, case.estimate.strategy, lambda _: None, watch)
    if found.stop is estimate.Stop.INTERRUPTED or (minima is not None and minima.interrupted):
        raise KeyboardInterrupt
    notes = [] if found.success else [f"the fit did not end at a minimum: {found.message}"]
    x = found.x
    for _ in range(MOST_MINIMA):
        known = uncertainty_at(problem, x, names_of_records(setups))
        rises = {free.index(name): known.rises[name] for name in wanted}
        sides = _sides(problem.compressed, x, rises, watch)
        interrupted = any(estimate.ProfileEnd.INTERRUPTED in one.ends for one in sides)
        if interrupted or not sides[0].moved:
            break
        x = sides[0].x  # its residuals, and so the rise, are others
    if not np.array_equal(sides[0].x, found.x):
        notes.append(LOWER)
    return Profiles(
        name=case.path.stem,
        cost=sides[0].cost,
        profiles=tuple(_profile(case, residuals, known, one) for one in sides),
        notes=tuple(notes),
        interrupted=interrupted,
    )


def _sides(
    residuals: Residuals,
    x: Array,
    rises: Mapping[int, float],
    watch: Callable[[estimate.Progress], None],
) -> list[estimate.CostProfile]:
    """Return the profiles about x, those of like rises side by side; if x is a minimum, of all."""
    alike: dict[str, list[int]] = {}
    for index, rise in rises.items():
        alike.setdefault(f"{rise:.{ALIKE}e}", []).append(index)
    found: dict[int, estimate.CostProfile] = {}
    for indices in alike.values():

        def tell(progress: estimate.Progress, done: int = 2 * len(found)) -> None:
            watch(replace(progress, done=done + progress.done, total=2 * len(rises)))

        profiles = estimate.profiles(
            residuals,
            residuals.exact,
            x,
            indices,
            residuals.bounds,
            rises[indices[0]],
            x_scale=UNIT,
            watch=tell,
        )
        found |= {one.index: one for one in profiles}
        if profiles[0].moved:
            return list(profiles)
        if any(estimate.ProfileEnd.INTERRUPTED in one.ends for one in profiles):
            break
    return [found[index] for index in rises if index in found]


def _profile(
    case: Case, residuals: Residuals, known: UncertaintyAnalysis, found: estimate.CostProfile
) -> Profile:
    """Return a profile in the parameter's own values."""
    one = residuals.free[found.index]
    below, above = found.ends
    return Profile(
        name=one.name,
        unit=case.units().get(one.name, unit_of(one.name)),
        value=one.value(float(found.x[found.index])),
        at=np.array([one.value(float(x)) for x in found.at]),
        costs=found.costs,
        low=None if found.low is None else one.value(found.low),
        high=None if found.high is None else one.value(found.high),
        ends=(ENDS[below], ENDS[above]),
        rise=known.rises[one.name],
        linear=known.confidence.parameters[one.name].interval,
    )
