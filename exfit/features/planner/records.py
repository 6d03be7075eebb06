"""The records that exfit has models for: constants in a program's order, read and written."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import sqrt
from typing import NamedTuple, TypeVar

from exfit.features.planner.buses import Buses
from exfit.features.planner.fields import DynamicsFault, Field, number, whole
from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS, sheet
from exfit.models.counterparts import OUT_OF_REACH
from exfit.models.machines import MACHINES, Machine
from exfit.models.machines.machine import unusual_reactances
from exfit.models.sheet import DynamicsRecord, Model, Parameter, Sheet, saturation_points, typical
from exfit.plants import LOAD_CONTROLLER, MOVING_PREF
from exfit.util.text import rounded, show, show_value

PSSE, PSLF = "PSS/E", "PSLF"
LIMITER = "limiter"
SORTED = (("E1", "SE1"), ("E2", "SE2"))  # PSS/E files have the lower voltage first
RESISTANCE = "RA"  # of the stator: it acts on load, where it is Ra of the network
RATING, SHARE = "Trate", "Trate_Mbase"  # of a turbine: MW, and over the machine's base
SPEED_FLAG = "SPDMLT"  # not 0: efd is multiplied by the speed
FLAGS = ("OEL", "UEL")  # of the places where limiters act
ID_OF_ANOTHER = "M"  # machine, the second one of IEEEG1, which may be quoted
LIMITS = ("MAX", "MIN", "VCU", "VCL")  # how the names of limits end
CEILING, FLOOR = ("MAX", "LIM"), "MIN"  # of a sheet
SIGNALS = {0: "none", 1: "speed", 3: "p", 4: "pa", 5: "vt"}  # by the usual code of an input
OF_SATURATION = ("E1", "SE1", "E2", "SE2")
LEAST_SATURATION = 1e-3  # pu at 1.0 pu: with less, and no more at 1.2 pu, a file means none
LEAST_DIGITS = 4  # of a fitted value: with fewer, values that depend on each other miss the record
WIDTH = 80  # columns of a file
LONGEST_ID = 2
LONGEST_BUS = 10  # digits that are looked at
MOST_BUSES = 10**6

Value = TypeVar("Value")
Texts = Iterable[tuple[str, str]]  # (symbol, what is wrong or must be known)


@dataclass(frozen=True)
class Definition:
    """A record of a program and the model that it gives the data of.

    ``kind``: machine, exciter, stabiliser, governor, load controller, limiter.
    """

    kind: str
    model: Model | Machine
    record: DynamicsRecord
    program: str = PSSE

    @property
    def prefix(self) -> str:
        """Beginning of the names of its parameters in a case; of a limiter that of its kind."""
        if self.kind == "exciter":
            return ""
        if self.kind == LOAD_CONTROLLER:
            return MOVING_PREF
        return f"{self.model.name[:3].lower() if self.kind == LIMITER else self.kind}."

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what follows the id: integers that are not listed, then what is."""
        cons = self.record.cons
        return (*(name for name, _ in self.record.icons if name not in cons), *cons)

    @property
    def symbols(self) -> list[str]:
        """The parameters of the model that the record lists, in its order."""
        own = {row.symbol for row in self.model.sheet}
        return [name for name in self.names if name in own]

    @property
    def codes(self) -> tuple[str, ...]:
        """The integers that say which signals the inputs of a stabiliser are."""
        return tuple(name for name, _ in self.record.icons if name.startswith("ICS"))

    @property
    def signals(self) -> Mapping[int, str]:
        """The signals that these integers stand for."""
        return dict(self.record.signals) or SIGNALS

    def codes_for(self, inputs: Iterable[str]) -> dict[str, int]:
        """Return these integers for the signals that have one."""
        of_signals = {signal: code for code, signal in self.signals.items()}
        named = zip(self.codes, map(of_signals.get, inputs), strict=False)
        return {symbol: code for symbol, code in named if code is not None}

    @property
    def absent(self) -> tuple[str, ...]:
        """The parameters of the model that the record neither lists nor holds at a value."""
        given = (*self.names, *dict(self.record.held))
        return tuple(row.symbol for row in self.model.sheet if row.symbol not in given)


