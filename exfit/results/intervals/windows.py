"""T'd0 by playback, in windows of the records: one number may not describe the iron in all.

After a step down the field current is lower than after a step up to the same voltage, and T'd0 by
the one step is not that by the other: the interval of a single fit knows nothing of that.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import ChannelSection, Recording
from exfit.dsp.noise import noise
from exfit.errors import ExfitError
from exfit.estimate import Stop
from exfit.fitting.build import build_experiment
from exfit.fitting.descents import short_descent
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.noise import propagated_noise
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.inference.confidence import NORMAL, UNDETERMINED, Uncertainty, closed
from exfit.inference.quantiles import chi_square_tail
from exfit.plants import DRIVING_SCALE, MACHINE
from exfit.records.record import read_only
from exfit.results.influences import WindowEstimate, WindowKind, WindowSpread
from exfit.util.arrays import Array

Values = Mapping[str, float]

TPD0 = MACHINE + "Tpd0"
SATURATION = (MACHINE + "S10", MACHINE + "S12")
FEWEST_STEPS = 2  # one by itself has nothing to differ from
REST_BEFORE_STEP = 2.0  # s: so long a rest is the start of a window
REST_SHARE = 0.25  # of the time since the step before: no more of it is taken for a rest
MOST_ITERATIONS = 25  # of each phase: the start is the solution for all records
REALISATIONS, SEED = 32, 0  # of noise: their spread is known to 13 %


class Window(NamedTuple):
    """A step of a record: from its rest on, (s), until the next one."""

    begin: float
    step: float
    end: float


def spread_over_windows(
    case: Case,
    setups: Sequence[ExperimentSetup],
    residuals: Residuals,
    values: Values,
    uncertainty: UncertaintyAnalysis,
) -> WindowSpread | None:
    """Return T'd0 over the windows of its records; None where it is not fitted by playback.

    The window of a step is fitted like the whole, but for the machine's T'd0 and saturation alone;
    from there each half is for T'd0 alone, by a Gauss-Newton step. Standard errors are those of
    the noise of the record, and of efd, which the playback carries into the response: what else
    they differ by is not noise. None also where the records have fewer than two steps.

    Source: Cochran 1954, The combination of estimates from different experiments.
    """
    from exfit.plants.playback import MACHINE_PLAYBACK

    if case.kind is not MACHINE_PLAYBACK or TPD0 not in {free.name for free in residuals.free}:
        return None
    estimates = _estimates_of_all(case, setups, residuals, values)
    steps = [each for each in estimates if each.kind == "step"]
    if len(steps) < FEWEST_STEPS:
        return None
    own = uncertainty.confidence.parameters[TPD0].interval
    interval = own if closed(own) else None
    ends = [*(each.value for each in estimates), *(interval or ())]
    for each in steps:
        ends += [each.value - NORMAL * each.std_error, each.value + NORMAL * each.std_error]
    # halves are tested apart from the windows that they are parts of: the smaller counts twice
    halves = [each for each in estimates if each.kind != "step"]
    tails = [_tail(each) for each in (steps, halves) if len(each) >= FEWEST_STEPS]
    return WindowSpread(
        name=TPD0,
        unit=case.units()[TPD0],
        windows=tuple(estimates),
        p_value=min(1.0, len(tails) * min(tails)),
        interval=interval,
        hull=(min(ends), max(ends)),
    )


def _estimates_of_all(
    case: Case, setups: Sequence[ExperimentSetup], residuals: Residuals, values: Values
) -> list[WindowEstimate]:
    """Return T'd0 by each window of all records, if these hold several steps."""
    windows = [
        (setup, recording, window)
        for setup, recording in zip(setups, case.recordings, strict=True)
        for window in windows_of(setup)
    ]
    estimates = list[WindowEstimate]()
    for setup, recording, window in windows if len(windows) >= FEWEST_STEPS else ():
        estimates += _estimates(case, recording, setup, window, residuals, values)
    return estimates


