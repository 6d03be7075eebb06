"""A fitted exciter as another model: the other's parameters for the same response to steps.

What both models have is copied; what the source does not have is without effect where it can be.
Where the responses then differ, the parameters that a bump test is fitted for are fitted to the
responses of the source, without noise, in the steps in which it meets no limit.
"""

import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exfit import estimate
from exfit.errors import ExfitError, SimulationError
from exfit.features.translate.result import (
    EXACT,
    UNDETERMINED,
    LoopComparison,
    LoopFigures,
    SignalError,
    StepComparison,
    TranslatedParameter,
    Translation,
)
from exfit.features.translate.start import StartValue, starting_values, with_limits
from exfit.features.translate.steps import (
    DEFAULT_MACHINE,
    StepPlant,
    TranslationTask,
    times_of_steps,
    translation_task,
)
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.models import MODELS, find
from exfit.models.blocks import SHORTEST
from exfit.models.counterparts import has_effect
from exfit.models.sheet import Model, Parameter
from exfit.results.io import load_result
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.simulation.small_signal import small_signal
from exfit.util.arrays import Array
from exfit.util.vocabulary import NOT_STATED, least_certain

Values = Mapping[str, float]
Watch = Callable[[estimate.Progress], None]

LARGEST_STEP = 0.5  # pu: beyond it no voltage is left
SMALLEST_STEP = 1e-6  # pu: below it the response is rounding
HARDLY_MORE = 0.5  # % of the step: what a plainer set of values may cost
NOTICEABLE = 1e-3  # of the step, rms: a change of the responses that a study would not see
REACH = 10.0  # times the copied and the typical value: how far the search goes
STARTS, REFINED = 32, 2  # from how many points the first search goes, how many it refines
ITERATIONS = 20  # of each phase
LEAST_GAIN = 1e-4  # of the cost, in an iteration


class Candidate(NamedTuple):
    """Values of the target, what they do in each step, and by what share each may change."""

    values: Mapping[str, StartValue]
    steps: tuple[StepComparison, ...]
    unnoticed: Values

    @property
    def largest(self) -> float:
        """The largest error in the steps that a search uses, %; inf without a response."""
        return max((step.percent for step in self.steps if step.fitted), default=inf)


def translate(
    result: FitResult | str | PathLike[str],
    model: Model | str,
    steps: Sequence[float] = (),
    progress: Watch = lambda _: None,
) -> Translation:
    """Return a fitted exciter as another model, and what is lost.

    Args:
        result: a fit, or the path of its result.json or folder.
        model: the name of the other model, of its PSS/E record, or the path of a .py file.
        steps: sizes of the steps of the reference in which both are compared, pu, up and down; by
            default 1, 5, 10 % on open circuit, and 1, 5 % on load where the fit has a network.
        progress: called with how far the search is.

    A model from a user's file is run only from the file that was fitted. Raises ExfitError
    where one of the models cannot be simulated, KeyboardInterrupt at an interruption.

    Example:
        >>> translation = exfit.translate("runs/ac1a_typical-fit", "EXAC1")
        >>> translation.verdict, translation.values["KA"]
    """
    if not isinstance(result, FitResult):
        result = load_result(result)
    for size in steps:
        if not SMALLEST_STEP <= abs(size) <= LARGEST_STEP:
            limits = f"{SMALLEST_STEP:g} ... {LARGEST_STEP:g}"
            raise ExfitError(f"step: {size:g} pu: lies outside {limits}")
    target = target_model(model)
    began = clock.perf_counter()
    task = translation_task(result, target, steps)
    copied = _candidate(task, starting_values(task), {})
    best = copied if copied.largest <= EXACT else _best(task, copied, progress)
    if not best.steps:
        raise SimulationError(f"{target.name} has no response in the plant of {result.name}")
    used = {name for entry in best.values.values() for name in entry.of}
    return Translation(
        name=result.name,
        source=task.source.name,
        target=target.name,
        parameters={row.symbol: _parameter(task, row, best) for row in target.sheet},
        steps=best.steps,
        loops=tuple(_loops(task, _numbers(best.values))),
        lost={
            row.symbol: task.own[row.symbol]
            for row in task.source.sheet
            if row.symbol not in used and has_effect(row, task.own[row.symbol])
        },
        searched=best is not copied,
        notes=tuple(_notes(task, best)),
        seconds=clock.perf_counter() - began,
        time=times_of_steps(),
    )


def target_model(model: Model | str) -> Model:
    """Return the model that a name or a path stands for; raises ModelError where there is none."""
    if isinstance(model, Model):
        return model
    own = {record.name: entry for entry in MODELS.values() for record in entry.records[:1]}
    return own.get(model.upper()) or find(model, Path())


