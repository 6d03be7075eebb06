"""A fit as data: its parameters, its search, and its match with the records.

The classes describe result.json, too: `results.io` writes and reads it by their annotations.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np

from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.inference.confidence import Interval, IntervalMethod, closed
from exfit.plants import LOAD_CONTROLLER
from exfit.results.comparisons import AsFound, Comparison, PhaseEnd
from exfit.results.description import (
    Behaviour,
    GivenInPlace,
    OtherProgram,
    PartDescription,
    RecordedTest,
    source_in_words,
    values_of_part,
)
from exfit.results.influences import WindowSpread, resting_on
from exfit.results.verdict import NO_MATCH, Verdict
from exfit.util.arrays import Array
from exfit.util.text import error_of_interval, rounded_value
from exfit.util.typed import IN_FILE, KEY, plain
from exfit.util.vocabulary import TYPICAL, Criteria

if TYPE_CHECKING:
    from exfit.output.notebook import Figure

OF_PROGRAMME = "test"  # the label among the inputs of a fit that a programme makes


NEAR = 2.0  # times a cost: below it another one is given to a thousandth
KNOWN = 0.5  # of the standard error that a value was given with: the records know it better
AT_TOLERANCE = (6, 7)  # status of a search that ended at a match or gradient that the case names


@dataclass(frozen=True)
class Iteration:
    """One line of a fit's history; line 0 is the start.

    f = 1/2 sum of squared residuals; ``gradient_norm`` of its gradient over the scaled parameters;
    ``damping`` is nu of Levenberg-Marquardt or the step length of Gauss-Newton; ``inner`` counts
    the trials that were rejected: cuts of a step, increases of nu; ``nfev`` and ``njev`` count
    residuals and Jacobians until now. ``capped``: the step that was tried first was held back (by
    the cap of dgn, by the damping of lm), and so was not the full Gauss-Newton step; None at a
    start.
    """

    DERIVED: ClassVar = {"trials": "trials"}

    number: int
    phase: str
    cost: Annotated[float, nan]
    gradient_norm: Annotated[float, nan]
    step_norm: Annotated[float, nan]
    damping: Annotated[float, nan]
    inner: int
    nfev: int
    njev: int
    quality: Annotated[float, nan]
    values: Mapping[str, float]
    capped: bool | None = None

    @property
    def trials(self) -> int:
        """How many points were tried: those that were rejected and the one that was accepted."""
        return self.inner + (self.step_norm > 0.0)


@dataclass(frozen=True)
class FittedParameter:
    """A free parameter after a fit; ``of_record`` where it belongs to a record, not to the unit.

    ``interval`` holds the true value with 95 % confidence; a side without a limit is None, and
    ``why`` is the reason for that, or for no interval at all. ``interval_method`` says how it was
    found: by linear theory, from the profile likelihood, as the hull over several minima, or over
    windows of the records. ``noise_interval`` is that from the noise alone, where the errors of
    what the case gives widen it. ``given_error`` is the standard error of a given value, ``start``,
    that the records refine.
    ``min`` and ``max`` are infinite where there is no bound; ``physical`` says whether the value
    lies in the range of its data sheet.
    """

    value: float
    start: float
    min: Annotated[float, -inf]
    max: Annotated[float, inf]
    at_bound: Literal["min", "max"] | None = None
    of_record: bool = False
    std_error: float | None = None
    interval: Interval | None = None
    interval_method: IntervalMethod | None = None
    why: str | None = None
    unit: str = ""
    meaning: str = ""
    physical: bool = True
    noise_interval: Interval | None = None
    given_error: float | None = None

    @property
    def moved(self) -> float | None:
        """By how many of its standard errors a given value has moved; None of any other."""
        return None if self.given_error is None else (self.value - self.start) / self.given_error

    @property
    def as_given(self) -> bool:
        """Whether the records say little more of a given value than its standard error does."""
        if self.moved is None or self.given_error is None:
            return False
        is_known = self.std_error is not None and self.std_error <= KNOWN * self.given_error
        return abs(self.moved) < 1.0 and not is_known

    @property
    def stderr(self) -> float | None:
        """The standard error, in its unit; None where nothing determines it."""
        return self.std_error

    @property
    def linear_error(self) -> float | None:
        """The standard error where the interval is that of linear theory."""
        return self.std_error if self.interval is not None and not self.interval_note else None

    @property
    def rounding_error(self) -> float | None:
        """The standard error that tables round to, of the interval where that is not linear."""
        known = None if self.linear_error is not None else self.interval
        return self.std_error if known is None else error_of_interval(*known) or self.std_error

    def rounded(self, number: float | None) -> str:
        """Return the value, or an end of its interval, as tables print it: within the bounds."""
        return rounded_value(number, self.rounding_error, self.min, self.max)

    def without_interval(self, why: str) -> "FittedParameter":
        """Return the parameter without its interval, for a reason."""
        return replace(self, interval=None, interval_method=None, why=why)

    @property
    def determined(self) -> bool:
        """Whether the record limits the parameter on both sides."""
        return closed(self.interval)

    @property
    def interval_note(self) -> str:
        """The method of an interval that is not that of linear theory; else ""."""
        method = None if self.interval is None else self.interval_method
        return "" if method is None or method == "linear" else method


class Minimum(NamedTuple):
    """A minimum of the cost: the values there, and how many runs converged to it.

    ``chi_square`` is its height above the lowest one, in variances of the residuals; it is
    ``refuted`` (rejected) where that exceeds the limit of the likelihood ratio at 95 %; minima in
    one ``valley``, 0 for that of the result, count as one. None: not known.
    """

    values: Mapping[str, float]
    cost: float
    starts: int
    chi_square: float | None = None
    refuted: bool | None = None
    valley: int | None = None

    def height(self, cost: float) -> str:
        """Word its cost as a multiple of another one."""
        if not cost > 0.0:
            return f"at a cost of {self.cost:.3g}"
        ratio = multiple(self.cost / cost)
        return "at the same cost" if ratio == "1.000 times" else f"at {ratio} the cost"


def multiple(ratio: float) -> str:
    """Write the ratio of two costs in as many digits as tell them apart."""
    digits = max(0, 3 - len(f"{ratio:.0f}")) if ratio >= NEAR else 3
    return f"{ratio:.{digits}f} times"


@dataclass(frozen=True, eq=False)
class Minima:
    """The distinct minima of a search from several starts, the lowest first.

    ``start_costs`` (starts,) are inf where there is no response, ``end_costs`` (starts,) nan where
    a start was not refined; those of the start of the case come first. ``ways`` (starts,) says what
    each run began with: the strategy of the case, its linear phase, or the model itself.
    """

    DERIVED: ClassVar = {"starts": "starts", "refined": "refined", "failed": "failed"}

    minima: tuple[Minimum, ...]
    start_costs: Annotated[Array, inf]
    end_costs: Annotated[Array, nan]
    ways: tuple[Literal["strategy", "linear", "direct"], ...] = ()

    @property
    def starts(self) -> int:
        """How many starts there were."""
        return len(self.start_costs)

    @property
    def refined(self) -> int:
        """From how many starts the search ended at a finite cost."""
        return int(np.count_nonzero(np.isfinite(self.end_costs)))

    @property
    def failed(self) -> int:
        """How many starts have no response, and led nowhere."""
        return int(np.count_nonzero(np.isinf(self.start_costs) & np.isnan(self.end_costs)))

    def summary(self, cost: float) -> str:
        """Say from where the search started, and where its runs ended; ``cost`` is the result's."""
        further = self.starts - max(1, self.ways.count("strategy"))
        here = sum(minimum.starts for minimum in self.minima if minimum.cost == cost)
        unfinished = int(np.count_nonzero(np.isnan(self.end_costs))) - self.failed
        ends = [f"{here} of {self.starts} runs converge to this {'minimum' if here else 'point'}"]
        ends += self._elsewhere(cost)
        if self.failed:
            ends.append(f"{self.failed} without a response")
        if unfinished > 0:
            ends.append(f"{unfinished} not finished")
        starts = "1 further start" if further == 1 else f"{further} further starts"
        return f"from the start of the case and {starts}: {', '.join(ends)}"

    def _elsewhere(self, cost: float) -> Iterator[str]:
        """Yield the counts of runs to other minima: in the valley, open ones, rejected ones."""
        others = [minimum for minimum in self.minima if minimum.cost != cost]
        along = sum(minimum.starts for minimum in others if minimum.valley == 0)
        if along:
            yield f"{along} to others in its flat valley"
        for minimum in others:
            if minimum.valley != 0 and not minimum.refuted:
                verdict = "" if minimum.refuted is None else " (not rejected)"
                yield f"{minimum.starts} to another {minimum.height(cost)}{verdict}"
        refuted = [minimum for minimum in others if minimum.refuted]
        if len(refuted) == 1:
            yield f"{refuted[0].starts} to another {refuted[0].height(cost)} (rejected)"
        elif refuted:
            runs = sum(minimum.starts for minimum in refuted)
            height = f"{refuted[0].height(cost)} or more"
            yield f"{runs} to {len(refuted)} others {height} (rejected)"


