"""Whether a case can be trusted before a fit: derivatives, bypasses, sub-steps, a flat run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from exfit.case.case import Case
from exfit.engine.system import time_constants
from exfit.errors import ExfitError
from exfit.fitting.build import build_experiments, planned
from exfit.fitting.experiment import Experiment, ExperimentSetup
from exfit.fitting.problem import free_parameters
from exfit.fitting.program import Program
from exfit.fitting.residuals import Residuals
from exfit.models.blocks import SHORTEST
from exfit.signals import OF_FLAT_RUN
from exfit.simulation.flat_run import FLAT_DRIFT, flat_drift
from exfit.verdict.diagnostics import (
    case_warnings,
    diagram_notes,
    event_warnings,
    record_warnings,
    search_range_notes,
)
from exfit.verdict.run_quality import state_of_rest_notes, typical_notes

Values = Mapping[str, float]

STEPS = tuple(10.0**-k for k in range(1, 9))  # of the scaled parameters
COARSEST = 1e-2  # s: with longer steps derivatives err by more than the differences
AGREEMENT = 1e-5  # relative to a column's largest element: what central differences can show
COLUMN_ROUNDING = 1e-12  # of the largest column
SMALLEST_COLUMN = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Check:
    """What a check found.

    ``deviations`` holds, for each free parameter, the largest difference between the exact column
    of the Jacobian and the central difference at each of STEPS, relative to the column's largest
    element; ``step_error`` is by how much halving every step moves the response (pu). ``warnings``
    are what to correct before a fit. ``from_program`` is by how much, at most and per unit, another
    program differs from its twin, by record, by signal; or from the record where it has no twin:
    then it has no equations either, and nothing else but the notes holds.
    """

    deviations: Mapping[str, tuple[float, ...]]
    bypassed: tuple[str, ...]
    substeps: int
    step: float
    step_error: float
    drift: float
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    from_program: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    has_equations: bool = True

    @property
    def agrees(self) -> bool:
        """Whether every column agrees with its best central difference."""
        return all(min(quotients) <= AGREEMENT for quotients in self.deviations.values())

    @property
    def flat(self) -> bool:
        """Whether a run without a step stays where it starts."""
        return self.drift <= FLAT_DRIFT


def check(case: Case, program: Program | None = None) -> Check:
    """Check a case at its start values; raises ExfitError for input that cannot be used."""
    of_events = tuple(event_warnings(case))
    setups = _ready(case, of_events)
    experiments = [setup.experiment for setup in setups] or [planned(case)]
    free = free_parameters(case, setups)
    names = {parameter.name for parameter in free}
    values = {**{parameter.name: parameter.start for parameter in free}, **case.values()}
    fixed = {name: value for name, value in values.items() if name not in names}
    drift, error, substeps, of_rest = 0.0, 0.0, 1, list[str]()
    for experiment in experiments:
        simulator, at = experiment.at(values)
        of_rest += state_of_rest_notes(simulator, at)
        signals = experiment.signals or OF_FLAT_RUN
        drift = max(drift, flat_drift(simulator, at, signals))
        error = max(error, *simulator.step_errors(at, signals).values())
        substeps = max(substeps, experiment.simulator.substeps(at))
    own_values: Sequence[str] = ()
    from_program: Mapping[str, Mapping[str, float]] = {}
    if program is not None:
        own_values = [*program.own_value_notes()]
        from_program = program.deviations(setups, values)
    residuals = Residuals([*map(_in_fine_steps, experiments)], free, fixed, case.ties)
    first = experiments[0].simulator
    at = experiments[0].parameters(values)
    return Check(
        deviations={} if case.has_no_equations else deviations(residuals),
        bypassed=tuple(name for name in time_constants(first.system) if at[name] < SHORTEST),
        substeps=substeps,
        step=first.step,
        step_error=error,
        drift=drift,
        notes=(
            *typical_notes(case, case.values()),
            *diagram_notes(case),
            *search_range_notes(case),
            *own_values,
            *(note for setup in setups for note in setup.record.notes),
            *dict.fromkeys(of_rest),
        ),
        warnings=(*case_warnings(case), *of_events, *record_warnings(case, setups, case.values())),
        has_equations=not case.has_no_equations,
        from_program=from_program,
    )


def _ready(case: Case, warnings: Sequence[str]) -> tuple[ExperimentSetup, ...]:
    """Return the tests of a case at its values; a fault follows what is wrong with the records."""
    if not case.recordings:
        return ()
    try:
        return tuple(
            setup.with_enough_substeps(setup.with_start_values(case.values()))
            for setup in build_experiments(case)
        )
    except ExfitError as fault:
        if not warnings:
            raise
        raise ExfitError("\n".join([*warnings, str(fault)])) from fault


def _in_fine_steps(experiment: Experiment) -> Experiment:
    simulator = experiment.simulator
    if not simulator.located or simulator.step <= COARSEST:
        return experiment
    return replace(experiment, simulator=simulator.remade(step=COARSEST))


def deviations(residuals: Residuals) -> dict[str, tuple[float, ...]]:
    """Compare the exact Jacobian with central differences at the start, column by column."""
    if not residuals.free:
        return {}
    start = residuals.start
    exact = residuals.exact(start)
    sizes = np.max(np.abs(exact), axis=0)
    # a column of rounding errors belongs to a parameter without effect
    sizes = np.maximum(sizes, COLUMN_ROUNDING * max(float(np.max(sizes)), SMALLEST_COLUMN))
    rows = [
        np.max(np.abs(residuals.differences(start, -h, h) - exact), axis=0) / sizes for h in STEPS
    ]
    return {
        parameter.name: tuple(float(row[k]) for row in rows)
        for k, parameter in enumerate(residuals.free)
    }