class Head(NamedTuple):
    """A record by what it begins with, and the fields behind.

    ``definition`` is what exfit has a model of, None if it has none; ``base`` the MVA or MW that
    its values are on, ``kv`` and ``bus_name`` those of the bus, where they are known; ``faults``
    are those of its fields.
    """

    bus: int
    name: str
    id: str
    line: int
    fields: tuple[Field, ...]
    definition: Definition | None
    program: str = PSSE
    base: float | None = None
    faults: tuple[DynamicsFault, ...] = ()
    kv: float | None = None
    bus_name: str = ""


class Heads(NamedTuple):
    """The records of a file that belong to a unit, and what is wrong with others."""

    heads: list[Head]
    faults: list[DynamicsFault]


@dataclass(frozen=True)
class FileFormat:
    """The files of a program.

    ``heads(text, buses)`` are the records of a file, in which a bus may stand by the name that
    ``buses`` give it; ``record_text(definition, values, bus, id)`` is one
    of them; ``comment`` begins a line that is none; ``begins`` says how a record begins.
    """

    program: str
    suffix: str
    comment: str
    begins: str
    heads: Callable[[str, Buses], Heads]
    record_text: Callable[[Definition, Mapping[str, float], int, str], str]


def wrong_place(bus: Field, machine_id: str) -> Iterator[str]:
    """Refuse a field that is not the number of a bus, and a text that is no machine's id."""
    whole = not bus.quoted and bus.text.isascii() and bus.text.isdigit()
    if not whole or not 0 < int(bus.text[:LONGEST_BUS]) < MOST_BUSES:
        advice = "; write the number in place of the name, or give --raw" if bus.quoted else ""
        yield f"{show_value(bus.text)} is not the number of a bus{advice}"
    if not 0 < len(machine_id) <= LONGEST_ID or not machine_id.isprintable():
        yield f"{show_value(machine_id)} is not a machine id of one or two characters"


def is_machine_id(text: str) -> bool:
    """Tell if a record that exfit writes can have this id of a machine."""
    return 1 <= len(text) <= LONGEST_ID and text.isascii() and text.isalnum()


@cache
def definitions(program: str = PSSE) -> tuple[Definition, ...]:
    """Return every record of every model that a program has."""
    catalogues: Iterable[tuple[str, Mapping[str, Model | Machine]]] = (
        ("machine", MACHINES),
        ("exciter", MODELS),
        ("stabiliser", STABILISERS),
        ("governor", GOVERNORS),
        (LOAD_CONTROLLER, LOAD_CONTROLLERS),
        (LIMITER, LIMITERS),
    )
    return tuple(
        Definition(kind, model, record, program)
        for kind, catalogue in catalogues
        for model in catalogue.values()
        for record in (model.records if program == PSSE else model.pslf_records)
    )


@cache
def definition_of(name: str, program: str = PSSE) -> Definition | None:
    """Return the record that a file means by a name, None where exfit has no model of it.

    A further record of a model is meant only where the model is known by that very name: PSS/E's
    ESAC8B is another model than the AC8B that can be written as one.
    """
    named = [own for own in definitions(program) if own.record.name.upper() == name.upper()]
    for own in named:
        if program == PSLF or own.record == own.model.records[0]:
            return own
    for own in named:
        if own.record.name in (own.model.name, *getattr(own.model, "aliases", ())):
            return own
    return None


def alternatives(model: Model | Machine, program: str = PSSE) -> list[Definition]:
    """Return the records that a model can be written as, its own first."""
    return [definition for definition in definitions(program) if definition.model is model]


def contradictions(model: Model | Machine, values: Mapping[str, float]) -> Texts:
    """Return (symbol, fault) for values of a model that contradict each other."""
    return model.faults(values) if isinstance(model, Machine) else sheet.contradictions(values)


