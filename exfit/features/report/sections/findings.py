"""What a reader must know beside the numbers."""

from collections.abc import Iterator

from exfit.results.model import FitResult
from exfit.results.validation_result import Reported
from exfit.show.blocks import Block, Heading, Note, remarks


def findings(result: Reported) -> Iterator[Block]:
    """Yield the unresolved findings, and the notes on a fit or a validation."""
    knowledge = result.knowledge if isinstance(result, FitResult) else None
    unresolved = () if knowledge is None else knowledge.sentences
    for title, texts in (("Unresolved", unresolved), ("Notes", result.notes)):
        if texts:
            yield Heading(title, 2)
            yield from remarks("", texts, "", "warning")
    if not unresolved and not result.notes:
        yield Note("None.")
