"""Values given beside a case: on the command line, or in the file of a former fit."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from exfit.case import Case
from exfit.case_form import near
from exfit.errors import CaseError
from exfit.trial import values_of
from exfit.yaml_lines import read_text, read_yaml


def changed_values(case: Case, given: Mapping[str, float], place: str) -> dict[str, float]:
    """Return changes of parameters as the system names them: KA, or machine.Tpd0.

    Raises CaseError, naming ``place``, for a symbol that no data sheet has or a value it excludes.
    """
    rows = {part.prefix + row.symbol: row for part in case.parts.all for row in part.sheet}
    faults = []
    for name, value in given.items():
        if name not in rows:
            faults.append(f"{place}: {name}: not a parameter; {near(name, rows)}")
        elif not rows[name].low <= value <= rows[name].high:
            low, high = rows[name].low, rows[name].high
            faults.append(f"{place}: {name}: {value:g} lies outside {low:g} ... {high:g}")
    if not faults:
        faults = [f"{place}: {text}" for text in contradictions(case, values_of(case, given))]
    if faults:
        raise CaseError(faults)
    return dict(given)


def contradictions(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Yield what does not fit together in the values of a system."""
    for part in case.parts.all:
        own = {row.symbol: values[part.prefix + row.symbol] for row in part.sheet}
        yield from (f"{part.prefix}{symbol}: {text}" for symbol, text in part.check(own))


def read_parameters(case: Case, path: Path) -> dict[str, float]:
    """Return the changes that a file of parameters makes to a case.

    Raises CaseError where it is not such a file, or is of another model.
    """
    top, faults = read_yaml(read_text(path), path)
    content = top.value if isinstance(top.value, dict) else {}
    parameters = content.get("parameters")
    texts = [f"{path}: {fault.text}" for fault in faults]
    if not isinstance(parameters, dict) or not parameters:
        raise CaseError([*texts, f"{path}: parameters: missing"])
    if str(content.get("model", case.subject)).upper() != case.subject:
        texts.append(f"{path}: model: {content['model']}, but {case.path} has {case.subject}")
    texts += [
        f"{path}: parameters.{name}: {value!r} is not a number"
        for name, value in parameters.items()
        if isinstance(value, bool) or not isinstance(value, int | float)
    ]
    if texts:
        raise CaseError(texts)
    return changed_values(case, parameters, str(path))
