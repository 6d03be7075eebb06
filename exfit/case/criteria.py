"""The acceptance criteria of a case: those of its own section, or of the file that it names."""

from pathlib import Path

from exfit.case.load import faults_with_lines, validated
from exfit.case.schema import CriteriaSection
from exfit.case.yaml import Fault, read_text, read_yaml
from exfit.util.vocabulary import Criteria, Criterion

OF_CASE = "the case"


def criteria_of(section: CriteriaSection, folder: Path) -> Criteria:
    """Return the criteria of a section, or of its file, relative to a folder.

    Raises CaseError with all faults of that file.
    """
    source = section.source or OF_CASE
    if section.file is not None:
        path = folder / section.file
        section = _read(path)
        source = section.source or path.name
    rows = (Criterion(**dict(row)) for row in section.limits)
    return Criteria(tuple(rows), source, given=True)


def _read(path: Path) -> CriteriaSection:
    top, faults = read_yaml(read_text(path), path)
    section = validated(top.value, faults, CriteriaSection, ("criteria",))
    faults = [
        fault._replace(place=fault.place[1:]) if fault.place[:1] == ("criteria",) else fault
        for fault in faults
    ]
    if section is not None and section.file is not None:
        faults.append(Fault(("file",), "not allowed here: this is the file"))
    if faults or section is None:
        raise faults_with_lines(faults, top, path)
    return section