def with_spread(
    uncertainty: UncertaintyAnalysis, spread: WindowSpread | None
) -> UncertaintyAnalysis:
    """Return the uncertainty with the interval over windows where the parameter moves."""
    if spread is None or not spread.moves or spread.interval is None:
        return uncertainty
    parameters = uncertainty.confidence.parameters
    own: Uncertainty = parameters[spread.name]._replace(interval=spread.hull, method="windows")
    return uncertainty.with_parameters({**parameters, spread.name: own})


def windows_of(setup: ExperimentSetup) -> Iterator[Window]:
    """Yield the windows of the steps that a record shows."""
    from exfit.records.steps import steps_of_record

    record = setup.record
    signals = {name: record.signals[name] for name in ("vt", "ifd") if name in record.signals}
    steps = steps_of_record(record.time, signals).steps
    instants = [(step.at - step.error, step.at) for step in steps if not step.from_start]
    if not instants:
        return
    ends = [*(early for early, _ in instants[1:]), float(record.time[-1])]
    before = -inf
    for (early, at), end in zip(instants, ends, strict=True):
        rest = min(REST_BEFORE_STEP, REST_SHARE * (early - before))
        yield Window(max(early - rest, float(record.time[0])), early, end)
        before = at


def _tail(estimates: Sequence[WindowEstimate]) -> float:
    """Probability that estimates of one value lie so far apart."""
    values = np.array([each.value for each in estimates])
    weights = 1.0 / np.array([each.std_error for each in estimates]) ** 2
    mean = float(weights @ values / np.sum(weights))
    return chi_square_tail(float(weights @ (values - mean) ** 2), len(estimates) - 1)


class WindowFit(NamedTuple):
    """The fit of a window: the values there, the errors (M,), their derivatives (M, N).

    The first of the N parameters is T'd0. Each of the ``draws`` (K, M) is what noise as strong as
    that of the record does to the errors; ``times`` (M,) are those of the errors.
    """

    values: dict[str, float]
    errors: Array
    slopes: Array
    draws: Array
    times: Array


def _estimates(
    case: Case,
    recording: Recording,
    setup: ExperimentSetup,
    window: Window,
    residuals: Residuals,
    values: Values,
) -> Iterator[WindowEstimate]:
    """Yield T'd0 by a step, then by each half of its window, as far as these determine it."""
    try:
        fit = _fitted(window_setup(case, recording, setup, window, values), residuals, values)
    except ExfitError:  # no rest, or too few samples
        return
    if fit is None:
        return
    order = np.argsort(fit.times, kind="stable")
    seen = np.cumsum(fit.slopes[order, 0] ** 2)
    half = fit.times[order[np.searchsorted(seen, 0.5 * seen[-1])]]
    inverse = np.linalg.pinv(fit.slopes)
    moved = -fit.draws @ inverse.T
    each: dict[WindowKind, tuple[float, Array]] = {
        "step": (0.0, moved[:, 0]),
        "first half": _of_part(fit, moved, fit.times <= half),
        "second half": _of_part(fit, moved, fit.times > half),
    }
    for kind, (change, errors) in each.items():
        value, std_error = fit.values[TPD0] + change, float(np.sqrt(np.mean(errors**2)))
        if 0.0 < std_error < UNDETERMINED * value:
            yield WindowEstimate(setup.name, kind, window.begin, window.end, value, std_error)


def _of_part(fit: WindowFit, moved: Array, rows: NDArray[np.bool_]) -> tuple[float, Array]:
    """Change of T'd0 by a part of the errors, and its errors by the noise ``moved`` (K, N)."""
    slopes, others = fit.slopes[rows, 0], fit.slopes[rows, 1:]
    power = float(slopes @ slopes)
    if power == 0.0:  # it does nothing there
        return 0.0, np.zeros(len(fit.draws))
    along = slopes / power
    with_others = fit.draws[:, rows] + moved[:, 1:] @ others.T
    return -float(along @ fit.errors[rows]), -with_others @ along


