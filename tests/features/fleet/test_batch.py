"""A batch: every case is a row, what is done is kept, and parts and runs need only the folder."""

import shutil
import signal
from pathlib import Path

import pytest
from batches import Events, case_file, record_file, table_of, troubled
from programmes import programme_content, written
from tiers import few_of

import exfit
from exfit.errors import ExfitError
from exfit.features.fleet.batch import tables_of
from exfit.features.fleet.folder import CaseOutcome, write_outcome
from exfit.features.fleet.local import in_this_process as here
from exfit.features.fleet.table import report_file
from exfit.features.fleet.task import CHANGED, files_of
from exfit.features.programme.folder import load_summary
from exfit.util.typed import plain

NAMES = ("a", "b", "c", "d")


@pytest.fixture
def cases(tmp_path, monkeypatch):
    """Work in a folder with four small cases, each with a record of its own."""
    monkeypatch.chdir(tmp_path)
    for seed, name in enumerate(NAMES):
        case_file(Path(f"cases/{name}.yaml"), record_file(tmp_path / f"records/{name}.csv", seed))
    return Path("cases")


def run(cases="cases", folder="fleet", **settings):
    """Run a batch in this process; return its fleet and its events."""
    events = Events()
    return exfit.batch(cases, folder, compute=here, observer=events, **settings), events


def test_a_batch_fits_every_case_as_it_is_fitted_alone(cases):
    fleet, events = run(workers=3)
    assert events.events[0] == ("begun", 4, 3)
    assert events.of("started") == events.of("done") == [f"{name}.yaml" for name in NAMES]
    for case in fleet.cases:
        result, alone = exfit.load_result(fleet.folder_of(case)), exfit.fit(fleet.path_of(case))
        assert result.values == alone.values
        assert result.cost == alone.cost
    assert [case.name for case in fleet.of_run] == [*NAMES]


def test_what_is_done_is_not_fitted_again(cases):
    first, _ = run()
    before = {path: path.stat().st_mtime_ns for path in Path("fleet").rglob("*.*")}
    again, events = run()
    assert events.of("started") == []
    assert len(events.of("kept")) == 4
    assert {path: path.stat().st_mtime_ns for path in Path("fleet").rglob("*.*")} == before
    assert table_of("fleet") == table_of(first.folder)
    assert not again.interrupted


def test_what_has_changed_is_fitted_again_and_nothing_else(cases):
    run()
    record_file(Path("records/b.csv").absolute(), seed=17)
    fleet, events = run()
    assert events.of("started") == ["b.yaml"]
    assert len(fleet.cases) == 4


def test_other_settings_are_other_fits(cases):
    run("cases/a.yaml")
    _, events = run("cases/a.yaml", strategy="dgn")
    assert events.of("started") == ["a.yaml"]


def test_equal_cases_are_fitted_once(cases):
    shutil.copy("cases/a.yaml", "cases/twin.yaml")
    fleet, events = run()
    assert len(events.of("started")) == 4
    assert events.of("kept") == ["twin.yaml"]
    rows = {case.name: case for case in fleet.cases}
    assert rows["twin"].key == rows["a"].key
    assert rows["twin"].parameters == rows["a"].parameters


def test_bad_cases_are_rows_with_their_reasons_and_the_rest_goes_on(cases, monkeypatch, tmp_path):
    monkeypatch.setenv("EXFIT_CONFIG", str(tmp_path / "configuration"))  # nothing is trusted
    Path("cases/own.py").touch()
    Path("cases/bad.yaml").write_text("model: SEXS\nplant: {type: open-circuit}\nrecord: 4\n")
    Path("cases/gone.yaml").write_text("model: SEXS\nrecord: {file: gone.csv}\n")
    Path("cases/no.yaml").write_text("model: SEXS\nplant: {type: open-circuit}\n")
    case_file(Path("cases/own.yaml"), "r.csv", model="own.py")
    fleet, events = run()
    states = {case.name: case.status for case in fleet.cases}
    assert states == {
        **dict.fromkeys(NAMES, "done"), "bad": "failed", "gone": "failed", "no": "no record",
        "own": "refused",
    }  # fmt: skip
    assert all(case.reason for case in fleet.cases)
    _, events = run()
    assert len(events.of("kept")) == 6  # those that failed, too
    _, events = run(retry_failed=True)
    assert events.of("started") == events.of("failed") == ["bad.yaml", "gone.yaml"]


