"""The records of a fit, as a planner's file."""

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from os import PathLike
from typing import Any

from exfit import __version__
from exfit.case.peek import content_of, stabiliser_inputs
from exfit.errors import ExfitError, FileError
from exfit.features.planner.psse import PSSE_FILES
from exfit.features.planner.records import (
    MOST_BUSES,
    PSSE,
    RATING,
    SHARE,
    SPEED_FLAG,
    WIDTH,
    Definition,
    FileFormat,
    alternatives,
    contradictions,
    definition_of,
    definitions,
    in_digits_borne,
    is_machine_id,
    outside,
    unused_of,
)
from exfit.features.planner.units import FORMATS
from exfit.features.start.starting_case import differs_in_psse
from exfit.features.translate.result import Translation
from exfit.models import LIMITERS, MODELS
from exfit.models.counterparts import OUT_OF_REACH
from exfit.models.sheet import DynamicsRecord
from exfit.plants import LOAD_CONTROLLER
from exfit.results.influences import first_of
from exfit.results.io import load_result
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.util.text import near, show
from exfit.util.vocabulary import NOT_STATED, TYPICAL, by_source

NAME = re.compile(r"[A-Za-z_][\w.]*")  # in a tie

Content = Mapping[str, Any]  # of a case


@dataclass(frozen=True)
class Exported:
    """A dynamics file, and warnings for its user."""

    text: str
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Written:
    """A record with its values, and their names by the source of their values.

    ``unused`` are values of the planner's file that its program ignores.
    """

    definition: Definition
    values: Mapping[str, float]
    by_source: Mapping[str, Sequence[str]]
    unused: Mapping[str, float]


def export(
    result: FitResult | str | PathLike[str],
    bus: int | None = None,
    machine_id: str | None = None,
    model: str | None = None,
    form: str = "dyr",
    translation: Translation | None = None,
) -> Exported:
    """Write machine, exciter, stabiliser and governor of a fit as records of a planner's file.

    Args:
        result: a fit, its result.json, or the folder that holds it.
        bus: of the unit; by default as found, else 1.
        machine_id: of the unit; by default as found, else "1".
        model: the record of the exciter in place of the model's first one, such as ESAC8B.
        form: "dyr" of PSS/E or "dyd" of PSLF.
        translation: another model in place of the exciter.

    Raises ExfitError where the result cannot be read, the model has no record, or a value is
    missing or lies outside the range of its data sheet.

    Example:
        >>> records = exfit.export("runs/ac1a_typical-fit", bus=101)
        >>> Path("unit.dyr").write_text(records.text)
        >>> records.warnings
    """
    if not isinstance(result, FitResult):
        result = load_result(result)
    if form not in FORMATS:
        raise ExfitError(f"{form}: unknown format of a planner's file; {near(form, FORMATS)}")
    if bus is None or machine_id is None:
        found_bus, found_id = place_of(result)
        bus, machine_id = bus or found_bus, machine_id or found_id
    files = FORMATS[form]
    comments = [*_origin(result, translation)]
    if translation is not None:
        result = _translated(result, translation)
    of_fit = [*_of_fit(result, files.program)]
    content, warnings = content_of(result.case_text, result.case), list[str]()
    exciter = _exciter(result, content, files.program, model)
    if exciter is not None and _loses_speed(content, exciter.definition.record):
        name = exciter.definition.record.name
        of_fit.append(f"fitted with efd_times_speed; {name} does not multiply efd by the speed")
    written = [*_parts(result, content, files.program, exciter, warnings)]
    if not written:
        raise ExfitError(f"{result.model} has no {files.program} record")
    of_fit += _other_forms(content, written)
    comments += [f"{text}." for text in of_fit]
    lines = list[str]()
    for own in written:
        warnings += warnings_of(own)
        comments += _comments(own)
        lines.append(
            files.record_text(own.definition, {**own.values, **own.unused}, bus, machine_id)
        )
    lines = [*(line for text in comments for line in comment_lines(text, files)), *lines]
    return Exported("\n".join(lines) + "\n", (*of_fit, *warnings))


