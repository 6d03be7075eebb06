"""The page of licences, from the metadata of the packages that are installed.

    pip install ".[records,pdf,cluster,test,docs,develop]" && python docs/licences.py

writes licences.md: of what is installed with exfit and with each of its extras also what those
packages need in turn, on Linux, macOS and Windows; of the tools of its developers themselves.
"""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import PackageMetadata, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PAGE = Path(__file__).parent / "licences.md"
TOOLS = ("test", "docs", "develop")  # extras that no user of exfit installs
SYSTEMS = (
    {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix"},
    {"sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix"},
    {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt"},
)
# what the metadata of some packages leave out, as their files of licence have it
OF_LICENCE_FILES = {"axe-playwright-python": "MIT", "pyphen": "GPL-2.0+ or LGPL-2.1+ or MPL-1.1"}
LONGEST = 60  # characters: more is the text of a licence, not its name

Rows = dict[str, tuple[str, str]]  # package: why it is there, and its licence

HEAD = """\
# Licences

exfit itself is under the MIT licence, see `LICENSE`. This page lists the licences of the packages that `pip` installs with it,
as their own metadata name them; exfit contains no code of theirs. `python docs/licences.py` writes it.

A wheel may contain libraries of others beside its own code, with their licences in its `dist-info` folder: those of NumPy and
SciPy contain OpenBLAS (BSD) and the runtime of GNU Fortran (GPL with the exception for runtime libraries), that of llvmlite
contains LLVM (Apache-2.0 with the LLVM exception).

## What lies inside the files that exfit writes

| file | of others | licence, and where its notice is |
|---|---|---|
| `report.html` | the scripts of BokehJS, as the package bokeh brings them | BSD-3-Clause; the whole notice is the first comment of each script |
| | in BokehJS: numbro 1.6.2, jQuery Mousewheel 3.1.13 | MIT; comments in the script |
| `report.pdf` | subsets of fonts of the system that prints it, such as DejaVu Sans | those of the fonts; PDF files may contain all that usual systems bring |
| figures as PNG | shapes of the letters of DejaVu Sans, which Matplotlib brings | Bitstream Vera and Arev, free to embed |

The page of a report contains no fonts, and fetches none: its rules of security (CSP) forbid it.
"""


def page() -> str:
    """Return the page as Markdown."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {name: _direct(name, project) for name in project["optional-dependencies"]}
    base = _with_needed(map(Requirement, project["dependencies"]))
    parts = [HEAD, f"## Installed with exfit\n\n{_table(base)}"]
    for name, requirements in extras.items():
        if name not in TOOLS and requirements:
            further = _with_needed(requirements)
            rows = {package: row for package, row in further.items() if package not in base}
            parts.append(f"## With `exfit[{name}]`, in addition\n\n{_table(rows)}")
    tools = {
        canonicalize_name(requirement.name): _row(requirement)
        for name in TOOLS
        for requirement in extras[name]
    }
    parts.append(f"## Tools of the developers\n\n{_table(tools)}")
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _direct(extra: str, project: Mapping[str, object]) -> list[Requirement]:
    """Return what an extra names itself, without other extras of exfit."""
    groups: Mapping[str, list[str]] = project["optional-dependencies"]  # type: ignore[assignment]
    requirements = map(Requirement, groups[extra])
    return [requirement for requirement in requirements if requirement.name != "exfit"]


def _with_needed(direct: Iterable[Requirement]) -> Rows:
    """Return the rows of packages, and of all that they need in turn."""
    rows: Rows = {}
    waiting = []
    for requirement in direct:
        rows[canonicalize_name(requirement.name)] = _row(requirement)
        waiting.append(requirement)
    for parent in waiting:
        for requirement in _needed_by(parent):
            name = canonicalize_name(requirement.name)
            if name not in rows:
                rows[name] = f"of {parent.name}", licence(requirement.name)
                waiting.append(requirement)
    return rows


def _row(requirement: Requirement) -> tuple[str, str]:
    return str(requirement.specifier) or "any version", licence(requirement.name)


def _needed_by(parent: Requirement) -> Iterator[Requirement]:
    """Yield what a package needs on one of the systems, with the extras that are asked of it."""
    try:
        texts = distribution(parent.name).requires or []
    except PackageNotFoundError:
        return
    for requirement in map(Requirement, texts):
        environments = (
            {**system, "extra": extra} for system in SYSTEMS for extra in ("", *parent.extras)
        )
        if requirement.marker is None or any(map(requirement.marker.evaluate, environments)):
            yield requirement


def licence(name: str) -> str:
    """Return the licence of a package; raises PackageNotFoundError where it is not installed."""
    return OF_LICENCE_FILES.get(canonicalize_name(name)) or _named(distribution(name).metadata)


def _named(metadata: PackageMetadata) -> str:
    """Return the licence that metadata name: as an expression, in words, or by its class."""
    expression = metadata["License-Expression"] if "License-Expression" in metadata else ""
    words = " ".join((metadata["License"] if "License" in metadata else "").split())
    classes = [
        text.rpartition(" :: ")[2]
        for text in metadata.get_all("Classifier") or []
        if text.startswith("License ::")
    ]
    short = words if len(words) <= LONGEST else ""
    return expression or short or ", ".join(classes) or f"not named by {metadata['Name']}"


def _table(rows: Rows) -> str:
    lines = [("package", "version, or what needs it", "licence"), ("---",) * 3]
    lines += [(name, *cells) for name, cells in sorted(rows.items())]
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in lines)


def _cell(text: str) -> str:
    return re.sub(r"([*<>|])", r"\\\1", text)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
