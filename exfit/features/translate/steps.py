"""Steps of the reference in which two models are compared: in which plant, how large, what shows.

The plant is that of a fit, with its machine, and without noise, recorder or stabiliser of a test.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from exfit.case.other_model import ALONE
from exfit.case.peek import section_of, stabiliser_inputs
from exfit.engine.system import System
from exfit.engine.trace import evaluate
from exfit.errors import ExfitError, SimulationError
from exfit.fitting.experiment import Channel, Experiment
from exfit.models import GOVERNORS, LOAD_CONTROLLERS, MODELS, STABILISERS, find
from exfit.models.load_control import controlled
from exfit.models.machines import find_machine
from exfit.models.sheet import Model, typical
from exfit.plants import (
    GOVERNOR,
    MACHINE,
    NETWORK,
    SATURATION,
    STABILISER,
    VT0,
    Equipment,
    PlantKind,
    Stabilised,
)
from exfit.plants.infinite_bus import INFINITE_BUS
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.results.model import FitResult
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.limits import at_rest, equation_limits, limits_hit, traced
from exfit.simulation.simulator import Simulator
from exfit.util.arrays import Array

Values = Mapping[str, float]

STEPS = (0.01, 0.05, 0.10)  # pu of the reference, up and down, with the breaker open
STEPS_ON_LOAD = (0.01, 0.05)  # a larger one may lose synchronism
STEP_AT = 0.5  # s
DURATION = 10.0  # s after the step
SPACING = 0.005  # s
INTEGRATION_STEP = 0.002  # s
EFD_WEIGHT = 0.1  # of the error of efd, as a share of its range, beside that of vt
RATED_VOLTAGE = 1.0  # pu, at the start
DEFAULT_MACHINE = "GENROU"
SIGNALS = ("vt", "efd")


@dataclass(frozen=True)
class Placed:
    """A model in a plant: its system, and all values of that by name."""

    model: Model
    system: System
    values: Values

    def resolved(self) -> dict[str, float]:
        """Return the values of the model's parameters, those computed at the start as computed."""
        graph = traced(self.system)
        start = at_rest(graph, self.values)
        computed = {
            name: float(start[node])
            for name, node in zip(self.system.setpoints, graph.r, strict=True)
        }
        symbols = [row.symbol for row in self.model.sheet]
        return {name: computed.get(f"{name}0", self.values[name]) for name in symbols}

    def limited_signals(self) -> dict[str, float]:
        """Find the value at rest of the signal behind each limit, by the limit's name."""
        graph = traced(self.system)
        limiters = equation_limits(self.system)
        values = evaluate([limiter.value for limiter in limiters], at_rest(graph, self.values))
        return {limiter.limit: float(values[limiter.value]) for limiter in limiters}

    def at_least_zero(self) -> bool:
        """Tell whether the exciter's voltage cannot become negative, whatever the data say."""
        return any(limiter.limit == "0" for limiter in equation_limits(self.system))


class StepResponse(NamedTuple):
    """A response to a step: vt and efd (M,) pu by name, and the limits that it met."""

    signals: Mapping[str, Array]
    limits: tuple[str, ...]


@dataclass(frozen=True)
class StepPlant:
    """A plant in which steps are made: the machine's breaker is open, or it feeds a network."""

    kind: PlantKind
    equipment: Equipment
    values: Values

    @property
    def label(self) -> str:
        """What it is, in words."""
        return "on load" if self.kind.on_load else "open circuit"

    def system(self, model: Model) -> System:
        """Return an exciter in this plant."""
        return self.kind.build(self.equipment._replace(exciter=model))

    def placed(self, model: Model, values: Values) -> Placed:
        """Return an exciter in this plant with its values."""
        return Placed(model, self.system(model), {**self.values, **values})

    def simulator(self, model: Model, step: float) -> Simulator:
        """Make the simulation of a step of the reference (pu)."""
        times = times_of_steps()
        inputs = Inputs(0.0, float(times[-1]), (InputStep(STEP_AT, step),))
        return Simulator(self.system(model), inputs, times, INTEGRATION_STEP)

    def response(self, model: Model, values: Values, step: float) -> StepResponse:
        """Simulate a step; raises SimulationError where there is no response."""
        parameters = {**self.values, **values}
        simulator = self.simulator(model, step).with_enough_substeps(parameters)
        signals = simulator.response(parameters, SIGNALS).signals
        names = (
            f"{hit.signal} >= 0" if hit.limit == "0" else hit.limit
            for hit in limits_hit(simulator, parameters)
        )
        return StepResponse(signals, tuple(dict.fromkeys(names)))


def times_of_steps() -> Array:
    """Return the clock of all responses (M,), s."""
    end = STEP_AT + DURATION
    return np.linspace(0.0, end, round(end / SPACING) + 1)