def _origin(result: FitResult, translation: Translation | None) -> Iterator[str]:
    error = f", rmse {result.rmse:.3g} pu" if isfinite(result.rmse) else ""
    yield f"exfit {__version__}: {result.model} fitted to {result.comparison.record}{error}."
    yield f"Case: {result.case}."
    if translation is not None:
        yield f"{translation.source} as {translation.target}: {translation.verdict}."
        yield from (f"{note}." for note in translation.notes)


def _comments(entry: Written) -> Iterator[str]:
    for source, symbols in entry.by_source.items():
        if source != TYPICAL:
            yield f"{entry.definition.record.name}: {source}: {' '.join(symbols)}."
    yield from (f"{warning}." for warning in warnings_of(entry))


def _other_forms(content: Content, written: Sequence[Written]) -> Iterator[str]:
    """Yield models that were fitted on load with other equations than those of PSS/E."""
    plant = content.get("plant")
    if isinstance(plant, Mapping) and "network" in plant and plant.get("dialect") != "psse":
        for own in written:
            if differs_in_psse(own.definition.model):
                name = own.definition.record.name
                yield f"fitted without dialect: psse; {name} has other equations in PSS/E"


def _loses_speed(content: Content, record: DynamicsRecord) -> bool:
    """Whether the speed multiplies the efd of a fit, but not that of a record."""
    return _times_speed(content) and not (record.times_speed or SPEED_FLAG in record.cons)


def _parts(
    result: FitResult,
    content: Content,
    program: str,
    exciter: Written | None,
    warnings: list[str],
) -> Iterator[Written]:
    """Yield the records of a fit in their order; add what is lost."""
    given = (result, content, program)
    yield from _added(*given, "machine", warnings)
    if exciter is not None:
        yield exciter
    for kind in ("stabiliser", "governor", LOAD_CONTROLLER):
        yield from _added(*given, kind, warnings)
    yield from _limiters(*given, () if exciter is None else exciter.values, warnings)


def place_of(result: FitResult) -> tuple[int, str]:
    """The bus and the machine id of a unit as found, 1 where they are not given.

    Raises ExfitError for what no record can hold.
    """
    found = result.as_found
    place = (None, None) if found is None else (found.bus, found.machine_id)
    bus, machine_id = (1 if place[0] is None else place[0]), place[1] or "1"
    if not (0 < bus < MOST_BUSES and is_machine_id(machine_id)):
        raise ExfitError(
            f"as_found: bus {bus}, id {machine_id!r} cannot be written to a record; "
            "give them with --bus and --id"
        )
    return bus, machine_id


def _translated(result: FitResult, translation: Translation) -> FitResult:
    """Return a result whose exciter is that of a translation."""
    of_others = {name: word for name, word in result.sources.items() if "." in name}
    of_target = {name: entry.value_source for name, entry in translation.parameters.items()}
    return replace(
        result,
        model=translation.target,
        parameters={name: entry for name, entry in result.parameters.items() if "." in name},
        fixed=translation.values,
        sources={**of_target, **of_others},
        inputs={label: sha for label, sha in result.inputs.items() if label != "model"},
    )


def _of_fit(result: FitResult, program: str) -> Iterator[str]:
    """List remarks on the fit for the reader."""
    if not result.holds:
        yield f"the fit does not hold: {outcome_of(result)}: {explanation_of(result)}"
    for name, values in result.resting_on.items():
        of = first_of([f"{value} ({result.sources.get(value, NOT_STATED)})" for value in values])
        yield f"the interval of {name} rests on data that nobody measured: {of}"
    for unit in dict.fromkeys(kind.partition(".")[0] for kind in result.units):
        yield f"{unit} is not written: export it from a case of its own"
    if result.saturation != "quadratic":
        yield as_quadratic(result, program)


def as_quadratic(result: FitResult, program: str) -> str:
    """Warn that a program takes the saturation of a fit in another form."""
    return (
        f"fitted with saturation: {result.saturation}; {program} takes E1 SE1 E2 SE2 as quadratic"
    )


def _times_speed(content: Content) -> bool:
    """Tell if a fit took efd times the speed."""
    return content.get("efd_times_speed") is True


