"""A validation in words and tables, as its report shows it."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from exfit.fitting.program import Program
from exfit.results.description import RecordedTest
from exfit.results.validation_result import ValidationResult
from exfit.util.sources import NOT_STATED
from exfit.workflows.behaviour import behaviour_of
from exfit.workflows.descriptions.case_description import (
    criteria_of,
    identified_values,
    input_hashes,
    input_names,
    parts_of,
    tests_of,
    text_of,
)
from exfit.workflows.other_values import as_found_of
from exfit.workflows.validation import Validation

OF_CASE, GIVEN = "values of the case, in which nothing is free", "given values"
AS_FOUND = "the model as found, before any fit"


def validation_result(
    validation: Validation,
    versions: Mapping[str, str],
    sources: Mapping[str, str] = MappingProxyType({}),
    program: Program | None = None,
) -> ValidationResult:
    """Return a validation with all that a report shows of it.

    ``sources`` says where those values come from that were given beside the case.
    """
    case, values, tests, other_program = validation
    setups = [test.setup for test in tests]
    own = [(test.setup, test.values) for test in tests]
    return ValidationResult(
        case=case.path,
        about=case.about,
        model=case.subject,
        saturation=case.saturation,
        origin=GIVEN if validation.fitted else AS_FOUND if case.free() else OF_CASE,
        values={name: values[name] for name in case.values()},
        sources=_sources(validation, sources),
        ties={name: tie.text for name, tie in case.ties.by_name.items()},
        matches=tuple(validation.comparisons),
        versions=versions,
        inputs=input_hashes(case, setups),
        parts=tuple(parts_of(case)),
        tests=tuple(_tests(validation)),
        behaviour=None if case.has_no_equations else behaviour_of(own),
        files=input_names(case, setups),
        case_text=text_of(case),
        as_found=None if case.as_found is None else as_found_of(case, own, program),
        criteria=criteria_of(case),
        other_program=other_program,
    )


def _sources(validation: Validation, sources: Mapping[str, str]) -> dict[str, str]:
    """Return where every value comes from: what differs from the case is by who gave it."""
    case, values = validation.case, validation.values
    of_case, free = case.values(), case.free() if validation.fitted else ()
    changed = [name for name in of_case if name not in free and values[name] != of_case[name]]
    given = {name: word for name, word in sources.items() if name in of_case}
    others = [name for name in changed if name not in case.ties.by_name]
    return {**case.sources(fitted=free), **dict.fromkeys(others, NOT_STATED), **given}


def _tests(validation: Validation) -> Iterator[RecordedTest]:
    """Yield the tests with their records; of a record by hand the steps that it shows."""
    matches = validation.comparisons
    setups = [test.setup for test in validation.tests]
    described = tests_of(validation.case, setups, identified_values({}, matches))
    for match, test in zip(matches, described, strict=True):
        done = "; ".join(step.text for step in match.steps) or test.done
        role = "validation" if match.validation else "fitted"
        yield replace(test, name=match.name, role=role, done=done)
