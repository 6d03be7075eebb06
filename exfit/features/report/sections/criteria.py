"""Whether the responses match their records, by the limits of the case."""

from collections.abc import Iterator, Mapping

from exfit.features.report.sections.texts import number
from exfit.results.criteria import JudgedCriterion, judged_by_criteria
from exfit.results.validation_result import Reported
from exfit.show.blocks import Block, Cell, Mark, Note, Table, columns, row
from exfit.util.criteria import ORIGIN, Criteria


def criteria(result: Reported) -> Iterator[Block]:
    """Yield the criteria of a fit with their results, and where their limits are from.

    Criteria that are met beside a verdict that they are no match for are no approval.
    """
    judged = judged_by_criteria(result)
    passed: Mark = "ok" if result.holds else "strong"
    words: Mapping[bool | None, tuple[str, Mark]] = {
        True: ("Pass:", passed),
        False: ("Fail:", "bad"),
        None: ("Open:", "strong"),
    }
    word, mark = words[judged.passed]
    yield Note(f"{judged.sentence}.", "verdict", word, mark)
    if judged.criteria:
        yield Table(
            (
                *columns("record", "used", "criterion"),
                *columns("difference", "limit", numbers=("difference", "limit")),
                *columns("unit", "result"),
            ),
            tuple(
                (
                    *row(each.record, "to fit" if each.fitted else "to validate", each.label),
                    *row(number(each.difference, 2), number(each.limit, 3), each.unit),
                    _result(each),
                )
                for each in judged.criteria
            ),
            "Criteria: simulated minus recorded",
        )
    own = "The case gives limits of its own. " if result.criteria != Criteria() else ""
    yield Note(f"{own}{ORIGIN}.")


def _result(criterion: JudgedCriterion) -> Cell:
    if criterion.met is None:
        return Cell(f"open: {criterion.why}")
    why = f": {criterion.why}" if criterion.why else ""
    return Cell(f"met{why}", "ok") if criterion.met else Cell(f"not met{why}", "bad")
