"""The records of a fit, as a planner's file."""

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

from exfit import __version__
from exfit.case.peek import limiter_places, section_of, stabiliser_inputs, unused_values
from exfit.errors import ExfitError, FileError
from exfit.features.planner.file_format import MOST_BUSES, WIDTH, FileFormat, is_machine_id
from exfit.features.planner.psse import PSSE_FILES
from exfit.features.planner.records import (
    PSSE,
    RATING,
    SHARE,
    SIGNALS,
    SPEED_FLAG,
    Definition,
    alternatives,
    contradictions,
    definition_of,
    definitions,
    in_digits_borne,
    outside,
    unused_of,
)
from exfit.features.translate.result import Translation
from exfit.models import LIMITERS, MODELS
from exfit.models.counterparts import OUT_OF_REACH
from exfit.models.machines import MACHINES
from exfit.models.sheet import DynamicsRecord
from exfit.results.influences import by_weight, first_of
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.util.sources import NOT_STATED, TYPICAL, by_source
from exfit.util.text import near, show

NAME = re.compile(r"[A-Za-z_][\w.]*")  # in a tie
CODES = {signal: code for code, signal in SIGNALS.items()}


@dataclass(frozen=True)
class Exported:
    """A dynamics file, and what its user must know."""

    text: str
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Written:
    """A record with its values, and their names by the source of their values.

    ``unused`` are values of the planner's file that its program does without.
    """

    definition: Definition
    values: Mapping[str, float]
    by_source: Mapping[str, Sequence[str]]
    unused: Mapping[str, float]


def export(
    result: FitResult,
    bus: int,
    machine_id: str,
    name: str | None = None,
    translation: Translation | None = None,
    files: FileFormat = PSSE_FILES,
) -> Exported:
    """Return the records of a fit for a program, of its exciter as its ``translation`` has it.

    ``name`` is the record of the exciter in place of the model's own. Raises ExfitError where the
    model has no record, or a value is missing or lies outside the range of its data sheet.
    """
    origin = [*_origin(result)]
    if translation is not None:
        verdict = f"{translation.source} as {translation.target}: {translation.verdict}"
        origin += [f"{text}." for text in (verdict, *translation.notes)]
        result = _translated(result, translation)
    program = files.program
    of_fit = [*_of_fit(result, program)]
    warnings = list[str]()
    exciter = [*_exciter(result, program, name)]
    written = [
        *_machine(result, program, warnings),
        *exciter,
        *_added(result, "stabiliser", program, warnings),
        *_added(result, "governor", program, warnings),
        *_limiters(result, program, exciter, warnings),
    ]
    if not written:
        raise ExfitError(f"{result.model} has no {program} record")
    for record in written:
        warnings += _warnings(record)
    of_fit += _of_speed(result, written)
    comments = [*origin, *(f"{text}." for text in of_fit)]
    comments += [text for record in written for text in _comments(record)]
    lines = [line for text in comments for line in comment_lines(text, files)]
    lines += [
        files.record_text(own.definition, {**own.values, **own.unused}, bus, machine_id)
        for own in written
    ]
    return Exported("\n".join(lines) + "\n", (*of_fit, *warnings))


def place_of(result: FitResult) -> tuple[int, str]:
    """The bus and the machine id of a unit where it was found, 1 where that is not said.

    Raises ExfitError for what no record can hold.
    """
    found = result.as_found
    place = (None, None) if found is None else (found.bus, found.machine_id)
    bus, machine_id = (1 if place[0] is None else place[0]), place[1] or "1"
    if not (0 < bus < MOST_BUSES and is_machine_id(machine_id)):
        raise ExfitError(
            f"as_found: bus {bus}, id {machine_id!r} are not those of a record; "
            "give them with --bus and --id"
        )
    return bus, machine_id


def _translated(result: FitResult, translation: Translation) -> FitResult:
    """Return a result whose exciter is that of a translation."""
    others = {name: entry for name, entry in result.parameters.items() if "." in name}
    of_others = {name: word for name, word in result.sources.items() if "." in name}
    of_target = {name: entry.value_source for name, entry in translation.parameters.items()}
    return replace(
        result,
        model=translation.target,
        parameters=others,
        fixed=translation.values,
        sources={**of_target, **of_others},
        inputs={label: sha for label, sha in result.inputs.items() if label != "model"},
    )


def _of_fit(result: FitResult, program: str) -> Iterator[str]:
    """List remarks on the fit that the reader must know."""
    if not result.holds:
        yield f"the fit does not hold: {outcome_of(result)}: {explanation_of(result)}"
    weighty = [*by_weight(result.typical_values)]
    if weighty:
        yield f"what was fitted depends on typical values: {first_of(weighty)}"
    if result.saturation != "quadratic":
        yield (
            f"fitted with saturation: {result.saturation}; {program} takes E1 SE1 E2 SE2 as "
            "quadratic"
        )


