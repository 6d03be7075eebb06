"""What fitted values do: without a step, near the state of rest, at the limits."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from exfit.errors import SimulationError
from exfit.fitting.experiment import Experiment, ExperimentSetup
from exfit.results.description import Behaviour, FlatRun, HitLimits, SmallSignalView
from exfit.simulation.inputs import Inputs
from exfit.simulation.limits import limits_hit
from exfit.simulation.simulator import Simulator
from exfit.simulation.small_signal import small_signal

Values = Mapping[str, float]
TestWithValues = tuple[ExperimentSetup, Values]

FLAT_SECONDS = 60.0
FLAT_TIMES = np.linspace(0.0, FLAT_SECONDS, 601)
FLAT_DRIFT = 1e-9  # pu


def behaviour_of(
    tests: Sequence[TestWithValues], others: Iterable[TestWithValues] = ()
) -> Behaviour:
    """Describe a run without a step, the state near rest and the limits met, by values in tests.

    The tests have sub-steps enough; each has its own values, with what was found about its record.
    """
    return Behaviour(
        flat_runs=tuple(_flat_run(setup.experiment, values) for setup, values in tests),
        small_signal=tuple(_small_signal(tests)),
        limits=tuple(_limits(setup, values) for setup, values in (*tests, *others)),
    )


def flat_drift(simulator: Simulator, values: Values, signals: Sequence[str] = ("vt",)) -> float:
    """Measure the stray of signals from their start (pu) in FLAT_SECONDS without any change.

    ``values`` are the parameters of the simulator's system. Raises SimulationError where the start
    is no rest.
    """
    still = Simulator(simulator.system, Inputs(0.0, FLAT_SECONDS, ()), FLAT_TIMES, simulator.step)
    flat, _ = still.samples(values, tuple(signals))
    return float(np.max(np.abs(flat - flat[0])))


def _flat_run(experiment: Experiment, values: Values) -> FlatRun:
    simulator, parameters = experiment.with_inputs(values), experiment.parameters(values)
    try:
        drift = flat_drift(simulator, parameters, experiment.signals)
    except SimulationError:
        drift = float("nan")
    return FlatRun(experiment.name, drift, drift <= FLAT_DRIFT)


def _small_signal(tests: Sequence[TestWithValues]) -> Iterator[SmallSignalView]:
    """Yield the small-signal view of each state of rest that the tests start from."""
    alike: dict[object, list[tuple[Experiment, Values]]] = {}
    for setup, values in tests:
        experiment = setup.experiment
        parameters = experiment.parameters(values)
        key = (experiment.simulator.system, tuple(sorted(parameters.items())))
        alike.setdefault(key, []).append((experiment, values))
    for same in alike.values():
        names, (first, values) = tuple(experiment.name for experiment, _ in same), same[0]
        if "vref" not in first.simulator.system.inputs:
            why = "the recorded signals drive the machine: there is no loop"
            yield SmallSignalView(names, None, why)
            continue
        try:
            view = small_signal(first.simulator.system, first.parameters(values))
            yield SmallSignalView(names, view)
        except SimulationError as fault:
            yield SmallSignalView(names, None, str(fault))


def _limits(setup: ExperimentSetup, values: Values) -> HitLimits:
    at = setup.with_start_values(values)
    simulator, parameters = setup.experiment.with_inputs(at), setup.experiment.parameters(at)
    return HitLimits(setup.name, limits_hit(simulator, parameters))
