"""The signal of each column by its name and unit, and how surely it is that signal.

Recorders, simulators and five languages make the names of channels of words that stand here without
accents, in small letters: läufer as laufer, tensão as tensao. What a signal is called as a whole,
as efd or ug, stands in its row of the table of signals.
"""

import re
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from itertools import pairwise, takewhile

from exfit.records.units import OTHER_UNITS, bare, quantity_of
from exfit.signals import ROWS, SIGNALS, SignalRow

# kind -> its words; those of `otherwise` are of channels that are none of the signals
WORDS: Mapping[str, str] = {
    "filler": """
        rel relative avg average mean mittel mittelwert rms eff meas measured ist istwert actual pv
        filt main active real activa ativa attiva wirk blind mag magnitude dc elec electrical el""",
    "voltage": """
        voltage volt volts vlt v u kv vdc vac vcc vll spannung spg tension tensao voltaje
        voltagem tensione""",
    "current": """
        current curr cur amp amps ampere amperes i ka adc strom courant corriente corrente intensite
        intensidad""",
    "power": "power load watt watts mw kw leistung wirkleistung puissance potencia potenza",
    "reactive": "reactive var vars mvar mvars kvar blindleistung reactiva reativa reattiva",
    "stator": """
        gen generator generatoren generador gerador generateur alternateur alternador alternator
        stator estator statorique estatorica stander anker armature machine maschine maschinen
        maquina terminal terminals term bornes klemmen klemme klemm trm generatore statore""",
    "field": """
        field fld feld rotor rot rotors rotorique rotorica rotore laufer polrad champ campo fd slip
        schleifring bridge""",
    "excitation": "excitation exc excit erreger erregung err excitacion excitacao eccitazione",
    "exciter": """
        exciter exciters excitatrice excitatriz excitadora eccitatrice pilot erregermaschine""",
    "grid": """
        bus busbar grid network netz reseau red rede rete barra barras sbarra hv ehv
        sammelschiene system mains infinite""",
    "reference": """
        ref reference referenz referencia setpoint setpt setval sp soll sollwert set consigne
        consigna riferimento""",
    "speed": "speed spd drehzahl vitesse velocidad velocidade velocita rpm",
    "frequency": "freq frequency frequenz frequence frecuencia frequencia frequenza",
    "angle": "angle winkel angulo angolo",
    "output": "output out ausgang salida saida sortie",
    "otherwise": """
        temp temperature temperatur temperatura limit limits lim limite limiter uel oel max
        min error deviation abweichung regelabweichung firing hz hertz gate valve breaker
        position factor pf cos trafo transformer transformador transformateur transformator
        neutral governor turbine pressure vibration trigger status alarm control ctrl steuersatz
        apparent mva scheinleistung spare""",
}
SHORT = frozenset("uvipq")  # letters that begin a word, as in ugen and ifeld
LINKING = ("s", "n", "en")  # letters between the parts of a German word
KINDS: Mapping[str, str] = {word: kind for kind, text in WORDS.items() for word in text.split()}
CAPITAL = re.compile(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])")  # where a word of a name begins

