"""Which signals a recorder's columns hold, by their names and units."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from exfit.records.channel_names import Clarity, NameReading, read_name
from exfit.records.units import bare, quantity_of
from exfit.signals import ROWS

IN_TURN = sorted((row for row in ROWS if row.words), key=lambda row: row.turn)
TRIPLES = (
    ("l1", "l2", "l3"), ("12", "23", "31"), ("ab", "bc", "ca"), ("rs", "st", "tr"),
    ("a", "b", "c"), ("r", "s", "t"), ("1", "2", "3"),
)  # fmt: skip
LINE_TO_LINE = TRIPLES[1:4]
OF_VOLTAGE = re.compile(r"^(u|v|.*volt|.*spannung)")


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
