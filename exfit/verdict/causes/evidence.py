"""What recognisers of causes work with: the evidence of a fit, the pace, and their suspicions."""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, log
from typing import NamedTuple

from exfit import estimate
from exfit.case.case import Case
from exfit.case.changes import place_in_record
from exfit.case.schema import BumpTest, Unknown
from exfit.estimate import Progress
from exfit.fitting.experiment import Channel, Experiment, ExperimentSetup
from exfit.fitting.noise import noise_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.inference.confidence import vagueness
from exfit.results.cause import Cause
from exfit.results.comparisons import Comparison
from exfit.results.influences import RecorderAverages
from exfit.results.intervals.determination import NEEDS_PROFILE
from exfit.results.intervals.value_errors import NONE_REFINED, RefinedValues
from exfit.util.arrays import Array

LEAST_TIME = 30.0  # s
LEAST_GAIN = 10.0  # of the log-likelihood: chi-square 20, beyond what any of twenty trials gains
LEAST_SHARE = 0.25  # of the error beyond the noise: a cause that explains less is not named
TINY_COST = 1e-300  # a record without noise may be matched exactly
CERTAIN, LAST = inf, -inf  # likelihoods of what needs no comparison


class OutOfTime(Exception):
    """The time for causes is over."""


def time_for_causes(given: float | None, search: float) -> float:
    """Return the time (s) for causes: as it is given, or by what the ``search`` took (s)."""
    return max(LEAST_TIME, search) if given is None else given


class Pace:
    """Watches the search for causes: announces its trials, and ends it when its time is over.

    The time (s) is that of ``clock``, processor time by default, from now on. ``untried`` are the
    causes that were not tried, or not to the end; ``interrupted`` whether an interruption left
    them.
    """

    def __init__(
        self,
        seconds: float = inf,
        watch: Callable[[Progress], object] = lambda _: None,
        clock: Callable[[], float] = time.process_time,
    ) -> None:
        self.seconds, self.watch, self.clock = seconds, watch, clock
        self.untried: tuple[str, ...] = ()
        self.interrupted = False
        self._until = clock() + seconds
        self._done, self._total, self._lowest, self._tried = 0, 0, inf, False

    def counts(self, done: int, total: int, cost: float) -> None:
        """Count how many causes are done; ``cost`` is that without any."""
        self._lowest = min(self._lowest, cost)
        self._done, self._total = done, total

    def goes_on(self, cost: float = inf) -> None:
        """Announce the cost of a trial; raises OutOfTime where its time is over."""
        if self.clock() > self._until:
            raise OutOfTime
        self._lowest = min(self._lowest, cost)
        self._announce(self._done if self._tried else 0)
        self._tried = True

    def ended(self) -> None:
        """Announce that all are done, where one needed a trial."""
        if self._tried:
            self._announce(self._total)

    def _announce(self, done: int) -> None:
        self.watch(Progress("causes", done, self._total, self._lowest))

    def stopped(self, untried: tuple[str, ...], interrupted: bool) -> None:
        """Keep what an interruption, or the end of the time, has left untried."""
        self.untried = (*self.untried, *untried)
        self.interrupted = self.interrupted or interrupted

    @property
    def sentence(self) -> str:
        """Causes that were not tried, with the reason; "" where all were."""
        if not self.untried:
            return ""
        why = (
            "interrupted"
            if self.interrupted
            else f"time limit estimate.causes, {self.seconds:.3g} s"
        )
        return f"not tried as causes ({why}): {', '.join(self.untried)}"


class FittedRecord(NamedTuple):
    """A record of a fit: its test as the case has it and as simulated, and the match with it."""

    test: BumpTest
    setup: ExperimentSetup
    comparison: Comparison

    @property
    def steady_until(self) -> float | None:
        """The instant (s) until which the record should be at rest; None where it never is."""
        return self.setup.test.steady if self.setup.test.begin is None else None

    @property
    def given_vt0(self) -> float | None:
        """The voltage (pu) before the first step that the case gives; None where it is fitted."""
        vt0 = self.setup.test.vt0 if self.setup.test.begin is None else None
        return None if isinstance(vt0, Unknown) else vt0