def test_code_runs_only_in_a_batch_that_trusts_it(cases, monkeypatch, tmp_path):
    monkeypatch.setenv("EXFIT_CONFIG", str(tmp_path / "configuration"))  # nothing is trusted
    Path("cases/own.py").write_text("from pathlib import Path\nPath('ran').touch()\n")
    case_file(Path("cases/own.yaml"), record_file(tmp_path / "r.csv"), model="own.py")
    fleet, _ = run("cases/own.yaml")
    assert not Path("ran").exists()
    assert "--trust" in fleet.cases[0].reason
    fleet, _ = run("cases/own.yaml", trust=True)
    assert Path("ran").exists()
    assert fleet.cases[0].status == "failed"  # it is no model


@pytest.mark.long
@pytest.mark.parametrize("parts", few_of([2, 4], 1))
def test_parts_come_to_the_same_as_one_run(cases, parts):
    run(folder="whole")
    tables = []
    for number in range(parts):
        run(folder="parted", part=(number + 1, parts), write_tables=tables.append)
    assert table_of("parted") == table_of("whole")
    assert len(tables[-1].cases) == 4
    assert sum(len(fleet.run) for fleet in tables) == 0  # of tables of the folder as a whole
    assert len(run(folder="parted", part=(1, parts))[0].of_run) == 4 // parts


@pytest.mark.long
def test_an_interruption_keeps_what_is_done_and_the_next_run_goes_on(cases):
    def interrupted(files, begin, end):
        def stop(case, outcome):
            end(case, outcome)
            raise KeyboardInterrupt

        here(files, begin, stop)

    tables = []
    fleet = exfit.batch("cases", "fleet", compute=interrupted, write_tables=tables.append)
    assert fleet.interrupted
    assert [case.status for case in fleet.cases] == ["done", "not run", "not run", "not run"]
    assert len(tables) == 1
    _, events = run()
    assert events.of("started") == ["b.yaml", "c.yaml", "d.yaml"]
    run(folder="whole")
    assert table_of("fleet") == table_of("whole")


@pytest.mark.parametrize("number", ["SIGTERM", "SIGHUP"])
def test_a_termination_is_an_interruption(cases, number):
    if not hasattr(signal, number):
        pytest.skip("a signal of POSIX")
    former = signal.signal(getattr(signal, number), signal.SIG_DFL)

    def terminated(*_):
        signal.raise_signal(getattr(signal, number))

    try:
        assert exfit.batch("cases", compute=terminated).interrupted
    finally:
        signal.signal(getattr(signal, number), former)


def test_a_case_that_changes_while_it_is_fitted_is_not_run(cases):
    def edited(files, begin, end):
        for case in files:
            end(case, CaseOutcome(changed=CHANGED))

    fleet = exfit.batch("cases/a.yaml", compute=edited)
    assert (fleet.cases[0].status, fleet.cases[0].reason) == ("not run", CHANGED)
    assert run("cases/a.yaml")[1].of("done") == ["a.yaml"]


@pytest.mark.long
def test_a_case_that_another_run_has_done_meanwhile_is_not_begun(cases):
    run(folder="other")

    def late(files, begin, end):
        case = next(files)
        shutil.copytree(Path("other") / case.entry.key, case.task.folder)
        assert not begin(case)

    events = Events()
    fleet = exfit.batch("cases/a.yaml", compute=late, observer=events)
    assert fleet.cases[0].status == "done"
    assert events.of("kept") == ["a.yaml"]


@pytest.mark.long
def test_a_table_is_written_again_if_something_was_added_meanwhile(cases):
    fleet, _ = run()
    row = fleet.cases[0]
    files = {"result.json": (fleet.folder_of(row) / "result.json").read_text()}
    written = []

    def write(fleet):
        written.append(len([case for case in fleet.cases if case.status == "done"]))
        if len(written) == 1:  # another run ends a case between the look and the table
            write_outcome(fleet.folder, "f" * 32, CaseOutcome(files, row))

    shutil.rmtree("fleet/index")
    run("cases/a.yaml")
    tables_of(Path("fleet"), write)
    assert len(written) == 2


