"""A planner's file with the values of verified units: every other byte as it was.

A unit is verified where its fit holds: it matches its records, and the records that it did not see
are accepted.
"""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isclose
from typing import NamedTuple

from exfit.case.peek import stabiliser_inputs
from exfit.errors import ExfitError
from exfit.features.planner.export import as_quadratic, not_of_catalogue, values_in_digits
from exfit.features.planner.fields import Field, encoded, located, number, text_of
from exfit.features.planner.records import (
    OF_SATURATION,
    RATING,
    SHARE,
    Reading,
    fields_of,
    idle_lags,
    read_values,
)
from exfit.features.planner.units import DynamicsUnits, Unit, read_units
from exfit.inference.confidence import holds
from exfit.plants import MOVING_PREF
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.results.tables import csv_text
from exfit.util.text import listed, show
from exfit.util.vocabulary import TYPICAL

DIGITS = 6  # significant, of a number that is written: more than any interval resolves
SAME = 1e-9  # of a value: written in decimals and read again
MOST_NAMED = 3  # values in a reason


class FittedUnit(NamedTuple):
    """A fit of a batch under the name of its case."""

    name: str
    result: FitResult


class ChangedValue(NamedTuple):
    """A value of a record that was changed: a row of the table beside the file.

    ``low`` and ``high`` are its 95 % interval, None for a side without a limit, or if not fitted.
    """

    bus: int
    id: str
    model: str
    parameter: str
    unit: str
    before: float
    after: float
    low: float | None
    high: float | None
    source: str
    case: str


class LeftUnit(NamedTuple):
    """A case whose unit is as it was, and why; ``verified``: though its fit holds."""

    name: str
    reason: str
    verified: bool


@dataclass(frozen=True)
class FittedFile:
    """The content of a file with fitted values, what was changed, and what was left.

    ``undetermined`` are fitted values of a case that its records do not determine.
    """

    data: bytes
    changes: tuple[ChangedValue, ...]
    left: tuple[LeftUnit, ...]
    undetermined: Mapping[str, Sequence[str]]


class _Edit(NamedTuple):
    """A text in place of a field."""

    field: Field
    text: str


def fitted_file(
    data: bytes, file: str, fits: Iterable[FittedUnit], whole: bool = False
) -> FittedFile:
    """Return the content of a dynamics file with the values of those fits that hold.

    Of the records of such a unit only those fields change whose values are others than as found. A
    value that the records do not determine stays as found where they do not exclude that, unless
    values are written as a ``whole``. Raises DynamicsError for a file that is none.
    """
    text = text_of(data, file)
    units = read_units(text, file)
    verified, left = _by_place(fits)
    edits, changes, undetermined = list[_Edit](), list[ChangedValue](), dict[str, list[str]]()
    for place, of_unit in verified.items():
        for fit in of_unit:
            try:
                if place[0] is not None and len(of_unit) > 1:
                    names = ", ".join(other.name for other in of_unit)
                    raise ExfitError(f"several fits of the unit: {names}")
                unit = _unit_of(place, units, file)
                parts = [*_parts(fit.result, unit, file)]
                open_ones = [_undetermined(fit.result, *each) for each in parts]
                own = [
                    [*_edits(fit.result, *each, file, () if whole else kept)]
                    for each, kept in zip(parts, open_ones, strict=True)
                ]
            except ExfitError as fault:
                left.append(LeftUnit(fit.name, str(fault), verified=True))
                continue
            if any(open_ones):
                undetermined[fit.name] = [*chain(*open_ones)]
            for (part, prefix), of_part in zip(parts, own, strict=True):
                edits += of_part
                changes += _changes(fit, unit, part, prefix, of_part)
    pieces, end = [], 0
    for field, new in sorted(edits, key=lambda edit: edit.field.start):
        pieces += [text[end : field.start], new]
        end = field.end
    edited = "".join([*pieces, text[end:]])
    return FittedFile(encoded(edited, data), tuple(changes), tuple(left), undetermined)


def _by_place(
    fits: Iterable[FittedUnit],
) -> tuple[dict[tuple[int | None, str], list[FittedUnit]], list[LeftUnit]]:
    """Fits that hold by bus and id of their units, and why the others do not."""
    verified: dict[tuple[int | None, str], list[FittedUnit]] = {}
    left = list[LeftUnit]()
    for fit in fits:
        why = _why_not_verified(fit.result)
        if why is not None:
            left.append(LeftUnit(fit.name, f"not verified: {why}", verified=False))
            continue
        found = fit.result.as_found
        place = (None, "") if found is None else (found.bus, (found.machine_id or "").upper())
        verified.setdefault(place, []).append(fit)
    return verified, left


