"""The coarse form of residuals: the same ones, simulated in steps several times as long."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from exfit.errors import SimulationError
from exfit.estimate import Descent
from exfit.fitting.experiment import Experiment
from exfit.fitting.problem import compressed
from exfit.fitting.residuals import Residuals, SideBySide
from exfit.plants import BREAKER, REFERENCES
from exfit.simulation.limits import limits_at_rest
from exfit.simulation.simulator import Simulator

COARSENESS = 5  # times the step: it moves minima by 0.2 standard errors at most in sample cases


def coarse_form(residuals: Residuals) -> Residuals:
    """Return the residuals on a grid of steps that are ``COARSENESS`` times as long.

    The rule of sub-steps holds as it does for the case's own grid: along the response to the start
    values, too. So a model that is fast for its step gains less.
    """
    values = residuals.values(residuals.start)
    experiments = [_on_coarse_grid(experiment, values) for experiment in residuals.experiments]
    return replace(residuals, experiments=experiments)


def _on_coarse_grid(experiment: Experiment, values: dict[str, float]) -> Experiment:
    """Return the same test on the coarse grid; on its own one where that gives no response."""
    own = experiment.simulator
    coarse = Simulator(own.system, own.inputs, own.times, COARSENESS * own.step, delay=own.delay)
    try:
        return replace(experiment, simulator=coarse).with_enough_substeps(values)
    except SimulationError:
        return experiment


Values = Mapping[str, float]

SWITCHED = {"R": "resistance", "X": "reactance"}  # a share of a switching is none


def linear_form(residuals: Residuals) -> Residuals | str:
    """Return the residuals of the small-signal response, or why that has no meaning.

    Each response is that to a small share of what moves the unit, enlarged about its rest to full
    size (`Simulator.small_signal`). Records, weights, priors and ties are the same, and so is all
    that a fit finds about a record. No simulation is needed to make it.
    """
    values = residuals.values(residuals.start)
    for experiment in residuals.experiments:
        reason = _no_meaning(experiment, values)
        if reason is not None:
            several = len(residuals.experiments) > 1
            return f"record {experiment.name}: {reason}" if several else reason
    experiments = [
        replace(experiment, simulator=experiment.simulator.small_signal())
        for experiment in residuals.experiments
    ]
    return replace(residuals, experiments=experiments)


def _no_meaning(experiment: Experiment, values: Values) -> str | None:
    """Reason against a small-signal response of a test, None where it has one."""
    inputs = experiment.simulator.inputs
    switched = [SWITCHED[step.signal] for step in inputs.steps if step.signal in SWITCHED]
    if switched:
        return f"the test switches the {switched[0]} of the network"
    if any(step.signal == BREAKER for step in inputs.steps):
        return "the test opens the breaker"
    driving = [signal for signal in inputs.recorded if signal not in REFERENCES]
    if driving:
        return f"recorded signals drive the simulation: {', '.join(driving)}"
    limits = limits_at_rest(experiment.simulator.system, experiment.parameters(values))
    if limits:
        return f"before the test the unit rests on a limit: {', '.join(limits)}"
    return None


LINEAR_ITERATIONS = 40  # with 25 of them one start in fifty ends elsewhere
COARSE_ITERATIONS = 50  # where limits make the cost creep from kink to kink
NEAR = 1e-3  # of the cost: what the next leg gains in an iteration or two
NEAR_STEP = 1e-6  # units


@dataclass(frozen=True)
class Legs:
    """The descents of a further start, one after the other.

    ``direct`` leave out the linear phase; ``no_linear_phase`` says why it has no meaning, "" where
    it has one: then ``linear`` begin with it.
    """

    direct: tuple[Descent, ...]
    linear: tuple[Descent, ...]
    no_linear_phase: str = ""


def legs_of(residuals: Residuals, own: Descent) -> Legs:
    """Return the legs that end with the ``own`` descent of a case, whose residuals these are.

    Only its bounds and units are those of the others: they do not depend on the case's methods and
    tolerances.
    """
    coarse = coarse_form(residuals)
    linear = linear_form(coarse)
    direct = (_leg(coarse, own, "lm-then-dgn", COARSE_ITERATIONS), own)
    if isinstance(linear, str):
        return Legs(direct, direct, linear)
    return Legs(direct, (_leg(linear, own, "lm", LINEAR_ITERATIONS), *direct))


def _leg(residuals: Residuals, own: Descent, method: str, iterations: int) -> Descent:
    return Descent(
        functions=SideBySide(compressed(residuals)),
        bounds=own.bounds,
        method=method,
        max_iterations=iterations,
        ftol=NEAR,
        xtol=NEAR_STEP,
        x_scale=own.x_scale,
    )
