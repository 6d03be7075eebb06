"""A test beside its record: what is simulated, filtered, and compared with what was measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.averages import Averages, averages_of
from exfit.fitting.nuisances.kinds import OF_SYSTEM, Nuisance
from exfit.fitting.nuisances.sine import Sine
from exfit.simulation.inputs import Direction, InputStep
from exfit.simulation.simulator import Simulator

if TYPE_CHECKING:
    from exfit.dsp.filtering import Filtering
    from exfit.inference.whitening import Whitening

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Values = Mapping[str, float]


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
        if self.filtering is None:
            return slopes
        return self.filtering.tangents(samples, slopes)

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
    its network. ``sines`` are periodic disturbances of the response. ``whitening`` makes errors
    white that hold noise of driving signals: weights of channels drop out.
    """

    simulator: Simulator
    channels: tuple[Channel, ...]
    own: Values = field(default_factory=dict)
    nuisances: tuple[Nuisance, ...] = ()
    name: str = ""
    sines: tuple[Sine, ...] = ()
    whitening: "Whitening | None" = None

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals to compare."""
        return tuple(channel.signal for channel in self.channels)

    @property
    def moves(self) -> bool:
        """Flag of a fit that moves what its simulations do not have side by side."""
        return any(
            nuisance.kind in ("at", "shift", "step", "drift", "switching", "delay")
            for nuisance in self.nuisances
        )

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

    def with_inputs(self, values: Values) -> Simulator:
        """Return the simulator with the steps and the delay that the values give."""
        return self._with_inputs(self.simulator, values)

    def _with_inputs(self, simulator: Simulator, values: Values) -> Simulator:
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

    @cached_property
    def _averages(self) -> Averages | None:
        """Short windows of averages of the simulation, None where those are its samples."""
        filterings = [channel.filtering for channel in self.channels]
        return averages_of(filterings) if self.simulator.responder is None else None

    @cached_property
    def _reader(self) -> Simulator:
        """The simulator, read where averages need it."""
        averages, own = self._averages, self.simulator
        return own if averages is None else own.at_times(averages.times(own.times))

    def _as_recorded(self, read: Array, axis: int = 0) -> Array:
        """Return simulated signals (..., M, channels, ...) as the recorder shows them.

        Where it records averages, these are averaged alike; so are derivatives.
        """
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

    def samples(self, values: Values) -> tuple[Array, int]:
        """Return the simulated signals (M, channels) as recorded, and the number of sub-steps."""
        simulator = self._with_inputs(self._reader, values)
        samples, parts = simulator.samples(self.parameters(values), self.signals)
        return self._with_sines(self._as_recorded(samples), values), parts

    def errors(self, values: Values) -> tuple[Array, int]:
        """Return the weighted errors, one channel behind the other, and the sub-steps."""
        samples, parts = self.samples(values)
        return self.compared(samples, values), parts

    def errors_of_many(self, sets: Sequence[Values]) -> tuple[Array, Counts]:
        """Return the weighted errors (K, errors) of several sets of values, and their sub-steps.

        Of a set without a start at rest they are no numbers; see ``Simulator.samples_of_many``.
        """
        samples, parts = self.samples_of_many(sets)
        return self._compared_many(samples, sets), parts

    def samples_of_many(self, sets: Sequence[Values]) -> tuple[Array, Counts]:
        """Return the signals (K, M, channels) of several sets of values, and their sub-steps.

        Of a set without a start at rest they are no numbers; see ``Simulator.samples_of_many``.
        """
        systems = [self.parameters(values) for values in sets]
        samples, parts = self._reader.samples_of_many(systems, self.signals, self._tests(sets))
        return self._all_with_sines(self._as_recorded(samples, 1), sets), parts

    def compared(self, samples: Array, values: Values) -> Array:
        """Return the weighted errors of simulated signals (M, channels)."""
        return np.asarray(self._compared_many(samples[None], [values])[0])

    def _tests(self, sets: Sequence[Values]) -> list[Simulator] | None:
        """Return the simulator of each set, None where they all have the same."""
        reader = self._reader
        return [self._with_inputs(reader, values) for values in sets] if self.moves else None

    def _compared_many(self, samples: Array, sets: Sequence[Values]) -> Array:
        """Return the weighted errors (K, errors) of signals (K, M, channels) of several sets."""
        blocks = []
        for k, channel in enumerate(self.channels):
            ours = channel.compared(samples[:, :, k])
            if self._moved_channel(channel):
                records = [channel.filtered(self.measured(channel, values)) for values in sets]
                theirs = np.stack(records)
            else:
                theirs = channel.record
            blocks.append(channel.weight * ours - channel.weight * theirs)
        errors = np.concatenate(blocks, axis=1) if len(blocks) > 1 else blocks[0]
        return errors if self.whitening is None else self.whitening.errors(errors)

    def _moved_channel(self, channel: Channel) -> bool:
        return any(nuisance.rescales(channel.signal) for nuisance in self.nuisances)

    def tangents(self, values: Values, moves: Sequence[Values]) -> tuple[Array, Array]:
        """Return the weighted errors and their derivatives (errors, N).

        Each of ``moves`` (N) is a direction: by how much it changes which value.
        """
        samples, slopes = self.response_with_derivatives(values, moves)
        errors = self._compared_many(samples[None], [values])
        return errors[0], self._slopes_of(samples, slopes, values, moves)

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
        samples = self._all_with_sines(self._as_recorded(samples, 1), sets)
        slopes = self._as_recorded(slopes, 1)
        derivatives = [
            self._slopes_of(response, self._slopes_with_sines(own, values, move), values, move)
            for response, own, values, move in zip(samples, slopes, sets, moves, strict=True)
        ]
        return self._compared_many(samples, sets), derivatives, parts

    def _slopes_of(
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

    def response_with_derivatives(
        self, values: Values, moves: Sequence[Values]
    ) -> tuple[Array, Array]:
        """Return the simulated signals (M, channels) and their derivatives (M, channels, N)."""
        directions = [self.direction(move) for move in moves]
        simulator = self._with_inputs(self._reader, values)
        samples, slopes = (
            self._as_recorded(each)
            for each in simulator.tangents(self.parameters(values), self.signals, directions)
        )
        return self._with_sines(samples, values), self._slopes_with_sines(slopes, values, moves)

    def _all_with_sines(self, samples: Array, sets: Sequence[Values]) -> Array:
        """Return signals (K, M, channels) of several sets with their periodic disturbances."""
        if not self.sines:
            return samples
        pairs = zip(samples, sets, strict=True)
        return np.stack([self._with_sines(own, values) for own, values in pairs])

    def _with_sines(self, samples: Array, values: Values) -> Array:
        """Return simulated signals (M, channels) with their periodic disturbances."""
        return samples + self.disturbances(values) if self.sines else samples

    def disturbances(self, values: Values) -> Array:
        """Return the periodic disturbances (M, channels) of the simulated signals."""
        disturbances = np.zeros((len(self.simulator.times), len(self.channels)))
        for sine in self.sines:
            place = self.signals.index(sine.signal)
            disturbances[:, place] += sine.samples(self.simulator.times, values)
        return disturbances

    def _slopes_with_sines(self, slopes: Array, values: Values, moves: Sequence[Values]) -> Array:
        """Return derivatives (M, channels, N) of signals with their periodic disturbances."""
        if not self.sines:
            return slopes
        disturbed = np.array(slopes)
        for sine in self.sines:
            place = self.signals.index(sine.signal)
            disturbed[:, place] += sine.slopes(self.simulator.times, values, moves)
        return disturbed

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
        own = samples[:, k]
        disturbed, of_sine = (channel.slopes(own, each[:, k]) for each in (slopes, of_sines))
        theirs = self._measured_slopes(channel, values, moves)
        return disturbed - of_sine, disturbed if theirs is None else disturbed - theirs

    def direction(self, move: Values) -> Direction:
        """Return a direction as the simulator takes it."""
        own = self.own.keys()
        names = self.simulator.system.parameters
        parameters = {name: d for name, d in move.items() if name in names and name not in own}
        steps: dict[int, tuple[float, float]] = {}
        delay = 0.0
        for nuisance in self.nuisances:
            d = move.get(nuisance.name, 0.0)
            if d == 0.0:
                continue
            at, step = steps.get(nuisance.step, (0.0, 0.0))
            if nuisance.kind in ("at", "switching"):
                for place in range(nuisance.step, nuisance.step + nuisance.count):
                    moved, size = steps.get(place, (0.0, 0.0))
                    steps[place] = (moved + d, size)
            elif nuisance.kind in ("step", "drift"):
                steps[nuisance.step] = (at, step + nuisance.factor * d)
            elif nuisance.kind in ("delay", "shift"):
                delay += d
            elif nuisance.kind in OF_SYSTEM:
                parameters = {**parameters, OF_SYSTEM[nuisance.kind]: d}
        return Direction(parameters, steps, delay)

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
            for k, move in enumerate(moves):
                by = raw if nuisance.kind == "scale" else np.ones_like(raw)
                columns[:, k] += by * move.get(nuisance.name, 0.0)
        return channel.slopes(self.measured(channel, values), columns)

    def with_enough_substeps(self, values: Values) -> "Experiment":
        """Return the experiment with sub-steps enough all along the response to the values."""
        steps, delay = self.simulator.inputs.steps, self.simulator.delay
        simulator = self.with_inputs(values).with_enough_substeps(self.parameters(values))
        # moved back: what the values shift must not be shifted twice
        return replace(self, simulator=simulator.with_inputs(steps, delay))