@dataclass(frozen=True)
class Reading:
    """A record as it is read: values by symbol, what is wrong, what must be known.

    It begins on ``line``; ``fields`` are those behind the id, one for each name of the definition;
    ``inputs`` are the signals of a stabiliser whose record has codes of them; ``times_speed`` says
    that efd is multiplied by the speed; ``unused`` are the file's values of what is 0 in
    ``values``, since its program ignores them, or not there: the rating of a turbine; ``place`` is
    where a limiter acts.
    """

    definition: Definition
    line: int
    fields: tuple[Field, ...]
    values: Mapping[str, float]
    faults: list[DynamicsFault]
    warnings: list[DynamicsFault]
    inputs: tuple[str, ...] = ()
    times_speed: bool = False
    unused: tuple[tuple[str, float], ...] = ()
    place: str = ""


def read_values(definition: Definition, line: int, fields: tuple[Field, ...]) -> Reading:
    """Read the fields behind a record's id; ``line`` is where the record begins."""
    record, names = definition.record, definition.names
    if len(fields) != len(names):
        return Reading(definition, line, fields, {}, [*_count_faults(definition, line, fields)], [])
    lines = {name: field.line for name, field in zip(names, fields, strict=True)}

    def placed(texts: Texts) -> list[DynamicsFault]:
        return [
            DynamicsFault(lines.get(name, line), f"{record.name}: {name}: {text}")
            for name, text in texts
        ]

    icons, rows = dict(record.icons), definition.model.sheet
    given, unreadable = _numbers(definition, fields)
    given = with_exchanged(record, given)
    of_sheet = {row.symbol: given[row.symbol] for row in rows if row.symbol in given}
    idle = idle_lags(rows, of_sheet)
    endless = limits_beyond(rows, of_sheet)
    of_sheet |= {row.symbol: row.typical for row in idle} | endless
    unused = unused_of(record, of_sheet)
    values = {**typical(rows), **dict(record.held), **of_sheet, **dict.fromkeys(unused, 0.0)}
    wrong = [*unreadable, *outside(rows, of_sheet)]
    wrong = wrong or [*contradictions(definition.model, values)]
    remarks = [
        *_unmodelled(definition, given),
        *_unusual(definition.model, values),
        *_without_effect(definition, of_sheet, unused, given.get(RATING, 0.0)),
        *_replaced(definition, given, endless, idle),
    ]
    codes = [(given.get(name, icons[name]), icons[name]) for name in definition.codes]
    signals = definition.signals
    inputs = tuple(signals.get(int(code), signals[usual]) for code, usual in codes)
    if given.get(RATING, 0.0) != 0.0:
        unused[RATING] = given[RATING]
    unused |= unmodelled_of(definition, given)
    times_speed = record.times_speed or given.get(SPEED_FLAG, 0.0) != 0.0
    return Reading(
        definition,
        line,
        fields,
        values,
        placed(wrong),
        [*_doubts(definition, line, fields), *placed(remarks)],
        inputs,
        times_speed,
        tuple(unused.items()),
    )


def _replaced(
    definition: Definition,
    given: Mapping[str, float],
    endless: Mapping[str, float],
    idle: Iterable[Parameter],
) -> Texts:
    """Yield (symbol, remark) for each value that another one takes the place of."""
    for name, limit in endless.items():
        yield name, f"{show(given[name])} is no limit; {show(limit)} is taken"
    for row in idle:
        needs, typical = row.search and row.search.needs, show(row.typical)
        why = f"0 has no effect, since {needs} is 0"
        yield row.symbol, f"{why}; the typical value {typical} is taken"
    for row in definition.model.sheet:
        if row.symbol in definition.absent:
            why = "not in the record"
            yield row.symbol, f"{why}; the typical value {show(row.typical)} is taken"


