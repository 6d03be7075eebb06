"""A case file read and checked: every fault at once, each with its line."""

from os import PathLike
from pathlib import Path

from exfit.case.assembly import check_content
from exfit.case.case import Case
from exfit.case.yaml import Fault, YamlNode, read_text, read_yaml
from exfit.errors import CaseError
from exfit.util.text import Place, dotted

CaseOrPath = Case | str | PathLike[str]


def load_case(path: Path, model_sha256: str = "") -> Case:
    """Return the case of a YAML file.

    The file of a user's own model is run only if it has the hash ``model_sha256``, where one is
    given.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    return parse_case(read_text(path), path, model_sha256)


def parse_case(text: str, path: Path, model_sha256: str = "") -> Case:
    """Return the case of a YAML text, as if it stood in the file ``path``; raises CaseError."""
    top, faults = read_yaml(text, path)
    checked = check_content(top.value, path.parent, faults, model_sha256)
    if checked is None:
        raise faults_with_lines(faults, top, path)
    return Case.of(checked, path)


def faults_with_lines(faults: list[Fault], top: YamlNode, path: Path) -> CaseError:
    """Return the faults of a file as an error, in the order of their lines."""
    lines = [(fault.line or top.line_of(fault.place), fault) for fault in faults]
    # what an alias repeats is wrong once
    first: dict[tuple[int, Place, str], Fault] = {}
    for line, fault in sorted(lines, key=lambda pair: pair[0]):
        first.setdefault((line, fault.place[-1:], fault.text), fault)
    return CaseError(
        f"{path}:{line}: {dotted(fault.place)}: {fault.text}"
        for (line, _, _), fault in first.items()
    )
