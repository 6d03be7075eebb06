"""What a case file says, read and checked as a whole: every fault at once, each with its line."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from exfit.case.case import Case
from exfit.case.checks.content import contradictions, states_more
from exfit.case.checks.node import ContentNode
from exfit.case.parts import parts_of, ties_of
from exfit.case.schema import SINGLE, CaseDocument, RecordFile
from exfit.case.schema.values import Section
from exfit.case.yaml import (
    TO_BE_FILLED_IN,
    Fault,
    YamlNode,
    open_places,
    read_text,
    read_yaml,
)
from exfit.errors import CaseError
from exfit.records.record import Record
from exfit.registry import parts
from exfit.util.interrupts import deferred_interrupts
from exfit.util.text import Place, dotted, near

CaseOrPath = Case | str | PathLike[str]
Content = dict[str, Any]
Form = TypeVar("Form", bound=Section)

HASH_DIGITS = 12  # of a SHA-256, in a message


def load_case(path: Path, model_sha256: str = "") -> Case:
    """Return the case of a YAML file.

    The file of a user's own model is run only if it has the hash ``model_sha256``, where one is
    given.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    return parse_case(read_text(path), path, model_sha256)


def parse_case(text: str, path: Path, model_sha256: str = "") -> Case:
    """Return the case of a YAML text, as if it stood in the file ``path``; raises CaseError."""
    top, faults = read_yaml(text, path)
    case = checked_case(top.value, path, faults, model_sha256)
    if case is None:
        raise faults_with_lines(faults, top, path)
    return case


def faults_with_lines(faults: list[Fault], top: YamlNode, path: Path) -> CaseError:
    """Return the faults of a file as an error, in the order of their lines."""
    lines = [(fault.line or top.line_of(fault.place), fault) for fault in faults]
    # what an alias repeats is wrong once
    first: dict[tuple[int, Place, str], Fault] = {}
    for line, fault in sorted(lines, key=lambda pair: pair[0]):
        first.setdefault((line, fault.place[-1:], fault.text), fault)
    return CaseError(
        f"{path}:{line}: {dotted(fault.place)}: {fault.text}"
        for (line, _, _), fault in first.items()
    )


def checked_case(
    content: Content,
    path: Path,
    faults: list[Fault],
    model_sha256: str = "",
    from_file: bool = True,
) -> Case | None:
    """Return the case of the content of a file; None, and faults added, where it has any.

    ``faults`` holds those found before. A user's own model is run only if its file has the hash
    given, where one is.
    """
    for key, section in parts("SECTIONS").items():
        if key in content:
            faults.append(Fault((key,), section.load().not_of_a_case))
            return None
    still_open = [Fault(place, TO_BE_FILLED_IN) for place in open_places(content)]
    apart = None
    if states_more(content):
        from exfit.case.stated_values import taken_apart

        apart = taken_apart(content)
    plain = content if apart is None else apart.content
    models = parts_of(plain, path.parent, faults, model_sha256)
    ties = ties_of(plain, models, faults)
    faults[:] = [*still_open, *elsewhere(faults, still_open)]
    validate = validated if apart is None else apart.validated
    document = validate(content, faults, CaseDocument)
    found = contradictions(plain, models, ties)
    faults += elsewhere(found if apart is None else apart.in_file(found), faults)
    if faults or document is None:
        return None
    return Case.of(document, models, ties, path, from_file)


def elsewhere(faults: Iterable[Fault], others: Iterable[Fault]) -> list[Fault]:
    """Return the faults of those places that have no other."""
    places = {fault.place for fault in others}
    return [fault for fault in faults if fault.place not in places]


def validated(
    content: Content,
    faults: list[Fault],
    form: type[Form],
    place: Place = (),
    schema: Callable[[], Mapping[str, Any]] | None = None,
) -> Form | None:
    """Read sections if all have the right form; add a fault for each place that has not.

    ``schema`` makes the JSON Schema of the file, by default that of a case.
    """
    try:
        with deferred_interrupts():  # pydantic makes errors of its own of an interruption
            return form.model_validate(content)
    except ValidationError as error:
        from exfit.case.json_schema import form_faults, json_schema

        details = [
            {**detail, "loc": (*place, *detail["loc"])}
            for detail in error.errors(include_url=False)
        ]
        faults += elsewhere(form_faults(details, (schema or json_schema)()), faults)
        return None


