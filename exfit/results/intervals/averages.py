"""Whether the recorder averages, where the case does not say: what the fit would find then.

Samples of single instants and averages are two hypotheses, neither of which contains the other: at
a low rate the parameters make up for most of an average, and the instant of the step for its delay.
Twice the difference of their log-likelihoods is normal about -s or s, with a variance of 4 s, where
s is what the parameters cannot make up for: beyond STRONG it is wrong at most once in 1000 records.

Source: Cox 1962, Further results on tests of separate families of hypotheses.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from exfit.case.case import Case
from exfit.case.changes import changes_to_averages
from exfit.errors import SimulationError
from exfit.fitting.channels import finds_instant, with_averages
from exfit.fitting.descents import descent_near
from exfit.fitting.noise import LEAST_NOISE
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis, free_values, variance_of
from exfit.inference.confidence import Interval, IntervalMethod
from exfit.results.influences import STRONG, RecorderAverages
from exfit.util.arrays import Array, median_step

USUAL = (0.02, 0.05, 0.1, 0.2, 0.5)  # s: windows of recorders, beside the time between samples
LONGEST = 0.1  # of the record: a longer window hides the response
MATTERS = 0.5  # standard errors
MOST_SAMPLES = 100_000  # of all records: so many are no low rate
UNSEEN = 1e-9  # of the largest singular value: rounding


def recorder_averages(
    case: Case, residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> RecorderAverages | None:
    """Estimate the effect of averages at the minimum theta (N,); None where there is none.

    Over the time between samples, or over a usual window that the record shows to be likelier. None
    also where the record excludes them, and where the case says whether the recorder averages.
    Raises KeyboardInterrupt at an interruption.
    """
    numbers = [*unstated(case, residuals)]
    if not numbers or sum(residuals.sizes) > MOST_SAMPLES:
        return None
    found = []
    try:
        errors, slopes = residuals.errors(theta)
        cost = 0.5 * float(errors @ errors)
        variance = variance_of(residuals, cost, uncertainty)
        for window, averaged in _likeliest(residuals, theta, numbers, errors, slopes, variance):
            end, without = descent_near(averaged, theta), residuals(theta)
            values = free_values(averaged, end.x)
            beyond = [
                name
                for name, own in uncertainty.confidence.parameters.items()
                if name not in residuals.of_records and _is_beyond(values[name], own.interval)
            ]
            found.append(
                RecorderAverages(
                    window=window,
                    chi_square=2.0 * (0.5 * float(without @ without) - end.cost) / variance,
                    given=free_values(residuals, theta),
                    values=values,
                    beyond=tuple(beyond),
                    changes=_changes(case, residuals, numbers, window),
                )
            )
    except SimulationError:
        return None
    likeliest = max(found, key=lambda each: each.chi_square, default=None)
    return None if likeliest is None or likeliest.chi_square < -STRONG else likeliest


def _changes(
    case: Case, residuals: Residuals, numbers: Sequence[int], window: float
) -> Mapping[str, str]:
    """Return the changes of a case by which some of its records hold averages."""
    changes = dict[str, str]()
    for number in numbers:
        experiment = residuals.experiments[number]
        late = None if finds_instant(experiment) else experiment.simulator.delay + 0.5 * window
        changes |= changes_to_averages(case, number, experiment.signals, window, late)
    return changes


def _is_beyond(value: float, interval: Interval | None) -> bool:
    low, high = interval or (None, None)
    return (low is not None and value < low) or (high is not None and value > high)


def unstated(case: Case, residuals: Residuals) -> Iterator[int]:
    """Yield the records of which neither the case nor what drives them says if they average."""
    if case.external is not None or case.kind.finds_rest:
        return
    pairs = zip(case.recordings, residuals.experiments, strict=True)
    for number, (recording, experiment) in enumerate(pairs):
        sections = (recording.record.channels[signal] for signal in experiment.signals)
        stated = any(section.averaged is not None for section in sections)
        filterings = [each.filtering for each in experiment.channels]
        plain = all(each is None or each.averaged is None for each in filterings)
        if plain and not stated and not experiment.simulator.inputs.recorded:
            yield number


def _likeliest(
    residuals: Residuals,
    theta: Array,
    numbers: Sequence[int],
    errors: Array,
    slopes: Array,
    variance: float,
) -> Iterator[tuple[float, Residuals]]:
    """Yield windows (s) with averaged residuals: between samples, and the one that matches best."""
    low, high = residuals.bounds
    free = slopes[:, (theta > low) & (theta < high)]
    if not np.isfinite(free).all():
        raise SimulationError("no finite derivatives")
    left, singular, _ = np.linalg.svd(free, full_matrices=False)
    # what the parameters can do, orthonormal
    basis = np.asarray(left[:, singular > UNSEEN * np.max(singular, initial=0.0)])
    gains, candidates = list[float](), list[tuple[float, bool, Residuals]]()
    for window, of_rate, averaged in averaged_residuals(residuals, numbers):
        # the errors alone: to differentiate them takes three times as long
        off = replace(averaged, robust=None)(theta)[: averaged.count]
        if not np.isfinite(off).all():
            raise SimulationError("no response with averages")
        made_up_for = basis.T @ off
        left_over = float(off @ off - made_up_for @ made_up_for)
        gain = (float(errors @ errors) - left_over) / variance
        change = off - errors
        matters = float(np.linalg.norm(basis.T @ change)) > MATTERS * np.sqrt(variance)
        visible = float(np.max(np.abs(change))) > LEAST_NOISE
        if matters and visible and (of_rate or gain > STRONG):
            gains.append(gain)
            candidates.append((window, of_rate, averaged))
    for k, (window, of_rate, averaged) in enumerate(candidates):
        if of_rate or k == np.argmax(gains):
            yield window, averaged


def averaged_residuals(
    residuals: Residuals, numbers: Sequence[int]
) -> Iterator[tuple[float, bool, Residuals]]:
    """Yield residuals with averages over a window (s), and whether that is the rate's.

    Averages are about each sample; of a test whose instant is given also over the time before. A
    usual window holds several samples, and is short beside the records.
    """
    chosen = [residuals.experiments[number] for number in numbers]
    slowest = max(median_step(each.simulator.times) for each in chosen)
    longest = LONGEST * min(float(np.ptp(each.simulator.times)) for each in chosen)
    usual = [window for window in USUAL if slowest < window < longest]
    lates = (0.0,) if any(map(finds_instant, chosen)) else (0.0, 0.5)
    for given, late in product((None, *usual), lates):
        windows = [given or median_step(each.simulator.times) for each in residuals.experiments]
        experiments = [
            with_averages(each, windows[k], late * windows[k]) if k in numbers else each
            for k, each in enumerate(residuals.experiments)
        ]
        averaged = replace(residuals, experiments=experiments, counter=None)
        yield given or slowest, given is None and not late, averaged


def allowing_for_averages(
    uncertainty: UncertaintyAnalysis, residuals: Residuals, averages: RecorderAverages | None
) -> UncertaintyAnalysis:
    """Return the uncertainty with intervals that hold the parameters with averages, too."""
    if averages is None:
        return uncertainty
    return holding(uncertainty, residuals, averages.given, averages.values, "averages")


def holding(
    uncertainty: UncertaintyAnalysis,
    residuals: Residuals,
    given: Mapping[str, float],
    others: Mapping[str, float],
    method: IntervalMethod,
) -> UncertaintyAnalysis:
    """Return the uncertainty with intervals that hold the parameters under another hypothesis.

    Each holds that about the fitted value, ``given``, and the same about the value of ``others``,
    within its bounds.
    """
    parameters = {**uncertainty.confidence.parameters}

    for free in residuals.free:
        own = parameters[free.name]
        if own.interval is not None and free.name in others:
            shift = free.scaled(others[free.name]) - free.scaled(given[free.name])
            low, high = own.interval
            interval = moved(free, low, min(shift, 0.0)), moved(free, high, max(shift, 0.0))
            by_noise = own.by_noise or own.interval
            parameters[free.name] = own._replace(
                interval=interval, method=method, by_noise=by_noise
            )
    return uncertainty.with_parameters(parameters)


def moved(free: FreeParameter, limit: float | None, shift: float) -> float | None:
    """Return an end of an interval by a shift of its scaled value, within the bounds."""
    if limit is None:
        return None
    bounds = free.scaled(free.low), free.scaled(free.high)
    return free.value(float(np.clip(free.scaled(limit) + shift, *bounds)))
