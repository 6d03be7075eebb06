"""What contradicts itself in a reference that is a table."""

from collections.abc import Iterator
from itertools import pairwise

from exfit.case.checks.bump_test import rows_of
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.util.text import show


def table_faults(given: ContentNode, duration: float | None) -> Iterator[Fault]:
    """Yield the faults of a reference that is a table; ``duration`` of a test without a record."""
    rows, table = rows_of(given), given.at("table")
    if len(rows) < 2:
        return
    times = [time for time, _ in rows]
    for k, (before, time) in enumerate(pairwise(times), 1):
        if time < before:
            yield table.at(k).fault(f"{show(time)} s is before {show(before)} s, the row before")
        elif k > 1 and times[k - 2] == time:
            text = f"{show(time)} s is given more than twice: a step has two rows"
            yield table.at(k).fault(text)
    level = rows[0][1]
    if all(value == level for _, value in rows):
        yield table.fault(f"stays at {show(level)}: there is no step")
    elif duration is not None and not times[0] <= 0.0 <= duration <= times[-1]:
        covered = f"{show(times[0])} ... {show(times[-1])} s"
        text = f"{covered} does not cover the test, 0 ... {show(duration)} s: add a row"
        yield table.fault(text)