def _best(task: TranslationTask, copied: Candidate, watch: Watch) -> Candidate:
    """Return the best values: copied, or fitted, where that is closer.

    The limits follow the fitted values, so that the search goes on once more from there; and what
    the steps hardly show then is as it was copied, where that costs hardly anything.
    """
    free = _free_parameters(task, copied.values)
    if not free:
        return copied
    first = _fitted(task, free, copied, STARTS, watch)
    second = _fitted(task, _from(first, free), first, 1, watch)
    fitted = min(first, second, key=lambda candidate: candidate.largest)
    held = {
        name: copied.values[name]
        for name, share in fitted.unnoticed.items()
        if share > UNDETERMINED and copied.values[name].of
    }
    left = [parameter for parameter in free if parameter.name not in held]
    if held and left:
        start = fitted._replace(values={**fitted.values, **held})
        plain = _fitted(task, _from(fitted, left), start, 1, watch)
        if plain.largest <= fitted.largest + HARDLY_MORE:
            fitted = plain
    return fitted if fitted.largest < copied.largest else copied


def _from(candidate: Candidate, free: Sequence[FreeParameter]) -> list[FreeParameter]:
    return [replace(entry, start=candidate.values[entry.name].value) for entry in free]


def _free_parameters(
    task: TranslationTask, values: Mapping[str, StartValue]
) -> list[FreeParameter]:
    """Return the parameters of the target that are fitted: those that bump tests are fitted for.

    A lag that the source bypasses stays as it is, and so does what nothing tells the size of.
    """
    of_source = {entry.symbol for entry in task.source.sheet if entry.free}
    free = []
    for row in task.target.sheet:
        start = values[row.symbol]
        bypassed = row.unit == "s" and start.value < SHORTEST
        if not row.free or (bypassed and of_source & {*start.of}):
            continue
        copied = bool(start.of) and not bypassed
        value = start.value if copied else row.typical
        if max(value, row.typical) > 0.0:
            free.append(_free(row, value, copied))
    return free


def _free(row: Parameter, value: float, copied: bool) -> FreeParameter:
    """Make a parameter free about a value; a gain that the source lacks may become zero."""
    sizes = [size for size in (value, row.typical) if size > 0.0]
    high = min(row.high, REACH * max(sizes))
    if row.unit != "s" and row.low <= 0.0 and not (copied and value > 0.0):
        return FreeParameter(row.symbol, value, 0.0, high, logarithmic=False)
    low = max(row.low, min(sizes) / REACH, SHORTEST if row.unit == "s" else 0.0)
    return FreeParameter(row.symbol, min(max(value, low), high), low, high, logarithmic=low > 0.0)


def _fitted(
    task: TranslationTask,
    free: Sequence[FreeParameter],
    start: Candidate,
    starts: int,
    watch: Watch,
) -> Candidate:
    """Fit values to the steps, with the limits that follow; the start where none responds.

    Raises KeyboardInterrupt at an interruption.
    """
    names = {parameter.name for parameter in free}
    fixed = {name: value for name, value in _numbers(start.values).items() if name not in names}
    at = fixed | {parameter.name: parameter.start for parameter in free}
    experiments = [step.experiment(task.target, at) for step in task.fitted]
    residuals = Residuals(experiments, free, fixed)
    descent = estimate.Descent(
        functions=residuals,
        bounds=residuals.bounds,
        max_iterations=ITERATIONS,
        ftol=LEAST_GAIN,
        x_scale=residuals.units,
    )
    first, *others = estimate.spread(residuals.bounds, starts, residuals.start)
    order = np.argsort(residuals.costs(others), kind="stable")
    points = [first, *(others[k] for k in order[: REFINED - 1])]
    minima = estimate.multistart(points, [descent], watch=watch)
    if minima.interrupted:
        raise KeyboardInterrupt
    if minima.best is None:
        return start
    found = residuals.values(minima.best.x)
    values = {
        name: replace(entry, value=found[name], kind="fitted") if name in names else entry
        for name, entry in start.values.items()
    }
    return _candidate(task, with_limits(values, task), unnoticed_shares(residuals, minima.best))


def unnoticed_shares(residuals: Residuals, best: estimate.Result) -> dict[str, float]:
    """Return by what share of its value each parameter that is not zero can change unnoticed.

    The others follow, as the linear model has it; half of the errors are those of vt.
    """
    values = residuals.values(best.x)
    slopes = [free.slope(float(x)) for free, x in zip(residuals.free, best.x, strict=True)]
    names = [free.name for free in residuals.free]
    relative = np.array([values[name] / slope for name, slope in zip(names, slopes, strict=True)])
    present = np.flatnonzero(relative)
    if not len(present):
        return {}
    jacobian = best.jac[:, present] * relative[present]
    _, singular, directions = np.linalg.svd(jacobian, full_matrices=False)
    rounding = np.finfo(float).eps * len(jacobian) * max(singular[0], np.finfo(float).tiny)
    per_share = directions / np.maximum(singular, rounding)[:, None]
    spread = np.sqrt(np.sum(per_share**2, axis=0))
    shares = NOTICEABLE * np.sqrt(len(jacobian) / 2.0) * spread
    return {names[k]: float(share) for k, share in zip(present, shares, strict=True)}


def _numbers(values: Mapping[str, StartValue]) -> dict[str, float]:
    return {name: entry.value for name, entry in values.items()}


