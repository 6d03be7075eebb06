"""The sections of a case that a record suggests: of a bump test, or of a grid event."""

from exfit.case.draft.suggestion import bump_section, record_section, weights_section
from exfit.features.events.suggestion import event_plant, event_section
from exfit.records.inspection import Inspection


def suggested_sections(inspection: Inspection, file: str) -> list[str]:
    """Return the lines of the sections that an inspected file suggests."""
    if inspection.is_event:
        return [*event_plant(inspection), *event_section(inspection, file)]
    return [
        *record_section(inspection, file),
        *bump_section(inspection),
        *weights_section(inspection),
    ]
