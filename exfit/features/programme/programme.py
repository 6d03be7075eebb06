"""A programme: all tests of a unit in one file, checked like a case; its steps and its cases.

A case of a programme is the case file that a fit of it alone would have.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from exfit.case.case import Case
from exfit.case.checks.content import contradictions
from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import name_faults
from exfit.case.load import faults_with_lines, parse_case, validated
from exfit.case.parts import kind_of, parts_of, ties_of
from exfit.case.peek import files_in
from exfit.case.schema import Recording
from exfit.case.stated_values import taken_apart
from exfit.case.yaml import Fault, read_text, read_yaml
from exfit.errors import CaseError
from exfit.features.programme.programme_checks import (
    governor_test_faults,
    saturation_test_faults,
    steady_test_faults,
)
from exfit.features.programme.programme_schema import (
    BUMP,
    GOVERNOR,
    ORDER,
    REJECTION,
    SATURATION,
    STEADY,
    GovernorTest,
    ProgrammeDocument,
    RecordedBump,
    SteadyTest,
    TestOfProgramme,
)
from exfit.features.programme.result import ProgrammeStep
from exfit.records.units import alike, needs_base
from exfit.util.text import Place, dotted

Content = dict[str, Any]
Bases = Mapping[str, tuple[float, str]]  # 1 pu by signal, and its unit
Places = dict[Place, Place | None]

TESTS = "tests"
FIT: Final = "fit"  # the name of what fits all bump tests together
# in place of the bases that a saturation test will measure, while the file is checked
BASES_TO_COME = {"ifd": (1.0, "A"), "efd": (1.0, "V")}
OF_PROGRAMME = ("kind", "use", "free")  # keys of a test that the record of a case does not have
IN_PLACE_OF_TESTS = ("test", "record", "records", "validate")
# where a case gives what it fits: its section, and where that would be fixed in it
FREE_SECTIONS = {
    "parameters": "fixed",
    "plant": "parameters",
    "stabiliser": "parameters",
    "governor": "parameters",
}


@dataclass(frozen=True)
class CaseContent:
    """The content of a case of a programme.

    ``places`` says where what it holds stands in the file of the programme; None: it follows from
    what is checked elsewhere.
    """

    content: Content
    places: Places = field(default_factory=dict)

    def in_file(self, fault: Fault) -> Fault | None:
        """Return a fault at its place in the programme; None of what is checked elsewhere."""
        for length in range(len(fault.place), 0, -1):
            head = fault.place[:length]
            if head in self.places:
                place = self.places[head]
                return None if place is None else fault._replace(place=place + fault.place[length:])
        return fault


def common_content(content: Content) -> CaseContent:
    """Build the content of the case without a record that all tests share."""
    return CaseContent({**_without(content, (TESTS, "records")), "records": []})


def bump_content(content: Content) -> CaseContent:
    """Return the case of all bump tests: its records are those that are fitted."""
    groups: dict[str, list[Content]] = {"records": [], "validate": []}
    places: Places = {}
    for index, test in tests_of_kind(content, BUMP):
        key = "validate" if test.get("use") == "validate" else "records"
        places |= _places_of_recording((key, len(groups[key])), index)
        groups[key].append(_without(test, OF_PROGRAMME))
    given = {key: group for key, group in groups.items() if group}
    return CaseContent({**common_content(content).content, **given}, places)


def machine_content(content: Content, index: int) -> CaseContent:
    """Return the case of a test of the machine: nothing is free in it but what it gives itself."""
    test = content[TESTS][index]
    of_governor = test["kind"] == GOVERNOR
    fitted = "governor" if of_governor else "plant"
    places: Places = {(fitted, "free"): (TESTS, index, "free")}
    inner = common_content(content).content
    if test["kind"] == REJECTION:
        inner = {**inner, "records": [_without(test, OF_PROGRAMME)]}
        places |= _places_of_recording(("records", 0), index)
    for section, fixed in FREE_SECTIONS.items():
        if isinstance(inner.get(section), dict):
            inner[section], starts = _with_fixed_starts(inner[section], fixed)
            places |= {(section, fixed, symbol): None for symbol in starts}
    if isinstance(inner.get("limiters"), list):
        inner["limiters"] = [
            _with_fixed_starts(entry, "parameters")[0] if isinstance(entry, dict) else entry
            for entry in inner["limiters"]
        ]
    part, free = inner.get(fitted), test.get("free")
    if isinstance(part, dict) and isinstance(free, dict):
        given = {
            key: _without(part[key], free)
            for key in ("parameters", "std_errors")
            if isinstance(part.get(key), dict)
        }
        inner[fitted] = {**part, **given, "free": free}
    return CaseContent(inner, places)


def tests_of_kind(content: Content, *kinds: str) -> Iterator[tuple[int, Content]]:
    """Yield the tests of some kinds in a programme's content, each with its index."""
    tests = content.get(TESTS)
    for index, test in enumerate(tests if isinstance(tests, list) else ()):
        if isinstance(test, dict) and test.get("kind", BUMP) in kinds:
            yield index, test