def _candidate(
    task: TranslationTask, values: Mapping[str, StartValue], unnoticed: Values
) -> Candidate:
    """Compare the target with the source in every step; in none where it lacks a response."""
    numbers, steps = _numbers(values), []
    for step in task.steps:
        source = step.source
        try:
            target = step.plant.response(task.target, numbers, step.step)
        except SimulationError:
            return Candidate(values, (), unnoticed)
        measures = {"vt": abs(step.step), "efd": float(np.ptp(source.signals["efd"]))}
        errors = {
            name: _error(target.signals[name] - source.signals[name], measure)
            for name, measure in measures.items()
        }
        comparison = StepComparison(
            plant=step.plant.label,
            step=step.step,
            fitted=step in task.fitted,
            errors=errors,
            source_limits=source.limits,
            target_limits=target.limits,
            source=source.signals,
            target=target.signals,
        )
        steps.append(comparison)
    return Candidate(values, tuple(steps), unnoticed)


def _error(difference: Array, measure: float) -> SignalError:
    rmse, largest = float(np.sqrt(np.mean(difference**2))), float(np.max(np.abs(difference)))
    return SignalError(rmse, largest, 100.0 * rmse / measure, 100.0 * largest / measure)


def _loops(task: TranslationTask, values: Values) -> Iterator[LoopComparison]:
    """Yield the voltage loop of both models in each plant in which both have one."""
    for plant in task.plants:
        try:
            source = _loop(plant, task.source, task.own)
            yield LoopComparison(plant.label, source, _loop(plant, task.target, values))
        except SimulationError:
            continue


def _loop(plant: StepPlant, model: Model, values: Values) -> LoopFigures:
    view = small_signal(plant.system(model), {**plant.values, **values})
    swings = [pole for pole in view.poles if pole.frequency > 0.0]
    least = min(swings, key=lambda pole: pole.damping, default=None)
    margins = view.margins
    return LoopFigures(
        bandwidth=view.bandwidth,
        peak=view.peak,
        gain_margin=None if margins is None else margins.gain,
        phase_margin=None if margins is None else margins.phase,
        damping=None if least is None else least.damping,
        frequency=None if least is None else least.frequency,
    )


def _parameter(task: TranslationTask, row: Parameter, best: Candidate) -> TranslatedParameter:
    """Return a parameter of the target with where it is from.

    Of several in the source the least certain names the origin of its value.
    """
    result, entry = task.result, best.values[row.symbol]
    states = {}
    for name in entry.of:
        fitted = result.parameters.get(name)
        if fitted is None:
            states[name] = result.source_of(name)
        elif fitted.at_bound:
            states[name] = f"fitted, at its {fitted.at_bound}"
        else:
            states[name] = "fitted" if fitted.determined else "fitted, not determined"
    sources = (result.sources.get(name, NOT_STATED) for name in entry.of)
    return TranslatedParameter(
        value=entry.value,
        unit=row.unit,
        meaning=row.meaning,
        origin=entry.kind,
        source=task.source.name,
        of=states,
        unnoticed=best.unnoticed.get(row.symbol),
        value_source=(
            least_certain(sources) if entry.kind in ("copied", "computed") else entry.kind
        ),
    )


def _notes(task: TranslationTask, best: Candidate) -> Iterator[str]:
    """Yield remarks on the fit, the parameters and the steps."""
    source, target = task.source.name, task.target.name
    yield from _fit_notes(task)
    hidden = ", ".join(name for name, share in best.unnoticed.items() if share > UNDETERMINED)
    if hidden:
        yield f"the steps hardly show {hidden} of {target}: other values match as well"
    typical = ", ".join(name for name, entry in best.values.items() if entry.kind == "typical")
    if typical:
        yield f"typical, {source} has no such parameter: {typical} of {target}"
    yield from _limit_notes(best.steps, source, target)
    if task.result.machine_model is None:
        yield f"the machine is typical, {DEFAULT_MACHINE}: the fit has none"
    if not any(plant.kind.on_load for plant in task.plants):
        yield "compared on open circuit alone: the fit has no network with a source"


def _fit_notes(task: TranslationTask) -> Iterator[str]:
    result, source = task.result, task.source.name
    if not result.holds:
        yield f"the fit of {source} does not hold: {outcome_of(result)}: {explanation_of(result)}"
    own = {name: entry for name, entry in result.parameters.items() if name in task.own}
    unknown = ", ".join(name for name, entry in own.items() if not entry.determined)
    if unknown:
        yield f"the record of the fit did not determine {unknown} of {source}"
    outside = [f"{name} {entry.value:.4g}" for name, entry in own.items() if not entry.physical]
    if outside:
        yield f"not physical, outside the range of the data sheet: {', '.join(outside)}"


def _limit_notes(steps: Sequence[StepComparison], source: str, target: str) -> Iterator[str]:
    at_source = [s.label for s in steps if s.source_limits and not s.target_limits]
    at_target = [s.label for s in steps if s.target_limits and not s.source_limits]
    for limited, free, labels in ((source, target, at_source), (target, source, at_target)):
        if labels:
            yield f"{limited} meets a limit and {free} none: {', '.join(labels)}"
    if not any(step.fitted and not step.source_limits for step in steps):
        yield f"{source} meets a limit in every step: choose smaller ones by --step"