def _exciter(result: FitResult, content: Content, program: str, name: str | None) -> Written | None:
    """Write the record of the exciter, or another of its model; None where there is none."""
    if result.model == result.machine_model:  # it stood alone
        if name is not None:
            text = f"--model {name}: the fit is of {result.model}, without an exciter"
            raise ExfitError(text)
        return None
    model = MODELS.get(result.model)
    if model is None or "model" in result.inputs:
        raise ExfitError(not_of_catalogue(result, program))
    candidates = {own.record.name.upper(): own for own in alternatives(model, program)}
    if not candidates:
        raise ExfitError(f"{result.model} has no {program} record")
    wanted = next(iter(candidates)) if name is None else name.upper()
    if wanted not in candidates:
        hint, other = near(wanted, candidates), definition_of(wanted, program)
        if other is not None and other.kind == "exciter":
            data = f"the data of {other.model.name}"
            hint = f"`exfit translate RESULT --model {wanted}` finds {data}"
        raise ExfitError(f"--model {name}: not a record of {result.model}; {hint}")
    written = _written(result, content, candidates[wanted], "")
    flags = {SPEED_FLAG: 1.0} if _times_speed(content) else {}
    flags |= _places(result, content, candidates[wanted])
    return replace(written, values={**written.values, **flags})


def _places(result: FitResult, content: Content, definition: Definition) -> dict[str, float]:
    """Return the flags that say in an exciter's record where limiters act, where known."""
    codes = {place: float(code) for code, place in definition.record.places}
    given = {
        str(entry.get("model")): str(entry["place"])
        for entry in content.get("limiters", ())
        if isinstance(entry, Mapping) and entry.get("place") is not None
    }
    flags: dict[str, float] = {}
    for kind, name in result.limiter_models.items():
        if name in LIMITERS and LIMITERS[name].records:
            place = given.get(name, LIMITERS[name].places[0])
            if kind.upper() in dict(definition.record.icons) and place in codes:
                flags[kind.upper()] = codes[place]
    return flags


def _added(
    result: FitResult, content: Content, program: str, kind: str, warnings: list[str]
) -> Iterator[Written]:
    """Yield the record of the machine or what controls the unit; add what is lost."""
    name = getattr(result, f"{kind.replace(' ', '_')}_model")
    of_kind = [own for own in definitions(program) if own.kind == kind]
    of_model = [own for own in of_kind if own.model.name == name]
    if not of_model:
        if kind == "machine":
            lacking = f"machine {name} has no {program} record"
            what = "no machine is named" if name is None else lacking
            warnings.append(f"{what}: only the exciter is written")
        elif name is not None:
            warnings.append(f"{kind} {name} has no {program} record: it is left out")
        return
    # such as TGOV1D, where the dead band of TGOV1 is not 0
    candidates = [_written(result, content, own, own.prefix) for own in of_model]
    record = min(candidates, key=lambda each: len([*lost_in(each)]))
    definition = record.definition
    if kind == "machine":
        yield record
        return
    own = getattr(definition.model, "inputs", ())
    inputs = stabiliser_inputs(result.case_text, result.case) or own
    codes = definition.codes_for(inputs)
    if len(codes) < len(inputs) and inputs != own:
        text = f"{name} has no codes of its inputs: {', '.join(inputs)} is lost"
        warnings.append(text)
    yield replace(record, values={**record.values, **codes})


def _limiters(
    result: FitResult,
    content: Content,
    program: str,
    placed: Iterable[str],
    warnings: list[str],
) -> Iterator[Written]:
    """Yield the records of the limiters, ``placed`` by flags of the exciter's; add what is lost."""
    flags = [*placed]
    for kind, name in result.limiter_models.items():
        known = name in LIMITERS and program == PSSE
        records = LIMITERS[name].records if known else ()
        if not records:
            text = f"limiter {name} has no {program} record: it is left out"
            warnings.append(text)
            continue
        yield _written(
            result, content, Definition("limiter", LIMITERS[name], records[0]), f"{kind}."
        )
        if kind.upper() not in flags:
            text = f"{name}: the exciter's record does not give its place: set its flag"
            warnings.append(text)


