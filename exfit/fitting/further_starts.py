"""The further starts of a search, and the legs of a descent from each of them.

These are the linear phase, a coarse grid, the case's own grid. Each only has to come near enough
for the next one: docs/methods.md has what was measured.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from exfit.errors import SimulationError
from exfit.estimate import Descent, spread
from exfit.estimate.problem import TINY, UNSEEN
from exfit.fitting.compression import compressed
from exfit.fitting.experiment import Experiment
from exfit.fitting.global_search import Way
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import UNREACHABLE, UNSTABLE, Residuals, SimulationCounter
from exfit.plants import BREAKER, FAULT, REFERENCES
from exfit.simulation.limits import limits_at_rest
from exfit.util.arrays import Array
from exfit.util.vocabulary import DEFAULT_STRATEGY

DIRECT = 3  # every third start goes without the linear phase, which misleads where limits are met
DRAWN = 8  # times the starts that are taken
MERGED = 3.0  # standard errors: first legs that end so near go on as one; 480 linear ones did
LINEAR_ITERATIONS = 40  # with 25 of them one start in fifty ends elsewhere
COARSENESS = 5  # times the step: it moves minima by 0.2 standard errors at most in sample cases
COARSE_ITERATIONS = 50  # where limits make the cost creep from kink to kink
NEAR = 1e-3  # of the cost: what the next leg gains in an iteration or two
NEAR_STEP = 1e-6  # units
MOST_ITERATIONS = 50  # of a phase of the last leg: what takes more creeps along a valley
TO_DISTINGUISH = 1e-8  # of the cost: what a search may leave where minima are compared
LAST_STEP = 1e-8  # units: no error of a parameter is as small
TOLD = 0.25  # of what all records say of each direction: errors twice as large are near enough
SWITCHED = {"R": "resistance", "X": "reactance"}  # a share of a switching is none


@dataclass(frozen=True)
class FurtherStarts:
    """The points (S, N) from which a search goes, and the legs that the descents from them take.

    ``ways`` says what each descent begins with: "linear" the linear phase, "direct" the model
    itself. ``why_direct`` is the reason where the linear phase has no meaning.
    """

    points: Array
    legs: tuple[Descent, ...]
    ways: tuple[Way, ...]
    why_direct: str

    @property
    def first_legs(self) -> tuple[int, ...]:
        """The leg that each descent begins with."""
        linear = not self.why_direct
        return tuple(int(linear and way == "direct") for way in self.ways)


def further_starts(
    problem: FitProblem, count: int, counter: SimulationCounter | None
) -> FurtherStarts:
    """Return ``count`` starts: that of the case by way of the linear phase, others over the bounds.

    ``counter`` counts the simulations of their descents.
    """
    residuals = problem.residuals.counted_by(counter)
    legs, why_direct = legs_of(residuals, last_leg(problem, counter))
    linear: tuple[Way, ...] = ("linear",)
    direct: tuple[Way, ...] = ("direct",)
    if why_direct:
        # a unit that a record shows was stable: of more points those with a stable rest come first
        points = spread(residuals.bounds, DRAWN * count)
        growing = [residuals.growth(point) > UNSTABLE for point in points]
        points = points[np.argsort(growing, kind="stable")[:count]]
        return FurtherStarts(points, legs, direct * count, why_direct)
    ways = (linear * (DIRECT - 1) + direct) * count
    points = spread(residuals.bounds, count, residuals.start)
    return FurtherStarts(points, legs, ways[:count], "")


def last_leg(problem: FitProblem, counter: SimulationCounter | None = None) -> Descent:
    """Return the descent of a further start on the case's own grid."""
    return Descent(
        functions=problem.compressed.counted_by(counter),
        bounds=problem.residuals.bounds,
        method=DEFAULT_STRATEGY,
        max_iterations=MOST_ITERATIONS,
        ftol=TO_DISTINGUISH,
        xtol=LAST_STEP,
        x_scale=problem.residuals.units,
    )


def legs_of(residuals: Residuals, own: Descent) -> tuple[tuple[Descent, ...], str]:
    """Return the legs that end with the ``own`` descent of a case, whose residuals these are.

    The first is the linear phase, left out where it has no meaning; then the reason follows. Only
    the bounds and units of the last leg are those of the others: they do not depend on the case's
    methods and tolerances. Of many records the others take those that tell enough.
    """

    def leg(form: Residuals, method: str, iterations: int) -> Descent:
        return Descent(
            functions=compressed(form),
            bounds=own.bounds,
            method=method,
            max_iterations=iterations,
            ftol=NEAR,
            xtol=NEAR_STEP,
            x_scale=own.x_scale,
        )

    coarse = coarse_form(telling_form(residuals))
    linear = linear_form(coarse)
    legs = (leg(coarse, "lm-then-dgn", COARSE_ITERATIONS), own)
    if isinstance(linear, str):
        return legs, linear
    return (leg(linear, "lm", LINEAR_ITERATIONS), *legs), ""


