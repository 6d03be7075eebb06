"""Values in place of those of a case, by name or of an earlier fit; what a result says of them."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeAlias

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.overrides import changed_values, taken_over, with_given_values

if TYPE_CHECKING:
    from exfit.results.description import GivenInPlace
    from exfit.results.model import FitResult

Values = Mapping[str, float]
ValuesOrResult: TypeAlias = "Values | FitResult"


def with_values(case: Case, values: "ValuesOrResult | None") -> Case:
    """Return a case with values in place of its own, by name, or with those of an earlier fit.

    Raises CaseError where it cannot start from them.
    """
    if values is None:
        return case
    if isinstance(values, Mapping):
        return with_given_values(case, values, "values")
    if values.model != case.subject:
        raise CaseError([f"values: model: {values.model}, but {case.path} has {case.subject}"])
    taken = taken_over(case, values.own_values, values.of_records, "values")
    return with_given_values(case, taken, "values", values.sources)


def changes_of(case: Case, values: "ValuesOrResult | None") -> Values:
    """Return changes of values by name: of a fit all that it has, of others the checked ones."""
    if values is None or isinstance(values, Mapping):
        return changed_values(case, values or {}, "values")
    return values.values


def given_values(case: Case) -> "dict[str, GivenInPlace]":
    """Return the values that were given in place of those of a case."""
    from exfit.results.description import GivenInPlace

    fixed = case.values().keys() - case.free().keys()
    return {
        name: GivenInPlace(given.value, given.before, name not in fixed, str(given.source))
        for name, given in case.given_values.items()
    }


def given_value_notes(case: Case) -> Iterator[str]:
    """Yield which values were given in place of those of the case, and by what."""
    fixed = case.values().keys() - case.free().keys()
    changes: dict[tuple[str, str], list[str]] = {}
    for name, given in case.given_values.items():
        verb = "takes" if name in fixed else "starts from"
        before = "" if given.before is None else f" (case: {given.before:.5g})"
        changes.setdefault((verb, str(given.source)), []).append(
            f"{name} {given.value:.5g}{before}"
        )
    for (verb, source), values in changes.items():
        yield f"the fit {verb} {', '.join(values)}, given by {source}"
