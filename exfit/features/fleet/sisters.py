"""Similar units, those of the same model, make and rating, side by side; which of them stand out.

Similar units have the same settings, or nearly: one that differs from the others by more than their
spread and its interval was set, built or recorded differently, and should be examined.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from exfit.features.fleet.folder import CaseSummary
from exfit.inference.outliers import FEWEST, Estimates, deviations
from exfit.results.facts import MAKER, MODEL, PLANT, RATED, TYPE, UNIT, stated
from exfit.results.verdict import WITHOUT_INTERVALS

ERRORS_IN_HALF = NormalDist().inv_cdf(0.975)  # standard errors in half of a 95 % interval
ALIKE = (MAKER, MODEL, TYPE, RATED)  # facts that similar units share where they are stated
OUTLIER = "outlier"
UNDETERMINED = "not determined"
WITHOUT_INTERVAL = "no interval"  # that was looked for, as without a global search


def missing_interval(case: CaseSummary, name: str) -> str:
    """Find why a fitted parameter of a case has no closed interval, "" where it has one."""
    parameter = case.fitted[name]
    if case.verdict in WITHOUT_INTERVALS:
        return f"{WITHOUT_INTERVAL}: {case.verdict}"
    if parameter.low is not None and parameter.high is not None and isfinite(parameter.value):
        return ""
    return UNDETERMINED if name in case.unresolved else WITHOUT_INTERVAL


class SisterValue(NamedTuple):
    """A parameter of one of several similar units, with its 95 % interval.

    ``deviation`` from the others is in standard deviations of such a difference, ``probability``
    that of chance alone to let any of them deviate as much; None where that is not known.
    ``remark`` is "outlier", what it lies beyond, or `missing_interval`.
    """

    case: str
    value: float
    low: float | None
    high: float | None
    remark: str = ""
    deviation: float | None = None
    probability: float | None = None

    @property
    def stands_out(self) -> bool:
        """Whether it is an outlier, or lies beyond the interval of another."""
        return self.remark not in ("", UNDETERMINED, WITHOUT_INTERVAL)

    @property
    def is_outlier(self) -> bool:
        """Whether it differs from those of similar units."""
        return self.remark == OUTLIER


@dataclass(frozen=True)
class SisterParameter:
    """A parameter of similar units: their values, in the order of their names.

    ``centre`` and ``spread`` are the mean and the standard deviation of the units without outliers,
    None where fewer than four are determined.
    """

    name: str
    unit: str
    values: tuple[SisterValue, ...]
    centre: float | None = None
    spread: float | None = None

    @property
    def remarkable(self) -> tuple[SisterValue, ...]:
        """Those that stand out."""
        return tuple(value for value in self.values if value.stands_out)


@dataclass(frozen=True)
class SisterGroup:
    """Units of one exciter on one machine model, and of one make and rating where stated.

    ``left_out`` says of cases of the group why they are not compared.
    """

    model: str
    machine_model: str
    facts: tuple[str, ...]
    cases: tuple[CaseSummary, ...]
    parameters: tuple[SisterParameter, ...]
    left_out: dict[str, str]

    @property
    def title(self) -> str:
        """The models, make and rating that the units share, in words."""
        models = self.model + (f" on {self.machine_model}" if self.machine_model else "")
        return ", ".join((models, *self.facts))

    @property
    def outliers(self) -> int:
        """Number of values that differ from those of similar units."""
        return sum(v.is_outlier for parameter in self.parameters for v in parameter.values)


def sisters(cases: Iterable[CaseSummary]) -> tuple[SisterGroup, ...]:
    """Return groups of similar units, by what they share, with their parameters.

    Of a unit with several cases the first that matches its records counts. With four units or more
    outliers are detected by `exfit.inference.outliers`; with fewer only those are named whose 95 %
    intervals do not overlap.
    """
    groups: dict[tuple[str, ...], list[CaseSummary]] = defaultdict(list)
    for case in cases:
        if case.status == "done":
            facts = (" ".join((stated(case.about, fact) or "").split()) for fact in ALIKE)
            shared = (case.model, case.machine_model, *(fact.casefold() for fact in facts))
            groups[shared].append(case)
    built = (_group(members) for _, members in sorted(groups.items()))
    return tuple(group for group in built if len(group.cases) > 1)


def _group(members: Sequence[CaseSummary]) -> SisterGroup:
    compared: dict[tuple[str, ...], CaseSummary] = {}
    left_out: dict[str, str] = {}
    for case in members:
        # a unit by its place, else its name, else all content of its case
        identity: tuple[str, ...] = (case.key,)
        plant, unit = (stated(case.about, fact) for fact in (PLANT, UNIT))
        if case.bus is not None and case.machine_id is not None:
            identity = ("bus", str(case.bus), case.machine_id)
        elif plant and unit:
            identity = (plant, unit)
        if not case.holds:
            left_out[case.name] = case.verdict
        elif identity in compared:
            left_out[case.name] = f"the unit of {compared[identity].name}"
        else:
            compared[identity] = case
    first = members[0]
    having: dict[str, list[CaseSummary]] = defaultdict(list)
    for case in compared.values():
        for name in case.fitted:
            having[name].append(case)
    return SisterGroup(
        first.model,
        first.machine_model,
        tuple(filter(None, (stated(first.about, fact) for fact in ALIKE))),
        tuple(compared.values()),
        tuple(_parameter(name, several) for name, several in having.items() if len(several) > 1),
        left_out,
    )


def _parameter(name: str, cases: Sequence[CaseSummary]) -> SisterParameter:
    values = []
    for case in cases:
        own = case.fitted[name]
        remark = missing_interval(case, name)
        values.append(SisterValue(case.name, own.value, own.low, own.high, remark))
    unit = cases[0].fitted[name].unit
    closed = [v for v in values if v.low is not None and v.high is not None]
    if len(closed) < FEWEST:
        return SisterParameter(name, unit, tuple(_beyond_intervals(values)))
    low, value, high = np.array([(v.low, v.value, v.high) for v in closed], dtype=float).T
    below, above = np.maximum(value - low, 0.0), np.maximum(high - value, 0.0)
    judged = deviations(Estimates(value, below / ERRORS_IN_HALF, above / ERRORS_IN_HALF))
    columns = (judged.deviation, judged.probability, judged.outlier)
    by_case = {
        v.case: v._replace(
            deviation=float(deviation),
            probability=float(probability),
            remark=OUTLIER if outlier else "",
        )
        for v, deviation, probability, outlier in zip(closed, *columns, strict=True)
    }
    every = tuple(by_case.get(v.case, v) for v in values)
    return SisterParameter(name, unit, every, judged.centre, judged.spread)


def _beyond_intervals(values: Sequence[SisterValue]) -> Iterator[SisterValue]:
    """Yield values, those with a remark whose intervals do not meet that of another."""

    def ends_before(one: SisterValue, other: SisterValue) -> bool:  # an open side has no end
        return one.high is not None and other.low is not None and one.high < other.low

    for value in values:
        others = [o.case for o in values if ends_before(value, o) or ends_before(o, value)]
        remark = f"beyond the interval of {', '.join(others)}" if others else value.remark
        yield value._replace(remark=remark)