def _why_not_verified(result: FitResult) -> str | None:
    """Why the values of a fit are not written, None if they are.

    The intervals of grid events are computed of the noise alone: they hold if nothing else is in
    the residuals.
    """
    if not result.holds:
        return f"{outcome_of(result)}: {explanation_of(result)}"
    tests = result.verdict.refuted if result.comparison.is_event else ()
    others = [
        f"{test.signal} of {test.record}" if len(result.comparisons) > 1 else test.signal
        for test in tests
    ]
    if not others:
        return None
    return f"the residuals of {listed(others)} are not noise: the intervals are too narrow"


def changes_table(changes: Iterable[ChangedValue]) -> str:
    """Make a table of all changes as CSV."""
    return csv_text([ChangedValue._fields, *changes])


def number_text(value: float) -> str:
    """Return a constant as a dynamics file has it: a few digits, always with a point."""
    mantissa, exponent, power = f"{value:.{DIGITS}g}".upper().partition("E")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{exponent}{power}"


def _unit_of(place: tuple[int | None, str], units: DynamicsUnits, file: str) -> Unit:
    """Return the unit of a fit in the file; raises ExfitError where there is none."""
    bus, machine_id = place
    if bus is None or not machine_id:
        raise ExfitError("the case does not give bus and id of its unit (as_found)")
    for unit in units.units:
        if (unit.bus, unit.id.upper()) == place:
            return unit
    for refused in units.refused:
        if (refused.bus, refused.id.upper()) == place:
            raise ExfitError("; ".join(located(refused.faults, file)))
    raise ExfitError(f"{file}: no record of bus {bus}, machine {machine_id}")


def _parts(result: FitResult, unit: Unit, file: str) -> Iterator[tuple[Reading, str]]:
    """Yield the records that a fit has the models of, with how their parameters are named.

    Raises ExfitError where a record is of another model, or is not as it was found.
    """
    exciter = None if result.model == result.machine_model else result.model
    models: tuple[tuple[str | None, Reading | None, str], ...] = (
        (exciter, unit.exciter, ""),
        (result.machine_model, unit.machine, "machine."),
        (result.stabiliser_model, unit.stabiliser, "stabiliser."),
        (result.governor_model, unit.governor, "governor."),
        (result.load_controller_model, unit.load_controller, MOVING_PREF),
    )
    if "model" in result.inputs:
        raise ExfitError(not_of_catalogue(result, unit.exciter.definition.program))
    limiters = {part.definition.prefix: part for part in unit.limiters}
    for kind, name in result.limiter_models.items():
        prefix = f"{kind}."
        fitted = [name for name in result.parameters if name.startswith(prefix)]
        if prefix in limiters:
            models += ((name, limiters[prefix], prefix),)
        elif fitted:
            names = ", ".join(fitted)
            raise ExfitError(f"{file}: the unit has no record of {name}: fitted: {names}")
    for model, part, prefix in models:
        if model is None:
            continue
        if part is None:
            raise ExfitError(f"{file}: the unit has no record of {model}")
        name = part.definition.record.name
        if part.definition.model.name != model:
            advice = f"; exfit translate finds its data for {name}" if not prefix else ""
            raise ExfitError(f"{file}:{part.line}: {name}: the fitted model is {model}{advice}")
        _refuse_other_record(result, part, prefix, f"{file}:{part.line}: {name}")
        yield part, prefix


def _refuse_other_record(result: FitResult, part: Reading, prefix: str, place: str) -> None:
    """Raise ExfitError where a record is not as it was when the case was made of it."""
    found = {} if result.as_found is None else result.as_found.values
    others = []
    for symbol in part.definition.symbols:
        now, then = part.values[symbol], found.get(prefix + symbol)
        if then is None or not isclose(now, then, rel_tol=SAME):
            was = "not stated" if then is None else show(then)
            others.append(f"{symbol} is {show(now)}, as found {was}")
    if others:
        more = ", ..." if len(others) > MOST_NAMED else ""
        raise ExfitError(f"{place}: changed since import: {', '.join(others[:MOST_NAMED])}{more}")
    usual = getattr(part.definition.model, "inputs", ())
    inputs = stabiliser_inputs(result.case_text, result.case) or usual
    if part.inputs and inputs != part.inputs:
        theirs = ", ".join(part.inputs)
        text = f"its inputs are {theirs}, the fit has {', '.join(inputs)}"
        raise ExfitError(f"{place}: {text}")


