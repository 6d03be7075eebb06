"""The page of licences lists what is installed, and a report keeps the notices of what it holds."""

import importlib.util
import re
import tomllib

import pytest
from places import ROOT

from exfit.features.report.page import library

PAGE = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| ([a-z0-9.-]+) \| (.+?) \| (.+?) \|$", re.MULTILINE)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NAME = re.compile(r"[A-Za-z0-9._-]+")
NOTICE = (  # what the licence of BokehJS asks to be kept
    "Copyright (c) Anaconda, Inc., and Bokeh Contributors",
    "Redistribution and use in source and binary forms",
    'THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS"',
)


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


@pytest.mark.parametrize("script", library(), ids=["bokeh", "bokeh-api"])
def test_a_script_of_a_report_begins_with_its_notice(script):
    head = script[: script.index("*/")]
    for words in NOTICE:
        assert words in " ".join(head.split()).replace(" * ", " ")


def test_the_page_names_all_whose_notices_stand_in_the_scripts():
    comments = re.findall(r"/\*!(.*?)\*/", "".join(library()), re.DOTALL)
    firsts = {
        re.search(r"[A-Z]?[A-Za-z]{2,}(?: [A-Z]\w+)*", text.replace("\\n", ""))[0]
        for text in comments
    }
    assert "numbro" in firsts
    assert {name for name in firsts - {"Copyright"} if name not in PAGE} == set()
