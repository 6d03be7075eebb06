"""The table of iterations, by the names of the thesis that exfit grew out of, wherever it is shown.

The keys in history.csv and result.json are others: `results.tables.HISTORY`.
"""

from collections.abc import Callable, Iterable, Iterator
from math import isnan
from typing import TYPE_CHECKING, NamedTuple

from exfit.output.blocks import Block, Note, Table, TableColumn, row
from exfit.results.tables import yes_or_no
from exfit.util.vocabulary import HISTORY_PHASES

if TYPE_CHECKING:
    from exfit.results.model import Iteration

COST = "cost f"
GRADIENT = "gradient norm"
DAMPING = "damping"
DAMPINGS = "damping (ν of lm, λ of gn, dgn)"
REJECTING = ("lm", "gn")  # phases whose `inner` counts trials that were rejected, not halvings
LEGEND = (
    "Iteration 0 is the start. Damping: ν of lm, step length λ of gn and dgn. Armijo halvings: how "
    "often a step of dgn was shortened until Armijo's rule held. Rejected trials: of lm, and of a "
    "first step of gn. Capped: whether the first trial was shorter than the full Gauss-Newton "
    "step. `history.csv` has the parameters as well."
)

Value = float | str | None


class IterationColumn(NamedTuple):
    """A column: its title, the value in a line, its form, and the characters that it needs.

    ``expendable`` is how early it is left out where there is little room, 1 first; 0 never.
    """

    title: str
    value: Callable[["Iteration"], Value]
    width: int
    form: str = ""
    expendable: int = 0

    @property
    def number(self) -> bool:
        """Whether it holds numbers."""
        return self.title not in ("phase", "capped")

    @property
    def heading(self) -> str:
        """The title, in two lines where it is wider than the column."""
        return self.title if len(self.title) <= self.width else self.title.replace(" ", "\n")

    def text(self, line: "Iteration", missing: str = "-") -> str:
        """Write the value in a line; ``missing`` where there is none."""
        value = self.value(line)
        unknown = value in (None, "") or (isinstance(value, float) and isnan(value))
        return missing if unknown else format(value, self.form)


def armijo_halvings(line: "Iteration") -> int | None:
    """Count how often Armijo's rule shortened a step: a full step of gn, never; None in lm."""
    return {"dgn": line.inner, "gn": 0}.get(line.phase)


def rejected_trials(line: "Iteration") -> int | None:
    """Count the trials that lm rejected, or gn; None in dgn, which shortens a step instead."""
    return line.inner if line.phase in REJECTING else None


COLUMNS = (
    IterationColumn("iteration", lambda line: line.number, 9),
    IterationColumn(COST, lambda line: line.cost, 10, ".4e"),
    IterationColumn(GRADIENT, lambda line: line.gradient_norm, 8, ".2e"),
    IterationColumn("step", lambda line: line.step_norm, 8, ".2e"),
    IterationColumn(DAMPING, lambda line: line.damping, 8, ".2e"),
    IterationColumn("Armijo halvings", armijo_halvings, 8),
    IterationColumn("phase", lambda line: line.phase, 6),
    IterationColumn("rejected trials", rejected_trials, 8, expendable=3),
    IterationColumn("capped", lambda line: yes_or_no(line.capped), 6, expendable=2),
    IterationColumn("evaluations", lambda line: line.nfev, 11, expendable=1),
)


def iterations(history: Iterable["Iteration"]) -> Iterator[Block]:
    """Yield the table of the iterations, and what its columns mean."""
    heads = tuple(
        TableColumn(each.heading, each.number, expendable=each.expendable) for each in COLUMNS
    )
    lines = [*history]
    yield Table(heads, tuple(row(*(each.text(line) for each in COLUMNS)) for line in lines))
    yield Note(LEGEND, mark="faint")
    for phase in dict.fromkeys(line.phase for line in lines):
        yield Note(HISTORY_PHASES.get(phase, phase), label=f"{phase}:", mark="faint")
