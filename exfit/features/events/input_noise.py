"""The noise of recorded signals that drive a simulation: errors in variables.

A simulation that recorded signals drive propagates their noise into its response, so that it is in
the errors of all channels at once, coloured by the unit. To first order these errors are

    e = J n_u - n_y

with n_y the noise of the channels, n_u that of the driving signals, and J the response to each of
their samples. Weighting errors by this covariance is maximum likelihood where the true values of
the driving signals are unknown at every sample, and eliminated. Derivatives by the parameters have
the same noise as the errors where they are taken at the recorded signals, which biases the
parameters: they are taken at the likeliest true ones, u - E[n_u | e], whose errors are independent
of e.

Source: Seber & Wild 1989, sections 2.1.4 and 10.2 (generalised least squares; errors in variables);
Britt & Luecke 1973, Technometrics 15, 233-247 (derivatives at the estimated true values).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from exfit.dsp.noise import noise
from exfit.dsp.sampling import sampling_of
from exfit.estimate import LocalMinimum, Progress, Stop
from exfit.fitting.channel_weights import as_recorded
from exfit.fitting.descents import descent_near, stopped
from exfit.fitting.experiment import Channel, Experiment, ExperimentSetup
from exfit.fitting.global_search import SearchResult
from exfit.fitting.noise import LEAST_NOISE
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals
from exfit.inference.whitening import ROWS_BEFORE, PropagatedNoise, Whitening, whitening
from exfit.plants import NETWORK, VT0
from exfit.plants.parts import initial
from exfit.records.record import Record
from exfit.signals import OF_CURRENT_PHASOR
from exfit.simulation.inputs import SplinedInput
from exfit.simulation.simulator import Simulator
from exfit.util.arrays import Array, Complex, median_step
from exfit.util.text import digits, listed

ORDER = 4  # of the differences that show the noise of a signal which swings
WINDOW = 0.5  # variance of a window, of the time between samples squared: C37.118.1, class M
F0 = f"{NETWORK}f0"
FAR_OUT = 4.0  # times the median: no noise
PULSE = 1e-5  # pu or rad: the response to it is linear, and far above rounding
LONGEST_BETWEEN_PULSES = 1.0  # s: the response changes little while the unit swings
FEWEST_PULSES, MOST_PULSES, ROUGH_PULSES = 9, 33, 3
ROUGH_ROWS = 200  # of errors before that tell what noise comes next
SAMPLES_AT_ENDS = 4  # of a record, where a spline through them is another: each has a pulse
Rows = NDArray[np.intp]
Values = Mapping[str, float]
MOST_ERRORS = 5000  # of a record: the covariance of more takes too much memory and time
MOST_PASSES = 5
FAR = 0.1  # of a scaled parameter: the response to noise is not the same
NEAR = 1e-3  # of one: rough weights have their minimum no nearer
SMALL_BIAS = 0.1  # standard errors: a smaller change of it matters to no interval
UNSEEN = 1e-9  # of the largest singular value: rounding
REFUTED = 4.0  # times the least cost: such a minimum stays rejected with any weights
NOT_SMALL = 0.5  # standard errors: the error of a larger bias matters
TURN = 2.0 * np.pi  # rad
NOISE, BIAS = "the noise of the driving signals", "the bias by that noise"
NOT_WEIGHTED = (
    f"{NOISE} biases the parameters, and the intervals do not include all "
    "of it: it cannot be weighted"
)


class RestNoise(NamedTuple):
    """Effect of noise of the samples (R,) at ``rest`` on all errors (M,), by what they decide.

    That is the level at which the simulation starts and, for an angle, how fast it turns:
    ``moved`` (M, R) is without what the samples do themselves.
    """

    rest: Rows
    moved: Array


class RestLevels(NamedTuple):
    """What the samples (R,) at ``rest`` decide of a signal, by ``weights`` (K, R).

    The K ``courses`` (K, M) over all its samples are its level and, for an angle, an even turn.
    """

    rest: Rows
    courses: Array
    weights: Array


def noise_of_inputs(simulator: Simulator) -> dict[str, float]:
    """Return the standard deviation of the noise of the recorded inputs, by their scatter."""
    recorded = simulator.inputs.recorded
    return {name: noise(own.samples, ORDER) for name, own in recorded.items()}


def noise_of_channel(channel: Channel) -> float:
    """Return the standard deviation of the noise of a channel, per unit: given, or estimated."""
    if channel.noise is not None:
        return channel.noise
    return max(noise(channel.measured[channel.kept], ORDER), LEAST_NOISE)


def propagated_noise(
    setup: ExperimentSetup, values: Values, rough: bool = False
) -> PropagatedNoise:
    """Return the noise of the errors of a test: that of its channels and what inputs carry.

    The response to noise is that of the simulation, linear in it, about the values. A ``rough`` one
    is much the same all along the record.
    """
    experiment = setup.experiment.coarse()
    by_rest = rest_noise(setup, experiment, values)
    simulator = experiment.with_inputs(values)
    deviations, powers = noise_of_inputs(simulator), phasor_in_powers(setup.record)
    carried = dict[str, Array]()
    for signal, deviation in deviations.items():
        responses = responses_to_samples(experiment, values, signal, rough)
        if signal in by_rest:
            responses[:, by_rest[signal].rest] += by_rest[signal].moved
        carried[signal] = responses * deviation
    columns, own, first = list[Array](), list[Array](), 0
    no_rest = RestNoise(np.arange(0), np.zeros((sum(experiment.sizes), 0)))
    for channel in experiment.channels:
        rows, kept = np.arange(first, first + channel.size), np.flatnonzero(channel.kept)
        first += channel.size
        variance = noise_of_channel(channel) ** 2
        rest, by_level = by_rest.get(channel.signal, no_rest)
        # at rest the mean of the errors is zero: with a variance of zero, rounding of the
        # record and of the simulation would have all the weight; no parameter moves it
        by_level = np.array(by_level)
        by_level[rows[np.isin(kept, rest)]] = 0.0
        for signal, in_power in powers.items() if channel.signal in ("p", "q") else ():
            part = in_power.real if channel.signal == "p" else in_power.imag
            noise_there = part * deviations[signal]
            variance -= float(np.mean(noise_there[kept] ** 2))
            carried[signal][rows, kept] -= channel.weight * noise_there[kept]
            carried[signal][:, rest] += by_level * noise_there[rest]
        variance = max(variance, LEAST_NOISE**2)
        columns.append(np.sqrt(variance) * by_level)
        own.append(np.full(channel.size, channel.weight**2 * variance))
    window = effect_of_window(setup, experiment, values)
    together = [*carried.values(), *columns, window[:, None]]
    return PropagatedNoise(np.concatenate(own), np.hstack(together))


def phasor_in_powers(record: Record) -> dict[str, Complex]:
    """By how much (M,) noise of the voltage and its angle is in p + jq of the same phasors.

    None is where fourth differences of the powers do not show it.
    """
    signals = {name: np.nan_to_num(samples) for name, samples in record.signals.items()}
    if "p" not in signals or "q" not in signals:
        return {}
    vt: Complex = np.maximum(signals["vt"], LEAST_NOISE).astype(complex)
    power: Complex = signals["p"] + 1j * signals["q"]
    in_power, phasor = {"vt": power / vt}, np.log(vt)
    if "angle" in signals:
        phasor += 1j * np.unwrap(signals["angle"])
        in_power["angle"] = 1j * power
    shown = np.diff(power, ORDER)
    own = power[ORDER // 2 : -ORDER // 2] * np.diff(phasor, ORDER)
    usual = np.all([np.abs(each) < FAR_OUT * np.median(np.abs(each)) for each in (shown, own)], 0)
    follows = np.vdot(own[usual], shown[usual]).real
    return in_power if follows > 0.5 * np.vdot(own[usual], own[usual]).real else {}


def effect_of_window(setup: ExperimentSetup, experiment: Experiment, values: Values) -> Array:
    """Effect on all errors (M,) of a window of usual length, from which a PMU takes its phasors.

    A window of variance s^2 lowers a phasor that turns at w by (s w)^2 / 2: the voltage that
    drives, and the current; powers by twice that. What it does else passes through a linear unit
    as through the record.
    """
    record, parameters = setup.record, experiment.parameters(values)
    if not {"angle", "frequency"} & record.signals.keys():  # no phasors drive
        return np.zeros(sum(experiment.sizes))
    if "angle" in record.signals:
        turning = np.gradient(np.unwrap(record.signals["angle"]), record.time)
    else:
        turning = TURN * (record.signals["frequency"] - parameters[F0])
    square = turning**2
    if setup.test.steady is not None:
        square -= np.mean(square[record.time < setup.test.steady])
    lower = 0.5 * WINDOW * median_step(record.time) ** 2 * square
    simulator, usual = experiment.with_inputs(values), experiment.samples(values)[0]
    own = lower * (parameters[VT0] + simulator.inputs.recorded["vt"].samples)
    scale = PULSE / max(float(np.max(np.abs(own))), PULSE)
    moved = replace(experiment, simulator=with_added(simulator, {"vt": scale * own}))
    response = (moved.samples(values)[0] - usual) / scale
    for k, channel in enumerate(experiment.channels):
        if channel.signal in OF_CURRENT_PHASOR:  # of which powers are the product with the voltage
            share = lower if channel.signal == "it" else 2.0 * lower
            response[:, k] -= share * channel.measured
    return errors_of(experiment, [each[None] for each in response.T])[:, 0]


def responses_to_samples(
    experiment: Experiment, values: Values, signal: str, rough: bool = False
) -> Array:
    """Response of each error to each sample (D,) of a recorded input: (M, D).

    Pulses at some samples show it, and between two of them the response is that of both, each as
    much later or earlier.
    """
    simulator = experiment.with_inputs(values)
    places = pulse_places(simulator.inputs.recorded[signal].time, rough)
    pulses = PULSE * np.eye(len(simulator.inputs.recorded[signal].time))[places]
    tests = [*(with_added(simulator, {signal: pulse}) for pulse in pulses), simulator]
    sets = [experiment.parameters(values)] * len(tests)
    samples, _ = simulator.samples_of_many(sets, experiment.signals, tests)
    responses = (samples[:-1] - samples[-1]) / PULSE
    return errors_of(experiment, [between_pulses(own.T, places) for own in responses.T])


def with_added(simulator: Simulator, added: Mapping[str, Array]) -> Simulator:
    """Return a simulator with something added to the samples (M,) of recorded inputs."""
    recorded = {
        signal: replace(own, samples=own.samples + added[signal]) if signal in added else own
        for signal, own in simulator.inputs.recorded.items()
    }
    return simulator.remade(inputs=replace(simulator.inputs, recorded=recorded))


def pulse_places(time: Array, rough: bool = False) -> Rows:
    """Return the samples (M,) at which pulses show the response."""
    wanted = int(np.ptp(time) / LONGEST_BETWEEN_PULSES) + 1
    count, last = min(max(wanted, FEWEST_PULSES), MOST_PULSES), len(time) - 1
    ends = np.arange(SAMPLES_AT_ENDS)
    if rough:
        count, ends = ROUGH_PULSES, ends[:0]
    inside = np.linspace(SAMPLES_AT_ENDS, last - SAMPLES_AT_ENDS, count)
    places = np.concatenate([ends, np.round(inside), last - ends])
    return np.unique(places.clip(0, last).astype(np.intp))


def between_pulses(pulses: Array, places: Rows) -> Array:
    """Return the responses (M, M) to a pulse at each sample, of those (P, M) at some places."""
    count = pulses.shape[1]
    still = np.zeros_like(pulses)
    delayed = sliding_window_view(np.hstack([still, pulses, still]), count, axis=1)[:, ::-1]
    every = np.arange(count)
    before = np.clip(np.searchsorted(places, every, "right") - 1, 0, len(places) - 2)
    since, until = every - places[before], places[before + 1] - every
    share = (since / (since + until))[:, None]
    earlier, later = delayed[before, count + since], delayed[before + 1, count - until]
    seen = every < (count - until)[:, None]  # beyond, the record ends before the later one's
    responses: Array = np.where(seen, (1.0 - share) * earlier + share * later, earlier)
    return responses


def rest_levels(
    setup: ExperimentSetup, experiment: Experiment, driving: Mapping[str, object]
) -> dict[str, RestLevels]:
    """What the samples at rest decide of each signal that drives or is compared."""
    steady, time = setup.test.steady, setup.record.time
    if steady is None:
        return {}
    levels, rest = {}, np.flatnonzero(time < steady)
    for signal in dict.fromkeys([*driving, *experiment.signals]):
        given = signal == "vt" and setup.test.vt0 is not None
        if given or not (signal in driving or initial(signal) in experiment.own):
            continue
        angle = driving.get(signal) if signal == "angle" else None
        turning = isinstance(angle, SplinedInput) and not angle.integrated
        # what turns may do so evenly at rest (`fitting.event`)
        level = np.ones(len(time))
        courses = np.stack([level, time - time[0]] if turning else [level])
        levels[signal] = RestLevels(rest, courses, np.linalg.pinv(courses[:, rest].T))
    return levels


def with_noise(
    experiment: Experiment,
    simulator: Simulator,
    levels: Mapping[str, RestLevels],
    added: Mapping[str, Array],
    sizes: Mapping[str, Array],
) -> Experiment:
    """Return an experiment with noise ``added`` to samples (M,) of recorded signals.

    By ``sizes`` (K,) the levels at rest are others: the simulation starts there, and what drives is
    taken from there.
    """
    own, added = {**experiment.own}, {**added}
    for signal, size in sizes.items():
        level = initial(signal)
        if level in own:
            own[level] += size[0]
        if signal in simulator.inputs.recorded:
            added[signal] = added.get(signal, 0.0) - size @ levels[signal].courses
    driving = {signal: added[signal] for signal in added.keys() & simulator.inputs.recorded.keys()}
    channels = tuple(
        replace(channel, measured=channel.measured + added.get(channel.signal, 0.0))
        for channel in experiment.channels
    )
    noisy = with_added(simulator, driving)
    return replace(experiment, own=own, simulator=noisy, channels=channels)


def rest_noise(
    setup: ExperimentSetup, experiment: Experiment, values: Values
) -> dict[str, RestNoise]:
    """Effect of noise at rest by the levels of the signals, beside what it does itself."""
    simulator = experiment.with_inputs(values)
    levels = rest_levels(setup, experiment, simulator.inputs.recorded)
    usual, noises = experiment.samples(values)[0], {}
    for signal, own in levels.items():
        moved = []
        for size in PULSE * np.eye(len(own.courses)):
            there = with_noise(experiment, simulator, levels, {}, {signal: size})
            change = (there.samples(values)[0] - usual) / PULSE
            moved.append(errors_of(experiment, [each[None] for each in change.T])[:, 0])
        noises[signal] = RestNoise(own.rest, np.transpose(moved) @ own.weights)
    return noises


def errors_of(experiment: Experiment, changes: Sequence[Array]) -> Array:
    """Return changes of signals, (K, M) of each channel, as those of the errors (errors, K)."""
    pairs = zip(experiment.channels, changes, strict=True)
    each = [channel.weight * channel.compared(change).T for channel, change in pairs]
    return np.concatenate(each)


def weighted_search(
    problem: FitProblem,
    setups: Sequence[ExperimentSetup],
    found: SearchResult,
    proceed: Callable[[FitProblem, SearchResult, Array], SearchResult],
    watch: Callable[[Progress], object] = lambda _: None,
) -> tuple[FitProblem, SearchResult]:
    """Weight a problem by the noise of the driving signals, and continue the search with it.

    ``found`` is the search of the problem without it, ``setups`` its tests as fitted; ``proceed``
    searches on, by the weighted problem, from a point (N,). Rough weights lead near the minimum;
    where it still moves by much, weights and bias are computed again from the better point. Minima
    far above the best one stay as they are. Where errors cannot be weighted, or at an
    interruption, problem and search remain, with a note. Raises SimulationError where there is no
    response.
    """
    own, theta = problem.residuals, found.best.x
    reason = why_not_weighted(setups, robust=own.robust is not None)
    if reason is not None:
        return problem, _noted(found, [f"{NOT_WEIGHTED} {reason}"])
    try:
        bias, cost = np.zeros_like(theta), float(own.costs([theta])[0])
        watch(Progress("weighing", 0, MOST_PASSES, cost))
        at = theta = descent_near(whitened(own, setups, theta, rough=True), theta, NEAR).x
        white = whitened(own, setups, at)
        for further in range(1, MOST_PASSES):
            watch(Progress("weighing", further, MOST_PASSES, cost))
            if _far(theta, at):
                at, white = theta, whitened(own, setups, theta)
            before = bias
            unbiased, bias = without_bias(white, setups, theta)
            end = descent_near(unbiased, theta)
            theta = end.x
            if not _far(theta, at) and np.max(np.abs(bias - before)) < SMALL_BIAS:
                break
        watch(Progress("weighing", MOST_PASSES, MOST_PASSES, cost))
        notes = [*noise_notes(white, theta, bias)]
        if found.minima is not None:
            minima = []
            for place, minimum in enumerate(found.minima.minima):
                if minimum.cost <= REFUTED * found.best.cost:
                    near = end if place == found.place else descent_near(unbiased, minimum.x)
                    minimum = LocalMinimum(near.x, near.cost, minimum.starts, near)
                minima.append(minimum)
            found = found._replace(minima=found.minima._replace(minima=tuple(minima)))
    except KeyboardInterrupt:
        return problem, found._replace(best=stopped(found.best, Stop.INTERRUPTED))
    weighted = FitProblem(unbiased, unbiased)
    found = proceed(weighted, found, theta)
    return weighted, _noted(found, notes)


def _noted(found: SearchResult, notes: Sequence[str]) -> SearchResult:
    """Return a search with notes on the noise in place of those of an earlier weighting."""
    others = (note for note in found.notes if not note.startswith((NOISE, BIAS)))
    return found._replace(notes=(*others, *notes))


def _far(there: Array, here: Array) -> bool:
    """Test whether the response to noise differs between two points (N,)."""
    return bool(np.max(np.abs(there - here)) >= FAR)


def why_not_weighted(setups: Sequence[ExperimentSetup], robust: bool = False) -> str | None:
    """Reason why errors cannot be weighted by the noise of driving signals; None if they can."""
    if robust:
        return "with a robust loss"
    for setup in setups:
        if setup.test.steady is None:
            return "without a rest before the event"
        if not all(channel.plain for channel in setup.channels):
            return "with a filter, or a recorder that averages"
        sampling = sampling_of(setup.record.time)
        if sampling.gaps or not sampling.even:
            return "where samples are missing or uneven"
        if sum(setup.experiment.sizes) > MOST_ERRORS:
            return f"in a record with more than {MOST_ERRORS} samples of all signals compared"
    return None


def errors_by_noise(setup: ExperimentSetup, values: Values) -> dict[str, float]:
    """Return the rms of the errors of each signal by noise alone, per unit; none is known: {}."""
    if why_not_weighted([setup]) is not None:
        return {}
    channels = setup.experiment.channels
    ends = np.cumsum([channel.size for channel in channels])[:-1]
    each = np.split(propagated_noise(setup, values, rough=True).variance, ends)
    return {
        channel.signal: float(np.sqrt(np.mean(variance))) / channel.weight
        for channel, variance in zip(channels, each, strict=True)
    }


def whitened(
    residuals: Residuals, setups: Sequence[ExperimentSetup], theta: Array, rough: bool = False
) -> Residuals:
    """Return residuals that are white near theta (N,), but for what no noise explains.

    They are as large as before, so that costs are of the same size. ``rough`` ones, which cost
    little, have their minimum within some standard errors.
    """
    values = residuals.values(theta)
    carried = [propagated_noise(setup, values, rough) for setup in setups]
    scale = float(np.sqrt(np.mean(np.concatenate([each.variance for each in carried]))))
    experiments = []
    for setup, each in zip(setups, carried, strict=True):
        times = [np.flatnonzero(channel.kept) for channel in setup.experiment.channels]
        in_time = np.argsort(np.concatenate(times), kind="stable")
        white = whitening(each, in_time, scale, ROUGH_ROWS if rough else ROWS_BEFORE)
        own = setup.experiment.coarse() if rough else setup.experiment
        experiments.append(replace(own, whitening=white))
    return replace(residuals, experiments=experiments)


def without_bias(
    residuals: Residuals, setups: Sequence[ExperimentSetup], theta: Array
) -> tuple[Residuals, Array]:
    """Return white residuals whose minimum near theta (N,) the driving noise does not move.

    With the bias (N,) that is gone, in standard errors of each parameter. At theta the errors are
    those as recorded, their derivatives are without the noise.
    """
    values, moves = residuals.values(theta), residuals.moves(theta)
    gradient, jacobians, experiments = np.zeros(len(theta)), [], []
    for whole, setup in zip(residuals.experiments, setups, strict=True):
        recorded = as_recorded(whole)
        white = recorded.whitening
        assert white is not None
        errors, slopes = recorded.tangents(values, moves)
        smooth = without_likely_noise(recorded, white, setup, values, errors)
        other, own = smooth.tangents(values, moves)
        gradient += (slopes - own).T @ errors
        jacobians.append(own)
        experiments.append(replace(smooth, whitening=white._replace(shift=other - errors)))
    jacobian = np.concatenate(jacobians)
    _, singular, directions = np.linalg.svd(jacobian, full_matrices=False)
    seen = singular > UNSEEN * np.max(singular, initial=0.0)
    roots = directions[seen].T / singular[seen]
    bias = -roots @ (roots.T @ gradient)
    added = np.split(-jacobian @ bias, np.cumsum([sum(e.sizes) for e in residuals.experiments]))
    experiments = [
        replace(experiment, whitening=experiment.whitening._replace(bias=each))
        for experiment, each in zip(experiments, added, strict=False)
        if experiment.whitening is not None
    ]
    scale = next(e.whitening.scale for e in experiments if e.whitening is not None)
    deviations = scale * np.sqrt(np.sum(roots**2, axis=1))
    some = deviations > 0.0
    relative = np.where(some, bias, 0.0) / np.where(some, deviations, 1.0)
    return replace(residuals, experiments=experiments), relative


def without_likely_noise(
    experiment: Experiment,
    white: Whitening,
    setup: ExperimentSetup,
    values: Values,
    errors: Array,
) -> Experiment:
    """Return an experiment driven by recorded signals less what white errors (M,) say is noise.

    As in the record, noise at rest moves the level that the simulation starts at.
    """
    recorded = experiment.simulator.inputs.recorded
    carried = propagated_noise(setup, values).carried
    likely = white.slopes(carried).T @ errors / white.scale**2  # in standard deviations
    likely /= max(float(np.sqrt(np.mean(likely**2))), 1.0)  # more is no noise: a misfit
    noise, first = dict[str, Array](), 0
    for signal, deviation in noise_of_inputs(experiment.simulator).items():
        count = len(recorded[signal].samples)
        noise[signal] = -deviation * likely[first : first + count]
        first += count
    if powers := phasor_in_powers(setup.record):
        power = np.sum([powers[signal] * noise[signal] for signal in powers], axis=0)
        noise |= {"p": power.real, "q": power.imag}
    levels = rest_levels(setup, experiment, recorded)
    sizes = {
        signal: own.weights @ noise[signal][own.rest]
        for signal, own in levels.items()
        if signal in noise
    }
    there = with_noise(experiment, experiment.simulator, levels, noise, sizes)
    as_it_was = experiment.simulator, experiment.own
    return replace(there, channels=experiment.channels, recorded=as_it_was)


def noise_notes(residuals: Residuals, theta: Array, bias: Array) -> Iterator[str]:
    """Note the treatment of the noise of the driving signals, and its size.

    ``bias`` (N,) is what it did to the parameters, in standard errors.
    """
    values = residuals.values(theta)
    worst = int(np.argmax(np.abs(bias)))
    share = f"{digits(abs(float(bias[worst])))} standard errors ({residuals.free[worst].name})"
    large = (
        "; the intervals allow for an error of 12 % of it" if abs(bias[worst]) > NOT_SMALL else ""
    )
    for experiment in residuals.experiments:
        name = f" of {experiment.name}" if len(residuals.experiments) > 1 else ""
        levels = listed(_levels(experiment.with_inputs(values)))
        yield (
            f"{NOISE}{name}, {levels}, is in the errors of all compared "
            "signals: these are weighted by its covariance, and the intervals include it"
        )
    yield f"{BIAS} is removed: it was at most {share}{large}"


def _levels(simulator: Simulator) -> list[str]:
    words = []
    for signal, deviation in noise_of_inputs(simulator).items():
        recorded = simulator.inputs.recorded[signal]
        if signal != "angle":
            words.append(f"{signal} {digits(deviation)} pu")
        elif isinstance(recorded, SplinedInput) and recorded.integrated:
            words.append(f"frequency {digits(deviation / TURN)} Hz")
        else:
            words.append(f"angle {digits(deviation)} rad")
    return words
