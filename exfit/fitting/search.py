"""The search for the parameters of a case."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import isfinite

import numpy as np

from exfit import estimate
from exfit.case.case import Case
from exfit.case.schema import Estimate
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import build_experiments
from exfit.fitting.descents import Announce
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.global_search import (
    METHODS_OF_AUTO,
    NO_JUDGE,
    FurtherDescents,
    Judge,
    SearchResult,
    global_search,
    local_search,
    no_doubt,
)
from exfit.fitting.noise import LEAST_NOISE
from exfit.fitting.problem import FitProblem, problem_of, residuals_of
from exfit.fitting.program import Program
from exfit.fitting.residuals import (
    CENTRAL_STEP,
    ONE_SIDED_STEP,
    UNSTABLE,
    Residuals,
    SimulationCounter,
)
from exfit.fitting.uncertainty import linearisation
from exfit.inference.confidence import confidence
from exfit.util.arrays import Array
from exfit.util.text import LARGEST, near
from exfit.util.vocabulary import (
    DEFAULT_STRATEGY,
    SEARCHES,
    STRATEGIES,
)

CUTS = {"parabola": estimate.to_parabola, "half": estimate.to_half}
LIKELIHOOD_RATIO = 3.84  # chi-square of one degree of freedom, 95 %
UNSTABLE_ITERATIONS = 10  # from a start whose response has little to do with the record
ROUNDING_OF_RUNS = 2e3 * np.finfo(float).eps  # of signals, by what scaled parameters do to them
JACOBIANS: Mapping[str, Callable[[Residuals, Array], Array]] = {
    "exact": Residuals.exact,
    "central": Residuals.central,
    "forward": Residuals.forward,
    "backward": Residuals.backward,
}


def fitted(
    case: Case, program: Program | None = None
) -> tuple[tuple[ExperimentSetup, ...], FitProblem]:
    """Return the tests of a case with the records that it is fitted to, and what is made small.

    They are simulated by a ``program`` where one is given. Raises ExfitError where there is none,
    or one that cannot be fitted.
    """
    start = case.values()
    setups = tuple(setup.with_enough_substeps(start) for setup in build_experiments(case, start))
    if program is not None:
        setups = program.simulated(setups)
    problem = problem_of(residuals_of(case, setups, start))
    if program is not None:
        program.try_start(problem.residuals)
    residuals = problem.residuals
    samples, free = residuals.count, len(residuals.free)
    if samples < free:
        raise CaseError(f"{case.path}: record: {samples} samples for {free} free parameters")
    for channel in residuals.channels:
        measured = channel.measured[channel.kept]
        if np.all(measured == measured[0]):
            level = f"{channel.signal} is {measured[0]:g} pu throughout"
            raise CaseError(f"{case.path}: record: {level}: there is no step in it")
    largest = float(np.max(np.abs(problem.compressed(residuals.start))))
    if not largest <= LARGEST:
        raise SimulationError(
            f"{case.path}: the residuals at the start values are too large to be computed with: "
            f"up to {largest:.3g}; check scale, weight and start"
        )
    return setups, problem


def names_of_records(setups: Iterable[ExperimentSetup]) -> tuple[str, ...]:
    """Return the names of all that is found about the records themselves."""
    return tuple(parameter.name for setup in setups for parameter in setup.free)


def checked_strategy(strategy: str) -> str:
    """Return a strategy, or raise CaseError where there is none of this name."""
    if strategy not in STRATEGIES:
        raise CaseError(f"strategy: {strategy!r} is unknown; {near(strategy, STRATEGIES)}")
    return strategy


def checked_search(search: str) -> str:
    """Check the name of a search, or raise CaseError where there is none of this name."""
    if search not in SEARCHES:
        raise CaseError(f"search: {search!r} is unknown; {near(search, SEARCHES)}")
    return search


def search_options(case: Case, search: str | None) -> Estimate:
    """Return the settings of a case, with another kind of search where one is given.

    Raises CaseError where there is no search of this name.
    """
    if search is None:
        return case.estimate
    if case.external is not None and search != "local":
        kind = case.external.type
        text = f"not allowed with plant {kind}, whose runs take long; must be local"
        raise CaseError(f"{case.path}: search: {search}: {text}")
    return case.estimate.model_copy(update={"search": checked_search(search)})


def search(
    case: Case,
    problem: FitProblem,
    method: str,
    announce: Announce,
    progress: Callable[[estimate.Progress], None],
    counter: SimulationCounter | None = None,
    options: Estimate | None = None,
    judge: Judge | None = None,
    program: Program | None = None,
) -> SearchResult:
    """Find the best point from the start of a case and, in a global search, from others.

    ``counter`` counts the simulations of the search alone; ``options`` are by default the case's.
    The ``program`` is the one that simulates the records, if there is one.
    The ``judge`` says on which of the minima that the records do not tell apart the validations
    hold, and to strategy auto why an end may not be the one looked for.
    """
    options = options or case.estimate
    searches = CaseSearches(problem, options, progress, counter, program)
    search_of = local_search if options.search == "local" else global_search
    if method == "auto" and judge is not None:
        return search_of(searches, METHODS_OF_AUTO, judge, announce)
    judge = (judge or NO_JUDGE)._replace(doubt=no_doubt)
    return search_of(searches, (method,), judge, announce)


@dataclass(frozen=True)
class CaseSearches:
    """The searches for the parameters of a case, with its settings."""

    problem: FitProblem
    options: Estimate
    progress: Callable[[estimate.Progress], None]
    counter: SimulationCounter | None
    program: Program | None = None

    @cached_property
    def residuals(self) -> Residuals:
        """What is made small."""
        return self.problem.compressed.counted_by(self.counter)

    @property
    def unbounded(self) -> tuple[str, ...]:
        """The parameters without finite bounds."""
        free = self.residuals.free
        return tuple(each.name for each in free if not isfinite(each.high - each.low))

    def one(self, method: str, announce: Announce) -> estimate.Result:
        """Descend from the start of the case."""
        residuals, options, program = self.residuals, self.options, self.program

        match = None
        if options.good_enough is not None:
            priors = len(residuals.priors)
            share = (residuals.samples + priors) / (residuals.count + priors)
            match = float(options.good_enough.rmse * np.sqrt(share))

        most = options.most_iterations
        follow = options.search != "local" and program is None  # further starts, the better ones
        if follow and isinstance(most, int) and residuals.growth(residuals.start) > UNSTABLE:
            most = min(most, UNSTABLE_ITERATIONS)

        def jacobian(theta: Array) -> Array:
            try:
                return JACOBIANS[options.jacobian](residuals, theta)
            except SimulationError:  # the model has none
                return np.full((1, 1), np.nan)

        def descent(functions: estimate.Functions) -> estimate.Descent:
            own = self._descent(functions, method)
            own = replace(
                own,
                max_iterations=most,
                jacobian_error=jacobian_error(options.jacobian, options.difference_step),
                good_enough=match,
                searches=searches_of(options),
            )
            return own if program is None else program.coarser(own)

        if program is not None and program.has_twin and options.jacobian == "exact":
            return program.descend(residuals, descent, announce)
        functions = estimate.OneByOne(residuals, jacobian)
        return descent(functions).run(residuals.start, announce)

    def refined(self, end: estimate.Result, announce: Announce) -> estimate.Result:
        """Descend from an end with the full tolerances of the case."""
        functions = estimate.OneByOne(self.residuals, self.residuals.exact)
        return self._descent(functions, DEFAULT_STRATEGY).run(end.x, announce)

    def _descent(self, functions: estimate.Functions, method: str) -> estimate.Descent:
        stop, tolerance = self.options.stop, self.options.tolerance
        return estimate.Descent(
            functions=functions,
            method=method,
            bounds=self.residuals.bounds,
            x_scale=self.residuals.units,
            gtol=tolerance.gradient,
            gtol_absolute=tolerance.gradient_absolute,
            xtol=tolerance.step,
            matches=None if stop is None else partial(self.residuals.match, rmse=stop.rmse),
        )

    def further(self, earlier: Sequence[estimate.Result]) -> FurtherDescents:
        """Find the minima from further starts, beside earlier descents."""
        # which no local search needs
        from exfit.fitting.further_starts import MERGED, further_starts

        counter = SimulationCounter()  # the sub-steps are those of a coarse grid
        starts = further_starts(self.problem, self.options.starts, counter)
        *first_legs, last = starts.legs
        minima = estimate.multistart(
            starts.points,
            [*first_legs, replace(last, known=min(end.cost for end in earlier))],
            first_legs=starts.first_legs,
            merged=MERGED,
            workers=self.residuals.threads,
            watch=self.progress,
            earlier=earlier,
        )
        own = [end.history[0].cost for end in earlier]
        start_costs = np.append(own, self.problem.compressed.costs([*starts.points]))
        minima = minima._replace(start_costs=start_costs)
        if self.counter is not None:
            self.counter.add(counter.simulations)
        return FurtherDescents(minima, starts.ways, starts.why_direct)

    def margin(self, lowest: estimate.Result) -> float:
        """Excess of a cost over the lowest up to which the records do not tell the two apart.

        That is the limit of the likelihood ratio, wider where residuals are not white, or what no
        recorder shows where that is more.
        """
        residuals = self.problem.residuals
        try:
            linear = linearisation(self.problem, lowest.x, ())
            variance = confidence(linear).variance
        except SimulationError:  # no finite derivatives
            variance = 2.0 * lowest.cost / max(1, residuals.count - len(residuals.free))
        weights = [channel.weight**2 * channel.samples for channel in residuals.channels]
        return 0.5 * (LIKELIHOOD_RATIO * variance + LEAST_NOISE**2 * sum(weights))


def jacobian_error(jacobian: str, difference_step: float | None = None) -> float | None:
    """Return the error of a Jacobian by differences, as a share of its largest singular value.

    It is what rounding or curvature makes of a direction that no signal sees; None for the exact
    one.
    """
    if jacobian == "exact":
        return None
    central = jacobian == "central"
    step = difference_step or (CENTRAL_STEP if central else ONE_SIDED_STEP)
    return max(ROUNDING_OF_RUNS / step, step**2 if central else step)


def searches_of(options: Estimate) -> estimate.Searches:
    """Make the searches with the settings of a case."""
    dgn = estimate.LineSearch(
        capped=options.dgn.step == "capped", cut=CUTS[options.dgn.cut], armijo=options.armijo
    )
    lm: estimate.TrustRegion | estimate.RatioDamping | estimate.ArmijoDamping
    if options.lm.update == "ratio":
        lm = estimate.RatioDamping(least=options.lm.nu_min)
    elif options.lm.update == "armijo":
        lm = estimate.ArmijoDamping(armijo=options.armijo)
    else:
        lm = estimate.TrustRegion(armijo=options.armijo)
    return estimate.Searches(dgn=dgn, lm=lm)
