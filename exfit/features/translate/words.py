"""A translation in words: where each value is from, and what must be known beside the numbers."""

from collections.abc import Iterator, Mapping, Sequence

from exfit.features.translate.result import UNDETERMINED, StepComparison, TranslatedParameter
from exfit.features.translate.start import StartValue
from exfit.features.translate.steps import DEFAULT_MACHINE, TranslationTask
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.util.sources import NOT_STATED, least_certain

Values = Mapping[str, float]


def translated_parameters(
    task: TranslationTask, values: Mapping[str, StartValue], unnoticed: Values
) -> dict[str, TranslatedParameter]:
    """Return the parameters of the target with where they are from."""
    return {
        row.symbol: TranslatedParameter(
            value=values[row.symbol].value,
            unit=row.unit,
            meaning=row.meaning,
            origin=values[row.symbol].kind,
            source=task.source.name,
            of={name: _state(task.result, name) for name in values[row.symbol].of},
            unnoticed=unnoticed.get(row.symbol),
            value_source=_value_source(task.result, values[row.symbol]),
        )
        for row in task.target.sheet
    }


def _value_source(result: FitResult, entry: StartValue) -> str:
    """Name the origin of a value in one word: of several in the source the least certain."""
    if entry.kind not in ("copied", "computed"):
        return entry.kind
    return least_certain(result.sources.get(name, NOT_STATED) for name in entry.of)


def _state(result: FitResult, name: str) -> str:
    """Describe the origin of the source's value, and whether its record determined it."""
    parameter = result.parameters.get(name)
    if parameter is None:
        return result.source_of(name)
    if parameter.at_bound:
        return f"fitted, on its {parameter.at_bound}"
    return "fitted" if parameter.determined else "fitted, not determined"


def translation_notes(
    task: TranslationTask,
    values: Mapping[str, StartValue],
    unnoticed: Values,
    steps: Sequence[StepComparison],
) -> Iterator[str]:
    """Yield notes on the numbers."""
    source, target = task.source.name, task.target.name
    yield from _fit_notes(task)
    hidden = [name for name, share in unnoticed.items() if share > UNDETERMINED]
    if hidden:
        yield (
            f"the steps hardly show {', '.join(hidden)} of {target}: another value would do as well"
        )
    typical = [name for name, entry in values.items() if entry.kind == "typical"]
    if typical:
        yield f"typical, {source} has no such parameter: {', '.join(typical)} of {target}"
    yield from _limit_notes(steps, source, target)
    yield from _plant_notes(task)


def _fit_notes(task: TranslationTask) -> Iterator[str]:
    """Yield notes on the fit itself."""
    result, source = task.result, task.source.name
    if not result.holds:
        yield f"the fit of {source} does not hold: {outcome_of(result)}: {explanation_of(result)}"
    own = {name: entry for name, entry in result.parameters.items() if name in task.own}
    unknown = [name for name, entry in own.items() if not entry.determined]
    if unknown:
        yield f"the record of the fit did not determine {', '.join(unknown)} of {source}"
    outside = [f"{name} {entry.value:.4g}" for name, entry in own.items() if not entry.physical]
    if outside:
        yield f"not physical, outside the range of the data sheet: {', '.join(outside)}"


def _limit_notes(steps: Sequence[StepComparison], source: str, target: str) -> Iterator[str]:
    for here, there, (at, free) in (
        ("source_limits", "target_limits", (source, target)),
        ("target_limits", "source_limits", (target, source)),
    ):
        labels = [s.label for s in steps if getattr(s, here) and not getattr(s, there)]
        if labels:
            yield f"{at} meets a limit and {free} none: {', '.join(labels)}"
    if not any(step.fitted and not step.source_limits for step in steps):
        yield f"{source} meets a limit in every step: choose smaller ones by --step"


def _plant_notes(task: TranslationTask) -> Iterator[str]:
    if task.result.machine_model is None:
        yield f"the machine is typical, {DEFAULT_MACHINE}: the fit has none"
    if not any(plant.kind.on_load for plant in task.plants):
        yield "compared on open circuit alone: the fit has no network with a source"
