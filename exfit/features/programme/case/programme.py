"""A programme: all tests of a unit in one file, checked like a case; its steps and its cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
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
from exfit.case.yaml import Fault, read_text, read_yaml
from exfit.errors import CaseError
from exfit.features.programme.case.case_content import (
    IN_PLACE_OF_TESTS,
    TESTS,
    CaseContent,
    Content,
    bump_content,
    common_content,
    machine_content,
    tests_of_kind,
    with_bases,
)
from exfit.features.programme.case.programme_checks import (
    saturation_test_faults,
    steady_test_faults,
)
from exfit.features.programme.case.programme_schema import (
    BUMP,
    ORDER,
    REJECTION,
    SATURATION,
    STEADY,
    ProgrammeDocument,
    RecordedBump,
    TestOfProgramme,
)
from exfit.features.programme.case.schema_at_rest import SteadyTest
from exfit.plants import PlantKind
from exfit.util.text import dotted

FIT: Final = "fit"  # the name of what fits all bump tests together
# in place of the bases that a saturation test will measure, while the file is checked
BASES_TO_COME = {"ifd": (1.0, "A"), "efd": (1.0, "V")}


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

    def test(self, name: str) -> TestOfProgramme:
        """Return the test of a name."""
        return next(test for test in self.tests if test.name == name)

    def content_of(self, name: str) -> Content:
        """Select the content of a test, and nothing of others; of "fit" that of all bump tests.

        It holds all from which the result of the test follows but values that others measured, and
        the files that it names.
        """
        shared = {key: value for key, value in self.content.items() if key not in ("about", TESTS)}
        if self.single is not None:
            return shared
        tests = self.bumps if name == FIT else (self.test(name),)
        names = {test.name for test in tests}
        return {**shared, TESTS: [t for t in self.content[TESTS] if t["name"] in names]}

    def files_of(self, name: str) -> tuple[Path, ...]:
        """Return the files that `content_of` a test names."""
        return files_in(self.content_of(name), self.folder)

    def columns(self) -> Iterator[Mapping[str, Any]]:
        """Yield the channels of each record, and the columns of each table of points on load."""
        for test in self.tests:
            if isinstance(test, SteadyTest):
                yield test.columns
            elif isinstance(test, Recording):
                yield test.record.channels

    def with_bases(self, bases: Mapping[str, tuple[float, str]]) -> "Programme":
        """Return the programme whose channels have bases, by signal, where they give none."""
        if self.single is not None or not bases:
            return self
        content = with_bases(dict(self.content), bases)
        return replace(self, content=content, tests=self._document(content).programme)

    def shared_case(self) -> Case:
        """Build the case without a record that all tests share."""
        return self.single or self._case(common_content(dict(self.content)))

    def bump_case(self) -> Case:
        """Return the case of all bump tests."""
        return self.single or self._case(bump_content(dict(self.content)))

    def rejection_case(self, name: str) -> Case:
        """Return the case of a test that determines data of the machine."""
        names = [test.name for test in self.tests]
        return self._case(machine_content(dict(self.content), names.index(name)))

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
    document = validated(top.value, faults, ProgrammeDocument)
    places = {fault.place for fault in faults}
    for fault in programme_faults(top.value, path.parent):
        if fault.place not in places:
            faults.append(fault)
            places.add(fault.place)
    if faults or document is None:
        raise faults_with_lines(faults, top, path)
    return Programme(
        path=path, text=text, content=top.value, about=document.about, tests=document.programme
    )


def programme_faults(content: Content, folder: Path) -> Iterator[Fault]:
    """Yield contradictions in a programme, or in one of its cases."""
    top = ContentNode((), content)
    for key in IN_PLACE_OF_TESTS:
        if key in content:
            yield top.at(key).fault("not allowed with tests: each of them has its own")
    tests = top.at(TESTS).entries
    yield from name_faults(tests)
    yield from _use_faults(tests)
    if any(test.at("kind").text == SATURATION for test in tests):
        content = with_bases(content, BASES_TO_COME)
    based = ContentNode((), content).at(TESTS).entries
    yield from _machine_faults(based, kind_of(top.at("plant").content))
    machine = (index for index, _ in tests_of_kind(content, STEADY, REJECTION))
    for inner in (
        common_content(content),
        *(machine_content(content, index) for index in machine),
        bump_content(content),
    ):
        yield from _faults_of_case(inner, folder)


def _use_faults(tests: list[ContentNode]) -> Iterator[Fault]:
    """Yield a validation of a fit that there is not."""
    bumps = [test for test in tests if test.content.get("kind", BUMP) == BUMP]
    if bumps and all(test.at("use").text == "validate" for test in bumps):
        yield bumps[0].at("use").fault("no bump test is fitted that it could validate")


def _machine_faults(tests: list[ContentNode], kind: PlantKind) -> Iterator[Fault]:
    """Yield contradictions in the tests of the machine, or that there is no machine."""
    for test in tests:
        of_test = test.at("kind").text
        if of_test in (SATURATION, STEADY, REJECTION) and not kind.has_machine:
            yield test.at("kind").fault(f"not allowed with plant {kind.name}: it has no machine")
        elif of_test == SATURATION:
            yield from saturation_test_faults(test)
        elif of_test == STEADY:
            yield from steady_test_faults(test)


def _faults_of_case(inner: CaseContent, folder: Path) -> Iterator[Fault]:
    faults: list[Fault] = []
    parts = parts_of(inner.content, folder, faults)
    ties = ties_of(inner.content, parts, faults)
    for fault in (*faults, *contradictions(inner.content, parts, ties)):
        placed = inner.in_file(fault)
        if placed is not None:
            yield placed


@dataclass(frozen=True)
class ProgrammeStep:
    """A test that is run by itself, or all bump tests, which are fitted together.

    ``name`` is that of its folder, ``tests`` are the names of its tests.
    """

    name: str
    kind: str
    tests: tuple[str, ...]


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
