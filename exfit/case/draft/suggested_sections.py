"""The sections of a case that a record suggests: of a bump test, or of a grid event."""

from collections.abc import Mapping

from exfit.case.draft.bases import Base
from exfit.case.draft.suggestion import NO_BASES, bump_section, record_section, weights_section
from exfit.records.inspection import Inspection
from exfit.registry import parts


def suggested_sections(inspection: Inspection, file: str) -> list[str]:
    """List the lines of the sections that an inspected file suggests."""
    if suggests_event(inspection):
        return [*event_plant(inspection), *event_section(inspection, file)]
    return [
        *record_section(inspection, file),
        *bump_section(inspection),
        *weights_section(inspection),
    ]


def suggests_event(inspection: Inspection) -> bool:
    """Tell whether a file seems to be that of a grid event, and a feature drafts its case."""
    return inspection.is_event and bool(parts("EVENT_DRAFT"))


def event_plant(inspection: Inspection) -> list[str]:
    """List the first lines of the section of a plant that the record of an event drives."""
    return list(parts("EVENT_DRAFT")["plant"].load()(inspection))


def event_section(
    inspection: Inspection, file: str, bases: Mapping[str, Base] = NO_BASES
) -> list[str]:
    """List the lines of the section of a record of an event; ``bases`` as for a bump test."""
    return list(parts("EVENT_DRAFT")["record"].load()(inspection, file, bases))
