"""A fitted exciter as another model: the other's parameters for the same response to steps.

What both models have is copied; what the source does not have is without effect where it can be.
Where the responses then differ, the parameters that a bump test is fitted for are fitted to the
responses of the source, without noise, in the steps in which it meets no limit.
"""

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.draft.free_parameters import ALONE
from exfit.errors import ExfitError, SimulationError
from exfit.features.translate.result import (
    EXACT,
    UNDETERMINED,
    LoopComparison,
    LoopFigures,
    SignalError,
    StepComparison,
    Translation,
)
from exfit.features.translate.search import (
    MANY_STARTS,
    ONE_START,
    Effort,
    Watch,
    free_parameters,
    search,
)
from exfit.features.translate.start import StartValue, lost_parameters, starting_values, with_limits
from exfit.features.translate.steps import (
    ReferenceStep,
    StepPlant,
    StepResponse,
    TranslationTask,
    reference_steps,
    response_of,
    source_model,
    source_values,
    step_plants,
    times_of_steps,
)
from exfit.features.translate.words import translated_parameters, translation_notes
from exfit.fitting.parameters import FreeParameter
from exfit.models import MODELS, find
from exfit.models.sheet import Model
from exfit.results.io import load_result
from exfit.results.model import FitResult
from exfit.simulation.small_signal import small_signal

Array = NDArray[np.float64]
Values = Mapping[str, float]

LARGEST_STEP = 0.5  # pu: beyond it no voltage is left
HARDLY_MORE = 0.5  # % of the step: what a plainer set of values may cost


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
    """Return a fitted exciter as another model, and what is lost by that.

    Args:
        result: a fit, or the path of its result.json or folder.
        model: the name of the other model, of its PSS/E record, or the path of a .py file.
        steps: sizes of the steps of the reference in which both are compared, pu, up and down; by
            default 1, 5, 10 % on open circuit, and 1, 5 % on load where the fit has a network.
        progress: called with how far the search is.

    A user's own model of the fit is run only from the file that was fitted. Raises ExfitError
    where one of the models cannot be simulated, KeyboardInterrupt at an interruption.

    Example:
        >>> translation = exfit.translate("runs/ac1a_typical-fit", "EXAC1")
        >>> translation.verdict, translation.values["KA"]
    """
    if not isinstance(result, FitResult):
        result = load_result(result)
    _refuse_sizes(steps)
    return _translation(result, target_model(model), steps, progress)


def target_model(model: Model | str) -> Model:
    """Return the model that a name or a path stands for; raises ModelError where there is none."""
    if isinstance(model, Model):
        return model
    own = {record.name: entry for entry in MODELS.values() for record in entry.records[:1]}
    return own.get(model.upper()) or find(model, Path())


def _refuse_sizes(sizes: Sequence[float]) -> None:
    for size in sizes:
        if not 0.0 < abs(size) <= LARGEST_STEP:
            raise ExfitError(f"step: {size:g} pu: must be above 0 and at most {LARGEST_STEP:g}")


def _translation(
    result: FitResult, target: Model, sizes: Sequence[float], watch: Watch
) -> Translation:
    began = clock.perf_counter()
    task = _task(result, target, sizes)
    copied = _candidate(task, starting_values(task.placed, target, task.place), {})
    best = copied if copied.largest <= EXACT else _best(task, copied, watch)
    if not best.steps:
        raise SimulationError(f"{target.name} has no response in the plant of {result.name}")
    lost = lost_parameters(task.placed, best.values)
    return Translation(
        name=result.name,
        source=task.source.name,
        target=target.name,
        parameters=translated_parameters(task, best.values, best.unnoticed),
        steps=best.steps,
        loops=tuple(_loops(task, _numbers(best.values))),
        lost={row.symbol: task.own[row.symbol] for row in lost},
        searched=best is not copied,
        notes=tuple(translation_notes(task, best.values, best.unnoticed, best.steps)),
        seconds=clock.perf_counter() - began,
        time=times_of_steps(),
    )


