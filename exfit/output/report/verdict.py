"""What a fit comes to: a word, a sentence, and whether it is good."""

from collections.abc import Sequence
from dataclasses import dataclass

from exfit.inference.wording import listed
from exfit.results.comparisons import Comparison
from exfit.results.model import FitResult
from exfit.results.typical_values import by_weight, first_of


@dataclass(frozen=True)
class Headline:
    """What the fit comes to: a word, a sentence, and whether it is good; None where none judges."""

    word: str
    sentence: str
    good: bool | None


def verdict(result: FitResult) -> Headline:
    """Return what a fit comes to."""
    word, text, good = _judged(result)
    rmse = ", ".join(
        f"{match.rmse:.2e} pu ({match.name})" for match in (*result.comparisons, *result.validation)
    )
    sentence = f"{text[:1].upper()}{text[1:]}{_missed(result)}; rmse {rmse}; {_determined(result)}."
    return Headline(word, sentence, good)


def _determined(result: FitResult) -> str:
    own = {name: fitted for name, fitted in result.parameters.items() if not fitted.of_record}
    vague = [name for name, parameter in own.items() if not parameter.determined]
    weighty = [*by_weight(result.typical_values)]
    if not vague and weighty:
        return f"typical values matter: {first_of(weighty)}"
    if not vague:
        return "every parameter determined"
    return f"{len(vague)} of {len(own)} parameters not determined: {listed(vague)}"


def _missed(result: FitResult) -> str:
    """Return the signals that are matched no better than by a constant.

    None is judged by them, but a wrong base of one shows nowhere else at a glance.
    """
    others = [
        f"{signal} of {comparison.name}"
        for comparison in result.comparisons
        for signal, match in comparison.channels.items()
        if signal != comparison.judged_by and not match.describes
    ]
    return f"; no better than by a constant matched: {listed(others)}" if others else ""


def _judged(result: FitResult) -> tuple[str, str, bool | None]:
    if result.interrupted:
        return "Interrupted", "the values are the best until the search was interrupted", False
    if not result.success:
        return "Not converged", f"the search ended before a minimum: {result.message}", False
    missed = [match.name for match in result.comparisons if not match.judged.describes]
    if missed:
        names = listed(missed)
        return "No match", f"the response matches {names} no better than a constant would", False
    return _validated(result.validation, result.outcome)


def _validated(validation: Sequence[Comparison], outcome: str) -> tuple[str, str, bool | None]:
    reasons = [match.reason or match.name for match in validation if not match.accepted]
    limits = [
        f"{match.limit:.2e} pu ({match.name})" for match in validation if match.limit is not None
    ]
    if reasons:
        return "Not accepted", "; ".join(reasons), False
    if not validation:
        return outcome.capitalize(), "no record was kept for a validation", None
    if len(limits) < len(validation):
        return outcome.capitalize(), "nothing limits the error of its validations", None
    within = f"every validation is within its limit of {', '.join(limits)}"
    return "Accepted", f"{outcome}, and {within}", True
