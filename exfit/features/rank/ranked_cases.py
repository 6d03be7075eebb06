"""The same records under several models, each from typical data, and what they say of these."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from exfit.case.case import Case
from exfit.case.load import CaseOrPath
from exfit.case.other_model import ALONE, with_exciter
from exfit.errors import CaseError
from exfit.features.rank.ranking import RankedModel, ranked, ranking_sentences
from exfit.fitting.system import typical_values_used
from exfit.models import MODELS, find
from exfit.models.families import FAMILIES, members, relatives, without_doubles
from exfit.plants import MACHINE
from exfit.results.model import FitResult
from exfit.runs.fits import FitRun, FitSeries, PlannedFit, Progress, run_all
from exfit.util.typed import plain
from exfit.workflows import loaded

ALL = "all"  # in place of names: the catalogue, one form of each type


@dataclass(frozen=True, eq=False)
class Ranking:
    """Models of the same records, the best first, and the fits behind them.

    ``sentences`` say which models the records tell apart.
    """

    case: str
    models: tuple[RankedModel, ...]
    sentences: tuple[str, ...]
    series: FitSeries

    @property
    def results(self) -> Mapping[str, FitResult]:
        """The fits by the names of their models, the best first."""
        results = self.series.results
        return {model.name: results[model.name] for model in self.models}

    @property
    def complete(self) -> bool:
        """Whether every model was fitted, and the first of them matches."""
        series = self.series
        done = not (series.failed or series.not_run or series.interrupted)
        return done and bool(self.models) and self.models[0].matches

    def to_dict(self) -> dict[str, Any]:
        """Return all figures as plain data, as ``exfit rank --json`` prints them."""
        return {
            "case": self.case,
            "models": [plain(model) for model in self.models],
            "sentences": [*self.sentences],
            **self.series.to_dict(),
        }


def rank(
    case: CaseOrPath,
    models: str | Iterable[str] = (),
    progress: Callable[[PlannedFit, Progress], None] = lambda *_: None,
    finished: Callable[[FitRun], None] = lambda _: None,
    search: str = "global",
) -> Ranking:
    """Fit the same records under several exciters, and rank these by their match.

    The exciter of the case has the values of the case, the others the typical data and bounds of
    their data sheets. Machine, network, stabiliser, tests and records are those of the case.

    Args:
        case: a case, or the path of its file.
        models: names of exciters or files of models; "DC", "AC", "ST": all of a type; "all": the
            whole catalogue; none: those of the same type as that of the case. Where a type has a
            form of 2005 and one of 2016, each of these takes that of the edition of the case.
        progress: called with the fit that runs and how far it is.
        finished: called with every fit that has ended.
        search: "global", or "local" for one run from the typical data alone.

    A KeyboardInterrupt ends it with the models that are finished. Raises CaseError for a case that
    cannot be fitted, ModelError for a model that does not exist.

    Example:
        >>> ranking = exfit.rank("case.yaml", ["AC7B", "AC8B", "ST6B"])
        >>> ranking.models[0].name, ranking.sentences
    """
    case = loaded(case)
    return ranking_of(case, run_all(planned_models(case, models, search), progress, finished))


def planned_models(
    case: Case, models: str | Iterable[str] = (), search: str = "global"
) -> tuple[PlannedFit, ...]:
    """Return the fit of each model; raises CaseError or ModelError where one cannot be planned."""
    own = case.parts.exciter
    if own is None or own.name == ALONE:
        raise CaseError(f"{case.path}: plant {case.plant.type} has no exciter to rank")
    if case.external is not None:
        text = f"{case.external.type}: not allowed with rank: the program has one exciter"
        raise CaseError(f"{case.path}: plant.type: {text}")
    cases: dict[str, Case] = {}
    for given in _names(own.name, [models] if isinstance(models, str) else [*models]):
        model = own if given == own.name else find(given, case.folder)
        if model.name in cases:
            raise CaseError(f"models: {given}: given more than once")
        same = model.name == own.name
        cases[model.name] = case if same else with_exciter(case, given, model)
    return tuple(
        PlannedFit(name, _without_causes(each), each.estimate.strategy, search, name)
        for name, each in cases.items()
    )


def _without_causes(case: Case) -> Case:
    """Return a case whose fit tries no causes, unless it says how long: rank tries the models."""
    if case.estimate.causes is not None:
        return case
    return replace(case, estimate=case.estimate.model_copy(update={"causes": 0.0}))


def _names(own: str, given: Sequence[str]) -> Sequence[str]:
    """Return the names of the models, that of the case first where they are not given.

    A type stands for several.
    """
    exciters = [name for name in MODELS if name != ALONE]
    if not given:
        return relatives(own, exciters)
    if [name.lower() for name in given] == [ALL]:
        return [own, *(name for name in without_doubles(own, exciters) if name != own)]
    names: list[str] = []
    for entry in given:
        kind = entry.upper()
        names += members(kind, own, exciters) if kind in FAMILIES else [entry]
    return names


def ranking_of(case: Case, series: FitSeries) -> Ranking:
    """Return the ranking of a series of fits of one case, a model each.

    One whose fit has no response to a record that was not fitted has failed.
    """
    silent = {
        run.name: match.reason
        for run in series.runs
        for match in run.result.validation
        if not match.overlays
    }
    runs = tuple(run for run in series.runs if run.name not in silent)
    series = replace(series, runs=runs, failed={**series.failed, **silent})
    typical = tuple(name for name in typical_values_used(case) if name.startswith(MACHINE))
    models = ranked(series.results, typical)
    return Ranking(case.path.stem, models, tuple(ranking_sentences(models)), series)