def case_of_dict(content: Mapping[str, Any], records: Mapping[str, Record], path: Path) -> Case:
    """Return the case that a mapping describes, as `Case.from_dict` does, with its records."""
    faults = list[Fault]()
    plain = _with_record_sections(plain_content(content, faults), records, faults)
    case = checked_case(plain, path, faults, from_file=False)
    if case is None:
        raise CaseError(f"{path}: {dotted(fault.place)}: {fault.text}" for fault in faults)
    for name, record in records.items():
        case = case.with_record(record, name)
    return case


def plain_content(value: Any, faults: list[Fault], place: Place = ()) -> Any:
    """Return Python data as a case file holds it: mappings, lists, numbers and text.

    Tuples become lists, NumPy's numbers floats and integers, paths text; a None is a fault.
    """
    if value is None:
        faults.append(Fault(place, "has no value"))
    if isinstance(value, Mapping):
        return {
            str(key): plain_content(entry, faults, (*place, str(key)))
            for key, entry in value.items()
        }
    if isinstance(value, list | tuple):
        return [plain_content(entry, faults, (*place, k)) for k, entry in enumerate(value)]
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)


def _with_record_sections(
    content: Content, records: Mapping[str, Record], faults: list[Fault]
) -> Content:
    """Return content whose record sections name the arrays where they name no file.

    A name that no record of the content has is a fault.
    """
    sections = {} if "records" in content else {SINGLE: content}
    for key in ("records", "validate"):
        for entry in ContentNode((), content).at(key).entries:
            if "name" in entry:
                sections[str(entry.value["name"])] = entry.value
    for name, record in records.items():
        if name not in sections:
            text = f"{name} is given, but is not a record of the case; {near(name, sections)}"
            faults.append(Fault(("records",), text))
            continue
        section = sections[name].get("record", {})
        if isinstance(section, dict):  # what is none is a fault of its own
            channels = section.get("channels", {signal: {} for signal in record.signals})
            for signal, entry in channels.items() if isinstance(channels, dict) else ():
                if isinstance(entry, dict) and not {"column", "phases"} & entry.keys():
                    entry["column"] = signal
            read = {"file": record.source.as_posix(), "time": "time"}
            sections[name]["record"] = {**read, **section, "channels": channels}
    return content


def record_section(content: Mapping[str, Any]) -> RecordFile:
    """Return the section of a record of a machine, which stands in no case.

    It is checked like that of a case. Raises CaseError with all faults of it.
    """
    from exfit.case.checks.record import channel_faults, record_faults

    place = ("record",)  # in a case, for the keys allowed there
    faults = list[Fault]()
    plain = plain_content(content, faults, place)
    section = validated(plain, faults, RecordFile, place)

    def contradicting(node: ContentNode) -> Iterator[Fault]:
        yield from record_faults(ContentNode(("test",), {"vt0": 1.0}), node)
        for signal, channel in node.at("channels").sections:
            yield from channel_faults(signal, channel, per_unit=True)

    faults += elsewhere(contradicting(ContentNode(place, plain)), faults)
    if section is None or faults:
        file = content.get("file", "record")
        raise CaseError(f"{file}: {dotted(fault.place[1:])}: {fault.text}" for fault in faults)
    return section


def refuse_changed_program(case: Case, sha256: str) -> None:
    """Raise CaseError where what simulates a case has another hash than a fit's, if it had one.

    Values of a fit are taken only together with the code that was fitted.
    """
    for file in case.program_files[:1] if sha256 else ():
        with file.open("rb") as opened:
            own = hashlib.file_digest(opened, "sha256").hexdigest()
        if own != sha256:
            raise CaseError(
                f"{file}: not run: the file has changed since the fit: its SHA-256 begins with "
                f"{own[:HASH_DIGITS]}, that of the fitted program was {sha256[:HASH_DIGITS]}; "
                "fit again"
            )