def _numbers(
    definition: Definition, fields: tuple[Field, ...]
) -> tuple[dict[str, float], list[tuple[str, str]]]:
    """Return the numbers of a record by symbol, and (symbol, fault) for what is none."""
    integers = dict(definition.record.icons)
    values: dict[str, float] = {}
    faults = []
    for name, field in zip(definition.names, fields, strict=True):
        try:
            if name == ID_OF_ANOTHER and field.quoted:
                values[name] = integers[name]
            elif name not in integers:
                values[name] = number(field)
            elif definition.program == PSSE:
                values[name] = whole(field)
            elif number(field).is_integer():
                values[name] = int(number(field))
            else:
                faults.append((name, f"{show_value(field.text)} is not a whole number"))
        except ValueError as error:
            faults.append((name, str(error)))
    return values, faults


def _count_faults(
    definition: Definition, line: int, fields: tuple[Field, ...]
) -> Iterator[DynamicsFault]:
    """Yield the wrong count of values, and those that are no numbers: one may spoil the count."""
    name, count = definition.record.name, len(fields)
    icons = len(definition.record.icons)
    cons = len(definition.names) - icons
    parts = f"{icons} integers and {cons} constants" if icons else f"{cons} constants"
    plural = "value" if count == 1 else "values"
    yield DynamicsFault(
        line,
        f"{name}: {count} {plural} after the id, but the record has {icons + cons} ({parts}): "
        + " ".join(definition.names),
    )
    for field in fields:
        try:
            number(field)
        except ValueError as error:
            yield DynamicsFault(field.line, f"{name}: {error}")


def _doubts(
    definition: Definition, line: int, fields: tuple[Field, ...]
) -> Iterator[DynamicsFault]:
    """Yield what is doubtful in a record, and the values that an older file does not have."""
    record, named = definition.record, zip(definition.names, fields, strict=True)
    if record.doubt:
        yield DynamicsFault(line, f"{record.name}: {record.doubt}")
    missing = [name for name, field in named if not field.end and name in dict(record.absent)]
    if missing:
        text = f"{record.name}: not in the file, taken as without effect: {', '.join(missing)}"
        yield DynamicsFault(line, text)


def _unmodelled(definition: Definition, given: Mapping[str, float]) -> Texts:
    """Yield (symbol, warning) for what the model has in one way only."""
    record = definition.record
    explained = {*record.ignored, *(row.symbol for row in definition.model.sheet)}
    for name, modelled in (*record.icons, *record.absent):
        value = given.get(name, modelled)
        known = name in definition.codes and value in definition.signals
        known = known or (name in FLAGS and value in dict(record.places))
        known = known or (name.endswith(LIMITS) and abs(value) >= OUT_OF_REACH)
        if not known and value != modelled and name not in explained:
            signal = f", {definition.signals[int(modelled)]}" if name in definition.codes else ""
            yield name, f"{show(value)} is not modelled; {show(modelled)} is taken{signal}"
    if given.get(RESISTANCE, 0.0) != 0.0:
        yield RESISTANCE, f"{show(given[RESISTANCE])} acts on load: it is Ra of a network"


def _without_effect(
    definition: Definition,
    given: Mapping[str, float],
    unused: Mapping[str, float],
    rating: float,
) -> Texts:
    """Yield (symbol, warning) for what does nothing: without its lag, or in the program."""
    for row in definition.model.sheet:  # without its lag a PID is a PI
        lag = "" if row.search is None or not row.symbol.startswith("K") else row.search.needs
        value = given.get(row.symbol, 0.0)
        if value != 0.0 and given.get(lag) == 0.0:
            yield row.symbol, f"{show(value)} has no effect, since {lag} is 0"
    for name, other in definition.record.unused:
        if name in unused:
            why = f", since {other} is 0" if other else ""
            yield name, f"{definition.program} ignores {show(unused[name])}{why}; 0 is taken"
    if "S10" in unused:
        yield "S10", f"{show(given['S10'])}, and S12 {show(given['S12'])}: no saturation is taken"
    knee = _knee_above(given)
    if knee is not None:
        text = (
            f"{show(given['SE1'])}, and SE2 {show(given['SE2'])}, fall: the quadratic curve is 0 "
            f"up to {knee:.4g} pu; no saturation is taken"
        )
        yield "SE1", text
    if rating != 0.0:
        text = (
            f"{show(rating)} MW, but the machine's base is not in the file: enter {SHARE} in the "
        )
        yield RATING, f"{text}case, {show(rating)} over that base (1 is taken)"


