"""The parameters of a fit: those that were fitted, and where all others come from."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from exfit.case.saturation import MEANINGS
from exfit.results.description import SheetRow
from exfit.results.model import FittedParameter
from exfit.results.typical_values import DEVIATION, by_weight, moved_parameters
from exfit.results.validation_result import Reported


@dataclass(frozen=True)
class FixedParameter:
    """A parameter that the fit did not move, and where its value is from."""

    name: str
    unit: str
    meaning: str
    value: float
    source: str


@dataclass(frozen=True)
class FixedGroup:
    """The parameters of a part that the fit did not move."""

    title: str
    rows: tuple[FixedParameter, ...]


@dataclass(frozen=True)
class MatteringValue:
    """A typical value that matters, what it would move, and how far beyond half its interval."""

    name: str
    value: float
    moves: str
    times: float


@dataclass(frozen=True)
class ParametersView:
    """The fitted parameters, then the others, part by part.

    ``mattering`` are the typical values that would move a parameter if they were ``deviation`` (in
    percent) off, ``harmless`` the others.
    """

    fitted: Mapping[str, FittedParameter]
    fixed: tuple[FixedGroup, ...]
    mattering: tuple[MatteringValue, ...]
    harmless: tuple[str, ...]
    deviation: float = 100.0 * DEVIATION


def parameters(result: Reported) -> ParametersView:
    """Return all parameters of a fit."""
    groups = (*_of_parts(result), *_helpers(result), *_networks_of_records(result))
    weighty = by_weight(result.typical_values)
    fitted = {name: parameter.value for name, parameter in result.parameters.items()}
    return ParametersView(
        result.parameters,
        tuple(group for group in groups if group.rows),
        tuple(
            MatteringValue(
                name,
                typical.value,
                moved_parameters(typical, fitted),
                max(typical.matters_to.values()),
            )
            for name, typical in weighty.items()
        ),
        tuple(name for name in result.typical_values if name not in weighty),
    )


def _of_parts(result: Reported) -> Iterator[FixedGroup]:
    for part in result.parts:
        values = result.values_of(part.prefix)
        rows = (
            _fixed(result, part.prefix, symbol, values[symbol], row)
            for symbol, row in part.sheet.items()
            if symbol in values and part.prefix + symbol not in result.parameters
        )
        yield FixedGroup(part.heading, tuple(rows))


def _helpers(result: Reported) -> Iterator[FixedGroup]:
    """Yield what is listed among the exciter's parameters and is none of them."""
    own = {symbol for part in result.parts if not part.prefix for symbol in part.sheet}
    rows = (
        _fixed(result, "", name, value, SheetRow(meaning=MEANINGS.get(name, "used by ties")))
        for name, value in result.fixed.items()
        if name not in own
    )
    yield FixedGroup("Helpers", tuple(rows))


def _networks_of_records(result: Reported) -> Iterator[FixedGroup]:
    for test in result.tests:
        rows = (
            FixedParameter(symbol, row.unit, row.meaning, row.value, row.source)
            for symbol, row in test.network.items()
            if f"network.{symbol}" not in result.parameters
        )
        yield FixedGroup(f"Network of {test.name}", tuple(rows))


def _fixed(
    result: Reported, prefix: str, symbol: str, value: float, row: SheetRow
) -> FixedParameter:
    source = result.source_of(prefix + symbol)
    return FixedParameter(symbol, row.unit, row.meaning, value, source)
