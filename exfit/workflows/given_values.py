"""Values in place of those of a case: by name, of a file, of an earlier fit; what a result says."""

from collections.abc import Iterator, Mapping
from math import isclose
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from exfit.case.case import Case
from exfit.case.parts import bounds_of
from exfit.case.ties import TieError
from exfit.case.yaml import read_text, read_yaml
from exfit.errors import CaseError
from exfit.fitting.nuisances import names_of
from exfit.fitting.system import values_of
from exfit.models.sheet import Parameter
from exfit.util.text import listed, magnitude_fault, near
from exfit.util.vocabulary import SOURCES

if TYPE_CHECKING:
    from exfit.results.description import GivenInPlace
    from exfit.results.model import FitResult

Values = Mapping[str, float]
ValuesOrResult: TypeAlias = "Values | FitResult"

WHOLE_FIT = "result.json"
OF_A_RESULT = "the result of a fit; give the parameters.yaml beside it"


def changed_values(case: Case, given: Mapping[str, float], place: str) -> dict[str, float]:
    """Return changes of values by name: KA, machine.Tpd0, or what is found about a record.

    Raises CaseError, naming ``place``, for a name that the case does not have, a value that the
    equations exclude, or values that contradict each other.
    """
    rows, faults = case.rows(), list[str]()
    names = [*rows, *(name for name in case.values() if name not in rows)]
    names += _of_records(case) if given else []
    for name, value in given.items():
        if name not in names:
            faults.append(f"{name}: not a parameter; {near(name, names)}")
        elif name not in rows and (fault := magnitude_fault(value)):
            faults.append(f"{name}: {fault}")
    faults += outside(rows, given)
    if not faults:
        try:
            values = values_of(case, given)
        except TieError as tied:
            raise CaseError(f"{place}: {tied}") from None
        following = {name: values[name] for name in case.ties.by_name if name not in given}
        faults += outside(rows, following)
        faults += _contradictions(case, values)
    if faults:
        raise CaseError(f"{place}: {fault}" for fault in faults)
    return dict(given)