def _of_speed(result: FitResult, written: Iterable[Written]) -> Iterator[str]:
    """Warn of efd times the speed in the fit, which the record does not have."""
    if not _times_speed(result):
        return
    for record in (
        entry.definition.record for entry in written if entry.definition.kind == "exciter"
    ):
        if not record.times_speed and SPEED_FLAG not in record.cons:
            yield f"fitted with efd_times_speed; {record.name} does not multiply efd by the speed"


def _exciter(result: FitResult, program: str, name: str | None) -> Iterator[Written]:
    if result.model == result.machine_model:  # it stood alone
        if name is not None:
            raise ExfitError(f"--model {name}: the fit is of {result.model}, without an exciter")
        return
    model = MODELS.get(result.model)
    if model is None or "model" in result.inputs:
        raise ExfitError(
            f"{result.model} is not a model of the catalogue: it has no {program} record"
        )
    candidates = {entry.record.name.upper(): entry for entry in alternatives(model, program)}
    if not candidates:
        raise ExfitError(f"{result.model} has no {program} record")
    wanted = next(iter(candidates)) if name is None else name.upper()
    if wanted not in candidates:
        raise ExfitError(
            f"--model {name}: not a record of {result.model}; "
            f"{_other_model(wanted, program) or near(wanted, candidates)}"
        )
    written = _written(result, candidates[wanted], "")
    flags = {SPEED_FLAG: 1.0} if _times_speed(result) else {}
    flags |= _place_flags(result, written.definition.record)
    yield replace(written, values={**written.values, **flags})


def _place_flags(result: FitResult, record: DynamicsRecord) -> dict[str, float]:
    """Return the flags that say in an exciter's record where limiters act, as far as known."""
    given = limiter_places(result.case_text, result.case)
    codes = {place: float(code) for code, place in record.places}
    places = {
        kind.upper(): given.get(name, LIMITERS[name].places[0])
        for kind, name in result.limiter_models.items()
        if name in LIMITERS and LIMITERS[name].records
    }
    return {
        flag: codes[place]
        for flag, place in places.items()
        if flag in dict(record.icons) and place in codes
    }


def _times_speed(result: FitResult) -> bool:
    """Tell if a fit took efd times the speed."""
    return section_of(result.case_text, result.case, "efd_times_speed") is True


def _other_model(name: str, program: str) -> str:
    """Return a hint where a record is that of another exciter."""
    definition = definition_of(name, program)
    if definition is None or definition.kind != "exciter":
        return ""
    return f"`exfit translate RESULT --model {name}` finds the data of {definition.model.name}"


def _machine(result: FitResult, program: str, warnings: list[str]) -> Iterator[Written]:
    name = result.machine_model
    candidates = (
        alternatives(MACHINES[name], program) if name is not None and name in MACHINES else []
    )
    if not candidates:
        what = "no machine is named" if name is None else f"machine {name} has no {program} record"
        warnings.append(f"{what}: only the exciter is written")
        return
    yield _written(result, candidates[0], "machine.")


def _added(result: FitResult, kind: str, program: str, warnings: list[str]) -> Iterator[Written]:
    """Yield the record of the stabiliser or governor; add what is lost to the warnings."""
    name = result.stabiliser_model if kind == "stabiliser" else result.governor_model
    if name is None:
        return
    candidates = [
        entry for entry in definitions(program) if entry.kind == kind and entry.model.name == name
    ]
    if not candidates:
        warnings.append(f"{kind} {name} has no {program} record: it is left out")
        return
    record = _written(result, candidates[0], f"{kind}.")
    own = getattr(record.definition.model, "inputs", ())
    inputs = stabiliser_inputs(result.case_text, result.case) or own
    codes = dict(zip(record.definition.codes, map(CODES.__getitem__, inputs), strict=False))
    if not codes and inputs != own:
        warnings.append(f"{name} has no codes of its inputs: {', '.join(inputs)} is lost")
    yield replace(record, values={**record.values, **codes})


def _limiters(
    result: FitResult, program: str, exciters: Iterable[Written], warnings: list[str]
) -> Iterator[Written]:
    """Yield the records of the limiters; add what is lost to the warnings."""
    placed = [flag for entry in exciters for flag in entry.values]
    for kind, name in result.limiter_models.items():
        records = LIMITERS[name].records if name in LIMITERS and program == PSSE else ()
        if not records:
            warnings.append(f"limiter {name} has no {program} record: it is left out")
            continue
        yield _written(result, Definition("limiter", LIMITERS[name], records[0]), f"{kind}.")
        if kind.upper() not in placed:
            warnings.append(f"{name}: the exciter's record says nothing of its place: set its flag")


