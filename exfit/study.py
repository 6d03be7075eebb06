"""The whole path of a study: from a case to a fit, a simulation, a validation."""

import sys
import time as clock
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exfit import __version__, estimate
from exfit.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.notes import level_notes, match_notes, notes, typical_notes, unsteady_notes
from exfit.plant import VT0
from exfit.record import file_hash
from exfit.residuals import JACOBIANS, Residuals
from exfit.result import Comparison, FitResult, FittedParameter, Iteration, PartOf
from exfit.simulate import Response
from exfit.trial import (
    Trial,
    fitted_trial,
    plain_simulator,
    residuals_of,
    secured,
    trial_of,
    values_of,
)

Values = Mapping[str, float]

LIBRARIES = ("numpy", "llvmlite", "pydantic")
UNIT = 0.5  # of a scaled parameter, a reasonable step: a factor of 1.6, or half of the interval


def fit(
    case: Case,
    strategy: estimate.Method | None = None,
    watch: Callable[[Iteration], None] = lambda _: None,
) -> FitResult:
    """Fit the free parameters of a case to its record, and try the result on its other records.

    ``watch`` is told every iteration. An interruption (KeyboardInterrupt) ends the search with the
    best point so far. Raises ExfitError for input that cannot be used.
    """
    began = clock.perf_counter()
    given = case.values()
    trial = fitted_trial(case).secured(given)
    validations = [trial_of(case, one.test, one.record, given) for one in case.validations]
    refuse_unfit(case, residuals_of(case, trial))
    residuals = residuals_of(case, trial)
    start = residuals.start
    method = strategy or case.estimate.strategy
    history: list[Iteration] = []

    def announce(line: estimate.Iteration) -> None:
        history.append(_iteration(line, residuals))
        watch(history[-1])

    found = estimate.least_squares(
        residuals,
        start,
        jac=JACOBIANS[case.estimate.jacobian](residuals),
        bounds=residuals.bounds,
        method=method,
        max_iterations=case.estimate.iterations,
        gtol=case.estimate.tolerance.gradient,
        xtol=case.estimate.tolerance.step,
        x_scale=UNIT,
        good_enough=case.estimate.good_enough.rmse,
        callback=announce,
    )
    values, begin = residuals.values(found.x), residuals.values(start)
    limit = None if case.accept is None else case.accept.rmse
    compared = trial.secured(values).compare("fit", values, begin)
    tried = tuple(
        other.secured(values).compare(one.name, values, None, limit)
        for one, other in zip(case.validations, validations, strict=True)
    )
    return FitResult(
        case=case.path,
        name=case.path.stem,
        model=case.subject,
        strategy=method,
        saturation=case.saturation,
        parameters=_parameters(case, residuals, values),
        fixed={name: v for name, v in given.items() if name not in case.free()},
        typical=case.typical(),
        parts=tuple(PartOf(part.kind, part.name, part.prefix) for part in case.parts.all),
        comparison=compared,
        status=found.status,
        message=found.message,
        success=found.success,
        interrupted=found.status == estimate.STATUS[estimate.Stop.INTERRUPTED],
        history=tuple(history),
        nfev=found.nfev,
        njev=found.njev,
        simulations=residuals.simulations,
        substeps=residuals.substeps,
        seconds=clock.perf_counter() - began,
        notes=(
            *notes(case, residuals, found, compared),
            *match_notes(compared, tried, trial.levels.get(VT0)),
            *record_notes(case, trial, compared),
        ),
        validation=tried,
        versions=versions(),
        inputs=inputs(case, trial, *validations),
    )


def record_notes(case: Case, trial: Trial, compared: Comparison) -> Iterator[str]:
    """Yield what the steady part of a record says against the case."""
    if case.test.steady is not None and case.test.begin is None:
        yield from unsteady_notes(trial.record, case.test.steady)
        yield from level_notes(compared, case.test.steady)


