"""The response of a case, with the record beside it where there is one."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from exfit.case.case import Case
from exfit.fitting.build import build_experiment, plain_simulator
from exfit.fitting.experiment import with_enough_substeps
from exfit.fitting.program import Program
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
    case: Case, values: Mapping[str, float], program: Program | None
) -> "SimulationResult":
    """Simulate a case at values, by a program where one is given."""
    before, after = tuple[str, ...](), tuple[str, ...]()
    comparison = None
    if case.recordings:
        setup = build_experiment(case, case.recordings[0], values).with_enough_substeps(values)
        if program is not None:
            (setup,) = program.simulated([setup])
        values = setup.with_start_values(values)
        simulator, at = setup.experiment.at(values)
        response = simulator.response(at)
        before = setup.record.notes
        if setup.channels:
            comparison = replace(compare_with_record(setup, values), name="record")
            after = tuple(rest_notes(setup, comparison))
    else:
        simulator, levels = plain_simulator(case, values)
        at = {**values, **levels}
        simulator = with_enough_substeps(simulator, at, case.path)
        if program is not None:
            simulator = program.simulator(simulator)
        response = simulator.response(at)
    simulated = simulation_notes(case, simulator, at, response)
    shown = () if program is None else program.response_notes(simulator, response.signals)
    return SimulationResult(response, comparison, (*before, *simulated, *after, *shown))
