"""The whole path of a study: from a case to a fit, a simulation, a validation."""

import sys
import time as clock
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit import __version__, estimate
from exfit.analysis.diagnostics import (
    level_notes,
    match_notes,
    misfit_notes,
    notes,
    outlier_notes,
    typical_notes,
    unsteady_notes,
    validation_notes,
    voltage_notes,
)
from exfit.analysis.iteration_responses import (
    LiveResponse,
    live_response,
    skipped_response_notes,
    with_iteration_responses,
)
from exfit.case.case import SINGLE, Case
from exfit.case.schema import Unknown
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import (
    ExperimentSetup,
    build_experiment,
    plain_simulator,
    robust_of,
    values_of,
    with_enough_substeps,
)
from exfit.fitting.compression import compressed
from exfit.fitting.nonlinearity import nonlinear_parameters
from exfit.fitting.nuisance import unit_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import UNIT, fitted, names_of_records, search
from exfit.fitting.uncertainty import UncertaintyAnalysis, uncertainty_at
from exfit.records.record import file_hash
from exfit.results.compare_with_record import compare_with_record
from exfit.results.model import (
    Comparison,
    FitResult,
    FittedParameter,
    Iteration,
    Minima,
    Minimum,
    PartOf,
)
from exfit.simulation.simulator import Response

Array = NDArray[np.float64]
Values = Mapping[str, float]

LIBRARIES = ("numpy", "llvmlite", "pydantic")


def fit(
    case: Case,
    strategy: estimate.Method | None = None,
    watch: Callable[[Iteration], None] = lambda _: None,
    progress: Callable[[estimate.Progress], None] = lambda _: None,
    look: Callable[[LiveResponse], None] | None = None,
) -> FitResult:
    """Fit the free parameters of a case to its records, and try the result on its other records.

    ``watch`` is told every iteration, ``look`` before it the response that it led to, ``progress``
    how far a search from many starts is. An interruption (KeyboardInterrupt) ends the search with
    the best point so far. Raises ExfitError for input that cannot be used.
    """
    began = clock.perf_counter()
    given = case.values()
    trials, residuals = fitted(case)
    validations = tuple(build_experiment(case, one, given) for one in case.validations)
    fewer = compressed(residuals)
    before = fewer.simulations
    method = strategy or case.estimate.strategy
    history: list[Iteration] = []

    def announce(line: estimate.SolverIteration) -> None:
        history.append(_iteration(line, residuals))
        seen = None if look is None else live_response(trials[0], residuals, line.x)
        if look is not None and seen is not None:
            look(seen)
        watch(history[-1])

    found, minima = search(case, residuals, method, announce, progress)
    simulations, substeps = fewer.simulations - before, fewer.substeps  # of the search alone
    values, begin = residuals.values(found.x), residuals.values(residuals.start)
    interrupted = found.stop is estimate.Stop.INTERRUPTED
    known = None if interrupted else told(residuals, found.x, trials)
    secure = [one.with_enough_substeps(values) for one in trials]
    compared = tuple(
        with_iteration_responses(
            compare_with_record(one, one.name, values, begin), one, residuals, history
        )
        for one in secure
    )
    tried = tuple(tried_on(case, one, values) for one in validations)
    return FitResult(
        case=case.path,
        name=case.path.stem,
        model=case.subject,
        strategy=method,
        saturation=case.saturation,
        parameters=_parameters(case, residuals, values),
        fixed={name: values[name] for name in given if name not in case.free()},
        ties={name: tie.text for name, tie in case.ties.by_name.items()},
        typical=case.typical(),
        parts=tuple(PartOf(part.kind, part.name, part.prefix) for part in case.parts.all),
        cost=found.cost,
        comparisons=compared,
        knowledge=known,
        minima=None if minima is None else minima_of(residuals, minima),
        status=found.status,
        message=found.message,
        success=found.success,
        interrupted=interrupted or (minima is not None and minima.interrupted),
        history=tuple(history),
        nfev=found.nfev,
        njev=found.njev,
        simulations=simulations,
        substeps=substeps,
        seconds=clock.perf_counter() - began,
        notes=(
            *_notes(case, residuals, found, trials, compared, tried),
            *(() if known is None else misfit_notes(residuals, known)),
            *skipped_response_notes(compared),
        ),
        validation=tried,
        versions=versions(),
        inputs=inputs(case, *trials, *validations),
        about=case.about,
    )


def told(
    residuals: Residuals, theta: Array, trials: Iterable[ExperimentSetup]
) -> UncertaintyAnalysis | None:
    """Return what the records tell at the solution theta (N,), in scaled parameters.

    None where the derivatives there are not finite.
    """
    try:
        known = uncertainty_at(residuals, theta, names_of_records(trials))
    except SimulationError:
        return None
    return replace(known, nonlinear=nonlinear_parameters(residuals, theta, known))


def minima_of(residuals: Residuals, found: estimate.MultistartResult) -> Minima:
    """Return the minima that were found, in the parameters' own values."""
    names = [one.name for one in residuals.free]

    def minimum(one: estimate.LocalMinimum) -> Minimum:
        values = residuals.values(one.x)
        return Minimum({name: values[name] for name in names}, one.cost, one.starts)

    each = tuple(minimum(one) for one in found.minima)
    return Minima(each, found.start_costs, found.end_costs)


def _notes(
    case: Case,
    residuals: Residuals,
    found: estimate.Result,
    trials: Sequence[ExperimentSetup],
    compared: Sequence[Comparison],
    tried: Sequence[Comparison],
) -> Iterator[str]:
    """Yield what must be known beside the numbers of a fit."""
    if not found.success:
        yield "the search did not end at a minimum: errors and intervals would be those of one"
    yield from notes(case, residuals, found, compared)
    for trial, one in zip(trials, compared, strict=True):
        before = trial.test.vt0 if trial.test.begin is None else None
        # one that is found lies where the record begins, or on a bound, which is told
        yield from match_notes(one, None if isinstance(before, Unknown) else before)
        if case.plant.type != "none":
            yield from voltage_notes(one)
        yield from record_notes(trial, one)
        yield from outlier_notes(trial.record.source.name, trial.channels)
    yield from validation_notes(compared, tried)


