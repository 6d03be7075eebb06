"""The cases of a programme: what each fit of it would have as a case file of its own."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from exfit.case.yaml import Fault
from exfit.features.programme.case.programme_schema import BUMP, REJECTION, STEADY
from exfit.records.units import alike, needs_base
from exfit.util.text import Place

Content = dict[str, Any]

TESTS = "tests"
OF_PROGRAMME = ("kind", "use", "free")  # keys of a test that the record of a case does not have
IN_PLACE_OF_TESTS = ("test", "record", "records", "validate")
# where a case gives what it fits, and where it would be fixed
FREE_SECTIONS = (
    (("parameters", "free"), ("parameters", "fixed")),
    (("plant", "free"), ("plant", "parameters")),
    (("stabiliser", "free"), ("stabiliser", "parameters")),
    (("governor", "free"), ("governor", "parameters")),
)


@dataclass(frozen=True)
class CaseContent:
    """The content of a case of a programme.

    ``places`` says where what it holds stands in the file of the programme; None: it follows from
    what is checked elsewhere.
    """

    content: Content
    places: Mapping[Place, Place | None] = field(default_factory=dict)

    def in_file(self, fault: Fault) -> Fault | None:
        """Return a fault at its place in the programme; None of what is checked elsewhere."""
        for length in range(len(fault.place), 0, -1):
            head = fault.place[:length]
            if head in self.places:
                place = self.places[head]
                return None if place is None else fault._replace(place=place + fault.place[length:])
        return fault


def tests_of_kind(content: Content, *kinds: str) -> Iterator[tuple[int, Content]]:
    """Yield the tests of some kinds in a programme's content, each with its index."""
    tests = content.get(TESTS)
    for index, test in enumerate(tests if isinstance(tests, list) else ()):
        if isinstance(test, dict) and test.get("kind", BUMP) in kinds:
            yield index, test


def common_content(content: Content) -> CaseContent:
    """Build the content of the case without a record that all tests share."""
    shared = {key: value for key, value in content.items() if key not in (TESTS, "records")}
    return CaseContent({**shared, "records": []})


def bump_content(content: Content) -> CaseContent:
    """Return the case of all bump tests: its records are those that are fitted."""
    groups: dict[str, list[Content]] = {"records": [], "validate": []}
    places: dict[Place, Place | None] = {}
    for index, test in tests_of_kind(content, BUMP):
        key = "validate" if test.get("use") == "validate" else "records"
        places |= _places_of_recording((key, len(groups[key])), index)
        groups[key].append(_recording(test))
    given = {key: group for key, group in groups.items() if group}
    return CaseContent({**common_content(content).content, **given}, places)


def machine_content(content: Content, index: int) -> CaseContent:
    """Return the case of a test of the machine: nothing is free in it but what it gives itself."""
    test = content[TESTS][index]
    places: dict[Place, Place | None] = {("plant", "free"): (TESTS, index, "free")}
    inner = common_content(content).content
    if test["kind"] == REJECTION:
        inner = {**inner, "records": [_recording(test)]}
        places |= _places_of_recording(("records", 0), index)
    for (section, free), (_, fixed) in FREE_SECTIONS:
        if isinstance(inner.get(section), dict):
            inner[section], starts = _with_fixed_starts(inner[section], free, fixed)
            places |= {(section, fixed, symbol): None for symbol in starts}
    if isinstance(inner.get("limiters"), list):
        inner["limiters"] = [
            _with_fixed_starts(entry, "free", "parameters")[0] if isinstance(entry, dict) else entry
            for entry in inner["limiters"]
        ]
    if isinstance(inner.get("plant"), dict) and isinstance(test.get("free"), dict):
        inner["plant"] = _with_free(inner["plant"], test["free"])
    return CaseContent(inner, places)


def with_bases(content: Content, bases: Mapping[str, tuple[float, str]]) -> Content:
    """Return a programme whose channels have the bases of their signals where they give none.

    ``bases`` are those by signal, each with its unit; a channel in another unit has none.
    """
    if not bases or not isinstance(content.get(TESTS), list):
        return content
    tests = [
        _with_columns(test, bases) if isinstance(test, dict) else test for test in content[TESTS]
    ]
    return {**content, TESTS: tests}


def _with_columns(test: Content, bases: Mapping[str, tuple[float, str]]) -> Content:
    record = test.get("record")
    if isinstance(record, dict):
        return {**test, "record": {**record, **_based(record, "channels", bases)}}
    return {**test, **_based(test, "columns", bases)} if test.get("kind") == STEADY else test


def _based(section: Content, key: str, bases: Mapping[str, tuple[float, str]]) -> Content:
    """Return the channels of a section, with bases, under their key; nothing where there are none.

    A base beside a scale would be another one.
    """
    channels = section.get(key)
    if not isinstance(channels, dict):
        return {}
    based = dict(channels)
    for signal, (base, unit) in bases.items():
        channel = channels.get(signal)
        if not isinstance(channel, dict) or {"base", "scale"} & channel.keys():
            continue
        own = channel.get("unit")
        if isinstance(own, str) and needs_base(own) and alike(own, unit):
            based[signal] = {**channel, "base": base}
    return {key: based}


def _with_fixed_starts(section: Content, free: str, fixed: str) -> tuple[Content, Content]:
    """Return a section in which nothing is free, and the starts that are fixed in it."""
    given, values = section.get(free), section.get(fixed, {})
    starts = _starts(given) if isinstance(given, dict) else {}
    if isinstance(values, dict):
        values = {**starts, **values}
    return {**_without(section, [free]), fixed: values}, starts


def _with_free(plant: Content, free: Content) -> Content:
    """Return a plant with free data of the machine in place of fixed ones."""
    given = plant["parameters"]
    kept = _without(given, free) if isinstance(given, dict) else given
    std_errors = plant.get("std_errors")
    others = {"std_errors": _without(std_errors, free)} if isinstance(std_errors, dict) else {}
    return {**plant, **others, "parameters": kept, "free": free}


def _places_of_recording(place: Place, index: int) -> dict[Place, Place | None]:
    """Map the places of a record to those in the file; names are checked with all others."""
    return {place: (TESTS, index), (*place, "name"): None}


def _recording(test: Content) -> Content:
    return _without(test, OF_PROGRAMME)


def _starts(free: Mapping[str, Any]) -> Content:
    starts = {
        name: section.get("start") for name, section in free.items() if isinstance(section, dict)
    }
    return {name: start for name, start in starts.items() if start is not None}


def _without(mapping: Mapping[str, Any], names: Any) -> Content:
    return {name: value for name, value in mapping.items() if name not in names}
