"""The parameters of a fit: those that were fitted, and where all others come from."""

from collections.abc import Callable, Iterable, Iterator

from exfit.case.parts import MEANINGS
from exfit.features.report.sections.texts import DASH, number
from exfit.inference.confidence import Interval
from exfit.results.description import SheetRow
from exfit.results.influences import DEVIATION, by_weight, moved_parameters
from exfit.results.model import FitResult, FittedParameter
from exfit.results.validation_result import Reported
from exfit.show.blocks import Block, Cell, Mark, Note, Table, TableColumn, columns, row

Row = tuple[Cell, ...]
OFF = f"{100.0 * DEVIATION:g} % off"
FITTED_NUMBERS = ("start", "fitted", "95 % interval", "standard error", "bounds")


def parameters(result: Reported) -> Iterator[Block]:
    """Yield all parameters of a fit, or of values that were compared."""
    if isinstance(result, FitResult):
        heads = columns("parameter", *FITTED_NUMBERS, "unit", "source", numbers=FITTED_NUMBERS)
        rows = tuple(_fitted(name, each) for name, each in result.parameters.items())
        yield Table(heads, rows, "Fitted parameters")
        yield from _typical_values(result)
    fitted = ", not fitted" if isinstance(result, FitResult) else ""
    for title, others in (*_of_parts(result), *_helpers(result), *_networks_of_records(result)):
        if rows := tuple(others):
            heads = columns("parameter", "value", "unit", "source", numbers=("value",))
            yield Table((*heads, TableColumn("meaning", folds=True)), rows, f"{title}{fitted}")


def value_cells(name: str, parameter: FittedParameter) -> Row:
    """Write name and meaning of a fitted parameter, its start, value and interval, or why none."""
    mark: Mark = "" if parameter.determined else "doubt"
    if parameter.interval is None:
        interval = Cell(parameter.why or "none", "doubt")
    else:
        text = interval_text(parameter.interval, parameter.rounded)
        notes = filter(None, (parameter.interval_note, parameter.why))
        interval = Cell("\n".join([text, *notes]))
    return (
        Cell(f"{name}\n{parameter.meaning}" if parameter.meaning else name, mark),
        Cell(number(parameter.start)),
        Cell(parameter.rounded(parameter.value), "strong"),
        interval,
    )


def interval_text(interval: Interval, rounded: Callable[[float | None], str]) -> str:
    """Write an interval, of which one side may be open."""
    low, high = interval
    if low is None:
        return f"below {rounded(high)}"
    return f"above {rounded(low)}" if high is None else f"{rounded(low)} … {rounded(high)}"


def _fitted(name: str, parameter: FittedParameter) -> Row:
    bounds = (number(parameter.min), number(parameter.max))
    remarks = (
        "fitted",
        f"on its {parameter.at_bound}" if parameter.at_bound else "",
        "" if parameter.physical else "not physical",
        "of the record" if parameter.of_record else "",
    )
    return (
        *value_cells(name, parameter),
        *row(
            number(parameter.linear_error, 2),
            "none" if bounds == (DASH, DASH) else " … ".join(bounds),
            parameter.unit,
            ", ".join(filter(None, remarks)),
        ),
    )


def _typical_values(result: FitResult) -> Iterator[Block]:
    """Yield the typical values that would move a parameter if they were off, then the others."""
    weighty = by_weight(result.typical_values)
    values = {name: parameter.value for name, parameter in result.parameters.items()}
    rows = tuple(
        (
            Cell(name, "doubt"),
            Cell(number(typical.value, 6)),
            Cell(moved_parameters(typical, values)),
            Cell(number(max(typical.matters_to.values()), 2)),
        )
        for name, typical in weighty.items()
    )
    if rows:
        heads = (
            *columns("typical value", "value", numbers=("value",)),
            TableColumn("would move", folds=True),
            TableColumn("half widths of the interval", number=True),
        )
        yield Table(heads, rows, f"Typical values that matter: if they were {OFF}")
    if harmless := [name for name in result.typical_values if name not in weighty]:
        of = "Of the other typical values" if rows else "Of the typical values"
        yield Note(
            f"{of} ({', '.join(harmless)}), none would move a parameter by more than half the "
            f"width of its interval if it were {OFF}."
        )


def _of_parts(result: Reported) -> Iterator[tuple[str, Iterable[Row]]]:
    for part in result.parts:
        values = result.values_of(part.prefix)
        yield (
            part.heading,
            [
                _fixed(result, part.prefix, symbol, values[symbol], sheet)
                for symbol, sheet in part.sheet.items()
                if symbol in values and part.prefix + symbol not in result.parameters
            ],
        )


def _helpers(result: Reported) -> Iterator[tuple[str, Iterable[Row]]]:
    """Yield the values listed among the exciter's parameters that are none of them."""
    own = {symbol for part in result.parts if not part.prefix for symbol in part.sheet}
    yield (
        "Helpers",
        [
            _fixed(result, "", name, value, SheetRow(meaning=MEANINGS.get(name, "used by ties")))
            for name, value in result.fixed.items()
            if name not in own
        ],
    )


def _networks_of_records(result: Reported) -> Iterator[tuple[str, Iterable[Row]]]:
    for test in result.tests:
        yield (
            f"Network of {test.name}",
            [
                row(symbol, number(each.value, 6), each.unit, each.source, each.meaning)
                for symbol, each in test.network.items()
                if f"network.{symbol}" not in result.parameters
            ],
        )


def _fixed(result: Reported, prefix: str, symbol: str, value: float, sheet: SheetRow) -> Row:
    source = result.source_of(prefix + symbol)
    return row(symbol, number(value, 6), sheet.unit, source, sheet.meaning)