@dataclass(frozen=True, eq=False)
class Evidence:
    """A fit with its records, as the recognisers of causes get it.

    ``solution`` is where the search ended, in scaled parameters; ``records`` are those of the fit,
    ``validation`` the comparisons with those of none. ``uncertainty`` is None where it is not
    known; ``averages`` are those of the recorder that it does not exclude. ``interrupted``: the
    search, or what follows it, was cut short. ``pace`` watches the search for causes.
    """

    case: Case
    residuals: Residuals
    solution: estimate.Result
    records: Sequence[FittedRecord]
    uncertainty: UncertaintyAnalysis | None
    validation: Sequence[Comparison] = ()
    averages: RecorderAverages | None = None
    refined: RefinedValues = NONE_REFINED
    interrupted: bool = False
    pace: Pace = field(default_factory=Pace)

    @cached_property
    def values(self) -> Mapping[str, float]:
        """Every value by name, the fitted ones as they ended."""
        return self.residuals.values(self.solution.x)

    @property
    def weighted_by_noise(self) -> bool:
        """Flag of errors that are weighted by the noise of inputs."""
        return any(each.whitening is not None for each in self.residuals.experiments)

    @property
    def cost(self) -> float:
        """Cost of the fit, where it ended."""
        return self.solution.cost

    @cached_property
    def noise_cost(self) -> float:
        """Cost of the noise of the records alone, as they scatter.

        Errors that are weighted by the noise of what drives them are as large as that predicts.
        """
        if self.weighted_by_noise:
            return 0.5 * self.residuals.count * self.residuals.noise**2
        squares = (
            channel.samples * (channel.weight * noise_of(channel)) ** 2
            for channel in self.residuals.channels
        )
        return 0.5 * sum(squares)

    @property
    def tests(self) -> Iterator[tuple[int, FittedRecord, Experiment]]:
        """The records of the fit by number, with the experiments that it simulates."""
        pairs = zip(self.records, self.residuals.experiments, strict=True)
        return ((number, record, experiment) for number, (record, experiment) in enumerate(pairs))

    @property
    def channels(self) -> Iterator[tuple[int, FittedRecord, Experiment, Channel]]:
        """The channels of these experiments."""
        for number, record, experiment in self.tests:
            for channel in experiment.channels:
                yield number, record, experiment, channel

    def place(self, number: int, key: str) -> str:
        """Return the place of a key of a record or its test in the file of the case."""
        return place_in_record(self.case, number, key)

    def name_of(self, number: int) -> str:
        """Name a record of several as a sentence does; "" where there is only one."""
        return f" of {self.records[number].setup.name}" if len(self.records) > 1 else ""

    @property
    def own(self) -> tuple[str, ...]:
        """The free parameters of the unit, without what belongs to a record, or was given."""
        asked = self.case.free()
        return tuple(free.name for free in self.residuals.free if free.name in asked)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """The parameters of the unit that the records do not limit on both sides."""
        if self.uncertainty is None:
            return self.own
        parameters, profiled = self.uncertainty.confidence.parameters, {*self.own}
        profiled -= {*self.without_profile}
        return tuple(n for n in self.own if n in profiled and not parameters[n].determined)

    @property
    def vague(self) -> dict[str, str]:
        """The parameters of the unit that are determined, but not as a setting is; how well."""
        if self.uncertainty is None:
            return {}
        known, values = self.uncertainty.confidence.parameters, self.values
        words = {name: vagueness(values[name], known[name].interval) for name in self.own}
        return {name: text for name, text in words.items() if text}

    @property
    def without_profile(self) -> tuple[str, ...]:
        """The parameters of the unit whose intervals only a profile shows, which was not run."""
        if self.uncertainty is None:
            return ()
        parameters = self.uncertainty.confidence.parameters
        return tuple(name for name in self.own if parameters[name].why == NEEDS_PROFILE)


class Trial(NamedTuple):
    """The end of a trial: its cost, every value by name, its residuals and where they ended."""

    cost: float
    values: Mapping[str, float]
    residuals: Residuals
    theta: Array


class Suspicion(NamedTuple):
    """A cause, the logarithm of the likelihood of the record with it, and its trial, if any.

    It is that of white noise of unknown size, -M/2 log(cost), less log(M)/2 for each number that
    is found with it (Schwarz 1978).
    """

    cause: Cause
    likelihood: float
    trial: Trial | None = None


def largest_likelihood(suspicions: Iterable[Suspicion]) -> float:
    """Return the largest likelihood of suspicions that are compared by it, -inf without any."""
    finite = (each.likelihood for each in suspicions if isfinite(each.likelihood))
    return max(finite, default=-inf)


Recogniser = Callable[[Evidence], Iterator[Suspicion]]  # yields the causes of one kind


def likelihood(evidence: Evidence, cost: float, numbers: int = 0) -> float:
    """Return the log-likelihood of the record at a cost, with so many more numbers found."""
    samples = max(1, evidence.residuals.samples)
    return -0.5 * samples * log(max(cost, TINY_COST)) - 0.5 * numbers * log(samples)


def suspected(
    evidence: Evidence, trial: Trial | float, numbers: int, cause: Cause, prior: float = 0.0
) -> Iterator[Suspicion]:
    """Yield a cause if the cost of its ``trial`` is so much lower that it is worth naming.

    With a trial by linear theory, its cost, nothing is known of the values with it. ``prior`` is
    the logarithm of how much likelier it is than others, before any record.
    """
    if isinstance(trial, Trial):
        cost, tried = trial.cost, trial
        own = {name: trial.values[name] for name in evidence.own if name in trial.values}
        cause = cause._replace(values=own)
    else:
        cost, tried = trial, None
    gained = likelihood(evidence, cost, numbers) - likelihood(evidence, evidence.cost)
    share = (evidence.cost - cost) / max(evidence.cost - evidence.noise_cost, TINY_COST)
    beyond_noise = evidence.cost > evidence.noise_cost
    if gained > LEAST_GAIN and (share > LEAST_SHARE or not beyond_noise):
        yield Suspicion(cause, likelihood(evidence, cost, numbers) + prior, tried)
