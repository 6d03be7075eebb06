"""The cases of a programme: what each fit of it would have as a case file of its own."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from exfit.case.schema.programme import BUMP, REJECTION
from exfit.case.yaml import Fault
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
    """Return what all tests of a programme share, as a case without a record."""
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


def rejection_content(content: Content, index: int) -> CaseContent:
    """Return the case of the test at an index: nothing is free in it but what it gives itself."""
    test = content[TESTS][index]
    places: dict[Place, Place | None] = {
        **_places_of_recording(("records", 0), index),
        ("plant", "free"): (TESTS, index, "free"),
    }
    inner = {**common_content(content).content, "records": [_recording(test)]}
    for (section, free), (_, fixed) in FREE_SECTIONS:
        if not isinstance(inner.get(section), dict):
            continue
        given = inner[section].get(free)
        starts = _starts(given) if isinstance(given, dict) else {}
        values = inner[section].get(fixed, {})
        if isinstance(values, dict):
            values = {**starts, **values}
            places |= {(section, fixed, symbol): None for symbol in starts}
        others = {key: value for key, value in inner[section].items() if key != free}
        inner[section] = {**others, fixed: values}
    own = test.get("free")
    plant = inner.get("plant")
    if isinstance(plant, dict) and isinstance(own, dict):
        given = plant["parameters"]
        kept = given if not isinstance(given, dict) else _without(given, own)
        inner["plant"] = {**plant, "parameters": kept, "free": own}
    return CaseContent(inner, places)


def rejections(content: Content) -> Iterator[CaseContent]:
    """Yield the case of each test that determines data of the machine."""
    for index, _ in tests_of_kind(content, REJECTION):
        yield rejection_content(content, index)


def _places_of_recording(place: Place, index: int) -> dict[Place, Place | None]:
    """Return where a record of a case stands; names are checked with those of all tests."""
    return {place: (TESTS, index), (*place, "name"): None}


def _recording(test: Content) -> Content:
    """Return a test as a record of a case."""
    return _without(test, OF_PROGRAMME)


def _starts(free: Mapping[str, Any]) -> Content:
    """Return the start of each parameter that can be read."""
    starts = {
        name: section.get("start") for name, section in free.items() if isinstance(section, dict)
    }
    return {name: start for name, start in starts.items() if start is not None}


def _without(mapping: Mapping[str, Any], names: Any) -> Content:
    return {name: value for name, value in mapping.items() if name not in names}