@dataclass(frozen=True, eq=False)
class ReferenceStep:
    """A step of the reference (pu) in a plant, and the response of the source to it."""

    plant: StepPlant
    step: float
    source: StepResponse

    def experiment(self, target: Model, values: Values) -> Experiment:
        """Make the comparison of a target with the source: errors as shares of step and range."""
        signals = self.source.signals
        weights = {"vt": 1.0 / abs(self.step), "efd": EFD_WEIGHT / float(np.ptp(signals["efd"]))}
        channels = tuple(Channel(name, signals[name], weight) for name, weight in weights.items())
        simulator = self.plant.simulator(target, self.step)
        name = f"{100.0 * self.step:+g} % {self.plant.label}"
        experiment = Experiment(simulator, channels, self.plant.values, name=name)
        try:
            return experiment.with_enough_substeps({**self.plant.values, **values})
        except SimulationError:  # these values may not have a response, others will
            return experiment


@dataclass(frozen=True)
class TranslationTask:
    """What is translated, and in which steps; ``own`` are the values of the source's parameters."""

    result: FitResult
    source: Model
    target: Model
    own: Values
    plants: tuple[StepPlant, ...]
    steps: tuple[ReferenceStep, ...]

    @property
    def placed(self) -> Placed:
        """The source on open circuit."""
        return self.plants[0].placed(self.source, self.own)

    def place(self, values: Values) -> Placed:
        """Return the target on open circuit."""
        return self.plants[0].placed(self.target, values)

    @property
    def fitted(self) -> tuple[ReferenceStep, ...]:
        """The steps in which the source meets no limit; where there is none, all."""
        return tuple(step for step in self.steps if not step.source.limits) or self.steps


def translation_task(result: FitResult, target: Model, sizes: Sequence[float]) -> TranslationTask:
    """Plan the steps up and down of each size (pu), with the responses of the fitted exciter.

    A user's own model is run only from the file that was fitted. Raises ExfitError where one of
    both is no exciter, its file is missing or another, or a value is missing, SimulationError
    where the source has no response to a step.
    """
    if result.model == result.machine_model:
        raise ExfitError(f"the fit is of {result.model}, without an exciter")
    sha256 = result.inputs.get("model", "")
    if sha256:
        name = section_of(result.case_text, result.case, "model") or result.files.get("model", "")
        source = find(str(name), result.case.parent, sha256)
    elif result.model in MODELS:
        source = MODELS[result.model]
    else:
        raise ExfitError(f"{result.model} is not in the catalogue")
    if ALONE in (source.name, target.name):
        raise ExfitError(f"{ALONE} is not an exciter: it has no machine")
    values = result.values_of("")
    missing = [row.symbol for row in source.sheet if row.symbol not in values]
    if missing:
        raise ExfitError(f"no value of {', '.join(missing)} in the result")
    own = {row.symbol: values[row.symbol] for row in source.sheet}
    plants = step_plants(result)
    steps = tuple(
        ReferenceStep(plant, step, plant.response(source, own, step))
        for plant in plants
        for size in sizes or (STEPS_ON_LOAD if plant.kind.on_load else STEPS)
        for step in (abs(size), -abs(size))
    )
    return TranslationTask(result, source, target, own, plants, steps)


def step_plants(result: FitResult) -> tuple[StepPlant, ...]:
    """Return the plants in which two models are compared: of a fit on load both."""
    machine = find_machine(result.machine_model or DEFAULT_MACHINE)
    given = {**typical(machine.sheet), **result.machine}
    values = {MACHINE + symbol: value for symbol, value in given.items()} | {VT0: RATED_VOLTAGE}
    form = SATURATION[result.saturation]
    plants = [StepPlant(OPEN_CIRCUIT, Equipment(None, machine, form), values)]
    network = network_of(result)
    if network:
        model = STABILISERS.get(result.stabiliser_model or "")
        heard = stabiliser_inputs(result.case_text, result.case)
        equipment = Equipment(
            None,
            machine,
            form,
            given=frozenset(network),
            stabiliser=None if model is None else Stabilised(model, heard or model.inputs),
            governor=_governor(result),
        )
        parts = {NETWORK: network, STABILISER: result.stabiliser, GOVERNOR: result.governor}
        own = {
            prefix + symbol: value
            for prefix, data in parts.items()
            for symbol, value in data.items()
        }
        plants.append(StepPlant(INFINITE_BUS, equipment, {**values, **own}))
    return tuple(plants)


def _governor(result: FitResult) -> Model | None:
    governor = GOVERNORS.get(result.governor_model or "")
    controller = LOAD_CONTROLLERS.get(result.load_controller_model or "")
    if governor is None or controller is None:
        return governor
    return controlled(governor, controller)


def network_of(result: FitResult) -> dict[str, float]:
    """Return the network of a fit, or of the first of its records that has one with a source.

    That of a grid event has none: there the recorded voltage is played in.
    """
    networks: list[dict[str, float]] = [dict(result.network)]
    for test in result.tests:
        own = {} if test.network is None else test.network
        networks.append({symbol: parameter.value for symbol, parameter in own.items()})
    for network in networks:
        starts = "P" in network and not network.keys().isdisjoint({"Q", "E"})
        if starts and (network["R"], network["X"]) != (0.0, 0.0):
            return network
    return {}