def _undetermined(result: FitResult, part: Reading, prefix: str) -> list[str]:
    """Fitted values without an interval, or with an open one that holds the value as found."""
    fitted = {
        symbol: result.parameters[prefix + symbol]
        for symbol in part.definition.symbols
        if prefix + symbol in result.parameters
    }
    return [
        symbol
        for symbol, own in fitted.items()
        if not own.determined and holds(own.interval or (None, None), part.values[symbol])
    ]


def _edits(
    result: FitResult, part: Reading, prefix: str, file: str, kept: Container[str]
) -> Iterator[_Edit]:
    """Yield the fields of a record that change; raises ExfitError where values cannot be written.

    Typical values are not of the unit: their fields stay, and what no field holds is not missed. So
    do those that are ``kept``, or that the records know little better than the file.
    """
    definition, values = part.definition, values_in_digits(result, prefix)
    _refuse_lost(result, part, prefix, values)
    changed = _changed(result, part, prefix, values, kept)
    fields = fields_of(part)
    of_curve = definition.kind == "exciter" and changed & {*OF_SATURATION}
    if of_curve and result.saturation != "quadratic":
        raise ExfitError(as_quadratic(result, definition.program))
    texts: dict[Field, str] = {}
    for symbol in sorted(changed, key=definition.names.index):
        value, whole = values[symbol], symbol in dict(definition.record.icons)
        if whole and not float(value).is_integer():
            raise ExfitError(f"{symbol}: {show(value)} is not a whole number")
        texts[fields[symbol]] = str(int(value)) if whole else number_text(value)
    edited = tuple(field._replace(text=texts.get(field, field.text)) for field in part.fields)
    faults = read_values(definition, part.line, edited).faults
    if faults:
        raise ExfitError("; ".join(located(faults, file)))
    edits = (_Edit(field, text) for field, text in texts.items())
    yield from (edit for edit in edits if float(edit.text) != number(edit.field))


def _changed(
    result: FitResult,
    part: Reading,
    prefix: str,
    values: Mapping[str, float],
    kept: Container[str],
) -> set[str]:
    """The parameters of a record that change, with the fields that then say something again."""
    definition = part.definition
    changed = {
        symbol
        for symbol in definition.symbols
        if symbol not in kept
        and prefix + symbol not in result.refined
        and result.sources.get(prefix + symbol) != TYPICAL
        and not isclose(values[symbol], part.values[symbol], rel_tol=SAME)
    }
    # lags that a record may have as 0 as long as their gains are 0
    numbers = {name: number(field) for name, field in fields_of(part).items()}
    idle = idle_lags(definition.model.sheet, numbers)
    return changed | {row.symbol for row in idle if row.search and row.search.needs in changed}


def _refuse_lost(
    result: FitResult, part: Reading, prefix: str, values: Mapping[str, float]
) -> None:
    """Raise ExfitError where the record has no field for a value that is fitted or not its own."""
    record = part.definition.record
    own = {symbol: part.values[symbol] for symbol in dict(record.held)}
    if RATING in dict(part.unused):
        del own[SHARE]  # the file has the rating, and a case its share of a base not in the file
    for symbol in (row.symbol for row in part.definition.model.sheet):
        lost = f"{record.name} cannot hold {symbol} = {show(values[symbol])}"
        if symbol not in part.definition.names and prefix + symbol in result.parameters:
            raise ExfitError(f"{lost}, which was fitted")
        if values[symbol] != own.get(symbol, values[symbol]):
            raise ExfitError(f"{lost}: its value there is {show(own[symbol])}")


def _changes(
    fit: FittedUnit, unit: Unit, part: Reading, prefix: str, edits: Iterable[_Edit]
) -> Iterator[ChangedValue]:
    """Yield the rows of the table for the edits of a record."""
    rows = {row.symbol: row for row in part.definition.model.sheet}
    names = {field: name for name, field in fields_of(part).items()}
    for field, text in edits:
        symbol = names[field]
        fitted = fit.result.parameters.get(prefix + symbol)
        low, high = (None, None) if fitted is None else fitted.interval or (None, None)
        yield ChangedValue(
            unit.bus,
            unit.id,
            part.definition.record.name,
            symbol,
            rows[symbol].unit,
            number(field),
            float(text),
            low,
            high,
            fit.result.source_of(prefix + symbol),
            fit.name,
        )
