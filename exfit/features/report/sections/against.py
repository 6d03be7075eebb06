"""Another fit beside that of the report: an earlier revision, or another unit."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from exfit.dsp.decimation import envelope
from exfit.features.report.layout import BINS, TALL, TIME
from exfit.results.comparisons import Comparison
from exfit.results.criteria import judged_by_criteria
from exfit.results.facts import PLANT, REVISION, UNIT, stated
from exfit.results.model import FitResult
from exfit.results.side_by_side import ParameterValue, outcome_of, parameters_beside
from exfit.show.blocks import Chart, Panel, Series
from exfit.signals import label_of

NONE = "–"


@dataclass(frozen=True)
class FactBeside:
    """A fact of both fits, in words."""

    name: str
    this: str
    other: str


@dataclass(frozen=True)
class AgainstView:
    """This fit and another one: what each comes to, their parameters, their responses."""

    this: str
    other: str
    facts: tuple[FactBeside, ...]
    parameters: Mapping[str, tuple[ParameterValue | None, ...]]
    units: Mapping[str, str]
    charts: tuple[Chart, ...]


def against(result: FitResult, other: FitResult) -> AgainstView:
    """Return a fit beside another one."""
    names = _names(result, other)
    fitted = [*other.parameters.items(), *result.parameters.items()]
    return AgainstView(
        *names,
        facts=tuple(_facts(result, other)),
        parameters=parameters_beside([result, other]),
        units={name: parameter.unit for name, parameter in fitted},
        charts=tuple(_charts(result, other, names)),
    )


def _names(result: FitResult, other: FitResult) -> tuple[str, str]:
    """Name the two fits: by plant, unit and revision, else by their cases."""
    this, older = (
        ", ".join(
            text if fact is PLANT else f"{fact.key.lower()} {text}"
            for fact in (PLANT, UNIT, REVISION)
            if (text := stated(fit.about, fact)) is not None
        )
        or fit.name
        for fit in (result, other)
    )
    return (this, older) if this != older else (f"{this} (this report)", f"{older} (the other)")


def _facts(result: FitResult, other: FitResult) -> Iterator[FactBeside]:
    pair = (result, other)
    yield FactBeside("case", *(fit.case.name for fit in pair))
    yield FactBeside("model", *(fit.model for fit in pair))
    yield FactBeside("verdict", *(outcome_of(fit) for fit in pair))
    yield FactBeside("criteria", *(judged_by_criteria(fit).sentence for fit in pair))
    matches = [{match.name: match for match in _all(fit)} for fit in pair]
    for name in dict.fromkeys(name for own in matches for name in own):
        yield FactBeside(f"rmse of {name} (pu)", *(_rmse(own.get(name)) for own in matches))


def _all(fit: FitResult) -> tuple[Comparison, ...]:
    return (*fit.comparisons, *fit.validation)


def _rmse(match: Comparison | None) -> str:
    return NONE if match is None else f"{match.rmse:.3g} ({match.judged_by}, {match.record})"


def _charts(result: FitResult, other: FitResult, names: tuple[str, str]) -> Iterator[Chart]:
    """Yield both responses to each test that both fits have, by its name."""
    others = {match.name: match for match in _all(other)}
    for k, match in enumerate(_all(result)):
        beside = others.get(match.name)
        if beside is None or match.judged_by not in beside.overlays or not match.overlays:
            continue
        yield _chart(f"against-{k}", match, beside, names)


def _chart(key: str, match: Comparison, beside: Comparison, names: tuple[str, str]) -> Chart:
    """Return both responses: over one record where it is the same, else above each other."""
    signal, same = match.judged_by, match.sha256 == beside.sha256
    this, other = (
        _lines(match, signal, names[0], "simulated"),
        _lines(beside, signal, names[1], "other"),
    )
    label = label_of(signal)
    panels = (
        (Panel(label, (*this, other[-1]), TALL),)
        if same
        else (Panel(f"{label}, {names[0]}", this, TALL), Panel(f"{label}, {names[1]}", other, TALL))
    )
    times = (match.time, beside.time)
    return Chart(
        key=key,
        title=f"{match.name}: {names[0]} and {names[1]}",
        text=f"{label}: rmse {match.rmse:.3g} pu and {beside.rmse:.3g} pu"
        + (", of one record." if same else f", of the records {match.record} and {beside.record}."),
        x_title=TIME,
        panels=panels,
        x_range=(min(float(time[0]) for time in times), max(float(time[-1]) for time in times)),
    )


def _lines(match: Comparison, signal: str, name: str, style: str) -> tuple[Series, Series]:
    samples = match.overlays[signal]
    return (
        Series("measured", *envelope(match.time, samples.measured, BINS), "measured", dots=True),
        Series(name, *envelope(match.time, samples.simulated, BINS), style),
    )