def refuse_unfit(case: Case, residuals: Residuals) -> None:
    """Raise ExfitError where a record cannot be fitted: it is too short, flat, or out of scale."""
    samples, unknown = residuals.measured.size, len(residuals.free)
    if samples < unknown:
        raise CaseError([f"{case.path}: record: {samples} samples for {unknown} free parameters"])
    for channel in residuals.channels:
        if np.all(channel.measured == channel.measured[0]):
            level = f"{channel.signal} is {channel.measured[0]:g} pu throughout"
            raise CaseError([f"{case.path}: record: {level}: it shows no test"])
    with np.errstate(over="ignore"):
        start = residuals(residuals.start)
        square = float(start @ start)
    if not np.isfinite(square):
        largest = float(np.max(np.abs(start)))
        raise SimulationError(
            f"{case.path}: the residuals at the start values are too large to be squared: "
            f"up to {largest:.3g}; check scale, weight and start"
        )


def _parameters(case: Case, residuals: Residuals, values: Values) -> dict[str, FittedParameter]:
    units = case.units()
    return {
        one.name: FittedParameter(
            value=values[one.name],
            start=one.start,
            min=one.low,
            max=one.high,
            at_bound=one.bound(values[one.name]),
            unit=units[one.name],
        )
        for one in residuals.free
    }


def _iteration(line: estimate.Iteration, residuals: Residuals) -> Iteration:
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


def inputs(case: Case, *trials: Trial) -> dict[str, str]:
    """Return the SHA-256 of every file that went into a result."""
    files = {"case": file_hash(case.path)}
    if case.model is not None and case.model.endswith(".py"):
        files["model"] = file_hash(case.folder / case.model)
    labels = ["record", *(f"validate.{one.name}" for one in case.validations)]
    return files | {
        label: trial.record.sha256 for label, trial in zip(labels, trials, strict=False)
    }


@dataclass(frozen=True)
class Simulation:
    """A response of a case, with the record beside it where there is one."""

    response: Response
    comparison: Comparison | None
    notes: tuple[str, ...]


def simulate(case: Case, changes: Values) -> Simulation:
    """Simulate a case at its start values, with changes upon them.

    Raises ExfitError for input that cannot be used.
    """
    values = values_of(case, changes)
    if case.record is not None:
        trial = trial_of(case, case.test, case.record, values).secured(values)
        response = trial.simulator.response({**values, **trial.levels})
        compared = trial.compare("record", values) if trial.channels else None
        told = [] if compared is None else record_notes(case, trial, compared)
        return Simulation(response, compared, (*simulation_notes(case, response), *told))
    simulator, levels = plain_simulator(case, values)
    at = {**values, **levels}
    response = secured(simulator, at, case.path).response(at)
    return Simulation(response, None, tuple(simulation_notes(case, response)))


def simulation_notes(case: Case, response: Response) -> Iterator[str]:
    """Yield which values are typical, and whether the machine falls out of step."""
    yield from typical_notes(case)
    delta = response.signals.get("delta")
    if delta is not None and np.max(np.abs(delta)) > np.pi:
        at = float(response.time[np.argmax(np.abs(delta) > np.pi)])
        yield f"the machine falls out of step at {at:.3g} s: delta passes half a turn"


def validate(case: Case, changes: Values, record: Path | None = None) -> list[Comparison]:
    """Compare a case with its records: the fitted one first, then those that no fit saw.

    ``record`` takes the place of the first of the latter (or of the fitted one if there is no
    other), under the same test and columns. Raises ExfitError for input that cannot be used.
    """
    limit = None if case.accept is None else case.accept.rmse
    named = [(one.name, one.test, one.record, limit) for one in case.validations]
    fitted = [] if case.record is None else [("fit", case.test, case.record, None)]
    if record is not None:
        if not named + fitted:
            raise CaseError([f"{case.path}: record: missing; nothing says how to read {record}"])
        _, test, file, _ = (named + fitted)[0]
        other = file.model_copy(update={"file": str(record.absolute())})
        name = record.name if record.stem == "fit" else record.stem
        named = [(name, test, other, limit)]
    if not named + fitted:
        raise CaseError([f"{case.path}: validate: missing; there is no record to compare with"])
    values = values_of(case, changes)
    return [
        trial_of(case, test, file, values).secured(values).compare(name, values, None, most)
        for name, test, file, most in fitted + named
    ]