def values_in_digits(result: FitResult, prefix: str) -> dict[str, float]:
    """The values of a model; fitted ones, and those tied to them, in the digits that they bear."""
    values = dict(result.values_of(prefix))
    for symbol, value in values.items():
        name = prefix + symbol
        if name in result.parameters:
            values[symbol] = in_digits_borne(value, result.parameters[name].rounding_error)
        elif result.parameters.keys() & NAME.findall(result.ties.get(name, "")):
            values[symbol] = in_digits_borne(value, None)
    return values


def _written(result: FitResult, definition: Definition, prefix: str) -> Written:
    """Return a record with the values of a result.

    Raises ExfitError where one is missing, outside its data sheet's range, or contradicts others.
    """
    values = values_in_digits(result, prefix)
    sheet = definition.model.sheet
    missing = [row.symbol for row in sheet if row.symbol not in values]
    if missing:
        names = ", ".join(prefix + symbol for symbol in missing)
        raise ExfitError(f"{definition.record.name}: no value of {names} in the result")
    faults = [*outside(sheet, values)] or [*contradictions(definition.model, values)]
    faults = faults or [*_not_whole(definition, values)]
    if faults:
        texts = (f"{definition.record.name}: {prefix}{symbol}: {text}" for symbol, text in faults)
        raise FileError(texts)
    own = {row.symbol: result.sources.get(prefix + row.symbol, NOT_STATED) for row in sheet}
    written = [name for name in definition.names if name in own]
    unused = _unused(result, definition.record, prefix, values)
    return Written(definition, values, by_source(written, own), unused)


def _unused(
    result: FitResult, record: DynamicsRecord, prefix: str, values: Mapping[str, float]
) -> dict[str, float]:
    """Collect the values of the planner's file that the case does without."""
    of_file = unused_values(result.case_text, result.case)
    symbols = [*dict(record.unused)]
    if prefix + SHARE not in result.parameters:
        symbols.append(RATING)
    return {
        symbol: of_file[prefix + symbol]
        for symbol in symbols
        if prefix + symbol in of_file and values.get(symbol, 0.0) == 0.0
    }


def _not_whole(definition: Definition, values: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Yield (symbol, fault) for each integer of a record whose value is none."""
    for symbol, _ in definition.record.icons:
        if not float(values.get(symbol, 0.0)).is_integer():
            yield symbol, f"{show(values[symbol])} is not a whole number"


def _warnings(entry: Written) -> Iterator[str]:
    """Warn of values that a record cannot hold, leaves undefined, or takes from typical data."""
    record = entry.definition.record
    for row in entry.definition.model.sheet:
        value = entry.values[row.symbol]
        if row.symbol == SHARE and RATING in entry.unused:
            continue
        if row.symbol not in entry.definition.names and _matters(row.symbol, value):
            yield f"{record.name} cannot hold {row.symbol} = {show(value)}: it is lost"
    for symbol, value in unused_of(record, entry.values).items():
        yield f"{record.name}: {entry.definition.program} does without {symbol} = {show(value)}"
    if record.doubt:
        yield f"{record.name}: {record.doubt}"
    if TYPICAL in entry.by_source:
        names = ", ".join(entry.by_source[TYPICAL])
        yield f"{record.name}: {TYPICAL}, not of this unit, check: {names}"


def _matters(symbol: str, value: float) -> bool:
    """Tell if a value does anything: a gain of 0 and a limit out of reach do not."""
    if symbol.endswith("MAX"):
        return value < OUT_OF_REACH
    if symbol.endswith("MIN"):
        return value > -OUT_OF_REACH
    return value != 0.0


def _origin(result: FitResult) -> Iterator[str]:
    error = f", rmse {result.rmse:.3g} pu" if isfinite(result.rmse) else ""
    yield f"exfit {__version__}: {result.model} fitted to {result.comparison.record}{error}."
    yield f"Case: {result.case}."


def _comments(entry: Written) -> Iterator[str]:
    record = entry.definition.record
    for source, symbols in entry.by_source.items():
        if source != TYPICAL:
            yield f"{record.name}: {source}: {' '.join(symbols)}."
    for warning in _warnings(entry):
        yield f"{warning}."


def comment_lines(text: str, files: FileFormat = PSSE_FILES) -> list[str]:
    """Return a comment of a planner's file in lines; what is not ASCII is not sure to be read."""
    plain = "".join(letter if " " <= letter <= "~" else "?" for letter in text)
    return textwrap.wrap(
        plain,
        WIDTH,
        initial_indent=files.comment,
        subsequent_indent=f"{files.comment}  ",
        break_on_hyphens=False,
    )
