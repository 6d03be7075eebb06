"""The signal of each column by its name and unit, and how surely it is that signal."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from exfit.records.units import OTHER_UNITS, bare, quantity_of
from exfit.records.vocabulary import KINDS, folded, tokens, words_of
from exfit.signals import ROWS, SIGNALS, SignalRow

EXCITER_FIELD = "that of the field of a brushless exciter"
CONTROL_ERROR = "a control error"
AMBIGUOUS_EXCITATION = ("err", "exc", "excit")  # exciter as well as excitation
OF_SPEED = ("rpm", "r/min", "1/min", "min-1", "U/min", "rad/s")
RATIOS = ("%", "-")  # units that a signal of any quantity may have
DOUBTS: Mapping[str, tuple[str, ...]] = {"ue": (EXCITER_FIELD,), "ie": (EXCITER_FIELD,)}
POWERS = ("power", "reactive")
# words of other columns -> with which others they are a signal after all, and what else it may be
EXCEPTIONS = {
    "grid": ("stator", "stator", "a voltage of the grid"),
    "exciter": ("output", "field", "a quantity within the exciter"),
    "output": ("field", "field", "a quantity of the regulator"),
}
# the channels of a planning program, by the name before the bus: ETRM 101[NAME 13.8]1
PSSE = re.compile(r"(?P<name>[A-Z]{2,6})\s*\d+\s*\[[^\]]*\]\s*\w{0,2}")
PSSE_CHANNELS = {
    "ETRM": "vt", "ETERM": "vt", "EFD": "efd", "XADI": "ifd", "XADIFD": "ifd", "POWR": "p",
    "PELEC": "p", "VARS": "q", "QELEC": "q", "VREF": "vref",
}  # fmt: skip
ON_SYSTEM_BASE = ("POWR", "PELEC", "VARS", "QELEC")
# variables of a machine in another one: s:ut
POWER_FACTORY = re.compile(r"[a-z]:(?P<name>\w+)")
POWER_FACTORY_VARIABLES = {
    "ut": "vt", "ve": "efd", "ie": "ifd", "pgt": "p", "qgt": "q", "usetp": "vref",
    "xspeed": "speed",
}  # fmt: skip
IN_TURN = sorted((row for row in ROWS if row.words), key=lambda row: row.turn)
TRIPLES = (
    ("l1", "l2", "l3"), ("12", "23", "31"), ("ab", "bc", "ca"), ("rs", "st", "tr"),
    ("a", "b", "c"), ("r", "s", "t"), ("1", "2", "3"),
)  # fmt: skip
LINE_TO_LINE = TRIPLES[1:4]
OF_VOLTAGE = re.compile(r"^(u|v|.*volt|.*spannung)")


class Clarity(IntEnum):
    """How clearly a name is that of a signal, the clearest first."""

    OWN = 0  # the signal's own: efd, ug
    WORDS = 1  # quantity and place: rotor current
    VAGUE = 2  # it may be something else: U1, excitation voltage
    QUANTITY = 3  # without a place: voltage
    UNIT = 4  # nothing but the unit: MW
    NONE = 5


@dataclass(frozen=True)
class NameReading:
    """The signal that a name shows, ``others`` that it may be as well, and why.

    ``system_base`` says that 1 pu is that of the grid, not of the machine.
    """

    signal: str | None
    clarity: Clarity
    why: str
    others: tuple[str, ...] = ()
    order: int = 0
    system_base: bool = False


def read_name(name: str, unit: str | None) -> NameReading:
    """Read the name and the unit of a column for the signal that it is."""
    program = _of_program(name)
    if program is not None:
        return program
    words = words_of(bare(name))
    kinds = {KINDS[word]: word for word in reversed(words) if word in KINDS}
    reading = _whole(" ".join(tokens(bare(name)))) or _by_words(words, kinds, unit)
    row = SIGNALS.get(reading.signal or "")
    if row is not None and not _fits(unit, row):
        return NameReading(None, Clarity.NONE, f"{unit} is no unit of {row.symbol}")
    return reading


def _whole(text: str) -> NameReading | None:
    """Return the signal of which a name is an own word, though it may be joined of others."""
    for row in ROWS:
        own = [folded(word) for word in row.words]
        if text in own:
            doubts = DOUBTS.get(text, ())
            return NameReading(row.symbol, Clarity.OWN, _named(text), doubts, own.index(text))
    return None


def _by_words(words: tuple[str, ...], kinds: Mapping[str, str], unit: str | None) -> NameReading:
    own = _own(words)
    if own is not None and own.signal == "vs":
        if "stator" in kinds and own.why == _named("vs"):  # vs is that of the stator then
            return NameReading(None, Clarity.NONE, own.why, ("vt", "vs"))
        return own
    quantity = _quantity(kinds) or quantity_of(unit)
    if "speed" in kinds and "reference" not in kinds:
        return NameReading("speed", Clarity.OWN, _named(kinds["speed"]))
    if "otherwise" in kinds:
        return NameReading(None, Clarity.NONE, _named(kinds["otherwise"]))
    if EXCEPTIONS.keys() & kinds.keys():
        return _elsewhere(kinds, quantity)
    if "reference" in kinds:
        return _reference(kinds, quantity)
    if "excitation" in kinds and quantity not in POWERS:
        return _excitation(kinds, quantity, own)
    return own or _by_place(kinds, quantity)


def _elsewhere(kinds: Mapping[str, str], quantity: str | None) -> NameReading:
    """Return no signal for the grid, an exciter or an output, but for some that may be one.

    A generator's bus has the terminal voltage, and an exciter's output is the field voltage.
    """
    for kind, (other, place, doubt) in EXCEPTIONS.items():
        if kind in kinds:
            row = _row(quantity or "", place) if other in kinds else None
            why = _named(kinds[kind], *([kinds[other]] if row else []))
            if row is None:
                return NameReading(None, Clarity.NONE, why)
            return NameReading(row.symbol, Clarity.VAGUE, why, (doubt,))
    return NameReading(None, Clarity.NONE, "")


def _by_place(kinds: Mapping[str, str], quantity: str | None) -> NameReading:
    """Read the words for a quantity and for a place together."""
    if quantity in POWERS:
        return _power(kinds, quantity)
    place = next((place for place in ("field", "stator") if place in kinds), "")
    row = _row(quantity or "", place)
    if row is not None and place:
        what = _named(*(kinds[kind] for kind in (row.quantity, place) if kind in kinds))
        return NameReading(row.symbol, Clarity.WORDS, what)
    if place == "field":
        return NameReading(None, Clarity.NONE, _named(kinds[place]), ("efd", "ifd"))
    return _without_place(kinds)


def _without_place(kinds: Mapping[str, str]) -> NameReading:
    """Read a word for a quantity by itself."""
    if "voltage" in kinds and "current" not in kinds:
        return NameReading("vt", Clarity.QUANTITY, _named(kinds["voltage"]))
    if "current" in kinds and "voltage" not in kinds:
        return NameReading(None, Clarity.NONE, _named(kinds["current"]), ("ifd", "it"))
    return NameReading(None, Clarity.NONE, "")


def _excitation(
    kinds: Mapping[str, str], quantity: str | None, own: NameReading | None
) -> NameReading:
    """Return the field's voltage or current, which may be that of a brushless exciter's field."""
    row = _row(quantity or "", "field")
    signal = row.symbol if row else own.signal if own else None
    word = kinds["excitation"]
    if signal is None:
        return NameReading(None, Clarity.NONE, _named(word), ("efd", "ifd"))
    if "field" in kinds and word not in AMBIGUOUS_EXCITATION:
        return NameReading(signal, Clarity.WORDS, _named(word, kinds["field"]))
    others = (CONTROL_ERROR,) if word == "err" else (EXCITER_FIELD,)
    return NameReading(signal, Clarity.VAGUE, _named(word), others)


def _power(kinds: Mapping[str, str], quantity: str) -> NameReading:
    if {"field", "excitation"} & kinds.keys():
        return NameReading(None, Clarity.NONE, _named(*kinds.values()))
    signal = "p" if quantity == "power" else "q"
    if quantity in kinds:
        return NameReading(signal, Clarity.WORDS, _named(kinds[quantity]))
    return NameReading(signal, Clarity.UNIT, "")


def _reference(kinds: Mapping[str, str], quantity: str | None) -> NameReading:
    """Return the reference of the voltage; that of power or of a field current is no signal."""
    word = kinds.get("reference", "vref")
    if quantity not in (None, "voltage") or {"field", "excitation", "speed"} & kinds.keys():
        return NameReading(None, Clarity.NONE, _named(word))
    return NameReading("vref", Clarity.OWN, _named(word))


def _own(words: tuple[str, ...]) -> NameReading | None:
    """Return the signal whose own words a name holds, the surest words first."""
    text = f" {' '.join(words)} "
    readings = [
        NameReading(row.symbol, clarity, _named(word), DOUBTS.get(word, ()), order)
        for row in ROWS
        for clarity, own in ((Clarity.OWN, row.words), (Clarity.VAGUE, row.vague_words))
        for order, word in enumerate(own)
        if f" {folded(word)} " in text
    ]
    longest = sorted(readings, key=lambda reading: (reading.clarity, -len(reading.why)))
    return longest[0] if longest else None


def _of_program(name: str) -> NameReading | None:
    """Read the name of a channel by the names that planning programs give."""
    text = bare(name).strip()
    channel = PSSE.fullmatch(text)
    if channel is not None:
        signal = PSSE_CHANNELS.get(channel["name"])
        why, system = f"PSS/E's {channel['name']}", channel["name"] in ON_SYSTEM_BASE
        clarity = Clarity.OWN if signal else Clarity.NONE
        return NameReading(signal, clarity, why, system_base=system)
    variable = POWER_FACTORY.match(text)
    signal = POWER_FACTORY_VARIABLES.get(variable["name"].lower()) if variable else None
    if variable is None or signal is None:
        return None
    return NameReading(signal, Clarity.OWN, f"PowerFactory's {variable['name']}")


def _quantity(kinds: Mapping[str, str]) -> str | None:
    """Find the quantity that a name says to be measured; None for none, or two."""
    for quantity in reversed(POWERS):  # a reactive power is none that is active
        if quantity in kinds:
            return quantity
    electric = [quantity for quantity in ("voltage", "current") if quantity in kinds]
    return electric[0] if len(electric) == 1 else None


def _row(quantity: str, place: str) -> SignalRow | None:
    rows = (row for row in ROWS if (row.quantity, row.place) == (quantity, place))
    return next(rows, None)


def _fits(unit: str | None, row: SignalRow) -> bool:
    """Check whether numbers in a unit can be a signal."""
    quantity = quantity_of(unit)
    if quantity is None:
        turning = row.symbol == "speed" and unit in OF_SPEED
        return unit not in OTHER_UNITS or unit in RATIOS or turning
    return quantity == row.quantity or not row.quantity


def _named(*words: str) -> str:
    return f"its name: {' '.join(words)}"


@dataclass(frozen=True)
class Guess:
    """The signal that a column seems to be by its name and unit, and the columns it shares it with.

    ``rivals`` are columns whose names show the same signal as clearly.
    """

    reading: NameReading
    rivals: tuple[str, ...] = ()

    @property
    def signal(self) -> str:
        """The signal."""
        return str(self.reading.signal)


def guess_signals(
    names: Sequence[str], units: Mapping[str, str], moving: Collection[str] = ()
) -> dict[str, Guess]:
    """Return the signals that columns seem to be, each signal once, by the clearest name.

    Of equally clear names the columns that are ``moving`` with the test come first. Where several
    remain that have no more than a quantity in common, none of them is taken.
    """
    readings = {name: read_name(name, units.get(name)) for name in names}
    guesses: dict[str, Guess] = {}
    for row in IN_TURN:
        ranked = [
            ((reading.clarity, reading.order, name not in moving), name)
            for name, reading in readings.items()
            if reading.signal == row.symbol
        ]
        if not ranked:
            continue
        first = min(rank for rank, _ in ranked)
        name, *rivals = (name for rank, name in ranked if rank == first)
        if not rivals or readings[name].clarity < Clarity.QUANTITY:
            guesses[name] = Guess(readings[name], tuple(rivals))
    return guesses


def three_phases(names: Sequence[str], units: Mapping[str, str]) -> tuple[tuple[str, ...], ...]:
    """Return the columns that are the three phases of a voltage: Ua Ub Uc, UL1 UL2 UL3, U12 ..."""
    groups: list[tuple[str, ...]] = []
    by_lower_case = {name.lower(): name for name in names}
    for name in names:
        for triple in triples(name, by_lower_case):
            quantities = {quantity_of(units.get(column)) for column in triple}
            voltage = quantities == {"voltage"} or (
                quantities == {None} and OF_VOLTAGE.match(bare(name).lower())
            )
            if voltage and not any({*triple} & {*group} for group in groups):
                groups.append(triple)
    return tuple(groups)


def connection_of(columns: Sequence[str]) -> str:
    """Return the connection of three recorded voltages, by their names: U12, Uab, URS ..."""
    lowered = [column.lower() for column in columns]
    for marks in LINE_TO_LINE:
        if all(mark in name for mark, name in zip(marks, lowered, strict=True)):
            return "phase-to-phase"
    return "phase-to-ground"


def triples(name: str, by_lower_case: Mapping[str, str]) -> Iterator[tuple[str, ...]]:
    """Yield the columns that differ from one in the mark of the phase alone."""
    text = name.lower()
    for marks in TRIPLES:
        for at in (match.start() for match in re.finditer(re.escape(marks[0]), text)):
            phases = [text[:at] + mark + text[at + len(marks[0]) :] for mark in marks]
            if at > 0 and all(phase in by_lower_case for phase in phases):
                yield tuple(by_lower_case[phase] for phase in phases)
