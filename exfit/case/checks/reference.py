"""What contradicts itself in a reference that is given as a table."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.util.text import show

Row = tuple[float, float]


def table_faults(given: ContentNode, duration: float | None) -> Iterator[Fault]:
    """Yield the faults of a reference that is a table; ``duration`` of a test without a record."""
    rows = rows_of(given)
    if rows is None or len(rows) < 2:
        return
    table = given.at("table")
    yield from _order_faults(table, [time for time, _ in rows])
    (first, level), (last, _) = rows[0], rows[-1]
    if all(value == level for _, value in rows):
        yield table.fault(f"stays at {show(level)}: there is no test")
    elif duration is not None and not first <= 0.0 <= duration <= last:
        covered = f"{show(first)} ... {show(last)} s"
        text = f"{covered} does not cover the test, 0 ... {show(duration)} s: add a row"
        yield table.fault(text)


def _order_faults(table: ContentNode, times: Sequence[float]) -> Iterator[Fault]:
    """Yield the rows whose time goes back, or is that of two others."""
    for k, (before, time) in enumerate(pairwise(times), 1):
        if time < before:
            yield table.at(k).fault(f"{show(time)} s is before {show(before)} s, the row before")
        elif k > 1 and times[k - 2] == time:
            text = f"{show(time)} s is given more than twice: a step has two rows"
            yield table.at(k).fault(text)


def rows_of(given: ContentNode) -> list[Row] | None:
    """Return the rows of a table; None where one of them is none."""
    rows = [row.pair for row in given.at("table").entries]
    return None if None in rows else [row for row in rows if row is not None]


def moves_of(given: ContentNode) -> Iterator[tuple[ContentNode, float]]:
    """Yield the instants from which on the lines of a table rise or fall, with their places."""
    rows = rows_of(given) or []
    for k, ((time, value), (_, then)) in enumerate(pairwise(rows)):
        if then != value:
            yield given.at("table", k), time