EXCITER_FIELD = "that of the field of a brushless exciter"
CONTROL_ERROR = "a control error"
AMBIGUOUS_EXCITATION = ("err", "exc", "excit")  # exciter as well as excitation
OF_SPEED = ("rpm", "r/min", "1/min", "min-1", "U/min", "rad/s")
OF_SHUNT = "mV"  # of a current: the voltage of its shunt
RATIOS = ("%", "-")  # units that a signal of any quantity may have
DOUBTS: Mapping[str, tuple[str, ...]] = {"ue": (EXCITER_FIELD,), "ie": (EXCITER_FIELD,)}
POWERS = ("power", "reactive")
FEWEST_SHARING = 3  # columns whose names begin or end alike
OF_FIELD = frozenset(("field", "excitation"))
OF_OTHERS = OF_FIELD | {"speed"}  # references to others than the voltage
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

    ``system_base`` says that 1 pu is that of the grid, not of the machine. With ``elsewhere`` the
    name is that of something else. What physics shows may come with its ``unit``, and a
    ``question`` where it does not show it for sure.
    """

    signal: str | None
    clarity: Clarity
    why: str
    others: tuple[str, ...] = ()
    order: int = 0
    system_base: bool = False
    elsewhere: bool = False
    unit: str | None = None
    question: str = ""


def read_name(name: str, unit: str | None) -> NameReading:
    """Read the name and the unit of a column for the signal that it is."""
    reading = _of_program(bare(name).strip())
    if reading is not None:
        return reading
    whole, words = " ".join(tokens(bare(name))), words_of(bare(name))
    kinds = {KINDS[word]: word for word in reversed(words) if word in KINDS}
    named = (row for row in ROWS if whole in _folded_words(row.words))
    row = next(named, None)
    if row is not None:  # an own word of a signal, though it may be joined of others
        order = _folded_words(row.words).index(whole)
        doubts = DOUBTS.get(whole, ())
        reading = NameReading(row.symbol, Clarity.OWN, _named(whole), doubts, order)
    else:
        reading = _by_words(_own(words), kinds, unit)
    if unit == "kV" and reading == _none(""):  # no field has so much
        return NameReading("vt", Clarity.UNIT, "")
    row = SIGNALS.get(reading.signal or "")
    if row is not None and not _fits(unit, row):
        return _none(f"{unit} is no unit of {row.symbol}")
    return reading


def _of_program(text: str) -> NameReading | None:
    """Read the name of a channel by the names that planning programs give."""
    channel = PSSE.fullmatch(text)
    if channel is not None:
        signal = PSSE_CHANNELS.get(channel["name"])
        why, system = f"PSS/E's {channel['name']}", channel["name"] in ON_SYSTEM_BASE
        clarity = Clarity.OWN if signal else Clarity.NONE
        return NameReading(signal, clarity, why, system_base=system, elsewhere=signal is None)
    variable = POWER_FACTORY.match(text)
    signal = POWER_FACTORY_VARIABLES.get(variable["name"].lower()) if variable else None
    if variable is None or signal is None:
        return None
    return NameReading(signal, Clarity.OWN, f"PowerFactory's {variable['name']}")


def _own(words: tuple[str, ...]) -> NameReading | None:
    """Return the signal whose own words a name holds, the surest words first."""
    text = f" {' '.join(words)} "
    readings = [
        NameReading(row.symbol, clarity, _named(word), DOUBTS.get(word, ()), order)
        for row in ROWS
        for clarity, own in ((Clarity.OWN, row.words), (Clarity.VAGUE, row.vague_words))
        for order, word in enumerate(own)
        if f" {_folded_words(own)[order]} " in text
    ]
    return min(readings, key=lambda reading: (reading.clarity, -len(reading.why)), default=None)


def _by_words(own: NameReading | None, kinds: Mapping[str, str], unit: str | None) -> NameReading:
    """Read a name by the ``kinds`` of its words, a word each, and by its ``own`` ones."""
    if own is not None and own.signal == "vs":
        of_stator = "stator" in kinds and own.why == _named("vs")
        return _none(own.why, "vt", "vs") if of_stator else own
    quantity = _quantity(kinds) or ("current" if unit == OF_SHUNT else quantity_of(unit))
    if "speed" in kinds and "reference" not in kinds:
        return NameReading("speed", Clarity.OWN, _named(kinds["speed"]))
    reading = _beside_machine(kinds, quantity)
    if reading is not None:
        return reading
    if "reference" in kinds:
        return _reference(kinds, quantity)
    if "excitation" in kinds and quantity not in POWERS:
        return _excitation(kinds, quantity, own)
    return own or _by_place(kinds, quantity)


def _beside_machine(kinds: Mapping[str, str], quantity: str | None) -> NameReading | None:
    """Read words of what is no signal of the machine, of the frequency and of the angle."""
    if "otherwise" in kinds:
        return _of_another(kinds["otherwise"])
    turning = next((kind for kind in ("frequency", "angle") if kind in kinds), None)
    if turning is not None:
        reading = NameReading(turning, Clarity.OWN, _named(kinds[turning]))
        return _of_another(kinds["field"]) if "field" in kinds else reading
    exceptions = EXCEPTIONS.keys() & kinds.keys()
    if exceptions and not (quantity in POWERS and exceptions == {"output"}):
        return _elsewhere(kinds, quantity)
    return None


def _elsewhere(kinds: Mapping[str, str], quantity: str | None) -> NameReading:
    """Return no signal for the grid, an exciter or an output, but for some that may be one.

    A generator's bus has the terminal voltage, and an exciter's output is the field voltage.
    """
    kind = next(kind for kind in EXCEPTIONS if kind in kinds)
    other, place, doubt = EXCEPTIONS[kind]
    row = _row(quantity, place) if other in kinds else None
    if row is None:
        return _of_another(kinds[kind])
    return NameReading(row.symbol, Clarity.VAGUE, _named(kinds[kind], kinds[other]), (doubt,))


def _reference(kinds: Mapping[str, str], quantity: str | None) -> NameReading:
    """Return the reference of the voltage; that of power or of a field current is no signal."""
    why = _named(kinds["reference"])
    of_others = quantity not in (None, "voltage") or OF_OTHERS & kinds.keys()
    return _of_another(kinds["reference"]) if of_others else NameReading("vref", Clarity.OWN, why)


def _excitation(
    kinds: Mapping[str, str], quantity: str | None, own: NameReading | None
) -> NameReading:
    """Return the field's voltage or current, which may be that of a brushless exciter's field."""
    row, word = _row(quantity, "field"), kinds["excitation"]
    signal = row.symbol if row else own.signal if own else None
    if signal is None:
        return _none(_named(word), "efd", "ifd")
    if "field" in kinds and word not in AMBIGUOUS_EXCITATION:
        return NameReading(signal, Clarity.WORDS, _named(word, kinds["field"]))
    others = (CONTROL_ERROR,) if word == "err" else (EXCITER_FIELD,)
    return NameReading(signal, Clarity.VAGUE, _named(word), others)


def _by_place(kinds: Mapping[str, str], quantity: str | None) -> NameReading:
    """Read the words for a quantity and for a place together, or for one of them."""
    if quantity in POWERS:
        if OF_FIELD & kinds.keys():
            return _of_another(*kinds.values())
        clarity = Clarity.WORDS if quantity in kinds else Clarity.UNIT
        why = _named(kinds[quantity]) if quantity in kinds else ""
        return NameReading("p" if quantity == "power" else "q", clarity, why)
    place = "field" if "field" in kinds else "stator" if "stator" in kinds else ""
    row = _row(quantity, place)
    if row is not None and place:
        what = _named(*(kinds[kind] for kind in (row.quantity, place) if kind in kinds))
        return NameReading(row.symbol, Clarity.WORDS, what)
    if place == "field":
        return _none(_named(kinds[place]), "efd", "ifd")
    electric = kinds.keys() & {"voltage", "current"}
    if electric == {"voltage"}:
        return NameReading("vt", Clarity.QUANTITY, _named(kinds["voltage"]))
    return _none(_named(kinds["current"]), "ifd", "it") if electric == {"current"} else _none("")


def _of_another(*words: str) -> NameReading:
    """Read a name that is of none of the signals."""
    return NameReading(None, Clarity.NONE, _named(*words), elsewhere=True)


def _none(why: str, *others: str) -> NameReading:
    """Read no signal in a name, though it may be one of ``others``."""
    return NameReading(None, Clarity.NONE, why, others)


def _quantity(kinds: Mapping[str, str]) -> str | None:
    for quantity in reversed(POWERS):  # a reactive power is none that is active
        if quantity in kinds:
            return quantity
    electric = kinds.keys() & {"voltage", "current"}
    return str(*electric) if len(electric) == 1 else None


def _row(quantity: str | None, place: str) -> SignalRow | None:
    rows = (row for row in ROWS if (row.quantity, row.place) == (quantity or "", place))
    return next(rows, None)


def _fits(unit: str | None, row: SignalRow) -> bool:
    quantity = quantity_of(unit)
    if quantity is None:
        turning = row.symbol == "speed" and unit in OF_SPEED
        return unit not in OTHER_UNITS or unit in RATIOS or turning
    of_shunt = unit == OF_SHUNT and row.quantity == "current"
    return quantity == row.quantity or of_shunt or not row.quantity


def _named(*words: str) -> str:
    return f"its name: {' '.join(words)}"


# ---- words


@cache
def _folded_words(words: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(map(folded, words))


def folded(text: str) -> str:
    """Return a text in small letters without accents."""
    if text.isascii():
        return text.lower()
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    return "".join(letter for letter in decomposed if not unicodedata.combining(letter))


def tokens(name: str) -> list[str]:
    """Return the words and numbers of a name that marks set apart, folded."""
    return [token for token in re.split(r"[^a-z0-9]+", folded(name)) if token]


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name: set apart by marks or capitals, or joined as in ugen."""
    apart = tokens(CAPITAL.sub(" ", name))
    whole = [token for token in tokens(name) if token in KINDS and token not in apart]
    symbols = [first + second for first, second in pairwise(apart) if first in SHORT]  # u_f is uf
    parts: list[str] = []
    for token in apart:  # the known words that it is joined of
        text = token.rstrip("0123456789")
        known = token in KINDS or len(text) < 2
        parts += [token] if known else next(_joined(text, first=True), (text,))
    return (*whole, *symbols, *parts)


