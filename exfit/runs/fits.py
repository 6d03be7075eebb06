"""Fits of several cases with several strategies, one after the other."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from exfit import estimate, workflows
from exfit.case.case import Case
from exfit.case.load import CaseOrPath
from exfit.errors import CaseError, ExfitError
from exfit.fitting.build import build_unseen
from exfit.fitting.search import checked_search, checked_strategy, fitted
from exfit.results.model import FitResult, Iteration
from exfit.results.side_by_side import outcome_of
from exfit.runs.runner import Runs, distinct_names, numbered, run_in_turn
from exfit.util.typed import plain

Progress = Iteration | estimate.Progress


@dataclass(frozen=True)
class PlannedFit:
    """A fit that has still to run: the name that no other of its series has, case and strategy.

    ``case_name`` is that of the case, which no other case of the series has; ``search`` is how far
    to search, None: as the case says.
    """

    case_name: str
    case: Case
    strategy: str
    search: str | None
    name: str


@dataclass(frozen=True, eq=False)
class FitRun:
    """A fit of a series: its name, that of its case, and its result."""

    name: str
    case_name: str
    result: FitResult

    @property
    def interrupted(self) -> bool:
        """Whether its result is the best point before an interruption."""
        return self.result.interrupted

    @property
    def verdict(self) -> str:
        """The verdict on its result, or what speaks against one that matches."""
        return outcome_of(self.result)

    @property
    def holds(self) -> bool:
        """Whether its result matches and is accepted."""
        return self.result.holds


@dataclass(frozen=True, eq=False)
class FitSeries(Runs[FitRun]):
    """The fits of several cases with several strategies, in the order of the cases."""

    @property
    def results(self) -> dict[str, FitResult]:
        """The results by the names of the fits."""
        return {run.name: run.result for run in self.runs}

    @property
    def by_case(self) -> dict[str, tuple[FitRun, ...]]:
        """The fits of each case, by its name."""
        names = dict.fromkeys(run.case_name for run in self.runs)
        return {name: tuple(run for run in self.runs if run.case_name == name) for name in names}

    @property
    def all_hold(self) -> bool:
        """Whether all fits were run, and each matches its records and is accepted."""
        done = not (self.failed or self.not_run or self.interrupted)
        return done and all(run.holds for run in self.runs)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of all fits as plain data, as ``exfit fit --json`` prints them."""
        return {
            "runs": [
                {
                    "name": run.name,
                    "case_name": run.case_name,
                    "outcome": run.verdict,
                    "result": run.result.to_dict(),
                }
                for run in self.runs
            ],
            "failed": plain(self.failed),
            "not_run": list(self.not_run),
            "interrupted": self.interrupted,
        }


def fit_all(
    cases: Iterable[CaseOrPath],
    strategies: Iterable[str] = (),
    progress: Callable[[PlannedFit, Progress], None] = lambda *_: None,
    finished: Callable[[FitRun], None] = lambda _: None,
    search: str | None = None,
) -> FitSeries:
    """Fit every case with every strategy; all cases are checked before the first fit.

    Args:
        cases: cases, or the paths of their files.
        strategies: of the descent from the start of a case; none: the own strategy of each case.
            Several are compared by that descent alone, unless ``search`` or the case says how far
            to search.
        progress: called with the fit that runs and its iteration, or how far its search from
            further starts is.
        finished: called with every fit that has ended, so that its files can be written.
        search: "global", or "local" for the descent from the start of each case alone; None: as
            each case says.

    A KeyboardInterrupt ends the series: it has the fits that were done, and the best point of the
    one that was running. Raises CaseError with the faults of all cases.

    Example:
        >>> series = exfit.fit_all(["a.yaml", "b.yaml"], ["dgn", "lm"])
        >>> {name: result.cost for name, result in series.results.items()}
    """
    return run_all(planned([*cases], [*strategies], search=search), progress, finished)


def planned(
    cases: Sequence[CaseOrPath],
    strategies: Sequence[str],
    load: Callable[[Any], Case] = workflows.loaded,
    search: str | None = None,
) -> tuple[PlannedFit, ...]:
    """Return the fits of every case with every strategy, or with its own where none is given.

    Cases and records are read; raises CaseError with the faults of all of them.
    """
    read: list[Case] = []

    def check_fit(source: Any) -> None:
        """Read the records of a case; raises ExfitError where no fit could begin."""
        case = load(source)
        setups, _ = fitted(case)
        build_unseen(case, case.validations, case.values(), setups)
        read.append(case)

    files = [case for case in cases if not isinstance(case, Case)]
    faults = [
        *_repeated("case", files, [Path(file).resolve() for file in files]),
        *_repeated("strategy", strategies, strategies),
        *_faults(checked_strategy, strategies),
        *_faults(checked_search, [] if search is None else [search]),
        *_faults(check_fit, cases),
    ]
    if faults:
        raise CaseError(faults)
    names = distinct_names([case.path for case in read])
    combinations = [
        (name, case, strategy)
        for name, case in zip(names, read, strict=True)
        for strategy in strategies or [case.estimate.strategy]
    ]
    runs = numbered([f"{name}-{strategy}" for name, _, strategy in combinations])
    plan = []
    for (name, case, strategy), run in zip(combinations, runs, strict=True):
        asked = search is not None or case.estimate.model_fields_set & {"search", "starts"}
        # strategies are compared: a search that goes on would lead all of them to one minimum
        far = "local" if len(strategies) > 1 and not asked else search
        plan.append(PlannedFit(name, case, strategy, far, run))
    return tuple(plan)


def run_all(
    plan: Sequence[PlannedFit],
    progress: Callable[[PlannedFit, Progress], None] = lambda *_: None,
    finished: Callable[[FitRun], None] = lambda _: None,
) -> FitSeries:
    """Run planned fits one after the other; one that fails keeps no other from running."""

    def run(fit: PlannedFit) -> FitRun:
        shown = partial(progress, fit)
        result = workflows.fit(fit.case, fit.strategy, shown, shown, search=fit.search)
        return FitRun(fit.name, fit.case_name, result)

    return FitSeries(**vars(run_in_turn(plan, run, finished)))


def _faults(check: Callable[[Any], object], subjects: Iterable[object]) -> Iterator[str]:
    """Yield the lines of what a check raises for each subject."""
    for subject in subjects:
        try:
            check(subject)
        except ExfitError as fault:
            yield from str(fault).splitlines()


def _repeated(kind: str, given: Sequence[object], identities: Sequence[object]) -> Iterator[str]:
    """Yield repetitions, by what was given and not by its name."""
    for identity, count in Counter(identities).items():
        if count > 1:
            yield f"{kind} {given[identities.index(identity)]}: given {count} times"
