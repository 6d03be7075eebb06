"""The values of a record of PSLF in the order of its definition, however the file gives them."""

from collections.abc import Iterator
from itertools import zip_longest

from exfit.features.planner.fields import DynamicsFault, Field
from exfit.features.planner.records import Definition
from exfit.util.text import near, show_value

Arranged = tuple[tuple[Field, ...], list[DynamicsFault]]


def arranged(definition: Definition, line: int, fields: tuple[Field, ...]) -> Arranged:
    """Return one field for each name of a record, and what is wrong with them.

    Values may stand behind their names in quotes. What does nothing may be missing: behind names
    anywhere, else at the end, before which files of older releases end.
    """
    if any(field.quoted for field in fields):
        return _named(definition, line, fields)
    idle = _idle(definition, line)
    behind = definition.names[len(fields) :]
    if all(name in idle for name in behind):
        fields += tuple(idle[name] for name in behind)
    return fields, []


def _named(definition: Definition, line: int, fields: tuple[Field, ...]) -> Arranged:
    """Return the values of fields "name" value "name" value in the order of the record."""
    name = definition.record.name
    symbols = {_name_in_file(definition, symbol): symbol for symbol in definition.names}
    given: dict[str, Field] = {}
    faults: list[DynamicsFault] = []
    for label, value in zip_longest(fields[::2], fields[1::2]):
        if not label.quoted or value is None or value.quoted:
            text = f"{name}: {show_value(label.text)}: not a name in quotes and its value"
            return (), [DynamicsFault(label.line, text)]
        symbol = symbols.get(_bare(label.text), "")
        fault = _label_fault(label.text, symbol, symbols, given)
        if fault:
            faults.append(DynamicsFault(label.line, f"{name}: {fault}"))
        given[symbol] = value
    faults = faults or [*_missing(definition, line, symbols, given)]
    ordered = {**_idle(definition, line), **given}
    return tuple(ordered[symbol] for symbol in definition.names if symbol in ordered), faults


def _missing(
    definition: Definition, line: int, symbols: dict[str, str], given: dict[str, Field]
) -> Iterator[DynamicsFault]:
    """Yield a fault where values that do something are missing."""
    idle = _idle(definition, line)
    missing = [name for name, symbol in symbols.items() if symbol not in given.keys() | idle]
    if missing:
        yield DynamicsFault(line, f"{definition.record.name}: missing: {', '.join(missing)}")


def _label_fault(label: str, symbol: str, symbols: dict[str, str], given: dict[str, Field]) -> str:
    """Return why a name is none of the record or one too many, "" where it is right."""
    if not symbol:
        return f"no value is named {show_value(label)}; {near(_bare(label), symbols)}"
    return f"{label}: given twice" if symbol in given else ""


def _idle(definition: Definition, line: int) -> dict[str, Field]:
    """Return fields for what a record need not have, by symbol, with what the model stands for."""
    idle = {**dict.fromkeys(definition.record.ignored, 0.0), **dict(definition.record.absent)}
    return {symbol: Field(repr(value), line) for symbol, value in idle.items()}


def _name_in_file(definition: Definition, symbol: str) -> str:
    """Return how a file names a value."""
    return dict(definition.record.spelled).get(symbol, symbol).lower()


def _bare(label: str) -> str:
    """Return a name without capitals and blanks: of "Ang p" angp."""
    return "".join(label.lower().split())
