"""The records that exfit has models for: constants in a program's order, read and written."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from exfit.features.planner.fields import DynamicsFault, Field, number, whole
from exfit.models import GOVERNORS, MODELS, STABILISERS, sheet
from exfit.models.counterparts import OUT_OF_REACH
from exfit.models.machines import MACHINES, Machine
from exfit.models.sheet import DynamicsRecord, Model, Parameter, Sheet, typical
from exfit.util.text import rounded, show, show_value

PSSE, PSLF = "PSS/E", "PSLF"
SORTED = (("E1", "SE1"), ("E2", "SE2"))  # PSS/E files have the lower voltage first
RATING, SHARE = "Trate", "Trate_Mbase"  # of a turbine: MW, and over the machine's base
SPEED_FLAG = "SPDMLT"  # not 0: efd is multiplied by the speed
FLAGS = ("OEL", "UEL")  # of the places where limiters act
LIMITS = ("MAX", "MIN", "VCU", "VCL")  # how the names of limits end
SIGNALS = {0: "none", 1: "speed", 3: "p", 4: "pa", 5: "vt"}  # by the input code of a stabiliser
OF_SATURATION = ("E1", "SE1", "E2", "SE2")
LEAST_DIGITS = 4  # of a fitted value: with fewer, values that depend on each other miss the record


@dataclass(frozen=True)
class Definition:
    """A record of a program and the model that it gives the data of.

    ``kind``: machine, exciter, stabiliser, governor.
    """

    kind: str
    model: Model | Machine
    record: DynamicsRecord
    program: str = PSSE

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what follows the id: integers that are not listed, then what is."""
        cons = self.record.cons
        return (*(name for name, _ in self.record.icons if name not in cons), *cons)

    @property
    def codes(self) -> tuple[str, ...]:
        """The integers that say which signals the inputs of a stabiliser are."""
        return tuple(name for name, _ in self.record.icons if name.startswith("ICS"))

    @property
    def absent(self) -> tuple[str, ...]:
        """The parameters of the model that the record neither lists nor holds at a value."""
        given = (*self.names, *dict(self.record.held))
        return tuple(row.symbol for row in self.model.sheet if row.symbol not in given)


@dataclass(frozen=True)
class Reading:
    """What the fields of a record say: values by symbol, what is wrong, what must be known.

    ``inputs`` are the signals of a stabiliser whose record has codes of them; ``times_speed`` says
    that efd is multiplied by the speed; ``unused`` are the file's values of what is 0 in
    ``values``, since its program does without them, or not there: the rating of a turbine.
    """

    values: Mapping[str, float]
    faults: list[DynamicsFault]
    warnings: list[DynamicsFault]
    inputs: tuple[str, ...] = ()
    times_speed: bool = False
    unused: tuple[tuple[str, float], ...] = ()


def definitions(program: str = PSSE) -> list[Definition]:
    """Return every record of every model that a program has."""
    catalogues: Iterable[tuple[str, Mapping[str, Model | Machine]]] = (
        ("machine", MACHINES),
        ("exciter", MODELS),
        ("stabiliser", STABILISERS),
        ("governor", GOVERNORS),
    )
    return [
        Definition(kind, model, record, program)
        for kind, catalogue in catalogues
        for model in catalogue.values()
        for record in (model.records if program == PSSE else model.pslf_records)
    ]


def definition_of(name: str, program: str = PSSE) -> Definition | None:
    """Return the record that a file means by a name, None where exfit has no model of it.

    A further record of a model is meant only where the model is known by that very name: PSS/E's
    ESAC8B is another model than the AC8B that can be written as one.
    """
    of_that_name = [
        definition
        for definition in definitions(program)
        if definition.record.name.upper() == name.upper()
    ]
    for definition in of_that_name:
        if program == PSLF or definition.record == definition.model.records[0]:
            return definition
    for definition in of_that_name:
        model = definition.model
        if definition.record.name in (model.name, *getattr(model, "aliases", ())):
            return definition
    return None


def alternatives(model: Model | Machine, program: str = PSSE) -> list[Definition]:
    """Return the records that a model can be written as, its own first."""
    return [definition for definition in definitions(program) if definition.model is model]


def contradictions(
    model: Model | Machine, values: Mapping[str, float]
) -> Iterable[tuple[str, str]]:
    """Return (symbol, fault) for values of a model that contradict each other."""
    return model.faults(values) if isinstance(model, Machine) else sheet.contradictions(values)


