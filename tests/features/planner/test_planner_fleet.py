"""The three commands of a planner, in short: tests/studies/planner_fleet.py has 200 units."""

import csv
from pathlib import Path

import pytest
from dyr_words import changed_words
from planner_files import OWN, planner_file


@pytest.mark.long
def test_three_commands_bring_what_was_verified_into_the_planner_s_file(run, empty_folder):
    made = planner_file(empty_folder, units=len(OWN), recorded=2)
    ran = run("import", "--all", made.dyr, "-o", "cases", "--records", made.records,
              "--step", "0.05", "--base", "efd=1")  # fmt: skip
    assert ran.code == 0, ran.err
    assert len([*Path("cases").glob("*.yaml")]) == len(OWN)
    ran = run("batch", "cases", "-o", "fleet", "--workers", "1", "--quiet")
    assert ran.code == 0, ran.err
    ran = run("export", "--all", "fleet", "-o", "fitted.dyr")
    assert ran.code == 0, ran.err
    with Path("fitted.csv").open(newline="") as table:
        rows = [*csv.DictReader(table)]
    assert {int(row["bus"]) for row in rows} == made.truth.keys()
    before, after = made.dyr.read_bytes(), Path("fitted.dyr").read_bytes()
    written = sorted((float(row["before"]), float(row["after"])) for row in rows)
    assert sorted(changed_words(before.decode("latin-1"), after.decode("latin-1"))) == written
    for bus, piece in made.pieces.items():
        assert bus in made.truth or piece.encode("latin-1") in after
    for row in rows:
        truth = made.truth[int(row["bus"])].get(row["parameter"])
        if truth is not None and row["low"] and row["high"]:
            # ten standard errors of an interval of 95 %
            far = 2.5 * (float(row["high"]) - float(row["low"]))
            assert float(row["after"]) == pytest.approx(truth, abs=far)