def _written(result: FitResult, content: Content, definition: Definition, prefix: str) -> Written:
    """Return a record with the values of the fit.

    Raises ExfitError where one is missing, outside its data sheet's range, or contradicts
    others.
    """
    record = definition.record
    values, sheet = values_in_digits(result, prefix), definition.model.sheet
    missing = [prefix + row.symbol for row in sheet if row.symbol not in values]
    if missing:
        raise ExfitError(f"{record.name}: no value of {', '.join(missing)} in the result")
    faults = [*outside(sheet, values)] or [*contradictions(definition.model, values)]
    faults = faults or [*_not_whole(record, values)]
    if faults:
        raise FileError(f"{record.name}: {prefix}{symbol}: {text}" for symbol, text in faults)
    sources = {
        symbol: result.sources.get(prefix + symbol, NOT_STATED)
        for symbol in (row.symbol for row in sheet)
    }
    # what the planner's file has and the case does without
    of_file = content.get("as_found", {}).get("unused", {})
    symbols = [*dict(record.unused), *dict(record.absent), "SE1", "SE2", "S10", "S12"]
    if prefix + SHARE not in result.parameters:
        symbols.append(RATING)
    unused = {
        symbol: float(of_file[prefix + symbol])
        for symbol in symbols
        if prefix + symbol in of_file and values.get(symbol, 0.0) == 0.0
    }
    return Written(definition, values, by_source(definition.symbols, sources), unused)


def _not_whole(record: DynamicsRecord, values: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Yield (symbol, fault) for each integer of a record whose value is none."""
    for symbol, _ in record.icons:
        if not float(values.get(symbol, 0.0)).is_integer():
            yield symbol, f"{show(values[symbol])} is not a whole number"


def not_of_catalogue(result: FitResult, program: str) -> str:
    """Explain that the model of a fit is a user's."""
    return f"{result.model} is not a model of the catalogue: it has no {program} record"


def values_in_digits(result: FitResult, prefix: str) -> dict[str, float]:
    """The values of a model; fitted ones, and those tied to them, in the digits of their errors."""
    values = dict(result.values_of(prefix))
    for symbol, value in values.items():
        name = prefix + symbol
        if name in result.parameters:
            values[symbol] = in_digits_borne(value, result.parameters[name].rounding_error)
        elif result.parameters.keys() & NAME.findall(result.ties.get(name, "")):
            values[symbol] = in_digits_borne(value, None)
    return values


def lost_in(entry: Written) -> Iterator[str]:
    """Name the values that a record cannot hold."""
    record, held = entry.definition.record, dict(entry.definition.record.held)
    for row in entry.definition.model.sheet:
        symbol, value = row.symbol, entry.values[row.symbol]
        if symbol in entry.definition.names or (symbol == SHARE and RATING in entry.unused):
            continue
        if value == held.get(symbol):  # what the record stands for
            continue
        acts = value != 0.0  # as no gain of 0 and no limit out of reach does
        if symbol.endswith(("MAX", "MIN")):
            acts = (value if symbol.endswith("MAX") else -value) < OUT_OF_REACH
        if acts:
            yield f"{record.name} cannot hold {symbol} = {show(value)}: it is lost"


def warnings_of(entry: Written) -> Iterator[str]:
    """Warn of values that a record cannot hold, leaves undefined, or takes from typical data."""
    record = entry.definition.record
    yield from lost_in(entry)
    for symbol in (name for name, _ in record.absent if name in entry.unused):
        as_found = f"{symbol} = {show(entry.unused[symbol])}"
        yield f"{record.name}: {as_found} is not modelled: as in the planner's file"
    for symbol, value in unused_of(record, entry.values).items():
        yield f"{record.name}: {entry.definition.program} ignores {symbol} = {show(value)}"
    if record.doubt:
        yield f"{record.name}: {record.doubt}"
    if TYPICAL in entry.by_source:
        names = ", ".join(entry.by_source[TYPICAL])
        yield f"{record.name}: {TYPICAL}, not of this unit, check: {names}"


def comment_lines(text: str, files: FileFormat = PSSE_FILES) -> list[str]:
    """Return a comment of a planner's file in lines, in ASCII, which every program reads."""
    plain = "".join(letter if " " <= letter <= "~" else "?" for letter in text)
    return textwrap.wrap(
        plain,
        WIDTH,
        initial_indent=files.comment,
        subsequent_indent=f"{files.comment}  ",
        break_on_hyphens=False,
    )