def read_values(definition: Definition, line: int, fields: tuple[Field, ...]) -> Reading:
    """Read the fields behind a record's id; ``line`` is where the record begins."""
    record, names = definition.record, definition.names
    if len(fields) != len(names):
        count = DynamicsFault(line, _wrong_count(definition, len(fields)))
        return Reading({}, [count, *_no_numbers(record.name, fields)], [])
    lines = dict(zip(names, (field.line for field in fields), strict=True))

    def placed(texts: Iterable[tuple[str, str]]) -> list[DynamicsFault]:
        return [
            DynamicsFault(lines.get(name, line), f"{record.name}: {name}: {text}")
            for name, text in texts
        ]

    given, unreadable = _numbers(definition, fields)
    rows = definition.model.sheet
    given = with_exchanged(record, given)
    of_sheet = {row.symbol: given[row.symbol] for row in rows if row.symbol in given}
    idle = idle_lags(rows, of_sheet)
    of_sheet |= {row.symbol: row.typical for row in idle}
    unused = unused_of(record, of_sheet)
    values = {**typical(rows), **dict(record.held), **of_sheet, **dict.fromkeys(unused, 0.0)}
    wrong = [*unreadable, *outside(rows, of_sheet)]
    wrong = wrong or [*contradictions(definition.model, values)]
    doubt = [DynamicsFault(line, f"{record.name}: {record.doubt}")] if record.doubt else []
    unmodelled = [*_unmodelled(definition, given), *_without_effect(rows, of_sheet)]
    unmodelled += [*_unused(definition, unused), *_rating(given)]
    unmodelled += [(row.symbol, _says_nothing(row)) for row in idle]
    short = [*_short(definition, line, fields)]
    warnings = doubt + short + placed([*unmodelled, *_lacking(definition)])
    times_speed = record.times_speed or given.get(SPEED_FLAG, 0.0) != 0.0
    inputs = _inputs(definition, given)
    kept = tuple((unused | {name: given[name] for name, _ in _rating(given)}).items())
    return Reading(values, placed(wrong), warnings, inputs, times_speed, kept)


def with_exchanged(record: DynamicsRecord, values: Mapping[str, float]) -> dict[str, float]:
    """Return values of which two have changed places, where they do so in a record."""
    pairs = zip(record.exchanged, reversed(record.exchanged), strict=True)
    return {**values, **{name: values[other] for name, other in pairs if other in values}}


def unused_of(record: DynamicsRecord, values: Mapping[str, float]) -> dict[str, float]:
    """Return those values that act in a model and not in the program of a record."""
    return {
        name: values[name]
        for name, other in record.unused
        if values.get(name, 0.0) != 0.0 and values.get(other, 0.0) == 0.0
    }


def record_fields(definition: Definition, values: Mapping[str, float]) -> list[str]:
    """Return the fields behind a record's id, each number in the digits that give it back."""
    record = definition.record
    integers = dict(record.icons)
    given = {**dict.fromkeys(record.ignored, 0.0), **integers, **values, **dict(record.absent)}
    given = with_exchanged(record, given)
    if {*OF_SATURATION} <= given.keys() and given["E1"] > given["E2"]:
        for first, second in zip(*SORTED, strict=True):
            given[first], given[second] = given[second], given[first]
    return [
        str(int(given[name])) if name in integers else repr(float(given[name])).upper()
        for name in definition.names
    ]


def idle_lags(rows: Sheet, given: Mapping[str, float]) -> list[Parameter]:
    """The lags of 0 that the model cannot have, and whose gain of 0 asks for none."""
    return [
        row
        for row in rows
        if row.is_time
        and row.low > 0.0 == given.get(row.symbol)
        and row.search is not None
        # above EFDN, KN takes the place of KF
        and given.get(row.search.needs) == 0.0 == given.get("KN", 0.0)
    ]


def _says_nothing(row: Parameter) -> str:
    gain = "" if row.search is None else row.search.needs
    return f"0 says nothing, since {gain} is 0; the typical value {show(row.typical)} is taken"


def in_digits_borne(value: float, error: float | None) -> float:
    """A fitted value in the digits that its standard error bears, at least four."""
    candidates = float(rounded(value, error)), float(f"{value:.{LEAST_DIGITS}g}")
    return min(candidates, key=lambda candidate: abs(candidate - value))


def _numbers(
    definition: Definition, fields: tuple[Field, ...]
) -> tuple[dict[str, float], list[tuple[str, str]]]:
    """Return the numbers of a record by symbol, and (symbol, fault) for what is none."""
    integers = dict(definition.record.icons)
    values: dict[str, float] = {}
    faults = []
    for name, field in zip(definition.names, fields, strict=True):
        try:
            values[name] = _whole(definition, field) if name in integers else number(field)
        except ValueError as error:
            faults.append((name, str(error)))
    return values, faults