def _places_of_recording(place: Place, index: int) -> Places:
    """Map the places of a record to those in the file; names are checked with all others."""
    return {place: (TESTS, index), (*place, "name"): None}


def _with_fixed_starts(section: Content, fixed: str) -> tuple[Content, Content]:
    """Return a section in which nothing is free, and the starts that are fixed in it."""
    free, values = section.get("free"), section.get(fixed, {})
    starts = {
        name: given["start"]
        for name, given in (free.items() if isinstance(free, dict) else ())
        if isinstance(given, dict) and given.get("start") is not None
    }
    if isinstance(values, dict):
        values = {**starts, **values}
    return {**_without(section, ["free"]), fixed: values}, starts


def _without(mapping: Mapping[str, Any], names: Any) -> Content:
    return {name: value for name, value in mapping.items() if name not in names}


def with_bases(content: Content, bases: Bases) -> Content:
    """Return a programme whose channels have the bases of their signals where they give none.

    A channel in another unit has none.
    """
    if not bases or not isinstance(content.get(TESTS), list):
        return content
    tests = []
    for test in content[TESTS]:
        record = test.get("record") if isinstance(test, dict) else None
        if isinstance(record, dict):
            test = {**test, "record": _with_based(record, "channels", bases)}
        elif isinstance(test, dict) and test.get("kind") == STEADY:
            test = _with_based(test, "columns", bases)
        tests.append(test)
    return {**content, TESTS: tests}


def _with_based(section: Content, key: str, bases: Bases) -> Content:
    """Return a section whose channels, under their key, have bases.

    A base beside a scale would be another one.
    """
    channels = section.get(key)
    if not isinstance(channels, dict):
        return section
    based = dict(channels)
    for signal, (base, unit) in bases.items():
        channel = channels.get(signal)
        if not isinstance(channel, dict) or {"base", "scale"} & channel.keys():
            continue
        own = channel.get("unit")
        if isinstance(own, str) and needs_base(own) and alike(own, unit):
            based[signal] = {**channel, "base": base}
    return {**section, key: based}


@dataclass(frozen=True, kw_only=True)
class Programme:
    """The tests of a unit, in the order of their file, and what they share.

    ``content`` is that of the file, ``text`` the file itself, ``about`` what identifies the unit.
    A case is the programme of one test: ``single``, and the programme has no other test.
    """

    path: Path
    text: str
    content: Mapping[str, Any]
    about: Mapping[str, float | str]
    tests: tuple[TestOfProgramme, ...] = ()
    single: Case | None = None

    @property
    def folder(self) -> Path:
        """The folder to which the paths in the file are relative."""
        return self.path.parent

    @property
    def bumps(self) -> tuple[RecordedBump, ...]:
        """The bump tests, in the order of the file."""
        return tuple(test for test in self.tests if isinstance(test, RecordedBump))

    def test(self, name: str) -> TestOfProgramme | None:
        """Return the test of a name; None for "fit", which is all bump tests."""
        tests = () if name == FIT else self.tests
        return next((test for test in tests if test.name == name), None)

    def content_of(self, name: str) -> Content:
        """Select the content of a test, and nothing of others; of "fit" that of all bump tests.

        It holds all from which the result of the test follows but values that others measured, and
        the files that it names.
        """
        shared = _without(self.content, ("about", TESTS))
        if self.single is not None:
            return shared
        names = {test.name for test in self.bumps} if name == FIT else {name}
        return {**shared, TESTS: [t for t in self.content[TESTS] if t["name"] in names]}

    def files_of(self, name: str) -> tuple[Path, ...]:
        """Return the files that `content_of` a test names."""
        return files_in(self.content_of(name), self.folder)

    def columns(self) -> Iterator[Mapping[str, Any]]:
        """Yield the channels of each record, and the columns of each table of points on load."""
        for test in self.tests:
            if isinstance(test, SteadyTest | GovernorTest):
                yield test.columns
            elif isinstance(test, Recording):
                yield test.record.channels

    def with_bases(self, bases: Bases) -> "Programme":
        """Return the programme whose channels have bases, by signal, where they give none."""
        if self.single is not None or not bases:
            return self
        content = with_bases(dict(self.content), bases)
        return replace(self, content=content, tests=self._document(content).programme)

    def shared_case(self) -> Case:
        """Build the case without a record that all tests share."""
        return self.single or self._case(common_content(dict(self.content)))

    def case_of(self, name: str) -> Case:
        """Return the case of a test that determines data of the machine; of "fit" of all bumps."""
        content = dict(self.content)
        if name == FIT:
            return self.single or self._case(bump_content(content))
        names = [test.name for test in self.tests]
        return self._case(machine_content(content, names.index(name)))

    def _case(self, inner: CaseContent) -> Case:
        faults: list[Fault] = []
        content = {key: value for key, value in inner.content.items() if value != []}
        parts = parts_of(content, self.folder, faults)
        ties = ties_of(content, parts, faults)
        return Case.of(self._document(content), parts, ties, self.path)

    def _document(self, content: Content) -> ProgrammeDocument:
        faults: list[Fault] = []
        document = validated(content, faults, ProgrammeDocument)
        if document is None:
            raise CaseError(f"{self.path}: {dotted(fault.place)}: {fault.text}" for fault in faults)
        return document


