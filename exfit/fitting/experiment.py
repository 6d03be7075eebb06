"""A test beside its record: what is simulated, filtered, and compared with what was measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.case.schema import BumpTest
from exfit.errors import SimulationError
from exfit.fitting.nuisances import OF_SYSTEM, Nuisance
from exfit.records.record import Record
from exfit.simulation.inputs import Direction, InputStep
from exfit.simulation.simulator import LARGEST_STEP, Response, Simulator
from exfit.util.arrays import Array

if TYPE_CHECKING:
    from exfit.dsp.filtering import Averages, Filtering
    from exfit.fitting.parameters import FreeParameter
    from exfit.fitting.sines import Sine
    from exfit.inference.whitening import Whitening

Counts = NDArray[np.int64]
Values = Mapping[str, float]

MASKED = 0.2  # s, before and after a switching, in which a record is not compared


@dataclass(frozen=True, eq=False)
class Channel:
    """A measured signal (M,) per unit, and the weight of its errors.

    ``noise`` is the standard deviation of its noise, per unit, where that is given; ``scale`` and
    ``offset`` are those that made it per unit. ``residual_deviation`` is the standard deviation of
    its residuals, per unit, where the channels are weighted by it.
    """

    signal: str
    measured: Array
    weight: float = 1.0
    filtering: "Filtering | None" = None
    noise: float | None = None
    scale: float = 1.0
    offset: float = 0.0
    residual_deviation: float | None = None

    def filtered(self, samples: Array) -> Array:
        """Return samples (M,) as they are compared: filtered, without those left out."""
        return samples if self.filtering is None else self.filtering.apply(samples)

    def compared(self, simulated: Array) -> Array:
        """Treat simulated signals (K, M) as the record is, a row (errors,) of each."""
        if self.filtering is None:
            return simulated
        return np.stack([self.filtered(samples) for samples in simulated])

    def slopes(self, samples: Array, slopes: Array) -> Array:
        """Return the derivatives of filtered samples, given those (M, N) of the samples."""
        own = self.filtering
        return slopes if own is None else own.tangents(samples, slopes)

    @cached_property
    def record(self) -> Array:
        """The record as it is compared: filtering it for every evaluation would double the work."""
        return self.filtered(self.measured)

    @property
    def kept(self) -> NDArray[np.bool_]:
        """Mask of the samples to compare, (M,)."""
        if self.filtering is None:
            return np.ones(len(self.measured), dtype=bool)
        return self.filtering.kept

    @property
    def samples(self) -> int:
        """Number of samples to compare."""
        return int(np.count_nonzero(self.kept))

    @property
    def size(self) -> int:
        """Number of errors: one for each of these samples."""
        return self.samples

    @property
    def plain(self) -> bool:
        """Flag of samples that are compared as they are."""
        if self.filtering is None:
            return True
        return self.filtering.filter is None and self.filtering.averaged is None


@dataclass(frozen=True, eq=False)
class Experiment:
    """A simulated test and the channels that it is compared with.

    ``own`` holds the parameters of the system that this test alone has: where its signals start,
    its network. ``sines`` disturb the response. ``whitening`` makes errors white that hold noise of
    driving signals: weights of channels drop out; ``recorded`` are simulator and own with it.
    """

    simulator: Simulator
    channels: tuple[Channel, ...]
    own: Values = field(default_factory=dict)
    nuisances: tuple[Nuisance, ...] = ()
    name: str = ""
    sines: "tuple[Sine, ...]" = ()
    whitening: "Whitening | None" = None
    recorded: tuple[Simulator, Values] | None = None

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals to compare."""
        return tuple(channel.signal for channel in self.channels)

    @property
    def moves(self) -> bool:
        """Flag of a fit that moves what its simulations do not have side by side."""
        moving = ("at", "shift", "step", "drift", "switching", "delay")
        return any(nuisance.kind in moving for nuisance in self.nuisances)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of errors of each channel."""
        return tuple(channel.size for channel in self.channels)

    def parameters(self, values: Values) -> dict[str, float]:
        """Return the parameters of the system."""
        parameters = {**values, **self.own}
        for nuisance in self.nuisances:
            if nuisance.kind in OF_SYSTEM:
                parameters[OF_SYSTEM[nuisance.kind]] = values[nuisance.name]
        return parameters

    def with_inputs(self, values: Values, simulator: Simulator | None = None) -> Simulator:
        """Return the simulator, or another one, with the steps and the delay of the values."""
        simulator = simulator or self.simulator
        if not self.moves:
            return simulator
        steps: list[InputStep] = list(simulator.inputs.steps)
        delay = simulator.delay
        for nuisance in self.nuisances:
            if nuisance.kind in ("at", "switching"):
                for place in range(nuisance.step, nuisance.step + nuisance.count):
                    steps[place] = steps[place]._replace(at=values[nuisance.name])
            elif nuisance.kind in ("step", "drift"):
                size = nuisance.factor * values[nuisance.name]
                steps[nuisance.step] = steps[nuisance.step]._replace(step=size)
            elif nuisance.kind == "delay":
                delay = values[nuisance.name]
        shifts = [
            values[nuisance.name] - steps[nuisance.step].at
            for nuisance in self.nuisances
            if nuisance.kind == "shift"
        ]
        return simulator.with_inputs(tuple(steps), sum(shifts, start=delay))

    def at(self, values: Values) -> tuple[Simulator, dict[str, float]]:
        """Return the simulator with the inputs of the values, and the parameters of the system."""
        return self.with_inputs(values), self.parameters(values)

    def direction(self, move: Values) -> Direction:
        """Return a direction as the simulator takes it."""
        names = self.simulator.system.parameters
        parameters = {name: d for name, d in move.items() if name in names and name not in self.own}
        steps: dict[int, tuple[float, float]] = {}
        delay = 0.0
        for nuisance in self.nuisances:
            d = move.get(nuisance.name, 0.0)
            if d == 0.0:
                continue
            if nuisance.kind in ("at", "switching"):
                for place in range(nuisance.step, nuisance.step + nuisance.count):
                    moved, size = steps.get(place, (0.0, 0.0))
                    steps[place] = (moved + d, size)
            elif nuisance.kind in ("step", "drift"):
                at, step = steps.get(nuisance.step, (0.0, 0.0))
                steps[nuisance.step] = (at, step + nuisance.factor * d)
            elif nuisance.kind in ("delay", "shift"):
                delay += d
            elif nuisance.kind in OF_SYSTEM:
                parameters[OF_SYSTEM[nuisance.kind]] = d
        return Direction(parameters, steps, delay)

    def with_enough_substeps(self, values: Values) -> "Experiment":
        """Return the experiment with sub-steps enough all along the response to the values."""
        steps, delay = self.simulator.inputs.steps, self.simulator.delay
        simulator = self.with_inputs(values).with_enough_substeps(
            self.parameters(values), self.signals
        )
        # moved back: what the values shift must not be shifted twice
        return replace(self, simulator=simulator.with_inputs(steps, delay))

    def coarse(self) -> "Experiment":
        """Return it with the longest steps: for what is small, of which they err by a small share.

        It stays as it is on a literal grid, and where another program simulates.
        """
        own = self.simulator
        if not own.located or own.step >= LARGEST_STEP or own.responder is not None:
            return self
        return replace(self, simulator=own.remade(step=LARGEST_STEP, least=1, rough=True))

    # ---- what is simulated, as a recorder shows it

    @cached_property
    def _averages(self) -> "Averages | None":
        """Short windows of averages of the simulation, None where those are its samples."""
        filterings = [channel.filtering for channel in self.channels]
        if self.simulator.responder is not None or not any(filterings):
            return None
        from exfit.dsp.filtering import averages_of

        return averages_of(filterings)

    @cached_property
    def _reader(self) -> Simulator:
        """The simulator, read where averages need it."""
        averages, own = self._averages, self.simulator
        return own if averages is None else own.at_times(averages.times(own.times))

    def _tests(self, sets: Sequence[Values]) -> list[Simulator] | None:
        """Return the simulator of each set, None where they all have the same."""
        return [self.with_inputs(own, self._reader) for own in sets] if self.moves else None

    def _as_recorded(self, read: Array, axis: int = 0) -> Array:
        """Return simulated signals (..., M, channels, ...) averaged as the recorder does."""
        if self._averages is not None:
            read = self._averages.of(read, axis)
        for k, channel in enumerate(self.channels):
            filtering = channel.filtering
            if filtering is None or (self._averages is not None and filtering.window_between):
                continue
            place = (slice(None),) * (axis + 1) + (k,)
            by_lines = filtering.as_recorded(np.moveaxis(read[place], axis, 0))
            read[place] = np.moveaxis(by_lines, 0, axis)
        return read

    def disturbances(self, values: Values) -> Array:
        """Return the periodic disturbances (M, channels) of the simulated signals."""
        disturbances = np.zeros((len(self.simulator.times), len(self.channels)))
        for sine in self.sines:
            place = self.signals.index(sine.signal)
            disturbances[:, place] += sine.samples(self.simulator.times, values)
        return disturbances

    def _with_sines(self, samples: Array, sets: Sequence[Values]) -> Array:
        """Return signals (K, M, channels) of several sets with their periodic disturbances."""
        if not self.sines:
            return samples
        pairs = zip(samples, sets, strict=True)
        return np.stack([own + self.disturbances(values) for own, values in pairs])

    def _slopes_with_sines(self, slopes: Array, values: Values, moves: Sequence[Values]) -> Array:
        """Return derivatives (M, channels, N) of signals with their periodic disturbances."""
        if not self.sines:
            return slopes
        disturbed = np.array(slopes)
        for sine in self.sines:
            place = self.signals.index(sine.signal)
            disturbed[:, place] += sine.slopes(self.simulator.times, values, moves)
        return disturbed

    def samples(self, values: Values) -> tuple[Array, int]:
        """Return the simulated signals (M, channels) as recorded, and the number of sub-steps."""
        simulator = self.with_inputs(values, self._reader)
        samples, parts = simulator.samples(self.parameters(values), self.signals)
        return self._with_sines(self._as_recorded(samples)[None], [values])[0], parts

    def samples_of_many(self, sets: Sequence[Values]) -> tuple[Array, Counts]:
        """Return the signals (K, M, channels) of several sets of values, and their sub-steps.

        Of a set without a start at rest they are no numbers; see ``Simulator.samples_of_many``.
        """
        systems = [self.parameters(values) for values in sets]
        samples, parts = self._reader.samples_of_many(systems, self.signals, self._tests(sets))
        return self._with_sines(self._as_recorded(samples, 1), sets), parts

    def response_with_derivatives(
        self, values: Values, moves: Sequence[Values]
    ) -> tuple[Array, Array]:
        """Return the simulated signals (M, channels) and their derivatives (M, channels, N).

        Each of ``moves`` (N) is a direction: by how much it changes which value.
        """
        directions = [self.direction(move) for move in moves]
        simulator = self.with_inputs(values, self._reader)
        samples, slopes = simulator.tangents(self.parameters(values), self.signals, directions)
        samples = self._with_sines(self._as_recorded(samples)[None], [values])[0]
        return samples, self._slopes_with_sines(self._as_recorded(slopes), values, moves)

    # ---- what is compared

    def measured(self, channel: Channel, values: Values) -> Array:
        """Return a record (M,) in per unit, by the scale and offset that the values give."""
        of_record = {
            nuisance.kind: values[nuisance.name]
            for nuisance in self.nuisances
            if nuisance.rescales(channel.signal)
        }
        if not of_record:
            return channel.measured
        raw = (channel.measured - channel.offset) / channel.scale
        return raw * of_record.get("scale", channel.scale) + of_record.get("offset", channel.offset)

    def _measured_slopes(
        self, channel: Channel, values: Values, moves: Sequence[Values]
    ) -> Array | None:
        """Return the derivatives of what was measured, if its scale or offset is found."""
        nuisances = [nuisance for nuisance in self.nuisances if nuisance.rescales(channel.signal)]
        if not nuisances:
            return None
        raw = (channel.measured - channel.offset) / channel.scale
        columns = np.zeros((len(raw), len(moves)))
        for nuisance in nuisances:
            by = raw if nuisance.kind == "scale" else np.ones_like(raw)
            for k, move in enumerate(moves):
                columns[:, k] += by * move.get(nuisance.name, 0.0)
        return channel.slopes(self.measured(channel, values), columns)

    def compared(self, samples: Array, sets: Sequence[Values]) -> Array:
        """Return the weighted errors (K, errors) of signals (K, M, channels) of several sets."""
        blocks = []
        for k, channel in enumerate(self.channels):
            ours, theirs = channel.compared(samples[:, :, k]), channel.record
            if any(nuisance.rescales(channel.signal) for nuisance in self.nuisances):
                records = [channel.filtered(self.measured(channel, values)) for values in sets]
                theirs = np.stack(records)
            blocks.append(channel.weight * ours - channel.weight * theirs)
        errors = np.concatenate(blocks, axis=1) if len(blocks) > 1 else blocks[0]
        return errors if self.whitening is None else self.whitening.errors(errors)

    def _compared_slopes(
        self, samples: Array, slopes: Array, values: Values, moves: Sequence[Values]
    ) -> Array:
        """Return the derivatives (errors, N) of weighted errors, of those of the signals."""
        blocks = []
        for k, channel in enumerate(self.channels):
            ours = channel.slopes(samples[:, k], slopes[:, k])
            theirs = self._measured_slopes(channel, values, moves)
            blocks.append(channel.weight * (ours if theirs is None else ours - theirs))
        slopes = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        return slopes if self.whitening is None else self.whitening.slopes(slopes)

    def errors(self, values: Values) -> tuple[Array, int]:
        """Return the weighted errors, one channel behind the other, and the sub-steps."""
        samples, parts = self.samples(values)
        return np.asarray(self.compared(samples[None], [values])[0]), parts

    def errors_of_many(self, sets: Sequence[Values]) -> tuple[Array, Counts]:
        """Return the weighted errors (K, errors) of several sets, as `samples_of_many` has them."""
        samples, parts = self.samples_of_many(sets)
        return self.compared(samples, sets), parts

    def tangents(self, values: Values, moves: Sequence[Values]) -> tuple[Array, Array]:
        """Return the weighted errors and their derivatives (errors, N) along ``moves``."""
        samples, slopes = self.response_with_derivatives(values, moves)
        errors = self.compared(samples[None], [values])[0]
        return errors, self._compared_slopes(samples, slopes, values, moves)

    def tangents_of_many(
        self, sets: Sequence[Values], moves: Sequence[Sequence[Values]]
    ) -> tuple[Array, list[Array], Counts]:
        """Return weighted errors (K, errors), derivatives (errors, N) and sub-steps of sets.

        Each set has its own N ``moves``. Of a set without a start at rest they are no numbers.
        """
        samples, slopes, parts = self._reader.tangents_of_many(
            [self.parameters(values) for values in sets],
            self.signals,
            [[self.direction(move) for move in own] for own in moves],
            self._tests(sets),
        )
        samples = self._with_sines(self._as_recorded(samples, 1), sets)
        slopes = self._as_recorded(slopes, 1)
        derivatives = []
        for response, own, values, move in zip(samples, slopes, sets, moves, strict=True):
            disturbed = self._slopes_with_sines(own, values, move)
            derivatives.append(self._compared_slopes(response, disturbed, values, move))
        return self.compared(samples, sets), derivatives, parts

    def undisturbed_slopes(
        self, signal: str, values: Values, moves: Sequence[Values]
    ) -> tuple[Array, Array]:
        """Return the derivatives (kept, N) of a signal as it is compared, and those of its errors.

        The first are those without its periodic disturbance, simulated less measured the others.
        """
        k = self.signals.index(signal)
        channel = self.channels[k]
        samples, slopes = self.response_with_derivatives(values, moves)
        of_sines = self._slopes_with_sines(np.zeros_like(slopes), values, moves)
        disturbed, of_sine = (
            channel.slopes(samples[:, k], each[:, k]) for each in (slopes, of_sines)
        )
        theirs = self._measured_slopes(channel, values, moves)
        return disturbed - of_sine, disturbed if theirs is None else disturbed - theirs


class Switching(NamedTuple):
    """A jump of a signal that drives a unit: from which sample to which, when (s), by how much."""

    signal: str
    jump: tuple[int, int]
    at: float
    change: float

    @property
    def masked(self) -> tuple[float, float]:
        """The interval in which the record is not compared, s."""
        return self.at - MASKED, self.at + MASKED


Simulated = TypeVar("Simulated", Simulator, Experiment)


def with_enough_substeps(simulated: Simulated, values: Values, place: Path | str) -> Simulated:
    """Return a simulator, or what has one, with sub-steps enough all along the response to values.

    Raises SimulationError, naming the place, where they have no start or no finite response.
    """
    try:
        return simulated.with_enough_substeps(values)
    except SimulationError as fault:
        raise SimulationError(f"{place}: {fault}") from fault


@dataclass(frozen=True)
class ExperimentSetup:
    """A test of a case beside its record, ready to be simulated.

    ``test`` has a number for everything; ``free`` are those of its values that a fit finds,
    ``references`` the files of the test's signals beside the record, by signal;
    ``driving`` are the signals of the record that drive it in place of a plant;
    ``automatic_sines`` are the signals of which residuals may show a periodic disturbance, with
    the range of its frequency, Hz; ``switchings`` those about which it is not compared, ``whole``
    the record with what its masks leave out.
    """

    case: Path
    test: BumpTest
    record: Record
    experiment: Experiment
    free: "tuple[FreeParameter, ...]"
    references: Mapping[str, Record] = field(default_factory=dict)
    driving: tuple[str, ...] = ()
    automatic_sines: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    switchings: tuple[Switching, ...] = ()
    whole: Record | None = None

    @property
    def name(self) -> str:
        """The name of the record."""
        return self.experiment.name

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Signals to compare."""
        return self.experiment.channels

    def with_start_values(self, values: Values) -> dict[str, float]:
        """Return the values with a start for what the fit finds about this record."""
        return {**{parameter.name: parameter.start for parameter in self.free}, **values}

    def with_enough_substeps(self, values: Values) -> "ExperimentSetup":
        """Return the setup with sub-steps enough all along the response to the values."""
        place = f"{self.case}: {self.record.source.name}"
        experiment = with_enough_substeps(self.experiment, self.with_start_values(values), place)
        return replace(self, experiment=experiment)

    def response(self, values: Values) -> Response:
        """Return everything that the simulation gives, on the clock of the record."""
        simulator, parameters = self.experiment.at(self.with_start_values(values))
        return simulator.response(parameters)


def compared(channel: Channel, samples: Array) -> Array:
    """Return samples (M,) as they are compared, nan where they are left out."""
    if channel.filtering is None:
        return samples
    filtered = np.full(len(samples), np.nan)
    filtered[channel.kept] = channel.filtered(samples)
    return filtered
