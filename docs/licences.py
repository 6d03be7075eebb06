"""The page of licences, from the metadata of the packages that are installed.

    pip install ".[records,pdf,cluster,test,docs,develop]" && python docs/licences.py

writes the tables of licences.md. What is installed with exfit, and with each of its extras, is
listed with all that it needs in turn on Linux, macOS and Windows; of the tools of developers only
what exfit itself names.
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
OF_LICENCE_FILES = {
    "axe-playwright-python": "MIT",
    "fmpy": "BSD-2-Clause",
    "pyphen": "GPL-2.0+ or LGPL-2.1+ or MPL-1.1",
}
LONGEST = 60  # characters: more is the text of a licence, not its name

Rows = dict[str, tuple[str, str]]  # package: why it is there, and its licence

BEGIN, END = "<!-- packages -->", "<!-- /packages -->"


def with_tables(page: str) -> str:
    """Return a page with the tables between their marks."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{tables()}\n\n{END}{after}"


def tables() -> str:
    """Return the tables of the packages as Markdown."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {name: _direct(name, project) for name in project["optional-dependencies"]}
    base = _with_needed(map(Requirement, project["dependencies"]))
    parts = [f"## Installed with exfit\n\n{_table(base)}"]
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
    return "\n\n".join(parts)


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
    expression = metadata.get("License-Expression", "")
    words = " ".join(metadata.get("License", "").split())
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
    text = with_tables(PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8", newline="\n")