def _contradictions(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    for part in case.parts.all:
        own = {row.symbol: values[part.prefix + row.symbol] for row in part.sheet}
        yield from (f"{part.prefix}{symbol}: {text}" for symbol, text in part.check(own))


def with_given_values(
    case: Case,
    given: Mapping[str, float],
    source: Path | str,
    sources: Mapping[str, str] = MappingProxyType({}),
) -> Case:
    """Return the case with other fixed values, and other starts of what is free.

    ``source`` is who gives them, ``sources`` where each of the values comes from. Raises CaseError,
    naming ``source``, as `changed_values` does, and for a start out of bounds.
    """
    changed = case.with_values(changed_values(case, given, str(source)), source, sources)
    faults, rows = [], case.rows()
    for name, section in changed.free().items():
        low, high = bounds_of(section, rows.get(name))
        if name in given and not low <= section.start <= high:
            limits = f"{low:g} ... {high:g} in {case.path}"
            faults.append(f"{source}: {name}: {section.start:g} lies outside its bounds {limits}")
    if faults:
        raise CaseError(faults)
    return changed


def outside(rows: Mapping[str, Parameter], values: Mapping[str, float]) -> Iterator[str]:
    """Yield the values of the rows' parameters that the equations exclude, and why."""
    for name, value in values.items():
        fault = rows[name].range_fault(value) if name in rows else None
        if fault is not None:
            yield f"{name}: {fault}"


class CodeHashes(NamedTuple):
    """The SHA-256 of the user's own model and of the program that a fit was made with, or ""."""

    model: str = ""
    program: str = ""


def fitted_code(path: Path) -> CodeHashes:
    """Return the hashes of the code that a file of parameters is of.

    They are read before a case is loaded, which runs the model. Raises CaseError for a file that
    holds no parameters: it would lack the hashes too.
    """
    content, _ = _content(path)
    return CodeHashes(*(str(content.get(key, "")) for key in ("model_sha256", "program_sha256")))


def _content(path: Path) -> tuple[dict[str, Any], list[str]]:
    """Read the content of a file of parameters, and the faults of its text."""
    if path.is_dir() or path.name == WHOLE_FIT:  # a large one is more than YAML is read of
        raise CaseError(f"{path}: {OF_A_RESULT}")
    top, faults = read_yaml(read_text(path), path)
    content = top.value if isinstance(top.value, dict) else {}
    if "inputs" in content:
        raise CaseError(f"{path}: {OF_A_RESULT}")
    texts = [fault.text for fault in faults]
    parameters = content.get("parameters")
    if not isinstance(parameters, dict) or not parameters:
        raise CaseError(f"{path}: {text}" for text in (*texts, "parameters: missing"))
    return content, texts


def read_parameters(case: Case, path: Path) -> dict[str, float]:
    """Return the changes that a file of parameters makes to a case.

    What follows others in the case is left to them, if the file agrees; so is what the file says
    about records that the case does not have. Raises CaseError where it is not such a file, or is
    of another model.
    """
    content, texts = _content(path)
    if str(content.get("model", case.subject)).upper() != case.subject:
        texts.append(f"model: {content['model']}, but {case.path} has {case.subject}")
    parameters, about = (_mapping(key, content, texts) for key in ("parameters", "records"))
    for key, section in (("parameters", parameters), ("records", about)):
        for name, value in section.items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                texts.append(f"{key}.{name}: {value!r} is not a number")
    for name, word in _mapping("sources", content, texts).items():
        if word not in SOURCES:
            texts.append(f"sources.{name}: {word!r} is not a source; {near(str(word), SOURCES)}")
    if texts:
        raise CaseError(f"{path}: {text}" for text in texts)
    return taken_over(case, parameters, about, str(path))


def sources_in(path: Path) -> dict[str, str]:
    """Read the sources of the values of a file that `read_parameters` has read, by name."""
    return {str(name): str(word) for name, word in _content(path)[0].get("sources", {}).items()}


def taken_over(
    case: Case, parameters: Mapping[str, float], about: Mapping[str, float], place: str
) -> dict[str, float]:
    """Return the changes that values of an earlier fit, and its values ``about`` records, make.

    As `read_parameters` does; raises CaseError, naming ``place``, as `changed_values` does.
    """
    names = _of_records(case)
    of_records = {name: value for name, value in about.items() if name in names}
    given = changed_values(case, {**parameters, **of_records}, place)
    following = values_of(case, {n: v for n, v in given.items() if n not in case.ties.by_name})
    return {  # without those of tied parameters that the ties give as well
        name: value
        for name, value in given.items()
        if name not in case.ties.by_name or not isclose(value, following[name])
    }


def _mapping(key: str, content: Mapping[str, Any], faults: list[str]) -> dict[str, Any]:
    """Return a section of a file, empty where it is no mapping, which is a fault then."""
    given = content.get(key, {})
    if isinstance(given, dict):
        return given
    faults.append(f"{key}: not a mapping (key: value)")
    return {}


def _of_records(case: Case) -> list[str]:
    """Return the names of all that a fit of a case finds about its records."""
    from exfit.fitting.event import names_of_switchings
    from exfit.fitting.recorded_steps import with_recorded_steps

    recordings = [with_recorded_steps(case, recording) for recording in case.recordings]
    return [
        name
        for recording in recordings
        for name in (*names_of(recording), *names_of_switchings(case, recording))
    ]


def with_values(case: Case, values: "ValuesOrResult | None") -> Case:
    """Return a case with values in place of its own, by name, or with those of an earlier fit.

    Raises CaseError where it cannot start from them.
    """
    if values is None:
        return case
    if isinstance(values, Mapping):
        return with_given_values(case, values, "values")
    from exfit.results.model import FitResult

    if not isinstance(values, FitResult):  # as a Series of pandas
        return with_given_values(case, values, "values")
    if values.model != case.subject:
        raise CaseError(f"values: model: {values.model}, but {case.path} has {case.subject}")
    taken = taken_over(case, values.own_values, values.of_records, "values")
    return with_given_values(case, taken, "values", values.sources)


def changes_of(case: Case, values: "ValuesOrResult | None") -> Values:
    """Return changes of values by name: of a fit all that it has, of others the checked ones."""
    if values is None or isinstance(values, Mapping):
        return changed_values(case, values or {}, "values")
    from exfit.results.model import FitResult

    if isinstance(values, FitResult):
        return values.values
    return changed_values(case, values, "values")


def given_values(case: Case) -> "dict[str, GivenInPlace]":
    """Return the values that were given in place of those of a case."""
    from exfit.results.description import GivenInPlace

    fixed = case.values().keys() - case.free().keys()
    return {
        name: GivenInPlace(given.value, given.before, name not in fixed, str(given.source))
        for name, given in case.given_values.items()
    }


def given_value_notes(case: Case) -> Iterator[str]:
    """Name the values that were given in place of those of the case, and their source."""
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
    if case.freed:
        yield f"the fit finds {listed(case.freed)}, which the case gives, by --free"
