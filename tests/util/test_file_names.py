"""Names that become files: what no system holds, and what is taken."""

import pytest

from exfit.features.compare import files as compare
from exfit.features.design import files as design
from exfit.features.rank import ranking_output as rank
from exfit.features.report.writing import PAGE
from exfit.features.translate import files as translate
from exfit.output import run_folder
from exfit.util.file_names import (
    OWN_NAMES,
    WHOLE_PROGRAMME,
    files_named_after,
    taken_names,
    unusable,
)


@pytest.mark.parametrize(
    "name",
    ["con", "CON", "Con.txt", "nul.", "aux.a.b", "prn", "com1", "COM9.csv", "lpt1", "com\u00b9",
     "LPT\u00b3.x", "con .txt", "CONIN$"],
)  # fmt: skip
def test_a_device_of_windows_is_no_name_with_any_ending(name):
    assert "is a device of Windows" in unusable(name)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("up.", "ends with a dot or a space"),
        ("up ", "ends with a dot or a space"),
        ("u" * 101, "longer than 100 characters"),
        ("a/b", "has '/'"),
        ("a\\b", "has '\\\\'"),
        ("a\0b", r"has '\x00'"),
        ("a\u202eb", r"has '\u202e'"),
        ("a:b", "has ':'"),
    ],
)
def test_what_some_system_cannot_hold_is_refused(name, reason):
    assert reason in unusable(name)


@pytest.mark.parametrize(
    "name", ["up", "up-5%-at-312s", "console", "com", "com10", "a.con", "é", "u" * 100]
)
def test_other_names_are_files_everywhere(name):
    assert unusable(name) is None
    assert [*taken_names([name])] == []


@pytest.mark.parametrize("name", OWN_NAMES)
def test_a_file_of_a_run_is_taken(name):
    for variant in (name, name.upper(), f"{name}.2"):
        assert [*taken_names([variant])] == [
            (0, "is taken by a file of every run: files are named after it")
        ]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("up", "up"),
        ("up", "UP"),
        ("up", "up-iterations"),
        ("up-iterations", "up"),
        ("up", "Up-lm"),
        ("Grün", "grün"),
        ("gru\u0308n", "grün"),
        ("strasse", "straße"),
    ],
)
def test_no_two_names_have_a_file_in_common(first, second):
    ((index, reason),) = taken_names([first, None, "other", second])
    assert index == 3
    assert f"is taken by {first!r}: the file " in reason


def test_every_name_that_is_taken_is_reported_and_thousands_take_no_time():
    names = ["con", "up", "result", "up", *(f"r{k}" for k in range(20_000)), "UP"]
    assert [index for index, _ in taken_names(names)] == [0, 2, 3, 20_004]


def test_all_that_is_written_beside_what_is_named_after_records_is_known():
    files = {*run_folder.FILES_OF_FIT, *run_folder.OF_FIT, *run_folder.OF_SIMULATION}
    files |= {*run_folder.OF_VALIDATION, *run_folder.OF_PROFILES, *run_folder.OF_INSPECTION}
    files |= {*run_folder.OF_SERIES, *compare.FILES, *design.FILES, *rank.FILES, *translate.FILES}
    files |= {WHOLE_PROGRAMME, PAGE, PAGE.replace("html", "pdf")}
    assert {name.partition(".")[0] for name in files} <= {*OWN_NAMES}


def test_what_is_named_after_a_record_is_what_a_fit_writes():
    assert {"up.csv", "up.png", "up-iterations.csv", "up-lm.png"} <= {*files_named_after("up")}
