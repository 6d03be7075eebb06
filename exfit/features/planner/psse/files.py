"""The dynamics files of PSS/E (.dyr): their records, read and written."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence

from exfit.features.planner.fields import DynamicsFault, Field, Fields
from exfit.features.planner.file_format import WIDTH, FileFormat, Head, Heads, wrong_bus, wrong_id
from exfit.features.planner.psse.free_format import sound_records
from exfit.features.planner.records import PSSE, Definition, definition_of, record_fields
from exfit.util.text import show_value


def heads(text: str) -> Heads:
    """Return the records of a file that belong to a unit."""
    records, faults = sound_records(text)
    return Heads([head for record in records for head in _heads_of(record, faults)], faults)


def record_text(
    definition: Definition, values: Mapping[str, float], bus: int, machine_id: str
) -> str:
    """Return a record as a dynamics file has it."""
    fields = [
        str(bus),
        f"'{definition.record.name}'",
        machine_id if machine_id.isalnum() else f"'{machine_id}'",
        *record_fields(definition, values),
        "/",
    ]
    return textwrap.fill("  ".join(fields), WIDTH, subsequent_indent="    ", break_on_hyphens=False)


def _heads_of(record: Fields, faults: list[DynamicsFault]) -> Iterator[Head]:
    """Yield the head of a record that belongs to a unit; add a fault where it has none."""
    line, fields = record
    if len(fields) < 3 or not fields[1].text[:1].isalpha():
        if len(fields) < 3 or any(definition_of(field.text) for field in fields[:2]):
            begin = " ".join(field.text for field in fields[:3])
            faults.append(DynamicsFault(line, f"{show_value(begin)} is not bus, 'model' and id"))
        return  # of a line or a device: their records begin otherwise
    bus, name, machine_id = (field.text for field in fields[:3])
    wrong = [*wrong_bus(fields[0]), *wrong_id(machine_id)]
    if not wrong:
        yield Head(int(bus), _label(fields), machine_id, line, fields[3:], definition_of(name))
    elif definition_of(name) is not None:
        faults += [DynamicsFault(line, f"{name.upper()}: {text}") for text in wrong]


def _label(fields: Sequence[Field]) -> str:
    """Return the name of a record's model; of a user's model with its own name."""
    name = fields[1].text
    label = f"{name} {fields[3].text}" if name.upper() == "USRMDL" and fields[3:] else name
    return "".join(letter if letter.isprintable() else "?" for letter in label).upper()


PSSE_FILES = FileFormat(PSSE, ".dyr", "// ", "bus, 'model', id, values and '/'", heads, record_text)