def telling_form(residuals: Residuals) -> Residuals:
    """Keep few records, which together tell ``TOLD`` of what all of them do at the start.

    That holds for each direction that the free parameters can take, so that a record that alone
    shows one of them is among them.
    """
    if len(residuals.experiments) == 1:
        return residuals
    try:
        values, moves = residuals.values(residuals.start), residuals.moves(residuals.start)
        slopes = [each.tangents(values, moves)[1] for each in residuals.experiments]
    except UNREACHABLE:
        return residuals
    whole = np.concatenate(slopes)
    whole /= np.maximum(np.linalg.norm(whole, axis=0), TINY)
    if not np.isfinite(whole).all():
        return residuals
    rows, sizes, _ = np.linalg.svd(whole, full_matrices=False)
    rows = rows[:, sizes > UNSEEN * sizes[0]]
    parts = np.split(rows, np.cumsum([len(own) for own in slopes])[:-1])
    shares = {k: own.T @ own for k, own in enumerate(parts)}  # of all records that is the identity

    def told(some: Iterable[int]) -> Array:
        """Share of each direction that some records tell, as far as it is needed."""
        whole = np.sum([shares[k] for k in some], axis=0)
        return np.asarray(np.minimum(np.linalg.eigvalsh(whole), TOLD))

    kept = list[int]()
    while not kept or np.min(told(kept)) < TOLD:
        left = [k for k in shares if k not in kept]
        kept.append(max(left, key=lambda k: np.sum(told([*kept, k]))))
    return replace(residuals, experiments=[residuals.experiments[k] for k in sorted(kept)])


def coarse_form(residuals: Residuals) -> Residuals:
    """Return the residuals on a grid of steps that are ``COARSENESS`` times as long.

    The rule of sub-steps holds as it does for the case's own grid: along the response to the start
    values, too. So a model that is fast for its step gains less. A test stays on its own grid where
    the coarse one gives no response.
    """
    values, experiments = residuals.values(residuals.start), list[Experiment]()
    for experiment in residuals.experiments:
        own, coarse = experiment.simulator, experiment.coarse()
        if not own.located:
            longer = own.remade(step=COARSENESS * own.step, least=1, rough=True)
            coarse = replace(experiment, simulator=longer)
        try:
            experiments.append(coarse.with_enough_substeps(values))
        except SimulationError:
            experiments.append(experiment)
    return replace(residuals, experiments=experiments)


def linear_form(residuals: Residuals) -> Residuals | str:
    """Return the residuals of the small-signal response, or why that has no meaning.

    Far from a minimum it is the better guide. It has few minima, as no limit is met and saturation
    stays where it is at rest, and it leads near those of the model itself.

    Each response is that to a small share of what moves the unit, enlarged about its rest to full
    size (`Simulator.small_signal`). Records, weights, priors and ties are the same, and so is all
    that a fit finds about a record. No simulation is needed to make it.
    """
    values = residuals.values(residuals.start)
    for experiment in residuals.experiments:
        inputs, reason = experiment.simulator.inputs, ""
        changed = [step.signal for step in inputs.steps]
        switched = [SWITCHED[signal] for signal in changed if signal in SWITCHED]
        driving = [signal for signal in inputs.recorded if signal not in REFERENCES]
        if switched:
            reason = f"the test switches the {switched[0]} of the network"
        elif BREAKER in changed:
            reason = "the test opens the breaker"
        elif not {*FAULT}.isdisjoint(changed):
            reason = "the test has a fault at the terminals"
        elif driving:
            reason = f"recorded signals drive the simulation: {', '.join(driving)}"
        elif limits := limits_at_rest(experiment.simulator.system, experiment.parameters(values)):
            reason = f"before the test the unit rests on a limit: {', '.join(limits)}"
        if reason:
            several = len(residuals.experiments) > 1
            return f"record {experiment.name}: {reason}" if several else reason
    experiments = [
        replace(experiment, simulator=experiment.simulator.small_signal())
        for experiment in residuals.experiments
    ]
    return replace(residuals, experiments=experiments)
