"""The command batch: its options, what it prints, its exit codes."""

import csv
import json
import re
from pathlib import Path

import pytest
from batches import case_file, record_file

from exfit.features.fleet import batch as batches
from exfit.features.fleet.local import in_this_process as here


@pytest.fixture(autouse=True)
def cases(empty_folder, monkeypatch):
    """Work in a folder with two small cases, which are fitted in this process."""
    monkeypatch.setattr(batches, "local_workers", lambda workers, time_limit: here)
    for seed, name in enumerate(("a", "b")):
        record = record_file(empty_folder / f"records/{name}.csv", seed)
        case_file(Path(f"cases/{name}.yaml"), record)


def rows():
    with Path("fleet/fleet.csv").open(encoding="utf-8-sig", newline="") as table:
        return [*csv.DictReader(table)]


def test_all_cases_are_fitted_and_the_table_is_written(run):
    done = run("batch", "cases")
    assert (done.code, done.err) == (0, "")
    assert [row["name"] for row in rows()] == ["a", "b"]
    assert {row["verdict"] for row in rows()} == {"good"}
    assert len([*Path("fleet").glob("*/result.json")]) == 2


def test_quiet_prints_nothing_and_json_one_document(run):
    assert run("batch", "cases", "-q")[1:] == ("", "")
    done = run("batch", "cases", "--json")
    content = json.loads(done.out)
    assert content["counts"] == {"done": 2}
    assert [case["name"] for case in content["cases"]] == ["a", "b"]
    assert "curves" not in content["cases"][0]


def test_a_case_without_a_fit_is_exit_code_1_and_a_poor_fit_3(run):
    poor = {"estimate": {"iterations": 1, "search": "local"}}
    record = record_file(Path("records/c.csv").absolute(), 9)
    case_file(Path("cases/c.yaml"), record, **poor)
    assert run("batch", "cases", "-q").code == 3
    Path("cases/d.yaml").write_text("model: SEXS\nrecord: 3\n")
    code, out, err = run("batch", "cases", "-q")
    assert (code, out) == (1, "")
    assert err.startswith("Error: cases/d.yaml:1: plant: is missing\n")  # said, however quiet
    for options in ([], ["--json"]):  # beside the table, for a script that reads standard error
        code, _, err = run("batch", "cases", *options)
        assert (code, err) == (1, "Error: cases without a fit: 1 of 4\n")
    assert run("batch", "cases/a.yaml", "-q").code == 0  # the others are not of this run
    assert len(rows()) == 4


def test_a_case_without_a_record_is_no_failure(run):
    Path("cases/c.yaml").write_text("model: SEXS\nplant: {type: open-circuit}\n")
    assert run("batch", "cases", "-q").code == 0
    assert rows()[2]["status"] == "no record"
    code, out, err = run("batch", "cases/c.yaml", "-q")  # nothing to fit at all
    assert (code, out) == (1, "")
    assert "cases/c.yaml: nothing to fit: the case has no record" in err


@pytest.mark.parametrize(("at_once", "code"), [(True, 130), (False, 3)])
def test_an_interruption_keeps_the_table(run, monkeypatch, at_once, code):
    def interrupted(files, begin, end):
        def stop(case, outcome):
            end(case, outcome)
            raise KeyboardInterrupt

        if at_once:
            raise KeyboardInterrupt
        here(files, begin, stop)

    monkeypatch.setattr(batches, "local_workers", lambda workers, time_limit: interrupted)
    done = run("batch", "cases", "-q")
    assert done.code == code
    statuses = [row["status"] for row in rows()]
    assert statuses == (["not run", "not run"] if at_once else ["done", "not run"])


def test_reports_are_written_for_earlier_fits_too(run):
    run("batch", "cases/a.yaml", "-q")
    assert not [*Path("fleet").glob("*/report.html")]
    assert run("batch", "cases", "--reports", "-q").code == 0
    reports = [*Path("fleet").glob("*/report.html")]
    assert len(reports) == 2
    assert all(b"</html>" in report.read_bytes() for report in reports)


def test_a_part_of_the_cases_is_given_by_its_number(run):
    for number in (1, 2):
        assert run("batch", "cases", "--part", f"{number}/2", "-q").code == 0
        assert len(rows()) == number


@pytest.mark.parametrize("part", ["3", "0/4", "5/4", "a/b", "1/0", "-1/4"])
def test_another_form_of_a_part_is_wrong_usage(run, part):
    done = run("batch", "cases", f"--part={part}")
    assert done.code == 2
    assert part in done.err


def test_what_does_not_exist_is_refused(run):
    done = run("batch", "nowhere")
    assert done.code == 1
    assert "nowhere: cannot be read" in done.err


@pytest.mark.long
def test_a_cluster_that_cannot_be_reached_is_a_line_and_the_table_is_there(run, monkeypatch):
    monkeypatch.setattr("exfit.features.fleet.dispatch.CONNECTED_WITHIN", 0.2)
    done = run("batch", "cases", "--scheduler", "127.0.0.1:1", "-q")
    assert done.code == 1
    # a busy machine may not even come to the refusal in so short a time
    assert re.fullmatch(
        r"Error: 127\.0\.0\.1:1: no connection: (Connection refused|Timed out .*)\n", done.err
    )
    assert {row["status"] for row in rows()} == {"not run"}
    done = run("batch", "cases", "--scheduler", "127.0.0.1:1", "--workers", "2")
    assert done.code == 2
    assert "--workers and --scheduler exclude each other" in done.err
