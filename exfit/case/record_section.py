"""The section of a record by itself: checked like that of a case, for a file without a case."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from exfit.case.assembly import plain_content
from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import channel_faults, record_faults
from exfit.case.json_schema import json_schema
from exfit.case.messages import form_faults
from exfit.case.schema import RecordFile
from exfit.case.yaml import Fault
from exfit.errors import CaseError
from exfit.util.text import dotted

SECTION = "record"  # the place of the section in a case, for the keys allowed there


def record_section(content: Mapping[str, Any]) -> RecordFile:
    """Return the section of a record of a machine; raises CaseError with all faults of it."""
    faults = list[Fault]()
    plain = plain_content(content, faults, (SECTION,))
    section, wrong_forms = _section(plain)
    faults += _elsewhere(wrong_forms, faults)
    faults += _elsewhere(_contradictions(ContentNode((SECTION,), plain)), faults)
    if section is None or faults:
        file = content.get("file", SECTION)
        raise CaseError(f"{file}: {dotted(fault.place[1:])}: {fault.text}" for fault in faults)
    return section


def _section(plain: Any) -> tuple[RecordFile | None, list[Fault]]:
    """Return the section, None where a value has the wrong form, and these faults."""
    try:
        return RecordFile.model_validate(plain), []
    except ValidationError as error:
        details = [
            {**detail, "loc": (SECTION, *detail["loc"])}
            for detail in error.errors(include_url=False)
        ]
        return None, [*form_faults(details, json_schema())]


def _contradictions(section: ContentNode) -> Iterator[Fault]:
    """Yield the faults of values that contradict each other, as in a test that is steady before."""
    yield from record_faults(ContentNode(("test",), {"vt0": 1.0}), section)
    for signal, channel in section.at("channels").sections:
        yield from channel_faults(signal, channel, per_unit=True)


def _elsewhere(faults: Iterable[Fault], others: Iterable[Fault]) -> list[Fault]:
    """Return the faults of those places that have no other."""
    places = {fault.place for fault in others}
    return [fault for fault in faults if fault.place not in places]
