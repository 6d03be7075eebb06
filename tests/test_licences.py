"""The page of licences lists what is installed."""

import importlib.util
import re
import tomllib

import pytest
from places import ROOT

PAGE = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| ([a-z0-9.-]+) \| (.+?) \| (.+?) \|$", re.MULTILINE)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NAME = re.compile(r"[A-Za-z0-9._-]+")


@pytest.fixture(scope="module")
def rows():
    """Return the cells of each package of the page."""
    return {name: (why, licence) for name, why, licence in ROW.findall(PAGE)}


def direct():
    """Yield the texts of all requirements that exfit names itself."""
    for texts in (PROJECT["dependencies"], *PROJECT["optional-dependencies"].values()):
        yield from (text for text in texts if not text.startswith("exfit["))


@pytest.mark.parametrize("text", sorted({*direct()}))
def test_the_page_lists_every_requirement_with_its_versions_and_licence(rows, text):
    name = NAME.match(text)[0]
    versions, licence = rows[name.lower().replace("_", "-")]
    stated = {part for part in text.removeprefix(name).split(",") if part}
    listed = versions.replace("\\", "")
    assert stated == ({*listed.split(",")} if stated else set()) or listed == "any version"
    assert licence
    assert "not named" not in licence


@pytest.mark.long  # the gate has all tools of the developers then
def test_the_page_lists_what_the_packages_that_are_installed_need():
    """Some may be of other versions than those that the page was made from: their names do."""
    pytest.importorskip("packaging")
    spec = importlib.util.spec_from_file_location("licences", ROOT / "docs" / "licences.py")
    licences = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(licences)
    try:
        made = licences.tables()
    except licences.PackageNotFoundError as missing:
        pytest.skip(f"{missing.name} is not installed")
    assert {row[0] for row in ROW.findall(made)} == {row[0] for row in ROW.findall(PAGE)}
