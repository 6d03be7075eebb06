"""What can be done with a case: the functions behind the commands and behind ``import exfit``.

Each imports what it needs when it is called: a simulation loads nothing of a fit.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exfit.case import load
from exfit.case.case import Case
from exfit.case.load import CaseOrPath

if TYPE_CHECKING:
    from exfit import estimate
    from exfit.case.schema.values import GivenAs
    from exfit.records.inspection import Inspection
    from exfit.records.record import Record
    from exfit.results.comparisons import Comparison
    from exfit.results.model import FitResult, Iteration
    from exfit.results.validation_result import ValidationResult
    from exfit.workflows.given_values import ValuesOrResult
    from exfit.workflows.model_check import Check
    from exfit.workflows.profiles import Profiles
    from exfit.workflows.responses import LiveResponse
    from exfit.workflows.simulation import SimulationResult


def _ignore(_: object) -> None:
    """Ignore a progress message."""


def fit(
    case: CaseOrPath,
    strategy: str | None = None,
    progress: "Callable[[Iteration], None]" = _ignore,
    search_progress: "Callable[[estimate.Progress], None]" = _ignore,
    live: "Callable[[LiveResponse], None] | None" = None,
    values: "ValuesOrResult | None" = None,
    search: str | None = None,
    given: "GivenAs | None" = None,
) -> "FitResult":
    """Fit the free parameters of a case to its records, and validate the result on its others.

    Args:
        case: a case, or the path of its file.
        strategy: of the run from the start of the case; None: as in the case.
        progress: called with every iteration of the path that leads from the start of the case to
            the result. A KeyboardInterrupt, raised in it too, ends the search with the best point
            so far.
        search_progress: called with the progress of the search from further starts.
        live: called before ``progress`` with the response of that iteration.
        values: in place of those of the case, by name, or those of an earlier fit: of a free
            parameter its start. The result says which.
        search: "global", or "local" for the run from the start of the case alone, with the
            intervals of linear theory; None: as in the case.
        given: how given values count, "uncertain" or "exact"; None: as in the case.

    Raises ExfitError for input that cannot be used.

    Example:
        >>> result = exfit.fit("case.yaml", progress=lambda iteration: print(iteration.cost))
        >>> result.parameters["KA"].value
    """
    from exfit.fitting.program import program_of
    from exfit.fitting.search import checked_strategy, search_options
    from exfit.workflows.fit_run import fit_result
    from exfit.workflows.given_values import with_values

    case = with_values(loaded(case, values), values)
    case = case if given is None else replace(case, given=given)
    method = checked_strategy(strategy or case.estimate.strategy)
    options = search_options(case, search)
    with program_of(case) as program:
        return fit_result(case, method, options, program, progress, search_progress, live)


def load_case(path: str | PathLike[str]) -> Case:
    """Return the case of a YAML file.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    return load.load_case(Path(path))


def read_record(
    path: str | PathLike[str],
    time: str | Sequence[str] | Mapping[str, str],
    channels: Mapping[str, str | Mapping[str, Any]],
    window: tuple[float, float] | None = None,
    missing: bool = False,
    sheet: str | None = None,
    resample: float | None = None,
    memory: float | None = None,
) -> "Record":
    """Return the record of a recorder's file of any supported format, per unit.

    Args:
        path: the file.
        time: column with the time, or the two of date and time of day, or {column, unit}.
        channels: column of each signal, or the mapping that a case has there: {column, unit, base,
            scale, offset} or {phases, kind, unit, base, connection}.
        window: first and last time kept, s.
        missing: whether a sample may be missing: it becomes nan.
        sheet: of a workbook.
        resample: rate of a slower, even clock, Hz.
        memory: what reading may take, GB; default: 1, or four times the file's size up to 4.

    Raises CaseError for columns and units that are not given rightly, RecordError for the file.

    Example:
        >>> volts = {"column": "Ugen", "unit": "kV", "base": 15.75}
        >>> record = exfit.read_record("bump.csv", ["Date", "Time"], {"vt": volts})
    """
    from exfit.case.load import record_section
    from exfit.fitting.recordings import read_section

    file = {"file": Path(path), "sheet": sheet, "memory": memory, "resample": resample}
    gaps = "skip" if missing else "refuse"
    samples = {"time": time, "channels": channels, "window": window, "gaps": gaps}
    given = {key: value for key, value in (file | samples).items() if value is not None}
    return read_section(record_section(given), Path(), per_unit=True)


def inspect(
    file: str | PathLike[str],
    time: str | Sequence[str] = (),
    time_unit: str | None = None,
    sheet: str | None = None,
    memory: float | None = None,
) -> "Inspection":
    """Return what a recorder's file holds, as ``exfit inspect`` shows it.

    Args:
        file: the file, of any supported format.
        time: column with the time, or those of date and time of day; none: as the file shows.
        time_unit: s, ms, us or min; None: as the file says, else s.
        sheet: of a workbook.
        memory: what reading may take, GB; default: 1, or four times the file's size up to 4.

    The result has the instants ``time`` (M,) in s, ``samples`` by column, each (M,) in its own
    unit, the ``channels`` with unit, level at rest, noise and the signal that each seems to be, the
    ``steps`` and the ``findings``. Raises RecordError where the file cannot be read.

    Example:
        >>> record = exfit.inspect("bump.csv")
        >>> [(channel.name, channel.signal, channel.level) for channel in record.channels]
        >>> [step.at for step in record.steps]
    """
    from exfit.case.suggestion import RecordSettings

    clock = (time,) if isinstance(time, str) else tuple(time)
    return RecordSettings(clock, time_unit, sheet, memory=memory).inspect(Path(file))


