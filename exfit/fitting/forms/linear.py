"""The linear form of residuals: of the small-signal response of the same model, at its full size.

Far from a minimum it is the better guide. It has few minima, as no limit is met and saturation
stays where it is at rest, and it leads near those of the model itself.
"""

from collections.abc import Mapping
from dataclasses import replace

from exfit.fitting.experiment import Experiment
from exfit.fitting.residuals import Residuals
from exfit.plants import BREAKER, REFERENCES
from exfit.simulation.limits import limits_at_rest

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
