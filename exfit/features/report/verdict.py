"""What a fit comes to: its verdict, in a word and a sentence, and the causes."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from exfit.results.comparisons import Comparison
from exfit.results.criteria import judged_by_criteria
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.results.validation_result import Reported, ValidationResult
from exfit.results.verdict import GOOD, MATCHES


@dataclass(frozen=True)
class Headline:
    """What the fit comes to: a word, a sentence, whether it is good, and the causes.

    ``good`` is None where it is neither good nor bad. ``criteria`` says whether the responses meet
    the limits of the report, ``passed`` as `CriteriaVerdict` has it.
    """

    word: str
    sentence: str
    good: bool | None
    causes: tuple[str, ...]
    criteria: str = ""
    passed: bool | None = None


def headline(result: FitResult) -> Headline:
    """Word the outcome of a fit."""
    outcome, judged = outcome_of(result), judged_by_criteria(result)
    rmse = ", ".join(_rmse((*result.comparisons, *result.validation)))
    sentence = "; ".join([*filter(None, [explanation_of(result)]), *_validated(result)])
    return Headline(
        word=f"{outcome[:1].upper()}{outcome[1:]}",
        sentence=f"{sentence[:1].upper()}{sentence[1:]}; rmse {rmse}.",
        good={GOOD: True, MATCHES: None}.get(outcome, False),
        causes=tuple(cause.sentence for cause in result.verdict.causes),
        criteria=judged.sentence,
        passed=judged.passed,
    )


def headline_of_validation(result: ValidationResult) -> Headline:
    """Word the outcome of a comparison of given values with records.

    It is neither good nor bad where nothing limits an error: the criteria then judge alone.
    """
    judged = judged_by_criteria(result)
    reasons = [match.reason for match in result.validation if match.reason]
    limited = all(match.limit is not None for match in result.validation)
    word, good = ("Accepted", True) if limited else ("Compared", None)
    if reasons:
        word, good = "Not accepted", False
    rmse = ", ".join(_rmse(result.matches))
    sentence = "; ".join([f"Simulated with {result.origin}", *reasons, *_validated(result)])
    return Headline(
        word, f"{sentence}; rmse {rmse}.", good, (), criteria=judged.sentence, passed=judged.passed
    )


def _rmse(matches: Iterable[Comparison]) -> Iterator[str]:
    """Yield the rms of the errors that records are judged by: of an event those of P and Q."""
    for match in matches:
        for signal in match.judging:
            of = f"{match.name}, {signal}" if len(match.judging) > 1 else match.name
            yield f"{match.channels[signal].rmse:.2e} pu ({of})"


def _validated(result: Reported) -> Iterator[str]:
    """Yield the limits that accepted validations keep."""
    if not result.validation:
        yield "no record was kept for a validation"
    elif result.accepted:
        limits = [
            f"{match.limit:.2e} pu ({match.name})"
            for match in result.validation
            if match.limit is not None
        ]
        if len(limits) < len(result.validation):
            yield "nothing limits the error of its validations"
        else:
            yield f"every validation is within its limit of {', '.join(limits)}"
