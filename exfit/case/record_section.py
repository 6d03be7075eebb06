"""The section of a record by itself: checked like that of a case, for a file without a case."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from exfit.case.assembly import plain_content
from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import channel_faults, record_faults
from exfit.case.json_schema import json_schema
from exfit.case.messages import form_faults
from exfit.case.schema import RecordFile
from exfit.case.yaml import Fault, dotted
from exfit.errors import CaseError

HERE = "record"  # where the section stands in a case, for the keys that are known there


def record_section(content: Mapping[str, Any]) -> RecordFile:
    """Return the section of a record of a machine; raises CaseError with all faults of it."""
    faults = list[Fault]()
    plain = plain_content(content, faults, (HERE,))
    try:
        section = RecordFile.model_validate(plain)
    except ValidationError as error:
        details = [
            {**detail, "loc": (HERE, *detail["loc"])} for detail in error.errors(include_url=False)
        ]
        places = {fault.place for fault in faults}
        wrong_forms = form_faults(details, json_schema())
        faults += [fault for fault in wrong_forms if fault.place not in places]
    node, steady_test = ContentNode((HERE,), plain), ContentNode(("test",), {"vt0": 1.0})
    places = {fault.place for fault in faults}
    contradictions = [
        *record_faults(steady_test, node),
        *(
            fault
            for signal, channel in node.at("channels").sections
            for fault in channel_faults(signal, channel, per_unit=True)
        ),
    ]
    faults += [fault for fault in contradictions if fault.place not in places]
    if faults:
        file = content.get("file", HERE)
        raise CaseError(f"{file}: {dotted(fault.place[1:])}: {fault.text}" for fault in faults)
    return section
