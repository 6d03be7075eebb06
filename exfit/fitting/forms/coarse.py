"""The coarse form of residuals: the same ones, simulated in steps several times as long."""

from dataclasses import replace

from exfit.errors import SimulationError
from exfit.fitting.experiment import Experiment
from exfit.fitting.residuals import Residuals
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