def tried_on(
    case: Case, trial: ExperimentSetup, values: Values, name: str | None = None
) -> Comparison:
    """Return how fitted values do on a record that the fit never saw.

    What that record leaves open about itself (its instants, its levels) is found on it, with the
    parameters of the unit as they are.
    """
    limit = None if case.accept is None else case.accept.rmse
    with_enough_substeps = trial.with_enough_substeps(values)
    if trial.free:
        robust = robust_of(case)
        residuals = Residuals([with_enough_substeps.experiment], trial.free, values, robust=robust)
        aligned = estimate.least_squares(
            residuals,
            residuals.start,
            jac=residuals.exact,
            bounds=residuals.bounds,
            method="lm-then-dgn",
            x_scale=UNIT,
        )
        values = residuals.values(aligned.x)
    return compare_with_record(with_enough_substeps, name or trial.name, values, None, limit)


def record_notes(trial: ExperimentSetup, compared: Comparison) -> Iterator[str]:
    """Yield what the steady part of a record says against the case."""
    test = trial.test
    if test.steady is not None and test.begin is None:
        yield from unsteady_notes(trial.record, test.steady, trial.channels)
        yield from level_notes(compared, test.steady)


def _parameters(case: Case, residuals: Residuals, values: Values) -> dict[str, FittedParameter]:
    units, shared = case.units(), case.free()
    return {
        one.name: FittedParameter(
            value=values[one.name],
            start=one.start,
            min=one.low,
            max=one.high,
            at_bound=one.bound(values[one.name]),
            unit=units.get(one.name, unit_of(one.name)),
            of_record=one.name not in shared,
        )
        for one in residuals.free
    }


def _iteration(line: estimate.SolverIteration, residuals: Residuals) -> Iteration:
    """Return a line of the log with the parameters' own values for the scaled ones."""
    values = residuals.values(line.x)
    kept = {name: value for name, value in vars(line).items() if name != "x"}
    return Iteration(**kept, values={one.name: values[one.name] for one in residuals.free})


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    from importlib.metadata import version

    return {
        "exfit": __version__,
        "python": ".".join(map(str, sys.version_info[:3])),
        **{name: version(name) for name in LIBRARIES},
    }


def inputs(case: Case, *trials: ExperimentSetup) -> dict[str, str]:
    """Return the SHA-256 of every file that went into a result."""
    files = {"case": file_hash(case.path)}
    if case.model is not None and case.model.endswith(".py"):
        files["model"] = file_hash(case.folder / case.model)
    fitted = ["record"] if not case.records else [f"records.{one.name}" for one in case.records]
    labels = [*fitted, *(f"validate.{one.name}" for one in case.validations)]
    return files | {label: trial.record.sha256 for label, trial in zip(labels, trials, strict=True)}


@dataclass(frozen=True)
class SimulationResult:
    """A response of a case, with the record beside it where there is one."""

    response: Response
    comparison: Comparison | None
    notes: tuple[str, ...]


def simulate(case: Case, changes: Values) -> SimulationResult:
    """Simulate a case at its start values, with changes upon them; of several records the first.

    Raises ExfitError for input that cannot be used.
    """
    values = values_of(case, changes)
    if case.recordings:
        trial = build_experiment(case, case.recordings[0], values).with_enough_substeps(values)
        response = trial.response(values)
        compared = compare_with_record(trial, "record", values) if trial.channels else None
        told = [] if compared is None else record_notes(trial, compared)
        return SimulationResult(response, compared, (*simulation_notes(case, response), *told))
    simulator, levels = plain_simulator(case, values)
    at = {**values, **levels}
    response = with_enough_substeps(simulator, at, case.path).response(at)
    return SimulationResult(response, None, tuple(simulation_notes(case, response)))


def simulation_notes(case: Case, response: Response) -> Iterator[str]:
    """Yield which values are typical, and whether the machine falls out of step."""
    yield from typical_notes(case)
    delta = response.signals.get("delta")
    if delta is not None and np.max(np.abs(delta)) > np.pi:
        at = float(response.time[np.argmax(np.abs(delta) > np.pi)])
        yield f"the machine falls out of step at {at:.3g} s: delta passes half a turn"


def validate(case: Case, changes: Values, record: Path | None = None) -> list[Comparison]:
    """Compare a case with its records: the fitted ones first, then those that no fit saw.

    ``record`` takes the place of the first of the latter (or of the fitted one if there is no
    other), under the same test and columns. Raises ExfitError for input that cannot be used.
    """
    fitted, others = list(case.recordings), list(case.validations)
    if record is not None:
        if not fitted + others:
            raise CaseError([f"{case.path}: record: missing; nothing says how to read {record}"])
        like = (others + fitted)[0]
        file = like.record.model_copy(update={"file": str(record.absolute())})
        name = record.name if record.stem == SINGLE else record.stem
        others = [like.model_copy(update={"name": name, "record": file})]
    if not fitted + others:
        raise CaseError([f"{case.path}: validate: missing; there is no record to compare with"])
    values = values_of(case, changes)
    seen = [build_experiment(case, one, values).with_enough_substeps(values) for one in fitted]
    unseen = [build_experiment(case, one, values) for one in others]
    return [
        *(compare_with_record(one, one.name, values) for one in seen),
        *(tried_on(case, one, values) for one in unseen),
    ]