def window_setup(
    case: Case, recording: Recording, setup: ExperimentSetup, window: Window, values: Values
) -> ExperimentSetup:
    """Return the playback of a window of a record, which rests before its step.

    Raises ExfitError where the window is too short.
    """
    channels = {
        signal: channel.model_copy(update={"scale": 1.0, "offset": 0.0})
        if isinstance(channel, ChannelSection)
        else channel
        for signal, channel in recording.record.channels.items()
    }
    delay = setup.experiment.with_inputs(values).delay
    of_file = {"channels": MappingProxyType(channels), "window": None, "mask": (), "delay": delay}
    of_test = {"begin": None, "vt0": None, "steady_until": window.step}
    own = recording.model_copy(
        update={
            "record": recording.record.model_copy(update=of_file),
            "test": recording.test.model_copy(update=of_test),
        }
    )
    record, experiment = setup.record, setup.experiment
    rows = (record.time >= window.begin) & (record.time <= window.end)
    driving = experiment.with_inputs(values).inputs.recorded
    scale = experiment.parameters(values).get(DRIVING_SCALE, 1.0)
    signals = {name: scale * driving[name].samples for name in driving}
    signals |= {each.signal: experiment.measured(each, values) for each in setup.channels}
    record = replace(
        record,
        time=read_only(record.time[rows]),
        signals=MappingProxyType({name: read_only(s[rows]) for name, s in signals.items()}),
    )
    alone = replace(case, given_records={recording.name: record})
    built = build_experiment(alone, own, values).with_enough_substeps(values)
    weights = {channel.signal: channel.weight for channel in setup.channels}
    weighted = tuple(replace(channel, weight=weights[channel.signal]) for channel in built.channels)
    return replace(built, experiment=replace(built.experiment, channels=weighted))


def _fitted(setup: ExperimentSetup, residuals: Residuals, values: Values) -> WindowFit | None:
    """Fit T'd0, and the saturation as far as it is free, to a window; None without convergence."""
    experiment = setup.experiment
    by_name = {parameter.name: parameter for parameter in residuals.free}
    free = [
        replace(by_name[name], start=values[name], prior=None)
        for name in (TPD0, *SATURATION)
        if name in by_name
    ]
    names = {parameter.name for parameter in free}
    own = replace(
        residuals,
        experiments=[experiment],
        free=free,
        fixed={name: value for name, value in values.items() if name not in names},
        robust=None,
        counter=None,
    )
    best = short_descent(own, own.start, MOST_ITERATIONS)
    if best is None:
        return None
    if best.stop is Stop.INTERRUPTED:
        raise KeyboardInterrupt
    values = own.values(best.x)
    draws = _draws(setup, values)
    if not best.success or draws is None:
        return None
    scales = [parameter.slope(float(x)) for parameter, x in zip(free, best.x, strict=True)]
    times = [experiment.simulator.times[channel.kept] for channel in experiment.channels]
    return WindowFit(values, best.fun, best.jac / scales, draws, np.concatenate(times))


def _draws(setup: ExperimentSetup, values: Values) -> Array | None:
    """Draw errors (K, M) by noise as strong as the record's; None where the response diverges."""
    experiment, generator = setup.experiment, np.random.default_rng(SEED)
    carried = propagated_noise(setup, values, REALISATIONS)
    if not carried:
        return None
    draws = []
    for channel, by_inputs in zip(experiment.channels, carried, strict=True):
        white = generator.normal(0.0, noise(channel.record), by_inputs.shape)
        if channel.signal == "vt":  # its level at rest is where the simulation starts
            at_rest = experiment.simulator.times[channel.kept] < (setup.test.steady or -inf)
            white -= np.mean(white[:, at_rest], axis=1, keepdims=True)
        draws.append(channel.weight * (by_inputs + white))
    return np.concatenate(draws, axis=1)
