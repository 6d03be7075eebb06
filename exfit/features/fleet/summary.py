"""A row of the table of a batch: what a case came to, in figures and small curves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf, nan
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.results.facts import UNIT, Facts, stated
from exfit.results.verdict import GOOD, MATCHES
from exfit.util.text import error_of_interval, rounded_value
from exfit.util.typed import IN_FILE

if TYPE_CHECKING:
    from exfit.results.model import FitResult

Array = NDArray[np.float64]
CaseStatus = Literal[
    "done", "failed", "timed out", "crashed", "refused", "no record", "not run"
]  # fmt: skip
FailureKind = Literal["failed", "timed out", "crashed"]

MOST_POINTS = 120  # of a curve in a summary
CURVE_DIGITS = 6  # significant, of a point of a curve


class CaseFacts(NamedTuple):
    """The unit of a case: its name, its place in a planner's file, its models.

    ``unit`` is what ``about`` has under Unit, else the bus and the machine; "" where neither is
    given. ``bus`` and ``machine_id`` are those of ``as_found``.
    """

    unit: str = ""
    bus: int | None = None
    machine_id: str | None = None
    model: str = ""
    machine_model: str = ""


class SummaryParameter(NamedTuple):
    """A value of the unit, with its 95 % interval where it was fitted.

    A side of the interval without a limit is None; ``source`` says where the value comes from,
    which is an earlier fit where it is "fitted" and the parameter is not ``fitted`` here. ``min``
    and ``max`` are infinite where there is no bound.
    """

    value: Annotated[float, nan]
    low: float | None
    high: float | None
    source: str
    unit: str
    fitted: bool
    min: Annotated[float, -inf] = -inf
    max: Annotated[float, inf] = inf

    def rounded(self, number: float) -> str:
        """Return the value, or an end of its interval, as tables print it: within the bounds."""
        return rounded_value(number, error_of_interval(self.low, self.high), self.min, self.max)


class SummaryValidation(NamedTuple):
    """The outcome of records that were not fitted, "" without any; ``rmse``: the largest, pu."""

    outcome: Literal["accepted", "not accepted", ""] = ""
    rmse: float | None = None


@dataclass(frozen=True, eq=False)
class SummaryCurve:
    """A signal of a fitted record beside its simulation: at most 120 points (M,) each, per unit.

    ``time`` is in s; what is left out of the comparison is nan.
    """

    record: str
    signal: str
    time: Array
    measured: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class CaseSummary:
    """The outcome of a case of a batch.

    ``name`` is that of no other case of the batch, ``case`` the path of its file, relative to the
    folder of the batch where there is a way, and ``key`` the folder of its fit there, "" without
    one. ``reason`` says why it is not done, or is the reason of the verdict. ``rmse`` (pu) is by
    signal, the largest over the fitted records; ``parameters`` are all of the unit's, fitted or
    not; ``unresolved`` names those fitted that the records do not determine. ``seconds`` is
    processor time; ``about`` are the facts that the case of a fit states of its unit and test.
    """

    name: str
    case: str
    key: str
    status: CaseStatus
    reason: str = ""
    unit: str = ""
    bus: int | None = None
    machine_id: str | None = None
    model: str = ""
    machine_model: str = ""
    verdict: str = ""
    holds: bool = False
    rmse: Mapping[str, Annotated[float, nan]] = field(default_factory=dict)
    validation: SummaryValidation = field(default_factory=SummaryValidation)
    unresolved: tuple[str, ...] = ()
    parameters: Mapping[str, SummaryParameter] = field(default_factory=dict)
    curves: tuple[SummaryCurve, ...] = field(default=(), metadata=IN_FILE)
    seconds: float = 0.0
    notes: tuple[str, ...] = ()
    about: Facts = field(default_factory=dict)

    @property
    def outcome(self) -> str:
        """The outcome in a few words: the verdict, or why there is none."""
        from exfit.results.side_by_side import NOT_ACCEPTED

        if self.status != "done":
            return self.status
        if self.verdict in (GOOD, MATCHES) and not self.holds:
            return NOT_ACCEPTED
        return self.verdict or "no verdict"

    @property
    def fitted(self) -> dict[str, SummaryParameter]:
        """The parameters that the fit of this case determined, or should have."""
        return {name: value for name, value in self.parameters.items() if value.fitted}


def facts_of(content: Mapping[str, Any]) -> CaseFacts:
    """Read the unit from the content of a case file, faulty or not."""
    about, as_found, plant = (
        section if isinstance(section := content.get(key), Mapping) else {}
        for key in ("about", "as_found", "plant")
    )
    bus, machine_id = as_found.get("bus"), as_found.get("id")
    bus = bus if isinstance(bus, int) and not isinstance(bus, bool) else None
    machine_id = None if machine_id is None else str(machine_id)
    model, machine = _text(content.get("model")), _text(plant.get("machine"))
    return CaseFacts(_unit(about, bus, machine_id), bus, machine_id, model, machine)


def _unit(about: Mapping[Any, Any], bus: int | None, machine_id: str | None) -> str:
    """Name the unit as its case does, else by its place in the planner's file."""
    facts = {str(key): _text(fact) for key, fact in about.items()}
    place = [] if bus is None else [f"bus {bus}"]
    place += [] if machine_id is None else [f"machine {machine_id}"]
    return stated(facts, UNIT) or ", ".join(place)