def _best(task: TranslationTask, copied: Candidate, watch: Watch) -> Candidate:
    """Return the best values: copied, or fitted, where that is closer.

    The limits follow the fitted values, so that the search goes on once more from there; and what
    the steps hardly show then is as it was copied, where that costs hardly anything.
    """
    free = free_parameters(task, copied.values)
    if not free:
        return copied
    first = _fitted(task, free, copied, MANY_STARTS, watch)
    second = _fitted(task, _from(first, free), first, ONE_START, watch)
    fitted = min(first, second, key=lambda candidate: candidate.largest)
    held = {
        name: copied.values[name]
        for name, share in fitted.unnoticed.items()
        if share > UNDETERMINED and copied.values[name].of
    }
    left = [parameter for parameter in free if parameter.name not in held]
    if held and left:
        start = fitted._replace(values={**fitted.values, **held})
        plain = _fitted(task, _from(fitted, left), start, ONE_START, watch)
        if plain.largest <= fitted.largest + HARDLY_MORE:
            fitted = plain
    return fitted if fitted.largest < copied.largest else copied


def _from(candidate: Candidate, free: Sequence[FreeParameter]) -> list[FreeParameter]:
    """Return free parameters that start where a candidate has them."""
    return [replace(entry, start=candidate.values[entry.name].value) for entry in free]


def _fitted(
    task: TranslationTask,
    free: Sequence[FreeParameter],
    start: Candidate,
    effort: Effort,
    watch: Watch,
) -> Candidate:
    """Return values fitted to the steps, with the limits that follow; the start where none are."""
    result = search(task, free, _numbers(start.values), effort, watch)
    if result is None:
        return start
    values = {
        name: replace(entry, value=result.values[name], kind="fitted")
        if name in result.values
        else entry
        for name, entry in start.values.items()
    }
    return _candidate(
        task, with_limits(values, task.placed, task.target, task.place), result.unnoticed
    )


def _candidate(
    task: TranslationTask, values: Mapping[str, StartValue], unnoticed: Values
) -> Candidate:
    return Candidate(values, _comparisons(task, _numbers(values)), unnoticed)


def _task(result: FitResult, target: Model, sizes: Sequence[float]) -> TranslationTask:
    source = source_model(result)
    for model in (source, target):
        if model.name == ALONE:
            raise ExfitError(f"{ALONE} is no exciter: it is without a machine")
    own, plants = source_values(result, source), step_plants(result)
    return TranslationTask(
        result, source, target, own, plants, reference_steps(plants, source, own, sizes)
    )


def _numbers(values: Mapping[str, StartValue]) -> dict[str, float]:
    return {name: entry.value for name, entry in values.items()}


def _comparisons(task: TranslationTask, values: Values) -> tuple[StepComparison, ...]:
    """Return the comparison in every step; nothing where the target has no response to one."""
    try:
        return tuple(
            _comparison(
                step,
                response_of(step.plant, task.target, values, step.step),
                fitted=step in task.fitted,
            )
            for step in task.steps
        )
    except SimulationError:
        return ()


def _comparison(step: ReferenceStep, target: StepResponse, fitted: bool) -> StepComparison:
    source = step.source
    measures = {"vt": abs(step.step), "efd": float(np.ptp(source.signals["efd"]))}
    return StepComparison(
        plant=step.plant.label,
        step=step.step,
        fitted=fitted,
        errors={
            name: _error(target.signals[name] - source.signals[name], measure)
            for name, measure in measures.items()
        },
        source_limits=source.limits,
        target_limits=target.limits,
        source=source.signals,
        target=target.signals,
    )


def _error(difference: Array, measure: float) -> SignalError:
    rmse, largest = float(np.sqrt(np.mean(difference**2))), float(np.max(np.abs(difference)))
    return SignalError(rmse, largest, 100.0 * rmse / measure, 100.0 * largest / measure)


def _loops(task: TranslationTask, values: Values) -> Iterator[LoopComparison]:
    """Yield the voltage loop of both models in each plant in which both have one."""
    for plant in task.plants:
        try:
            yield LoopComparison(
                plant.label,
                _loop(plant, task.source, task.own),
                _loop(plant, task.target, values),
            )
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
