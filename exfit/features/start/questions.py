"""One question of a conversation, asked until its answer can be read."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import click

from exfit.case.yaml import QUESTION
from exfit.cli.streams import echo
from exfit.errors import ExfitError
from exfit.features.start.answers import Answers, Given, checked
from exfit.features.start.making import Inspections, NewCase, inspected, new_case
from exfit.records.inspection import Inspection
from exfit.util.text import near, printable

Answer = TypeVar("Answer")

WIDTH = 79  # columns
MOST_LISTED = 12  # files of a folder, units of a planner's file
NO = ("none", "no", "-", "")


class Conversation(NamedTuple):
    """What was answered so far, by key, and the records that were read."""

    given: Given
    read: Inspections

    def case(self, **others: Any) -> NewCase:
        """Make the case that it is with further answers; raises ExfitError."""
        return new_case(self.answers(**others), Path(), self.read)

    def number_of(self, key: str) -> Callable[[str], float]:
        """Return what reads the number of an answer, which the case must be able to take."""

        def read(text: str) -> float:
            self.case(**{key: number(text)})
            return number(text)

        return read

    def answers(self, **others: Any) -> Answers:
        """Return the answers so far with others."""
        return checked({**self.given, **others})

    @property
    def inspection(self) -> Inspection:
        """The record."""
        return inspected(self.answers(), Path(self.given["record"]), self.read)


def say(text: str, faint: bool = False, hang: int = 0, err: bool = True) -> None:
    """Write a paragraph of the conversation; its further lines ``hang`` by some letters."""
    lines = click.wrap_text(printable(text), WIDTH, subsequent_indent=" " * hang)
    click.secho(lines, dim=faint, err=err)


def ask(
    text: str,
    read: Callable[[str], Answer],
    where: str = "",
    proposal: str = "",
    more: str = "",
    doubt: Callable[[Answer], str] = lambda _: "",
) -> Answer:
    """Ask until the answer can be read; Enter takes the proposal, ``?`` shows more.

    ``where`` says where the answer is found, ``doubt`` why it may be wrong: it is taken when it is
    given once more. Raises click.Abort at Ctrl-C and Ctrl-D.
    """
    if where:
        echo("", err=True)
        say(where, faint=True)
    doubted = None
    while True:
        answer: str = click.prompt(
            printable(text), default=proposal, show_default=bool(proposal), err=True
        ).strip()
        if answer == QUESTION:
            say(more or where)
            continue
        try:
            value = read(answer)
            why = doubt(value)
        except ExfitError as fault:
            say(str(fault))
            continue
        if not why or answer == doubted:
            return value
        say(f"{why}. To keep it, enter it once more.")
        doubted = answer


def number(text: str) -> float:
    """Read a number; raises ExfitError."""
    try:
        return float(text)
    except ValueError:
        with_point = "; decimals have a point" if "," in text else ""
        raise ExfitError(f"{text!r} is not a number{with_point}") from None


def place_of(text: str, words: Sequence[str]) -> int | None:
    """Return the place of a word by its number from 1; None where the text is no such number."""
    numbers = [*map(str, range(1, len(words) + 1))]
    return numbers.index(text) if text in numbers else None


def one_of(words: Sequence[str], numbered: bool = False) -> Callable[[str], str]:
    """Return what reads the beginning of a word of a list, or its number."""

    def read(text: str) -> str:
        if numbered and (place := place_of(text, words)) is not None:
            return words[place]
        begun = [word for word in words if text and word.lower().startswith(text.lower())]
        if text in words or len(begun) == 1:
            return text if text in words else begun[0]
        raise ExfitError(f"{text!r} is not in the list; {near(text, words)}")

    return read


def list_rows(rows: Mapping[str, str]) -> None:
    """Write a list of what can be chosen, each behind the word that chooses it."""
    echo("", err=True)
    width = max(map(len, rows), default=0)
    for name, text in rows.items():
        say(f"  {name:{width}}  {text}".rstrip(), hang=width + 4)
