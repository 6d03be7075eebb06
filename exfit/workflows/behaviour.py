"""What fitted values do: without a step, near the state of rest, at the limits."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from exfit.errors import SimulationError
from exfit.fitting.experiment import Experiment
from exfit.fitting.setup import ExperimentSetup
from exfit.results.description import Behaviour, FlatRun, HitLimits, SmallSignalView
from exfit.simulation.limit_hits import limits_hit
from exfit.simulation.small_signal import small_signal
from exfit.workflows.model_check import FLAT_DRIFT, flat_drift

Values = Mapping[str, float]
TestWithValues = tuple[ExperimentSetup, Values]


def behaviour_of(
    tests: Sequence[TestWithValues], others: Iterable[TestWithValues] = ()
) -> Behaviour:
    """Return what values do in tests, and which limits were met in these and in others.

    The tests have sub-steps enough; each has its own values, with what was found about its record.
    """
    return Behaviour(
        flat_runs=tuple(_flat_run(setup.experiment, values) for setup, values in tests),
        small_signal=tuple(_small_signal(tests)),
        limits=tuple(_limits(setup, values) for setup, values in (*tests, *others)),
    )


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
