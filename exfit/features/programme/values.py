"""Measured values of a test, as they enter the tests after it.

A value of the file stays where its source is more certain than a test: a fitted value replaces one
that is typical or has no source stated, a measured one also one that was fitted; what was measured
before, unless by an earlier test of the programme itself, what a test report says, the maker's and
the nameplate's remain. Of equal certainty the test of the programme counts.
"""

from collections.abc import Iterator
from dataclasses import replace

from exfit.case.case import Case
from exfit.features.programme.case.programme import Programme
from exfit.features.programme.result import EnteredValue, FinishedTest
from exfit.features.programme.steady.saturation_result import MeasuredValue, SaturationResult
from exfit.features.programme.steady.tests_at_rest import channel_bases, machine_values
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.plants import MACHINE
from exfit.records.units import alike
from exfit.results.model import FittedParameter
from exfit.util.sources import FITTED, LEAST_CERTAIN_FIRST, NOT_STATED
from exfit.workflows.given_values import with_given_values

MEASURED = "measured"
BASE = ".base"
Values = tuple[EnteredValue, ...]


def values_given(test: FinishedTest, programme: Programme) -> Iterator[EnteredValue]:
    """Yield the values of a finished test for those after it, each beside that of the file.

    Only what the test limits on both sides counts, and only where its points or record are matched.
    """
    if not test.holds:
        return
    case = programme.shared_case()
    own, sources, stated = case.values(), case.sources(), {*case.values()} - {*case.typical()}
    for value in _measured(test):
        if value.name.endswith(BASE):
            # beside the first base of the file that contradicts it
            signal, (low, high) = value.name.removesuffix(BASE), value.interval
            bases = [
                channel.base
                for section in programme.columns()
                if (channel := section.get(signal)) is not None
                and isinstance(getattr(channel, "base", None), float)
                and channel.unit is not None
                and alike(channel.unit, value.unit)
            ]
            outside = [base for base in bases if not low <= base <= high]
            first = next(iter((*outside, *bases)), None)
            yield _beside(value, first, NOT_STATED if bases else "", entered=not bases)
        elif value.name in own:
            given = own[value.name] if value.name in stated else None
            source = sources[value.name]
            entered = _certainty(source) <= _certainty(value.source)
            yield _beside(value, given, source, entered)


def with_values(case: Case, values: Values) -> Case:
    """Return a case with what the tests before it gave, and how uncertain that is.

    A free parameter starts from it.

    Raises CaseError where a value contradicts others, or lies outside the bounds of a free one.
    """
    own = case.values()
    last = {value.name: value for value in values if value.entered and value.name in own}
    if not last:
        return case
    sources = {name: value.source for name, value in last.items()}
    numbers = {name: value.value for name, value in last.items()}
    changed = with_given_values(case, numbers, "the tests before", sources)
    by_test = {
        name: given._replace(source=f"test {last[name].test}") if name in last else given
        for name, given in changed.given_values.items()
    }
    std_errors = {name: value.std_error for name, value in last.items()}
    return replace(changed, given_values=by_test, given_std_errors=std_errors)


def bases_of(values: Values) -> dict[str, tuple[float, str]]:
    """Collect the bases that tests gave, by signal: 1 pu, and its unit."""
    return {
        value.name.removesuffix(BASE): (value.value, value.unit)
        for value in values
        if value.name.endswith(BASE)
    }


def errors_of_bases(values: Values) -> dict[str, float]:
    """Return the standard errors of the bases that the tests gave, by their names."""
    return {
        value.name: value.std_error
        for value in values
        if value.name.endswith(BASE) and value.entered
    }


def _measured(test: FinishedTest) -> Iterator[EnteredValue]:
    result = test.result
    if isinstance(result, SaturationResult):
        for symbol, value in machine_values(result).items():
            yield from _by_points(MACHINE + symbol, value, test.name)
        for signal, (value, unit) in channel_bases(result).items():
            yield from _by_points(signal + BASE, value, test.name, unit)
    elif isinstance(result, VCurve):
        for name, parameter in result.parameters.items():
            known_as = name if parameter.of_record else MACHINE + name
            yield from _fitted(known_as, parameter, MEASURED, test.name)
    elif test.kind != "bump":
        for name, parameter in result.parameters.items():
            if name.startswith(MACHINE):
                yield from _fitted(name, parameter, FITTED, test.name)


def _by_points(
    name: str, value: MeasuredValue, test: str, unit: str = ""
) -> Iterator[EnteredValue]:
    low, high = value.interval
    if low is not None and high is not None:
        yield EnteredValue(name, value.value, (low, high), MEASURED, test, unit)


def _fitted(
    name: str, parameter: FittedParameter, source: str, test: str
) -> Iterator[EnteredValue]:
    low, high = parameter.interval or (None, None)
    if low is not None and high is not None:
        yield EnteredValue(
            name,
            parameter.value,
            (low, high),
            source,
            test,
            parameter.unit,
            min=parameter.min,
            max=parameter.max,
        )


def _beside(value: EnteredValue, given: float | None, source: str, entered: bool) -> EnteredValue:
    low, high = value.interval
    excluded = given is not None and not low <= given <= high
    return replace(value, given=given, given_source=source, entered=entered, excluded=excluded)


def _certainty(source: str) -> int:
    return LEAST_CERTAIN_FIRST.index(source)