def _text(content: Any) -> str:
    return str(content) if isinstance(content, str | int | float) else ""


def summary_of(result: "FitResult", key: str, seconds: float) -> CaseSummary:
    """Return the summary of a fit that has ended; ``seconds`` of processor time it took.

    Its name and path are those of its case until a batch gives others.
    """
    from exfit.results.side_by_side import explanation_of

    found = result.as_found
    bus, machine_id = (None, None) if found is None else (found.bus, found.machine_id)
    rmse: dict[str, float] = {}  # the largest where several records have a signal
    for comparison in result.comparisons:
        for signal, channel in comparison.channels.items():
            rmse[signal] = max(channel.rmse, rmse.get(signal, channel.rmse))
    validation = SummaryValidation()
    if result.validation:
        accepted = all(match.accepted for match in result.validation)
        largest = max(match.rmse for match in result.validation)
        validation = SummaryValidation(
            "accepted" if accepted else "not accepted", largest if largest < np.inf else None
        )
    return CaseSummary(
        name=result.name,
        case=result.case.as_posix(),
        key=key,
        status="done",
        reason=explanation_of(result),
        unit=_unit(result.about, bus, machine_id),
        bus=bus,
        machine_id=machine_id,
        model=result.model,
        machine_model=result.machine_model or "",
        verdict=result.verdict.verdict,
        holds=result.holds,
        rmse=rmse,
        validation=validation,
        unresolved=_unresolved(result),
        parameters=_parameters(result),
        curves=tuple(_curves(result)),
        seconds=round(seconds, 3),
        notes=(*result.notes, *(note for match in result.comparisons for note in match.notes)),
        about=dict(result.about),
    )


def _unresolved(result: "FitResult") -> tuple[str, ...]:
    """List the parameters that the records do not determine, as the verdict counts them.

    A parameter whose interval was not looked for, as without a global search, or that has none as
    the response misses the records, is none of these.
    """
    from exfit.results.intervals.determination import NEEDS_PROFILE, UNFINISHED

    if result.knowledge is None or result.verdict.misfit:
        return ()
    return tuple(
        name
        for name, parameter in result.parameters.items()
        if not (parameter.of_record or parameter.determined)
        and parameter.why not in (NEEDS_PROFILE, UNFINISHED)
    )


def _parameters(result: "FitResult") -> dict[str, SummaryParameter]:
    units = {
        part.prefix + symbol: row.unit
        for part in result.parts
        for symbol, row in (part.sheet or {}).items()
    }
    of_records, parameters = result.of_records, {}
    for name, value in result.values.items():
        if name in of_records:
            continue
        source, fitted = result.source_of(name), result.parameters.get(name)
        if fitted is None:
            unit = units.get(name, "")
            parameters[name] = SummaryParameter(value, None, None, source, unit, False)
        else:
            low, high = fitted.interval or (None, None)
            parameters[name] = SummaryParameter(
                value, low, high, source, fitted.unit, True, fitted.min, fitted.max
            )
    return parameters


def _curves(result: "FitResult") -> Iterator[SummaryCurve]:
    """Yield the signals of the fitted records, thinned to their extremes."""
    from exfit.dsp.sampling import kept_rows
    from exfit.results.thinning import rounded

    for comparison in result.comparisons:
        for signal, overlay in comparison.overlays.items():
            drawn = [overlay.measured, overlay.simulated]
            rows = kept_rows(drawn, (MOST_POINTS - 2) // (2 * len(drawn)))
            samples = [rounded(line[rows], CURVE_DIGITS) for line in (comparison.time, *drawn)]
            yield SummaryCurve(comparison.name, signal, *samples)
