"""The limits that the responses were on."""

from collections.abc import Iterator

from exfit.features.report.sections.texts import DASH, no_behaviour, number
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported
from exfit.show.blocks import Block, Note, Table, columns, row


def limits(result: Reported) -> Iterator[Block]:
    """Yield the limits that each test was on, and the tests that were on none."""
    if result.behaviour is None:
        yield Note(no_behaviour(result), mark="faint")
        return
    rows = [
        row(
            run.test,
            hit.limit,
            hit.signal or DASH,
            number(hit.value),
            number(hit.first, 4),
            number(hit.seconds, 3),
            f"{100.0 * hit.share:.1f} %",
        )
        for run in result.behaviour.limits
        for hit in run.hits
    ]
    fitted = "with the fitted values " if isinstance(result, FitResult) else ""
    if rows:
        numbers = ("value (pu)", "first at (s)", "for (s)", "share of the test")
        heads = columns("test", "limit", "signal", *numbers, numbers=numbers)
        yield Table(heads, tuple(rows), f"Limits that the response {fitted}was on")
    free = [run.test for run in result.behaviour.limits if not run.hits]
    if free:
        records = "its record shows" if len(free) == 1 else "their records show"
        yield Note(f"No limit was hit on {', '.join(free)}: {records} nothing of the limits.")
