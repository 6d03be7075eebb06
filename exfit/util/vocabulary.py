"""What case, result and report share: words of sources, strategies and searches, criteria."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Literal, NamedTuple

TYPICAL = "typical"
FITTED = "fitted"
PLANNER = "planner"  # of the values of a planner's file, which does not say where it has them from
NOT_STATED = "not stated"  # of a given value without a source
# of several values the first of these is the source of what follows from them all
LEAST_CERTAIN_FIRST = (
    *(TYPICAL, NOT_STATED, PLANNER, FITTED, "measured", "test report", "maker", "certificate"),
    "nameplate",
)
# that a case may give
SOURCES = tuple(word for word in reversed(LEAST_CERTAIN_FIRST) if word != NOT_STATED)
# exact but for a standard error of the case
EXACT_SOURCES = ("measured", "test report", "certificate", "nameplate")
UNSTATED = (TYPICAL, NOT_STATED, PLANNER)  # no data of this unit are behind them
GIVEN_AS = ("uncertain", "exact")  # how given values count

# the functions of the strategies stand in `exfit.estimate.solver`
PHASES: Mapping[str, str] = {
    "lm": "Levenberg-Marquardt",
    "dgn": "damped Gauss-Newton",
    "gn": "Gauss-Newton",
}
FROM_FURTHER_STARTS = "search"  # in the history: the point that the search from them found
WEIGHTED_BY_NOISE = "noise"  # in the history: the point where errors are weighted by its covariance
COMPRESSED_ANEW = "samples"  # in the history: the point at which long records are compressed anew
REFINING_VALUES = "given"  # in the history: given values are fitted that the records refine
ON_FINER_GRID = "step"  # in the history: the point from which on the simulation takes shorter steps
HISTORY_PHASES: Mapping[str, str] = {
    **PHASES,
    FROM_FURTHER_STARTS: "found from further starts",
    WEIGHTED_BY_NOISE: "weighted by the noise of the driving signals",
    COMPRESSED_ANEW: "long records compressed anew at the end of the search",
    REFINING_VALUES: "with given values that the records refine, which are fitted",
    ON_FINER_GRID: "simulated with shorter steps, which the response found needs",
}
STRATEGIES: Mapping[str, str] = {
    "gn": "Gauss-Newton with full steps (a first one that fails is shortened once)",
    "dgn": "damped Gauss-Newton: each step capped, then shortened until Armijo's rule holds",
    "lm": "Levenberg-Marquardt",
    "lm-then-dgn": "lm to reach a better start, then dgn, and lm again where that stalls",
    "auto": "dgn, then lm-then-dgn if noise or validation casts doubt on its match",
    "robust": "gn while it makes progress, then lm",
}
DEFAULT_STRATEGY = "lm-then-dgn"
SEARCHES: Mapping[str, str] = {
    "global": "one run from the start of the case by its strategy, then runs from points "
    "distributed over the bounds; the lowest minimum is the result, or one that the records do not "
    "distinguish from it if only that one passes the validations",
    "local": "the run from the start of the case alone",
}
DEFAULT_SEARCH = "global"
EXPLAINED = "; ".join(f"{name}: {words}" for name, words in STRATEGIES.items())
SEARCHES_EXPLAINED = "; ".join(f"{name}: {words}" for name, words in SEARCHES.items())

ORIGIN_OF_CRITERIA = (
    "The defaults are those of exfit, of the order that operators ask for: a tenth of the change "
    "that was recorded, and less at rest (cf. AEMO, Power System Model Guidelines, on the accuracy "
    "of models). The standard itself gives none (cf. NERC MOD-026-1)"
)


class Quantity(NamedTuple):
    """What a criterion limits the difference of; the unit is "" where it is that of the signal.

    It is one ``of_samples``, of which there may be some in any part of a record, or of a step.
    """

    label: str
    unit: str = ""
    of_samples: bool = False


QUANTITIES: Mapping[str, Quantity] = {
    "rms": Quantity("rms of the difference", of_samples=True),
    "largest": Quantity("largest difference", of_samples=True),
    "mean": Quantity("mean of the difference", of_samples=True),
    "mean_absolute": Quantity("mean magnitude of the difference", of_samples=True),
    "final_value": Quantity("final value"),
    "rise_time": Quantity("rise time 10-90 %", "s"),
    "overshoot": Quantity("overshoot", "%"),
    "peak_time": Quantity("peak time", "s"),
    "settling_time": Quantity("settling time 2 %", "s"),
    "delay": Quantity("delay to 10 %", "s"),
    "damping_ratio": Quantity("damping ratio", "1"),
}

if TYPE_CHECKING:
    QuantityName = str
else:
    QuantityName = Literal[tuple(QUANTITIES)]


class Criterion(NamedTuple):
    """The largest difference of a quantity, simulated less recorded, that is accepted.

    It is ``limit``, in the unit of the quantity, or ``percent`` of what was recorded: of the change
    of the signal, of times, overshoot and damping ratio of their own recorded value. Of both the
    larger counts. Without ``signals`` it holds for those that a record is judged by; ``begin`` and
    ``end`` are s after the event.
    """

    quantity: QuantityName
    signals: tuple[str, ...] = ()
    limit: float | None = None
    percent: float | None = None
    begin: float | None = None
    end: float | None = None


class Criteria(NamedTuple):
    """Acceptance criteria with their ``source``; those of a case are ``given``: they decide."""

    rows: tuple[Criterion, ...] = (
        Criterion("rms", percent=5.0),
        Criterion("final_value", percent=2.0),
        Criterion("overshoot", limit=5.0),
        Criterion("rise_time", limit=0.02, percent=10.0),
        Criterion("peak_time", limit=0.02, percent=10.0),
        Criterion("settling_time", limit=0.02, percent=20.0),
    )
    source: str = ORIGIN_OF_CRITERIA
    given: bool = False


def least_certain(sources: Iterable[str]) -> str:
    """Return the source of a value that follows from others, given theirs."""
    among = set(sources)
    return next((source for source in LEAST_CERTAIN_FIRST if source in among), NOT_STATED)


def by_source(names: Iterable[str], sources: Mapping[str, str]) -> dict[str, list[str]]:
    """Return names by the source of their values, in the order in which these first appear."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(sources.get(name, NOT_STATED), []).append(name)
    return groups