def _joined(text: str, first: bool) -> Iterator[tuple[str, ...]]:
    """Yield the ways in which a text is joined of known words, the longest first word first."""
    if text in KINDS and (first or len(text) > 1):
        yield (text,)
    for length in range(len(text) - 1, 0, -1):
        word, rest = text[:length], text[length:]
        known = word in KINDS if length > 1 else first and word in SHORT
        if not known:
            continue
        for linking in ("", *LINKING):
            if rest.startswith(linking) and len(rest) > len(linking):
                for others in _joined(rest[len(linking) :], first=False):
                    yield (word, *others)


# ---- the columns of a file


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


def read_names(names: Sequence[str], units: Mapping[str, str]) -> dict[str, NameReading]:
    """Read the names of the columns of a file; what all of them share says nothing: vA, fA, pA."""
    readings = {name: read_name(name, units.get(name)) for name in names}
    plain = [bare(name) for name in names]
    shortest = min(map(len, plain), default=1) - 1  # a letter of each remains
    before = _shared([name[:shortest] for name in plain])
    after = _shared([name[: -1 - shortest + before : -1] for name in plain])
    if len(names) < FEWEST_SHARING or not before + after:
        return readings
    for name, text in zip(names, plain, strict=True):
        short = text[before : len(text) - after]
        own = read_name(short, units.get(name)) if short.isalpha() else readings[name]
        if readings[name].clarity >= Clarity.QUANTITY > own.clarity:
            readings[name] = own
    return readings


def _shared(texts: Sequence[str]) -> int:
    """Return with how many letters all texts begin alike."""
    return sum(
        1 for _ in takewhile(lambda letters: len({*letters}) == 1, zip(*texts, strict=False))
    )


def guess_signals(
    names: Sequence[str],
    units: Mapping[str, str],
    moving: Collection[str] = (),
    known: Mapping[str, NameReading] | None = None,
) -> dict[str, Guess]:
    """Return the signals that columns seem to be, each signal once, by the clearest reading.

    Of equally clear ones the columns that are ``moving`` with the test come first. Where several
    remain that have no more than a quantity in common, none of them is taken. The readings that are
    ``known`` count for their names.
    """
    readings = read_names(names, units) if known is None else {name: known[name] for name in names}
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
            stated = {units.get(column) for column in triple}
            quantities = {quantity_of(unit) for unit in stated} if len(stated) == 1 else set()
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