def _whole(definition: Definition, field: Field) -> int:
    """Return an integer of a record, which PSLF writes as a number; raises ValueError."""
    if definition.program == PSSE:
        return whole(field)
    value = number(field)
    if not value.is_integer():
        raise ValueError(f"{show_value(field.text)} is not a whole number")
    return int(value)


def _no_numbers(name: str, fields: Iterable[Field]) -> Iterable[DynamicsFault]:
    """Name fields that are no numbers, such as a repeat count: one may spoil the count."""
    for field in fields:
        try:
            number(field)
        except ValueError as error:
            yield DynamicsFault(field.line, f"{name}: {error}")


def _inputs(definition: Definition, given: Mapping[str, float]) -> tuple[str, ...]:
    """Return the input signals of a stabiliser; its model's for codes that nothing stands for."""
    modelled = dict(definition.record.icons)
    codes = [(given.get(name, modelled[name]), modelled[name]) for name in definition.codes]
    return tuple(SIGNALS.get(int(code), SIGNALS[usual]) for code, usual in codes)


def _short(definition: Definition, line: int, fields: tuple[Field, ...]) -> Iterable[DynamicsFault]:
    """Name the values with an effect that a file of PSLF does not have."""
    record = definition.record
    named = zip(definition.names, fields, strict=True)
    missing = [name for name, field in named if not field.end and name in dict(record.absent)]
    if missing:
        text = f"{record.name}: not in the file, taken as without effect: {', '.join(missing)}"
        yield DynamicsFault(line, text)


def _lacking(definition: Definition) -> Iterable[tuple[str, str]]:
    """Yield (symbol, warning) for what the model has and the record has not."""
    for row in definition.model.sheet:
        if row.symbol in definition.absent:
            text = f"not in the record; the typical value {show(row.typical)} is taken"
            yield row.symbol, text


def _unmodelled(definition: Definition, given: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, warning) for what the model has in one way only."""
    explained = {*definition.record.ignored, *(row.symbol for row in definition.model.sheet)}
    places = dict(definition.record.places)
    for name, modelled in (*definition.record.icons, *definition.record.absent):
        value = given.get(name, modelled)
        if (name in definition.codes and value in SIGNALS) or (name in FLAGS and value in places):
            continue
        if name.endswith(LIMITS) and abs(value) >= OUT_OF_REACH:
            continue
        if value != modelled and name not in explained:
            yield name, f"{show(value)} is not modelled; {show(modelled)} is taken"


def _unused(definition: Definition, unused: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, warning) for what the program of a record does without."""
    for name, value in unused.items():
        other = dict(definition.record.unused)[name]
        why = f", since {other} is 0" if other else ""
        yield name, f"{show(value)} does not act in {definition.program}{why}; 0 is taken"


def _rating(given: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, warning) for the rating of a turbine, where it has one of its own."""
    rating = given.get(RATING, 0.0)
    if rating != 0.0:
        text = f"{show(rating)} MW, but the machine's base is not in the file: {SHARE} is 1 in the "
        yield RATING, f"{text}case, where it must be {show(rating)} over that base"


def _without_effect(rows: Sheet, given: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, warning) for a gain that does nothing without its lag: a PID is then a PI."""
    for row in rows:
        lag = "" if row.search is None or not row.symbol.startswith("K") else row.search.needs
        value = given.get(row.symbol, 0.0)
        if value != 0.0 and given.get(lag) == 0.0:
            yield row.symbol, f"{show(value)} has no effect, since {lag} is 0"


def outside(rows: Sheet, values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) for each value that its data sheet excludes."""
    for row in rows:
        value = values.get(row.symbol, row.low)
        if not row.low <= value <= row.high:
            limits = f"{show(row.low)} ... {show(row.high)} {row.unit}"
            yield row.symbol, f"{show(value)} lies outside {limits}, its data sheet's range"


def _wrong_count(definition: Definition, count: int) -> str:
    icons = len(definition.record.icons)
    cons = len(definition.names) - icons
    parts = f"{icons} integers and {cons} constants" if icons else f"{cons} constants"
    order = " ".join(definition.names)
    plural = "value" if count == 1 else "values"
    return (
        f"{definition.record.name}: {count} {plural} after the id, "
        f"but the record has {icons + cons} ({parts}): {order}"
    )
