"""Parameters that follow from others: the arithmetic in place of a number.

A text such as ``=0.9*machine.Tpd0/(1+KE)`` is read by Python's own grammar, and every node that is
not plain arithmetic is refused; nothing of it is ever run.
"""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from math import exp, inf, isfinite

from exfit.case.yaml import DECIMAL

Values = Mapping[str, float]
Slopes = dict[str, float]

MOST_CHARACTERS = 200  # characters; no text so short is nested too deep to be walked
NOT_ALLOWED = re.compile(r"[^A-Za-z0-9_.+\-*/() ]")
USED = "only numbers, names, + - * / **, exp() and parentheses are allowed"


class TieError(ValueError):
    """A tie that cannot be read, or has no finite value; the message begins with its text."""


@dataclass(frozen=True)
class Tie:
    """A parameter as arithmetic of others, ``names`` in order of appearance."""

    text: str
    names: tuple[str, ...]
    tree: ast.expr = field(repr=False, compare=False)

    def value(self, values: Values) -> float:
        """Return the value, given those of the names; raises TieError where it is not finite."""
        return self.along(values, {})[0]

    def slopes(self, values: Values) -> Slopes:
        """Return the exact partial derivative to each name; raises TieError as ``along`` does."""
        return self.along(values, {name: {name: 1.0} for name in self.names})[1]

    def along(self, values: Values, slopes: Mapping[str, Slopes]) -> tuple[float, Slopes]:
        """Return the value and its exact derivatives, given those of the names.

        ``slopes`` holds for each name that varies its derivatives to any number of unknowns.
        Raises TieError where the value or a derivative is not finite.
        """
        try:
            value, derivatives = _dual(self.tree, values, slopes)
        except ZeroDivisionError:
            raise self._error("division by zero", values) from None
        except OverflowError:
            raise self._error("too large a number", values) from None
        except ArithmeticError as error:
            raise self._error(str(error), values) from None
        if not isfinite(value):
            raise self._error("not a finite number", values)
        for name, slope in derivatives.items():
            if not isfinite(slope):
                raise self._error(f"the slope to {name} is not finite", values)
        return value, derivatives

    def _error(self, what: str, values: Values) -> TieError:
        at = ", ".join(f"{name} = {values[name]:g}" for name in self.names)
        return TieError(f"{self.text}: {what}" + (f" at {at}" if at else ""))


def is_tie(value: object) -> bool:
    """Tell if a value stands for the arithmetic of others."""
    return isinstance(value, str) and value.startswith("=")


def parse(text: str) -> Tie:
    """Return the tie that a text beginning with = stands for.

    Raises TieError, which names the offending piece, for anything but numbers, names (dotted ones
    such as machine.Tpd0 too), + - * /, ** with an exponent without names, exp(), and parentheses.
    """
    if len(text) > MOST_CHARACTERS:
        start = text[:20]
        raise TieError(f"{start}...: {len(text)} characters; at most {MOST_CHARACTERS} are allowed")
    if not is_tie(text):
        raise TieError(f"{text}: does not begin with =")
    body = text[1:].strip(" ")
    if foreign := NOT_ALLOWED.search(body):
        raise TieError(f"{text}: {foreign[0]!r} is not allowed; {USED}")
    try:
        tree = ast.parse(body, mode="eval").body
    except SyntaxError as error:
        rest = body[max(error.offset or 1, 1) - 1 :]
        where = f"cannot be read from {rest!r} on" if rest else "ends too soon"
        raise TieError(f"{text}: {where}") from None
    return Tie(text, tuple(dict.fromkeys(_names(tree, text))), tree)


