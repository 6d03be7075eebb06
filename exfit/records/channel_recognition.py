"""What the names and units of a recorder's columns say of the signals behind them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from exfit.records.units import bare, quantity_of

# signal -> the quantity of its unit, and the words that stand for it, the surest first
WORDS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "vref": (
        "voltage",
        ("vref", "uref", "usoll", "vset", "uset", "reference", "setpoint", "sollwert", "ref"),
    ),
    "efd": (
        "voltage",
        ("efd", "vfd", "ufd", "vf", "uf", "field voltage", "ufield", "vfield", "erregerspannung",
         "feldspannung"),
    ),
    "ifd": (
        "current",
        ("ifd", "if", "field current", "ifield", "erregerstrom", "feldstrom", "lad ifd"),
    ),
    "q": ("reactive", ("q", "qe", "qg", "qgen", "reactive power", "reactive", "blindleistung")),
    "p": (
        "power",
        ("p", "pe", "pg", "pgen", "active power", "real power", "wirkleistung", "power"),
    ),
    "vt": (
        "voltage",
        ("vt", "ut", "ug", "vg", "ugen", "vgen", "uterm", "vterm", "ugenerator", "terminal voltage",
         "generator voltage", "stator voltage", "generatorspannung", "klemmenspannung",
         "ustator", "vstator", "voltage", "volt", "spannung", "u", "v"),
    ),
}  # fmt: skip
OF_EXCITER = {"exciter", "erregermaschine", "pilot", "ve", "ife", "ief", "efe", "vfe"}
BY_UNIT: Mapping[str, str] = {"power": "p", "reactive": "q"}
TRIPLES = (
    ("l1", "l2", "l3"), ("12", "23", "31"), ("ab", "bc", "ca"), ("rs", "st", "tr"),
    ("a", "b", "c"), ("r", "s", "t"), ("1", "2", "3"),
)  # fmt: skip
LINE_TO_LINE = TRIPLES[1:4]
OF_VOLTAGE = re.compile(r"^(u|v|.*volt|.*spannung)")


@dataclass(frozen=True)
class Guess:
    """A signal that a column seems to be, and why."""

    signal: str
    why: str


def guessed(names: Sequence[str], units: Mapping[str, str]) -> dict[str, Guess]:
    """Return the signals that columns seem to be, by column: each signal once, by the surest word.

    The unit must go with the signal; where the name says nothing, MW and Mvar still do.
    """
    found: dict[str, Guess] = {}
    for signal, (_, words) in WORDS.items():
        ranked = [
            (rank, name)
            for name in names
            if name not in found and (rank := _rank(name, units.get(name), signal)) is not None
        ]
        if ranked:
            rank, name = min(ranked, key=lambda one: one[0])
            found[name] = Guess(signal, f"its name: {words[rank]}")
    for name in names:
        signal = BY_UNIT.get(quantity_of(units.get(name)) or "", "")
        if signal and name not in found and signal not in {one.signal for one in found.values()}:
            found[name] = Guess(signal, f"its unit: {units[name]}")
    return found


def three_phases(names: Sequence[str], units: Mapping[str, str]) -> tuple[tuple[str, ...], ...]:
    """Return the columns that are the three phases of a voltage: Ua Ub Uc, UL1 UL2 UL3, U12 ..."""
    found: list[tuple[str, ...]] = []
    taken: set[str] = set()
    for name in names:
        for triple in _triples(name, names):
            quantities = {quantity_of(units.get(one)) for one in triple}
            voltage = quantities == {"voltage"} or (
                quantities == {None} and OF_VOLTAGE.match(bare(name).lower())
            )
            if voltage and not taken & {*triple}:
                found.append(triple)
                taken |= {*triple}
    return tuple(found)


def connection_of(columns: Sequence[str]) -> str:
    """Return between what three voltages seem to be recorded, by their names: U12, Uab, URS ..."""
    low = [one.lower() for one in columns]
    for marks in LINE_TO_LINE:
        if all(mark in name for mark, name in zip(marks, low, strict=True)):
            return "phase-to-phase"
    return "phase-to-ground"


def _triples(name: str, names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield the columns that differ from one in the mark of the phase alone."""
    known = {one.lower(): one for one in names}
    low = name.lower()
    for marks in TRIPLES:
        for at in (match.start() for match in re.finditer(re.escape(marks[0]), low)):
            others = [low[:at] + mark + low[at + len(marks[0]) :] for mark in marks]
            if at > 0 and all(other in known for other in others):
                yield tuple(known[other] for other in others)


def _rank(name: str, unit: str | None, signal: str) -> int | None:
    """Return how surely a column is a signal, the surest 0; None where it is not."""
    quantity, words = WORDS[signal]
    if unit not in (None, "pu", "%") and quantity_of(unit) != quantity:
        return None
    tokens = [one for one in re.split(r"[^a-zäöüß0-9]+", bare(name).lower()) if one]
    if OF_EXCITER & {*tokens}:
        return None
    text = " ".join(tokens)
    joined = "".join(tokens)
    for rank, word in enumerate(words):
        if word in (text, joined) or re.search(rf"(^| ){re.escape(word)}( |$)", text):
            return rank
    return None
