"""Which signals a recorder's columns hold, by their names and units."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from exfit.records.units import bare, quantity_of
from exfit.signals import ROWS, SignalRow

IN_TURN = sorted((row for row in ROWS if row.words), key=lambda row: row.turn)
OF_EXCITER = {"exciter", "erregermaschine", "pilot", "ve", "ife", "ief", "efe", "vfe"}
BY_UNIT: Mapping[str, str] = {row.quantity: row.symbol for row in ROWS if row.unit_suffices}
TRIPLES = (
    ("l1", "l2", "l3"), ("12", "23", "31"), ("ab", "bc", "ca"), ("rs", "st", "tr"),
    ("a", "b", "c"), ("r", "s", "t"), ("1", "2", "3"),
)  # fmt: skip
LINE_TO_LINE = TRIPLES[1:4]
CAPITAL = re.compile(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])")  # where a word of a name begins
OF_VOLTAGE = re.compile(r"^(u|v|.*volt|.*spannung)")


@dataclass(frozen=True)
class Guess:
    """A signal that a column seems to be, and why."""

    signal: str
    why: str


def guess_signals(names: Sequence[str], units: Mapping[str, str]) -> dict[str, Guess]:
    """Return the signals that columns seem to be, by column: each signal once, by the surest word.

    The unit must be one of the signal; where the name shows nothing, MW and Mvar still do.
    """
    guesses: dict[str, Guess] = {}
    for row in IN_TURN:
        ranked = [
            (rank, name)
            for name in names
            if name not in guesses and (rank := _rank(name, units.get(name), row)) is not None
        ]
        if ranked:
            rank, name = min(ranked, key=lambda pair: pair[0])
            guesses[name] = Guess(row.symbol, f"its name: {row.words[rank]}")
    for name in names:
        signal = BY_UNIT.get(quantity_of(units.get(name)) or "", "")
        recognised = {guess.signal for guess in guesses.values()}
        if signal and name not in guesses and signal not in recognised:
            guesses[name] = Guess(signal, f"its unit: {units[name]}")
    return guesses


def three_phases(names: Sequence[str], units: Mapping[str, str]) -> tuple[tuple[str, ...], ...]:
    """Return the columns that are the three phases of a voltage: Ua Ub Uc, UL1 UL2 UL3, U12 ..."""
    groups: list[tuple[str, ...]] = []
    for name in names:
        for triple in _triples(name, names):
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


def _triples(name: str, names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield the columns that differ from one in the mark of the phase alone."""
    by_lower_case = {column.lower(): column for column in names}
    text = name.lower()
    for marks in TRIPLES:
        for at in (match.start() for match in re.finditer(re.escape(marks[0]), text)):
            phases = [text[:at] + mark + text[at + len(marks[0]) :] for mark in marks]
            if at > 0 and all(phase in by_lower_case for phase in phases):
                yield tuple(by_lower_case[phase] for phase in phases)


def _rank(name: str, unit: str | None, row: SignalRow) -> int | None:
    """Return how surely a column is a signal, the surest 0; None where it is not.

    A word is the whole name, with or without its unit, or a part that is set apart: by a mark, or,
    if it has two letters or more, by its capital as in rUgRel.
    """
    if unit not in (None, "pu", "%") and quantity_of(unit) != row.quantity:
        return None
    tokens = _tokens(bare(name))
    if OF_EXCITER & {*tokens}:
        return None
    whole = {" ".join(tokens), "".join(tokens), " ".join(_tokens(name))}
    text, split_at_capitals = " ".join(tokens), " ".join(_tokens(CAPITAL.sub(" ", bare(name))))
    for rank, word in enumerate(row.words):
        part = re.compile(rf"(^| ){re.escape(word)}( |$)")
        if word in whole or part.search(text) or (len(word) > 1 and part.search(split_at_capitals)):
            return rank
    return None


def _tokens(name: str) -> list[str]:
    """Return the words and numbers of a name, in small letters."""
    return [token for token in re.split(r"[^a-zäöüß0-9]+", name.lower()) if token]