@dataclass(frozen=True)
class Ties:
    """The tied parameters of a case by name; a tie may use another tied parameter.

    Raises TieError where parameters follow from each other in a circle.
    """

    by_name: Mapping[str, Tie] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse circles."""
        _ = self.order

    @cached_property
    def order(self) -> tuple[str, ...]:
        """The tied parameters, each after those that it uses."""
        used = {name: tie.names for name, tie in self.by_name.items()}
        try:
            return tuple(name for name in TopologicalSorter(used).static_order() if name in used)
        except CycleError as error:
            circle = error.args[1][:0:-1]  # the other way round, and without its end
            first = circle.index(next(name for name in used if name in circle))
            path = [*circle[first:], *circle[:first], circle[first]]
            raise TieError(f"{' -> '.join(path)}: a circle") from None

    def apply(self, values: Values) -> dict[str, float]:
        """Return the values with those of the tied parameters, computed; raises TieError."""
        completed = dict(values)
        for name in self.order:
            completed[name] = self.by_name[name].value(completed)
        return completed

    def slopes(self, values: Values, free: Sequence[str]) -> dict[str, Slopes]:
        """Return the total derivatives of each tied parameter to the free ones it depends on.

        ``free`` holds no tied parameter. Raises TieError where one is not finite.
        """
        every, slopes = dict(values), {name: {name: 1.0} for name in free}
        for name in self.order:
            every[name], slopes[name] = self.by_name[name].along(every, slopes)
        return {name: slopes[name] for name in self.by_name}


def _names(node: ast.expr, text: str) -> Iterator[str]:
    """Yield the names of an expression from left to right; raises TieError where it is none."""
    match node:
        case ast.Name() | ast.Attribute(value=ast.Name()):
            yield _name(node)
        case ast.Constant(value=int() | float() as number) if DECIMAL.fullmatch(_piece(node, text)):
            if not isfinite(float(number)):
                raise TieError(f"{text}: {_piece(node, text)} is not finite")
        case (
            ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=inner)
            | ast.Call(func=ast.Name("exp"), args=[inner], keywords=[])
        ):
            yield from _names(inner, text)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            yield from _names(left, text)
            if any(_names(right, text)):
                raise TieError(f"{text}: the exponent {_piece(right, text)} is not constant")
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div(), right=right):
            yield from _names(left, text)
            yield from _names(right, text)
        case _:
            raise TieError(f"{text}: {_piece(node, text)!r} is not arithmetic; {USED}")


def _piece(node: ast.expr, text: str) -> str:
    body = text[1:].strip(" ")
    return body[node.col_offset : node.end_col_offset]


def _name(node: ast.expr) -> str:
    match node:
        case ast.Attribute(value=ast.Name(id=part), attr=symbol):
            return f"{part}.{symbol}"
        case ast.Name(id=symbol):
            return symbol
        case _:
            raise TypeError(node)


def _dual(node: ast.expr, values: Values, slopes: Mapping[str, Slopes]) -> tuple[float, Slopes]:
    """Return the value and the derivatives of an expression, given those of its names."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number), {}
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            x, dx = _dual(inner, values, slopes)
            return -x, {name: -slope for name, slope in dx.items()}
        case ast.UnaryOp(operand=inner):
            return _dual(inner, values, slopes)
        case ast.Call(args=[inner]):
            x, dx = _dual(inner, values, slopes)
            return exp(x), {name: exp(x) * slope for name, slope in dx.items()}
        case ast.BinOp(left=left, op=op, right=right):
            x, dx = _dual(left, values, slopes)
            y, dy = _dual(right, values, slopes)
            value = _result(op, x, y)
            if not dx and not dy:
                return value, {}
            px, py = _partials(op, x, y)
            both = {**dx, **dy}
            return value, {n: px * dx.get(n, 0.0) + py * dy.get(n, 0.0) for n in both}
        case _:
            name = _name(node)
            return values[name], slopes.get(name, {})


def _result(op: ast.operator, x: float, y: float) -> float:
    match op:
        case ast.Add():
            return x + y
        case ast.Sub():
            return x - y
        case ast.Mult():
            return x * y
        case ast.Div():
            return x / y
    if x < 0.0 and not y.is_integer():
        raise ArithmeticError(f"{x:g} has no real power {y:g}")
    return float(x**y)


def _partials(op: ast.operator, x: float, y: float) -> tuple[float, float]:
    """Return the derivatives of an operation to both sides; an exponent has none."""
    match op:
        case ast.Add():
            return 1.0, 1.0
        case ast.Sub():
            return 1.0, -1.0
        case ast.Mult():
            return y, x
        case ast.Div():
            return 1.0 / y, -x / y / y
    if y == 0.0:
        return 0.0, 0.0
    steep = x == 0.0 and y < 1.0
    return (inf if steep else float(y * x ** (y - 1.0))), 0.0
