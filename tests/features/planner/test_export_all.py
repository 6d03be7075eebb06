"""export --all: a planner's file with what a batch has verified, and every other byte as it was."""

import csv
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from dynamics import SOUND
from places import ROOT

from exfit import workflows
from exfit.case.load import load_case
from exfit.features.fleet.folder import (
    CaseOutcome,
    IndexEntry,
    case_name,
    prepare_folder,
    summary_of,
    write_entry,
    write_outcome,
)
from exfit.results.io import result_text

BUSES = (101, 102, 103)
GOVERNOR = "{} 'IEEEG1', 1 0 0 .05  0.10 / governor\r\n"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Return a folder with a file of three units, the case of one of them, and its fit."""
    folder = tmp_path_factory.mktemp("fleet")
    unit = SOUND.replace("\n", "\r\n").replace(" 766 ", " 400. ")
    text = "".join(
        unit.replace("1 GENROU", f"{bus} GENROU").replace("1 ESAC1A", f"{bus} ESAC1A")
        + GOVERNOR.format(bus)
        for bus in BUSES
    )
    (folder / "units.dyr").write_bytes(f"// Prüfstand\r\n{text}/ the end".encode("latin-1"))
    (folder / "records").mkdir()
    shutil.copy(ROOT / "sample_data" / "ac1a_up.csv", folder / "records" / "102_1.csv")
    return folder


@pytest.fixture
def fleet(fitted, empty_folder, run):
    """Return the folder of a batch of all units, of which one has a record and a fit that holds."""
    shutil.copytree(fitted, empty_folder, dirs_exist_ok=True)
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records", "--step",
              "0.05")  # fmt: skip
    assert ran.code == 0, ran.err
    prepare_folder(Path("fleet"))
    for bus in BUSES:
        case = Path("cases", f"bus-{bus}-1.yaml")
        write_entry(Path("fleet"), IndexEntry(case_name(Path("fleet"), case), status="no record"))
    keep(fit_of(fitted))
    return Path("fleet")


@cache
def fit_of(folder):
    """Return the fit of the unit with a record, in a batch of the cases of a folder.

    A local search computes no intervals: KA, TE and TA get some, that of TA open above, which
    excludes the value as found.
    """
    result = workflows.fit(load_case(Path("cases", "bus-102-1.yaml")), search="local")
    known = dict(result.parameters)
    for name in ("KA", "TE", "TA"):
        ends = 0.9 * known[name].value, None if name == "TA" else 1.1 * known[name].value
        known[name] = replace(known[name], interval=ends)
    return replace(result, parameters=known)


def keep(result, key="a" * 32, bus=102):
    """Keep a fit in the folder of the batch."""
    outcome = CaseOutcome({"result.json": result_text(result)}, summary_of(result, key, 1.0))
    write_outcome(Path("fleet"), key, outcome)
    case = case_name(Path("fleet"), Path("cases", f"bus-{bus}-1.yaml"))
    write_entry(Path("fleet"), IndexEntry(case, key))


def changes_of(file="fitted.csv"):
    with Path(file).open(newline="") as table:
        return [*csv.DictReader(table)]


def test_what_a_fit_found_is_in_the_file_and_every_other_byte_as_it_was(run, fleet, fitted):
    result = fit_of(fitted)
    ran = run("export", "--all", fleet, "-o", "fitted.dyr")
    assert ran.code == 0, ran.err
    before, after = Path("units.dyr").read_bytes(), Path("fitted.dyr").read_bytes()
    start, end = before.index(b"102 ESAC1A"), before.index(b"102 'IEEEG1'")
    assert after[:start] == before[:start]
    assert after.endswith(before[end:])
    rows = changes_of()
    free = {name for name, each in result.parameters.items() if not each.of_record}
    undetermined = free - {"KA", "TE", "TA"}
    assert {row["parameter"] for row in rows} == free - undetermined
    (warning,) = ran.err.splitlines()
    told, _, named = warning.rpartition(": ")
    assert told == "Warning: bus-102-1: no closed interval, as found (--undetermined writes them)"
    assert sorted(named.split(", ")) == sorted(undetermined)
    assert {(row["bus"], row["id"], row["model"], row["case"]) for row in rows} == {
        ("102", "1", "ESAC1A", "bus-102-1")
    }
    for row in rows:
        assert float(row["after"]) == pytest.approx(result.values[row["parameter"]], rel=5.0001e-4)
        assert row["source"] == "fitted"
        interval = result.parameters[row["parameter"]].interval or (None, None)
        assert (row["low"], row["high"]) == tuple(
            "" if end is None else str(end) for end in interval
        )
    assert f"units changed: 1, values: {len(rows)}" in ran.out
    whole = run("export", "--all", "--undetermined", fleet, "-o", "whole.dyr")
    assert f"units changed: 1, values: {len(free)}" in whole.out
    assert {row["parameter"] for row in changes_of("whole.csv")} == free
    again = run("import", "fitted.dyr", "--bus", "102")
    assert f"KA: {float(rows[0]['after'])}" in again.out or rows[0]["parameter"] != "KA"


def test_a_unit_whose_fit_does_not_hold_is_named_and_left(run, fleet, fitted):
    keep(replace(fit_of(fitted), interrupted=True), key="b" * 32, bus=101)
    poor = run("export", "--all", fleet, "-o", "fitted.dyr")
    assert poor.code == 0
    assert "not changed: bus-101-1: not verified: interrupted" in poor.err
    assert {row["bus"] for row in changes_of()} == {"102"}
    keep(replace(fit_of(fitted), interrupted=True))
    none = run("export", "--all", fleet, "-o", "none.dyr")
    assert none.code == 1
    assert "units.dyr: no unit to change" in none.err
    assert not Path("none.dyr").exists()


def test_a_verified_unit_that_cannot_be_written_ends_with_1(run, fleet):
    text = Path("units.dyr").read_bytes()
    Path("since.dyr").write_bytes(text.replace(b"102 GENROU 1 6.0", b"102 GENROU 1 7.0"))
    ran = run("export", "--all", fleet, "-o", "fitted.dyr", "--dyr", "since.dyr")
    assert ran.code == 1
    assert (
        "bus-102-1: since.dyr:7: GENROU: changed since import: Tpd0 is 7, as found 6"
        in " ".join(ran.err.split())
    )


def test_the_planner_s_own_file_and_files_that_exist_are_kept(run, fleet):
    before = Path("units.dyr").read_bytes()
    ran = run("export", "--all", fleet, "-o", "units.dyr", "--force")
    assert (ran.code, Path("units.dyr").read_bytes()) == (1, before)
    assert "is the planner's file itself" in ran.err
    Path("fitted.csv").write_text("mine")
    ran = run("export", "--all", fleet, "-o", "fitted.dyr")
    assert "fitted.csv: exists already; --force overwrites it" in ran.err
    assert not Path("fitted.dyr").exists()


def test_the_file_must_be_one_that_the_cases_name(run, fleet):
    Path("units.dyr").rename("moved.dyr")
    ran = run("export", "--all", fleet, "-o", "fitted.dyr")
    assert (ran.code, "units.dyr: cannot be read" in ran.err) == (1, True)
    assert run("export", "--all", fleet, "-o", "fitted.dyr", "--dyr", "moved.dyr").code == 0


def test_a_batch_without_a_finished_fit_says_what_came_of_its_cases(run, fleet):
    case = case_name(Path("fleet"), Path("cases", "bus-102-1.yaml"))
    write_entry(Path("fleet"), IndexEntry(case, status="refused", reason="vt: missing"))
    ran = run("export", "--all", fleet, "-o", "fitted.dyr")
    assert (ran.code, ran.out) == (1, "")
    first, last = (line.strip() for line in ran.err.splitlines())
    assert first == "Error: bus-102-1: refused: vt: missing"
    assert last == "fleet: no case has a finished fit"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--all",), "Missing option '-o'"),
        (("--all", "-o", "x.dyr", "--bus", "1"), "not allowed with --all"),
        (("--dyr", "units.dyr"), "only with --all"),
    ],
)
def test_options_that_contradict_each_other_are_refused(run, fleet, options, says):
    ran = run("export", fleet, *options)
    assert ran.code == 2
    assert says in " ".join(ran.err.split())


def test_a_single_export_is_at_the_bus_where_the_unit_was_found(run, fleet):
    ran = run("export", fleet / ("a" * 32))
    assert "\n102  'GENROU'  1  " in ran.out
    assert "\n7  'GENROU'  1  " in run("export", fleet / ("a" * 32), "--bus", "7").out