@dataclass(frozen=True, repr=False, eq=False)
class FitResult:
    """A fit: its parameters, its search, and its match with the records.

    ``parameters`` holds the fitted ones under their names in the system: KA, machine.Tpd0.
    ``fixed`` are the exciter's others, and helpers; ``machine``, ``network``, ``stabiliser`` and
    ``governor`` are all values of these parts by symbol, the fitted ones among them; their models
    are None where the case has no such part; ``limiters`` holds those by kind (oel, uel), ``units``
    those of the parts of further units by their prefix (unit2, unit2.machine). Values that follow
    others by ``ties`` are among these.
    ``sources`` says where every value comes from: typical, nameplate ..., not stated;

    ``cost`` is the minimised sum, ``comparisons`` are with each record, ``knowledge`` are errors
    and intervals of the parameters, None where these are not known; ``about`` identifies unit
    and test. ``inputs`` is the SHA-256 of every file by its label,
    ``files`` its name. ``given_values`` are those in place of the case's, ``freed`` those of its
    given values that were fitted, too, ``refined`` those that lie elsewhere within their errors, as
    they were given. ``as_found`` is the model before the test, ``criteria`` are
    those by which a report judges; ``other_program`` is what simulated the records where exfit did
    not; ``windows`` is T'd0 over windows of its records, None unless it is fitted to several steps
    by playback.
    ``behaviour`` and ``as_found`` are None where the fit was interrupted.
    """

    DERIVED: ClassVar = {
        "start_cost": "start_cost",
        "rmse": "rmse",
        "nit": "nit",
        "fit": "comparison",
        "typical": "typical",
    }

    case: Path
    about: Mapping[str, float | str]
    model: str
    strategy: str
    saturation: str
    parameters: Mapping[str, FittedParameter]
    fixed: Mapping[str, float]
    ties: Mapping[str, str]
    machine: Mapping[str, float]
    machine_model: str | None
    network: Mapping[str, float]
    network_model: str | None
    stabiliser: Mapping[str, float]
    stabiliser_model: str | None
    cost: Annotated[float, nan]
    status: int
    message: str
    success: bool
    interrupted: bool
    nfev: int
    njev: int
    simulations: int
    substeps: int
    seconds: float
    notes: tuple[str, ...]
    comparisons: tuple[Comparison, ...] = field(metadata={KEY: "records"})
    minima: Minima | None
    knowledge: UncertaintyAnalysis | None
    validation: tuple[Comparison, ...]
    versions: Mapping[str, str]
    inputs: Mapping[str, str]
    verdict: Verdict
    governor: Mapping[str, float] = field(default_factory=dict)
    governor_model: str | None = None
    limiters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    limiter_models: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    unit_models: Mapping[str, str] = field(default_factory=dict)
    given_values: Mapping[str, GivenInPlace] = field(default_factory=dict)
    refined: Mapping[str, float] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    phase_ends: tuple[PhaseEnd, ...] = ()
    history: tuple[Iteration, ...] = field(default=(), metadata=IN_FILE)
    strategy_given: bool = field(default=True, metadata=IN_FILE)
    search_given: str = field(default="", metadata=IN_FILE)
    parts: tuple[PartDescription, ...] = field(default=(), metadata=IN_FILE)
    tests: tuple[RecordedTest, ...] = field(default=(), metadata=IN_FILE)
    windows: WindowSpread | None = None
    behaviour: Behaviour | None = field(default=None, metadata=IN_FILE)
    files: Mapping[str, str] = field(default_factory=dict, metadata=IN_FILE)
    case_text: str = field(default="", metadata=IN_FILE)
    as_found: AsFound | None = field(default=None, metadata=IN_FILE)
    freed: tuple[str, ...] = field(default=(), metadata=IN_FILE)
    criteria: Criteria = field(default_factory=Criteria, metadata=IN_FILE)
    other_program: OtherProgram | None = field(default=None, metadata=IN_FILE)

    @property
    def name(self) -> str:
        """The name of the case."""
        return self.case.stem

    @property
    def resting_on(self) -> dict[str, tuple[str, ...]]:
        """The given values without data of this unit that widen the interval of each parameter."""
        given = {} if self.knowledge is None else self.knowledge.given_errors
        return resting_on(self.parameters, given, self.sources)

    @property
    def load_controller_model(self) -> str | None:
        """The model of what moves the governor's reference; its data are among the governor's."""
        return next((part.name for part in self.parts if part.kind == LOAD_CONTROLLER), None)

    @property
    def comparison(self) -> Comparison:
        """The comparison with the first record."""
        return self.comparisons[0]

    @property
    def rmse(self) -> float:
        """Root mean square of the error of the first record, per unit."""
        return self.comparison.rmse

    @property
    def nit(self) -> int:
        """Number of iterations."""
        return len(self.history) - 1

    @property
    def start_cost(self) -> float:
        """The cost of the start values."""
        return self.history[0].cost if self.history else nan

    @property
    def values(self) -> dict[str, float]:
        """Every parameter of all parts, those that were fitted last."""
        every = dict(self.fixed)
        of_unit = {"machine": self.machine, "network": self.network}
        added = {"stabiliser": self.stabiliser, "governor": self.governor, **self.limiters}
        for kind, own in {**of_unit, **added, **self.units}.items():
            every |= {f"{kind}.{symbol}": value for symbol, value in own.items()}
        others = {name: value for name, value in every.items() if name not in self.parameters}
        return {**others, **{name: parameter.value for name, parameter in self.parameters.items()}}

    @property
    def own_values(self) -> dict[str, float]:
        """The values of the unit that another case may take over: all of the exciter, fitted ones.

        The others, of machine, network, stabiliser and governor, are as the case has them.
        """
        taken = {**self.parameters, **self.refined, **self.values_of("")}
        own = taken.keys() - self.of_records.keys()
        return {name: value for name, value in self.values.items() if name in own}

    @property
    def of_records(self) -> dict[str, float]:
        """What the fit found about its records: instants and sizes of steps, levels, delays."""
        return {name: each.value for name, each in self.parameters.items() if each.of_record}

    def values_of(self, prefix: str) -> dict[str, float]:
        """Return the values of one part by symbol; the exciter's prefix is empty."""
        return values_of_part(self.values, prefix)

    @property
    def typical(self) -> tuple[str, ...]:
        """The parameters whose values are typical, by name; not those that follow them."""
        return tuple(
            name for name, word in self.sources.items() if word == TYPICAL and name not in self.ties
        )

    def source_of(self, name: str) -> str:
        """Word the source of a parameter's value: fitted, typical, tied ..."""
        return source_in_words(name, self.sources, self.ties)

    @property
    def outcome(self) -> str:
        """How the search ended: at a minimum, at a tolerance of the case, or short of both.

        At the minimum of a fit that is no match it has not converged to anything.
        """
        if self.status in AT_TOLERANCE:
            return "ended at a tolerance"
        if not self.success:
            return "not converged"
        return "converged" if self.describes else "ended at a minimum"

    @property
    def accepted(self) -> bool:
        """Whether every record meets the criteria of the case, or its validation holds."""
        return all(match.accepted for match in (*self.comparisons, *self.validation))

    @property
    def describes(self) -> bool:
        """Whether the response matches every record better than a constant would."""
        own = all(match.judged.describes for match in self.comparisons)
        return own and self.verdict.verdict != NO_MATCH

    @property
    def holds(self) -> bool:
        """Whether the fit matches its records, and its validations are accepted.

        It then ends with exit code 0.
        """
        return not self.interrupted and self.accepted and self.verdict.matches

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data: everything but the history, samples and descriptions.

        It is what ``--json`` prints.
        """
        figures: dict[str, Any] = plain(self)
        return figures

    def plot(self, record: str | None = None) -> "Figure":
        """Return a figure of the fitted response beside a record of the fit or of its validation.

        ``record`` is its name, by default the first. Raises ExfitError for a name of none.
        """
        from exfit.output.notebook import fit_figure

        return fit_figure(self, record)

    def _repr_html_(self) -> str:
        """Return the table that a notebook shows."""
        from exfit.output.notebook import fit_html

        return fit_html(self)

    def __repr__(self) -> str:
        """Return the model, the record, the match and the values in one line."""
        values = ", ".join(
            f"{name}={each.rounded(each.value)}" for name, each in self.parameters.items()
        )
        to = ", ".join(match.record for match in self.comparisons)
        match = f"rmse {self.rmse:.3g} pu, {self.verdict.verdict}"
        return f"<FitResult {self.model} to {to}: {match}; {values}>"
