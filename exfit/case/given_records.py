"""Records that are given as arrays, in place of the files that a case would name."""

from collections.abc import Iterator, Mapping
from typing import Any

from exfit.case.schema import SINGLE
from exfit.case.yaml import Fault
from exfit.records.record import Record
from exfit.util.text import near

Content = dict[str, Any]


def with_record_sections(
    content: Content, records: Mapping[str, Record], faults: list[Fault]
) -> Content:
    """Return the content of a case whose record sections name the arrays where they name no file.

    A name that no record of the content has is a fault.
    """
    content = dict(content)
    places = dict(_places(content))
    for name, record in records.items():
        if name not in places:
            text = f"{name} is given, but is not a record of the case; {near(name, places)}"
            faults.append(Fault(("records",), text))
            continue
        key, index = places[name]
        if index is None:
            content["record"] = _section(content.get("record"), record)
        else:
            entries = list(content[key])
            entry = entries[index]
            entries[index] = {**entry, "record": _section(entry.get("record"), record)}
            content[key] = entries
    return content


def _places(content: Content) -> Iterator[tuple[str, tuple[str, int | None]]]:
    """Yield the name of each record of a content, and its place."""
    if "records" not in content:
        yield SINGLE, ("record", None)
    for key in ("records", "validate"):
        entries = content.get(key)
        for index, entry in enumerate(entries if isinstance(entries, list) else ()):
            if isinstance(entry, dict) and "name" in entry:
                yield str(entry["name"]), (key, index)


def _section(section: Any, record: Record) -> Any:
    """Return a record section with the arrays for its file, time and columns."""
    if section is None:
        section = {}
    if not isinstance(section, dict):
        return section  # a fault of its own
    channels = section.get("channels", {signal: {} for signal in record.signals})
    if isinstance(channels, dict):
        channels = {signal: _channel(signal, entry) for signal, entry in channels.items()}
    return {"file": record.source.as_posix(), "time": "time", **section, "channels": channels}


def _channel(signal: str, entry: Any) -> Any:
    """Return a channel with its signal for the column, where it names none."""
    if not isinstance(entry, dict) or "column" in entry or "phases" in entry:
        return entry
    return {"column": signal, **entry}
