"""The response of a case, with the record beside it where there is one."""

from collections.abc import Mapping
from dataclasses import dataclass

from exfit.case.case import Case
from exfit.features.external.program import ExternalProgram
from exfit.features.external.setups import (
    external_simulator,
    simulated_by,
    simulation_by_twin_notes,
)
from exfit.fitting.build import build_experiment, plain_simulator
from exfit.fitting.setup import with_enough_substeps
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison
from exfit.simulation.simulator import Response
from exfit.verdict.run_quality import rest_notes, simulation_notes


@dataclass(frozen=True)
class SimulationResult:
    """A response of a case, with the record beside it where there is one."""

    response: Response
    comparison: Comparison | None
    notes: tuple[str, ...]


def simulate(
    case: Case, values: Mapping[str, float], program: ExternalProgram | None
) -> "SimulationResult":
    """Simulate a case at values, by a program where one is given."""
    if case.recordings:
        setup = build_experiment(case, case.recordings[0], values).with_enough_substeps(values)
        if program is not None:
            (setup,) = simulated_by(program, case, [setup])
        response = setup.response(values)
        comparison = compare_with_record(setup, "record", values) if setup.channels else None
        notes = [] if comparison is None else rest_notes(setup, comparison)
        at = setup.experiment.parameters(setup.with_start_values(values))
        simulator = setup.experiment.with_inputs(setup.with_start_values(values))
        simulated = simulation_notes(case, simulator, at, response)
        by_twin = simulation_by_twin_notes(case, simulator, response.signals)
        left_out = setup.record.notes
        return SimulationResult(response, comparison, (*left_out, *simulated, *notes, *by_twin))
    simulator, levels = plain_simulator(case, values)
    at = {**values, **levels}
    simulator = with_enough_substeps(simulator, at, case.path)
    if program is not None:
        simulator = external_simulator(program, case, simulator)
    response = simulator.response(at)
    notes = simulation_notes(case, simulator, at, response)
    by_twin = simulation_by_twin_notes(case, simulator, response.signals)
    return SimulationResult(response, None, (*notes, *by_twin))