@pytest.mark.long
def test_a_table_that_is_outrun_is_left_to_the_run_that_goes_on(cases):
    run()
    written = []

    def write(fleet):
        written.append(fleet)
        Path(f"fleet/index/{len(written)}.json").write_text("{}")

    tables_of(Path("fleet"), write)
    assert 1 < len(written) < 10


def test_a_crash_is_a_row(cases, tmp_path):
    case_file(Path("cases/a.yaml"), record_file(tmp_path / "r.csv"), about={"Unit": "large"})
    fleet, _ = run(further=[troubled])
    states = [case.status for case in fleet.cases]
    assert states == ["crashed", "done", "done", "done"]
    assert fleet.cases[0].reason.startswith("MemoryError")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"part": (4, 3)}, "part 4/3: must be 1/N ... N/N"),
        ({"workers": -1}, "workers: -1 must be 0 or more"),
        ({"time_limit": 0.0}, "time limit: 0 s must be above 0"),
        ({"time_limit": float("nan")}, "time limit"),
        ({"strategy": "newton"}, "strategy: newton"),
        ({"search": "globally"}, "search: globally .*did you mean global"),
        ({"cases": "nowhere"}, "nowhere: cannot be read"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_is_written(cases, settings, message):
    with pytest.raises(ExfitError, match=message):
        run(**{"cases": "cases", **settings})
    assert not Path("fleet").exists()


def test_a_folder_that_cannot_be_written_is_refused(cases):
    Path("fleet").write_text("")
    with pytest.raises(ExfitError, match="cannot be written"):
        run()


@pytest.mark.long
def test_a_programme_is_a_row_with_the_files_of_all_its_tests(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = written(programme_content(), tmp_path)
    fleet, events = run(str(file), further=(report_file,))
    alone = exfit.run(file, "alone")
    (row,) = fleet.cases
    assert (row.status, row.verdict, row.holds) == ("done", "good", alone.holds)
    place = fleet.folder_of(row)
    assert load_summary(place).fit.values == alone.fit.values
    assert exfit.load_result(fleet.fit_of(row)).cost == alone.fit.cost
    assert "Test programme" in (place / "report.html").read_text(encoding="utf-8")
    assert row.parameters["machine.S12"].fitted
    assert row.parameters["KPR"].value == alone.fit.values["KPR"]
    _, events = run(str(file))
    assert (events.of("started"), events.of("kept")) == ([], ["unit.yaml"])
    (place / "summary.json").unlink()
    assert table_of("fleet") == [{**plain(row, whole=True), "seconds": None}]


@pytest.mark.long
def test_the_file_that_says_that_a_programme_is_done_is_written_last(tmp_path):
    for name in ("a/result.json", "programme.json", "v-curve/result.json"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("{}")
    assert [*files_of(tmp_path)] == ["a/result.json", "v-curve/result.json", "programme.json"]


def test_a_programme_of_which_a_test_fails_has_failed_with_its_reason(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    content = programme_content()
    content["tests"][0]["file"] = str(tmp_path / "gone.csv")
    fleet, _ = run(str(written(content, tmp_path)))
    assert fleet.cases[0].status == "failed"
    assert "gone.csv" in fleet.cases[0].reason


def test_without_workers_a_batch_fits_in_this_process(cases):
    fleet = exfit.batch(cases, "fleet", workers=0)
    assert [case.status for case in fleet.cases] == ["done"] * len(NAMES)


def test_an_interruption_without_workers_keeps_what_is_done(cases):
    def interrupted(result, folder):
        if result.case.stem == "c":
            raise KeyboardInterrupt
        return ()

    fleet = exfit.batch(cases, "fleet", workers=0, further=[interrupted])
    assert fleet.interrupted
    states = {case.name: case.status for case in fleet.cases}
    assert states == {"a": "done", "b": "done", "c": "not run", "d": "not run"}
    again = exfit.batch(cases, "fleet", workers=0)
    assert {case.status for case in again.cases} == {"done"}
