"""Values given beside a case: on the command line, or in the file of a former fit."""

from collections.abc import Iterator, Mapping
from math import isclose, isfinite
from pathlib import Path
from typing import Any

from exfit.case.case import Case
from exfit.case.ties import TieError
from exfit.case.yaml import read_text, read_yaml
from exfit.errors import CaseError
from exfit.fitting.build import values_of
from exfit.fitting.nuisance import names_of
from exfit.models.sheet import Parameter
from exfit.util.text import near


def changed_values(case: Case, given: Mapping[str, float], place: str) -> dict[str, float]:
    """Return changes of values by name: KA, machine.Tpd0, or what is found about a record.

    Raises CaseError, naming ``place``, for a name that the case does not know, a value that its
    data sheet excludes, or values that do not fit together.
    """
    rows = {part.prefix + row.symbol: row for part in case.parts.all for row in part.sheet}
    known = [*rows, *(name for name in case.values() if name not in rows), *_of_records(case)]
    faults = []
    for name, value in given.items():
        if name not in known:
            faults.append(f"{place}: {name}: not a parameter; {near(name, known)}")
        elif name not in rows and not isfinite(value):
            faults.append(f"{place}: {name}: {value:g} is not a finite number")
    faults += [f"{place}: {text}" for text in _outside(rows, given)]
    if not faults:
        try:
            values = values_of(case, given)
        except TieError as fault:
            raise CaseError([f"{place}: {fault}"]) from None
        following = {name: values[name] for name in case.ties.by_name if name not in given}
        faults = [f"{place}: {text}" for text in _outside(rows, following)]
        faults += [f"{place}: {text}" for text in contradictions(case, values)]
    if faults:
        raise CaseError(faults)
    return dict(given)


def _outside(rows: Mapping[str, Parameter], values: Mapping[str, float]) -> Iterator[str]:
    """Yield the values that lie outside the range of their data sheet."""
    for name, value in values.items():
        row = rows.get(name)
        if row is not None and not row.low <= value <= row.high:
            yield f"{name}: {value:g} lies outside {row.low:g} ... {row.high:g}"


def contradictions(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Yield what does not fit together in the values of a system."""
    for part in case.parts.all:
        own = {row.symbol: values[part.prefix + row.symbol] for row in part.sheet}
        yield from (f"{part.prefix}{symbol}: {text}" for symbol, text in part.check(own))


def read_parameters(case: Case, path: Path) -> dict[str, float]:
    """Return the changes that a file of parameters makes to a case.

    What follows others in the case is left to them, if the file agrees; so is what the file tells
    of records that the case does not have. Raises CaseError where it is not such a file, or is of
    another model.
    """
    top, faults = read_yaml(read_text(path), path)
    content = top.value if isinstance(top.value, dict) else {}
    parameters = content.get("parameters")
    texts = [f"{path}: {fault.text}" for fault in faults]
    if not isinstance(parameters, dict) or not parameters:
        raise CaseError([*texts, f"{path}: parameters: missing"])
    if str(content.get("model", case.subject)).upper() != case.subject:
        texts.append(f"{path}: model: {content['model']}, but {case.path} has {case.subject}")
    texts += [f"{path}: parameters.{text}" for text in _no_numbers(parameters)]
    about = content.get("records", {})
    if not isinstance(about, dict):
        texts.append(f"{path}: records: not a mapping (key: value)")
        about = {}
    texts += [f"{path}: records.{text}" for text in _no_numbers(about)]
    if texts:
        raise CaseError(texts)
    about = {name: value for name, value in about.items() if name in _of_records(case)}
    given = changed_values(case, {**parameters, **about}, str(path))
    others = {name: value for name, value in given.items() if name not in case.ties.by_name}
    following = values_of(case, others)
    return {
        name: value
        for name, value in given.items()
        if name in others or not isclose(value, following[name])
    }


def _no_numbers(given: Mapping[str, Any]) -> Iterator[str]:
    """Yield the values that are no numbers."""
    for name, value in given.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            yield f"{name}: {value!r} is not a number"


def _of_records(case: Case) -> list[str]:
    """Return the names of all that a fit of a case finds about its records."""
    return [name for one in case.recordings for name in names_of(one)]
