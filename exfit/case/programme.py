"""A programme: all tests of a unit in one file, checked like a case; and its cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exfit.case.assembly import CheckedContent, validated_document
from exfit.case.case import Case
from exfit.case.checks.content import contradictions
from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import repeated_names
from exfit.case.load import faults_with_lines, parse_case
from exfit.case.parts import parts_of, ties_of
from exfit.case.programme_content import (
    IN_PLACE_OF_TESTS,
    TESTS,
    CaseContent,
    bump_content,
    common_content,
    rejection_content,
    rejections,
)
from exfit.case.schema import RecordedBump, RecordedRejection, TestOfProgramme
from exfit.case.schema.programme import BUMP
from exfit.case.yaml import Fault, read_text, read_yaml
from exfit.errors import CaseError


@dataclass(frozen=True, kw_only=True)
class Programme:
    """The tests of a unit, in the order of their file, and what they share.

    ``content`` is that of the file. A case is the programme of one test: ``single``, and the
    programme has no other test.
    """

    path: Path
    content: Mapping[str, Any]
    tests: tuple[TestOfProgramme, ...] = ()
    single: Case | None = None

    @property
    def bumps(self) -> tuple[RecordedBump, ...]:
        """The bump tests, in the order of the file."""
        return tuple(test for test in self.tests if isinstance(test, RecordedBump))

    @property
    def rejections(self) -> tuple[RecordedRejection, ...]:
        """The tests that determine data of the machine, in the order of the file."""
        return tuple(test for test in self.tests if isinstance(test, RecordedRejection))

    def shared_case(self) -> Case:
        """Return what all tests share, as a case without a record."""
        return self._case(common_content(dict(self.content)))

    def bump_case(self) -> Case | None:
        """Return the case of all bump tests; None where there are none."""
        if self.single is not None:
            return self.single
        return self._case(bump_content(dict(self.content))) if self.bumps else None

    def rejection_case(self, name: str) -> Case:
        """Return the case of a test that determines data of the machine."""
        names = [test.name for test in self.tests]
        return self._case(rejection_content(dict(self.content), names.index(name)))

    def _case(self, inner: CaseContent) -> Case:
        faults: list[Fault] = []
        content = {key: value for key, value in inner.content.items() if value != []}
        parts = parts_of(content, self.path.parent, faults)
        ties = ties_of(content, parts, faults)
        document = validated_document(content, faults)
        if document is None:  # of a file that changes meanwhile
            raise CaseError(f"{self.path}: {fault.text}" for fault in faults)
        return Case.of(CheckedContent(document, parts, ties), self.path)


def load_programme(path: Path) -> Programme:
    """Return the programme of a YAML file, which may be a case.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    text = read_text(path)
    top, faults = read_yaml(text, path)
    if TESTS not in top.value:
        return Programme(path=path, content=top.value, single=parse_case(text, path))
    document = validated_document(top.value, faults)
    places = {fault.place for fault in faults}
    for fault in programme_faults(top.value, path.parent):
        if fault.place not in places:
            faults.append(fault)
            places.add(fault.place)
    if faults or document is None:
        raise faults_with_lines(faults, top, path)
    return Programme(path=path, content=top.value, tests=document.programme)


def programme_faults(content: dict[str, Any], folder: Path) -> Iterator[Fault]:
    """Yield what contradicts itself in a programme, or in one of its cases."""
    top = ContentNode((), content)
    for key in IN_PLACE_OF_TESTS:
        if key in content:
            yield top.at(key).fault("not allowed with tests: each of them has its own")
    tests = top.at(TESTS).entries
    yield from repeated_names(tests)
    yield from _use_faults(tests)
    for inner in (common_content(content), bump_content(content), *rejections(content)):
        yield from _faults_of_case(inner, folder)


def _use_faults(tests: list[ContentNode]) -> Iterator[Fault]:
    """Yield a validation of a fit that there is not."""
    bumps = [test for test in tests if test.content.get("kind", BUMP) == BUMP]
    if bumps and all(test.at("use").text == "validate" for test in bumps):
        yield bumps[0].at("use").fault("no bump test is fitted that it could validate")


def _faults_of_case(inner: CaseContent, folder: Path) -> Iterator[Fault]:
    faults: list[Fault] = []
    parts = parts_of(inner.content, folder, faults)
    ties = ties_of(inner.content, parts, faults)
    for fault in (*faults, *contradictions(inner.content, parts, ties)):
        placed = inner.in_file(fault)
        if placed is not None:
            yield placed
