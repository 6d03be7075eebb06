"""Typeset formulas: symbols with their subscripts, fractions, and how wide they are."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

Style = Literal["plain", "italic", "sub", "sup"]

SIZE = 15.0  # px: of letters
SMALL = 10.5  # px: of subscripts
PADDING = 3.0  # px: on either side of a fraction
# widths of a serif font's letters, as parts of its size; a little more than those of Times
WIDTHS: Mapping[str, float] = {
    **dict.fromkeys("ijlt|()[]'′.,:/ ", 0.36), **dict.fromkeys("frsIJ-", 0.45),
    **dict.fromkeys("mwMW", 0.88), **dict.fromkeys("+−=<>≤≥∠", 0.66),
}  # fmt: skip
CAPITAL, OTHER = 0.72, 0.54
TOKEN = re.compile(r"s(?=[A-Z²(])|[A-Za-z][A-Za-z0-9]*|\^[A-Za-z0-9]+|²|<=|>=|\d+(?:\.\d+)?|\s+|.")
SYMBOL = re.compile(
    r"[A-Z]p+[dq]0?|[A-Z][A-Z0-9_]*|v(?:ref|sum|s|t|c1|si\d|uel|oel)?|[ei]fd|X[dql]"
    r"|[iv][dq]|it|i1q|[a-ik-z]"
)
WORDS = ("UEL", "OEL", "HV", "LV", "PI", "PID")
SIGNS: Mapping[str, str] = {"<=": "≤", ">=": "≥", "-": "−"}
FRACTION = re.compile(r"(\([^()]*\)|[\w²]+)/(\([^()]*\)|[\w²]+)")
PRIMED = re.compile(r"([A-Z])(p+)([dq]0?)")  # Tpd0: T'd0
FLUXES: Mapping[str, tuple[str, int, str]] = {
    "EQP": ("E", 1, "q"), "EDP": ("E", 1, "d"), "PSID": ("ψ", 0, "d"), "PSIQ": ("ψ", 0, "q"),
}  # fmt: skip


@dataclass(frozen=True)
class Styled:
    """Letters of one style."""

    text: str
    style: Style

    @property
    def width(self) -> float:
        """Its width in px, in a wide font of the kind."""
        size = SIZE if self.style in ("plain", "italic") else SMALL
        return size * sum(
            WIDTHS.get(letter, CAPITAL if letter.isupper() else OTHER) for letter in self.text
        )


@dataclass(frozen=True)
class Typeset:
    """Letters in a row."""

    runs: tuple[Styled, ...]

    @property
    def width(self) -> float:
        """Its width in px."""
        return sum(run.width for run in self.runs)

    @property
    def letters(self) -> str:
        """What it says."""
        return "".join(run.text for run in self.runs)


@dataclass(frozen=True)
class Stack:
    """One text above another; with a bar between a fraction."""

    upper: Typeset
    lower: Typeset
    bar: bool

    @property
    def width(self) -> float:
        """Its width in px."""
        return max(self.upper.width, self.lower.width) + 2 * PADDING


Piece = Typeset | Stack


def text(letters: str) -> Typeset:
    """Return a text with its symbols."""
    return Typeset(tuple(_runs(letters)))


def formula(rows: tuple[str, ...]) -> tuple[Piece, ...]:
    """Typeset the rows of a box: a fraction, a sum over two rows, two rows of words."""
    upper, *lower = (re.sub(r"(?<=\S) ?\+ ?", " + ", row.strip("[]").strip()) for row in rows)
    if not lower:
        return tuple(_pieces(upper))
    if lower[0].startswith(("+", "-")):
        return (*_pieces(upper), *_pieces(f" {lower[0]}"))
    words = re.findall(r"\b[a-z]{3,}\b", f"{upper} {lower[0]}")
    is_formula = all(SYMBOL.fullmatch(word) for word in words)
    return (Stack(text(upper), text(lower[0]), bar=is_formula),)


def _pieces(letters: str) -> Iterator[Piece]:
    """Yield the texts and fractions of a row; a bar takes the place of brackets."""
    end = 0
    for match in FRACTION.finditer(letters):
        if match.start() > end:
            yield text(letters[end : match.start()])
        upper, lower = (part.removeprefix("(").removesuffix(")").strip() for part in match.groups())
        yield Stack(text(upper), text(lower), bar=True)
        end = match.end()
    if end < len(letters):
        yield text(letters[end:])


def _runs(letters: str) -> Iterator[Styled]:
    """Yield the letters of a text by their style: a symbol's first one, its subscript ..."""
    for token in TOKEN.findall(letters):
        if token.startswith("^") or token == "²":
            yield Styled(token.strip("^").replace("²", "2"), "sup")
            continue
        if token in WORDS or not SYMBOL.fullmatch(token):
            yield Styled(SIGNS.get(token, token), "plain")
            continue
        primed = PRIMED.fullmatch(token)
        head, primes, tail = FLUXES.get(token, (token[0], 0, token[1:]))
        if primed:
            head, primes, tail = primed[1], len(primed[2]), primed[3]
        yield Styled(head, "italic")
        if primes:
            yield Styled("′" * primes, "plain")
        if tail:
            yield Styled(tail, "sub")


def width(pieces: Iterable[Piece]) -> float:
    """Return the width of pieces beside each other, in px."""
    return sum(piece.width for piece in pieces)
