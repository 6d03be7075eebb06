"""What a case file names, at a glance: read at once and without a check, faulty or not."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import read_text, read_yaml
from exfit.errors import CaseError
from exfit.util.files import siblings

NAMING_FILES = ("test", "record", "records", "validate", "tests", "criteria")
# the places of parameters, and how their names begin
SECTIONS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "": (("parameters", "free"), ("parameters", "fixed")),
    "machine.": (("plant", "free"), ("plant", "parameters")),
    "network.": (("plant", "network"),),
    "stabiliser.": (("stabiliser", "free"), ("stabiliser", "parameters")),
    "governor.": (("governor", "free"), ("governor", "parameters")),
    "governor.load_controller.": (
        ("governor", "load_controller", "free"),
        ("governor", "load_controller", "parameters"),
    ),
}


def files_of(case: Path) -> tuple[Path, ...]:
    """Return the case file and the files that it names, whether they exist or not: model, records.

    Of a file that cannot be read as YAML it is the case alone.
    """
    return (case, *(file for file in files_in(_content(case), case.parent) if file != case))


def files_in(content: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the files that the content of a case names: its model, its records, in a folder."""
    model = content.get("model")
    named = [model] if isinstance(model, str) and model.endswith(".py") else []
    named += [file for key in NAMING_FILES for file in _files(content.get(key))]
    named += [*scripts_of(command_of(content), folder), *fmu_of(content)]
    files = [part for name in named for part in _parts(folder / name)]
    return tuple(dict.fromkeys(files))


def command_of(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the command by which another program simulates a case, () where none does."""
    words = (entry.text for entry in _at(content, "plant", "command").entries)
    return tuple(word for word in words if word is not None)


def fmu_of(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the FMU that simulates a case, () where none does: no other plant has a file."""
    return tuple(_files(content.get("plant")))


def free_of(case: Path) -> tuple[str, ...]:
    """Return the names of the free parameters, in the order of the file."""
    return _names(_content(case), free=True)


def parameters_of(case: Path) -> tuple[str, ...]:
    """Return the names of all parameters that the file gives, in its order."""
    return _names(_content(case), free=False)


def keys_of(file: Path) -> frozenset[str]:
    """Return the keys at the top of a file; none where it cannot be read as YAML."""
    return frozenset(map(str, _content(file)))


def content_of(text: str, case: Path) -> Mapping[str, Any]:
    """Read the content of the text of a case; nothing where it is no YAML."""
    try:
        root, _ = read_yaml(text, case)
    except CaseError:
        return {}
    return root.value if isinstance(root.value, Mapping) else {}


def section_of(text: str, case: Path, key: str) -> Any:
    """Read the value of a top key in the text of a case; None where there is none."""
    return content_of(text, case).get(key)


def stabiliser_inputs(text: str, case: Path) -> tuple[str, ...]:
    """Return the input signals that the text of a case gives its stabiliser, () for its own."""
    inputs = _at(content_of(text, case), "stabiliser", "inputs").entries
    return tuple(str(entry.value) for entry in inputs)


def _content(case: Path) -> Mapping[str, Any]:
    try:
        return content_of(read_text(case), case)
    except CaseError:
        return {}


def _files(content: Any) -> Iterator[str]:
    """Yield the values of the keys ``file``, however deep."""
    if isinstance(content, Mapping):
        file = content.get("file")
        if isinstance(file, str) and "\0" not in file:
            yield file
        content = list(content.values())
    if isinstance(content, list):
        for entry in content:
            yield from _files(entry)


def scripts_of(command: Sequence[str], folder: Path) -> list[str]:
    """Return the words of a command that are files, such as a script.

    A program by its absolute path is none: it is a Python, or an installed tool.
    """
    program, arguments = command[:1], command[1:]
    own = [word for word in program if not Path(word).is_absolute()]
    return [word for word in (*own, *arguments) if (folder / word).is_file()]


def _parts(file: Path) -> Iterator[Path]:
    """Yield a file, and the other part of a COMTRADE record beside it."""
    yield file
    if file.suffix.lower() == ".cfg":
        yield from siblings(file, ".dat") or [file.with_suffix(".dat")]
    elif file.suffix.lower() == ".dat":  # without a configuration it is text
        yield from siblings(file, ".cfg")


def _names(content: Mapping[str, Any], free: bool) -> tuple[str, ...]:
    sections = [
        (prefix, _at(content, *place))
        for prefix, places in SECTIONS.items()
        for place in places
        if not free or place[-1] == "free"
    ]
    for limiter in _at(content, "limiters").entries:
        prefix = f"{limiter.at('model').text or ''}"[:3].lower()
        keys = ("free",) if free else ("free", "parameters")
        sections += [(f"{prefix}.", limiter.at(key)) for key in keys if prefix]
    return tuple(dict.fromkeys(prefix + name for prefix, own in sections for name in own.content))


def _at(content: Mapping[str, Any], *place: str) -> ContentNode:
    return ContentNode((), dict(content)).at(*place)