def load_programme(path: Path) -> Programme:
    """Return the programme of a YAML file, which may be a case.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    text = read_text(path)
    top, faults = read_yaml(text, path)
    if TESTS not in top.value:
        case = parse_case(text, path)
        return Programme(path=path, text=text, content=top.value, about=case.about, single=case)
    apart = taken_apart(top.value)
    document = apart.validated(top.value, faults, ProgrammeDocument)
    places = {fault.place for fault in faults}
    for fault in apart.in_file(programme_faults(apart.content, path.parent)):
        if fault.place not in places:
            faults.append(fault)
            places.add(fault.place)
    if faults or document is None:
        raise faults_with_lines(faults, top, path)
    return Programme(
        path=path, text=text, content=apart.content, about=document.about, tests=document.programme
    )


def programme_faults(content: Content, folder: Path) -> Iterator[Fault]:
    """Yield contradictions in a programme, or in one of its cases."""
    top = ContentNode((), content)
    for key in IN_PLACE_OF_TESTS:
        if key in content:
            yield top.at(key).fault("not allowed with tests: each of them has its own")
    tests = top.at(TESTS).entries
    yield from name_faults(tests)
    yield from _source_faults(tests)
    bumps = [test for test in tests if test.content.get("kind", BUMP) == BUMP]
    if bumps and all(test.at("use").text == "validate" for test in bumps):
        yield bumps[0].at("use").fault("no bump test is fitted: nothing to validate")
    if any(test.at("kind").text == SATURATION for test in tests):
        content = with_bases(content, BASES_TO_COME)
    yield from _machine_faults(ContentNode((), content))
    machine = (index for index, _ in tests_of_kind(content, STEADY, GOVERNOR, REJECTION))
    for inner in (
        common_content(content),
        *(machine_content(content, index) for index in machine),
        bump_content(content),
    ):
        faults: list[Fault] = []
        parts = parts_of(inner.content, folder, faults)
        ties = ties_of(inner.content, parts, faults)
        for fault in (*faults, *contradictions(inner.content, parts, ties)):
            placed = inner.in_file(fault)
            if placed is not None:
                yield placed


def _source_faults(tests: list[ContentNode]) -> Iterator[Fault]:
    for _, free in (entry for test in tests for entry in test.at("free").sections):
        if "source" in free:
            yield free.at("source").fault("not allowed here: the test finds the value")


def _machine_faults(top: ContentNode) -> Iterator[Fault]:
    """Yield contradictions in the tests of the machine, or that there is no machine."""
    kind = kind_of(top.at("plant").content)
    for test in top.at(TESTS).entries:
        of_test = test.at("kind").text
        if of_test in (SATURATION, STEADY, REJECTION) and not kind.has_machine:
            yield test.at("kind").fault(f"not allowed with plant {kind.name}: it has no machine")
        elif of_test == SATURATION:
            yield from saturation_test_faults(test)
        elif of_test == STEADY:
            yield from steady_test_faults(test)
        elif of_test == GOVERNOR:
            if not top.at("governor").content:
                yield test.at("kind").fault("not allowed without a governor")
            yield from governor_test_faults(test)


def steps_of(programme: Programme) -> tuple[ProgrammeStep, ...]:
    """List the steps of a programme in their order, within a kind in that of the file."""
    case = programme.single
    if case is not None:
        names = (recording.name for recording in (*case.recordings, *case.validations))
        return (ProgrammeStep(FIT, BUMP, tuple(names)),)
    alone = [
        ProgrammeStep(test.name, kind, (test.name,))
        for kind in ORDER
        if kind != BUMP
        for test in programme.tests
        if test.kind == kind
    ]
    bumps = tuple(test.name for test in programme.bumps)
    return (*alone, *([ProgrammeStep(FIT, BUMP, bumps)] if bumps else []))