def loaded(case: CaseOrPath, values: "ValuesOrResult | None" = None) -> Case:
    """Return a case, read from its file where it is a path, whose own model is that of a fit.

    So is the program that simulates it.
    """
    from exfit.case.load import refuse_changed_program

    hashes = getattr(values, "inputs", {})
    if not isinstance(case, Case):
        case = load.load_case(Path(case), hashes.get("model", ""))
    refuse_changed_program(case, hashes.get("program", ""))
    return case


def simulate(case: CaseOrPath, values: "ValuesOrResult | None" = None) -> "SimulationResult":
    """Simulate a case, with the test of its first record where it has several.

    Args:
        case: a case, or the path of its file.
        values: of parameters, by name, or those of a fit; None: the start values of the case, which
            also stand for what is not among them.

    Raises ExfitError for input that cannot be used.

    Example:
        >>> exfit.simulate("case.yaml", {"KA": 400.0}).response.signals["vt"]
    """
    from exfit.fitting.program import program_of
    from exfit.fitting.system import values_of
    from exfit.workflows import simulation

    case = loaded(case, values)
    with program_of(case) as program:
        if not values and not case.given_values:  # the case's own, which are checked
            return simulation.simulate(case, values_of(case, {}), program)
        from exfit.workflows.given_values import changes_of

        return simulation.simulate(case, values_of(case, changes_of(case, values)), program)


def validate(
    case: CaseOrPath,
    values: "ValuesOrResult",
    record: "Record | Path | str | None" = None,
    step: float | Sequence[float] = (),
    at: float | Sequence[float] = (),
) -> "list[Comparison]":
    """Compare a case with its records: the fitted ones first, then those that were not fitted.

    Those that were not fitted are judged: ``accepted``, or the ``reason`` why not.

    Args:
        case: a case, or the path of its file.
        values: of parameters, by name, or those of a fit.
        record: instead of all records that were not fitted: a record, or a file with the columns of
            the first of them, or of the fitted one where there is no other. Its steps are
            detected: ``steps`` of the comparison lists them.
        step: size of its step, pu, instead of the one detected; for several steps one each.
        at: time of its step, s, instead of the one detected; for several steps one each.

    Raises ExfitError for input that cannot be used, or where there is nothing to validate on.

    Example:
        >>> result = exfit.fit("case.yaml")
        >>> [match.rmse for match in exfit.validate("case.yaml", result)]
        >>> exfit.validate("case.yaml", result, "down.csv")[-1].accepted
    """
    from exfit.fitting.program import program_of
    from exfit.workflows import validation

    case = loaded(case, values)
    with program_of(case) as program:
        return validation.validate(case, values, record, step, at, program).comparisons


def validation_result(
    case: CaseOrPath,
    values: "ValuesOrResult | None",
    record: "Record | Path | str | None" = None,
    step: float | Sequence[float] = (),
    at: float | Sequence[float] = (),
    sources: Mapping[str, str] | None = None,
) -> "ValidationResult":
    """Compare a case with its records as `validate` does, with all that a report shows of it.

    Without ``values`` they are those of the model as found, or else the start values: no record was
    fitted then. ``sources`` says where values come from that are given by name.
    """
    from exfit.fitting.program import program_of
    from exfit.results.model import FitResult
    from exfit.workflows import validation

    if isinstance(values, FitResult):
        sources = values.sources
    case = loaded(case, values)
    with program_of(case) as program:  # it runs the model as found, too
        compared = validation.validate(case, values, record, step, at, program)
        return validation.validation_result(compared, sources or {}, program)


def profile(
    case: CaseOrPath,
    names: str | Iterable[str] = (),
    progress: "Callable[[estimate.Progress], None]" = _ignore,
) -> "Profiles":
    """Fit a case and find the 95 % intervals of its parameters from their profile likelihood.

    Args:
        case: a case, or the path of its file.
        names: of free parameters, or of one; none: all.
        progress: called with the progress of the profiles.

    An interruption keeps what is done of the profiles; one of the fit before them is passed on.
    Raises ExfitError for input that cannot be used.

    Example:
        >>> for profile in exfit.profile("case.yaml", ["KA"]).profiles:
        ...     print(profile.name, profile.low, profile.high)
    """
    from exfit.fitting.program import program_of
    from exfit.workflows import profiles

    names = [names] if isinstance(names, str) else names
    case = loaded(case)
    with program_of(case) as program:
        return profiles.profile(case, names, progress, program)


def check(case: CaseOrPath) -> "Check":
    """Check a case before its fit: derivatives, bypasses, sub-steps, a run without a step.

    Raises ExfitError for input that cannot be used.

    Example:
        >>> exfit.workflows.check("case.yaml").agrees
    """
    from exfit.fitting.program import program_of
    from exfit.workflows import model_check

    case = loaded(case)
    with program_of(case) as program:
        return model_check.check(case, program)