def fields_of(part: Reading) -> dict[str, Field]:
    """Return the field of each symbol of a record that has no faults."""
    fields = dict(zip(part.definition.names, part.fields, strict=True))
    return with_exchanged(part.definition.record, fields)


def with_exchanged(record: DynamicsRecord, values: Mapping[str, Value]) -> dict[str, Value]:
    """Return values of which two have changed places, where they do so in a record."""
    pairs = zip(record.exchanged, reversed(record.exchanged), strict=True)
    return {**values, **{name: values[other] for name, other in pairs if other in values}}


def unmodelled_of(definition: Definition, given: Mapping[str, float]) -> dict[str, float]:
    """Return the values of a governor's record that its model does not have, but for usual ones."""
    absent = definition.record.absent if definition.kind == "governor" else ()
    return {name: given[name] for name, usual in absent if given.get(name, usual) != usual}


def unused_of(record: DynamicsRecord, values: Mapping[str, float]) -> dict[str, float]:
    """Return those values that act in a model and not in the program of a record."""
    unused = {
        name: values[name]
        for name, other in record.unused
        if values.get(name, 0.0) != 0.0 and values.get(other, 0.0) == 0.0
    }
    if _knee_above(values) is not None:
        unused |= {name: values[name] for name in ("SE1", "SE2")}
    if values.get("S12", 1.0) <= values.get("S10", 0.0) < LEAST_SATURATION:
        unused |= {name: values[name] for name in ("S10", "S12") if values[name] != 0.0}
    return unused


def _knee_above(values: Mapping[str, float]) -> float | None:
    """The knee of a saturation that falls from the lower to the higher voltage, else None.

    VX = B (E - A)^2 through both points is 0 below A, which then lies above them.
    """
    for low, high in pairwise(saturation_points(values)):
        if min(low.e * low.se, high.e * high.se) < 0.0:
            continue  # no data of a curve: refused where they are checked
        before, behind = sqrt(low.e * low.se), sqrt(high.e * high.se)
        if before > behind and low.e < high.e:
            return (high.e * before - low.e * behind) / (before - behind)
    return None


def _unusual(model: Model | Machine, values: Mapping[str, float]) -> Texts:
    """Yield (symbol, warning) for data that a machine can hardly have."""
    return unusual_reactances(values) if isinstance(model, Machine) else ()


def record_fields(definition: Definition, values: Mapping[str, float]) -> list[str]:
    """Return the fields behind a record's id, each number in the digits that give it back."""
    record = definition.record
    integers = dict(record.icons)
    given = {**dict.fromkeys(record.ignored, 0.0), **integers, **dict(record.absent), **values}
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


def limits_beyond(rows: Sheet, given: Mapping[str, float]) -> dict[str, float]:
    """The ends of the sheet for limits beyond them that never act, as 99999: by symbol."""
    ends = dict[str, float]()
    for row in rows:
        value = given.get(row.symbol, 0.0)
        if row.symbol.endswith(CEILING) and value > row.high and value >= OUT_OF_REACH:
            ends[row.symbol] = row.high
        elif row.symbol.endswith(FLOOR) and value < row.low and value <= -OUT_OF_REACH:
            ends[row.symbol] = row.low
    return ends


def in_digits_borne(value: float, error: float | None) -> float:
    """A fitted value in the digits that its standard error bears, at least four."""
    candidates = float(rounded(value, error)), float(f"{value:.{LEAST_DIGITS}g}")
    return min(candidates, key=lambda candidate: abs(candidate - value))


def outside(rows: Sheet, values: Mapping[str, float]) -> Texts:
    """Yield (symbol, fault) for each value that its data sheet excludes."""
    for row in rows:
        value = values.get(row.symbol, row.low)
        if not row.low <= value <= row.high:
            limits = f"{show(row.low)} ... {show(row.high)} {row.unit}"
            yield row.symbol, f"{show(value)} lies outside {limits}, its data sheet's range"
