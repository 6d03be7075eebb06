"""What `--progress json` announces: the table of docs/commands.md, in strict JSON, to the end."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from places import CONFIGS, ROOT, SAMPLES
from tiers import few_of

from exfit.output import events

ALWAYS = {"event", "elapsed"}
CASE = CONFIGS / "ac1a_typical.yaml"
RECORD = SAMPLES / "ac1a_up.csv"
LOCAL = ("--search", "local", "--no-plots")


def documented():
    """Return the keys of each event, by the table of the page."""
    section = (ROOT / "docs" / "commands.md").read_text().partition("## Progress for programs")[2]
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", section.partition("\n## ")[0], re.MULTILINE)
    return {name: ALWAYS | {*re.findall(r"`(\w+)`", text)} for name, text in rows}


@pytest.mark.long
def test_the_example_of_the_page_prints_each_iteration(empty_folder):
    page = (ROOT / "docs" / "commands.md").read_text().partition("## Progress for programs")[2]
    example = re.search(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)[1]
    Path("configs").symlink_to(CONFIGS)
    places = [str(Path(sys.executable).parent), os.environ["PATH"]]
    ran = subprocess.run(
        [sys.executable, "-c", example],
        env={**os.environ, "PATH": os.pathsep.join(places)},
        capture_output=True,
        text=True,
        check=True,
    )
    history = json.loads(Path("runs/ac1a_typical-fit/result.json").read_text())["history"]
    printed = [line for line in ran.stdout.splitlines() if re.match(r"\d+ \d", line)]
    assert printed == [f"{line['number']} {line['cost']}" for line in history]


def refused(constant):
    raise AssertionError(f"{constant} is no JSON")


def announced(text):
    """Return the events of standard error, and the text behind them."""
    lines = text.splitlines()
    count = sum(line.startswith("{") for line in lines)
    read = [json.loads(line, parse_constant=refused) for line in lines[:count]]
    assert [event["event"] for event in read].count("end") == 1
    assert read[0]["event"] == "start"
    assert read[-1]["event"] == "end"
    elapsed = [event["elapsed"] for event in read]
    assert elapsed == sorted(elapsed)
    keys = documented()
    for event in read:
        if event["event"] == "iteration":  # of these the table names some
            assert keys["iteration"] - {"history"} <= {*event, "result", "json"}
        else:
            assert {*event} == keys[event["event"]]
    return read, "\n".join(lines[count:])


def of(read, name):
    return [event for event in read if event["event"] == name]


def test_the_last_iteration_is_that_of_the_result(run, empty_folder):
    silent = run("fit", CASE, "-o", "one", *LOCAL, "--progress", "none")
    ran = run("fit", CASE, "-o", "two", *LOCAL, "--progress", "json")
    read, after = announced(ran.err)
    assert after == silent.err == ""
    assert ran.out == silent.out.replace("one", "two")
    history = json.loads(Path("two/result.json").read_text())["history"]
    iterations = of(read, "iteration")
    assert len(iterations) == len(history)
    for event, line in zip(iterations, history, strict=True):
        assert {**line, **event} == event
    (done,), (end,) = of(read, "done"), of(read, "end")
    assert done["run"] == iterations[0]["run"] == CASE.stem
    assert end["verdict"] == done["verdict"]
    assert (end["exit_code"], end["folder"], end["error"]) == (ran.code, "two", None)


@pytest.mark.parametrize("option", few_of(["--json", "--quiet"], 1))
def test_events_come_whatever_standard_output_has(run, empty_folder, option):
    plain_run = run("fit", CASE, *LOCAL, option)
    ran = run("fit", CASE, *LOCAL, option, "--progress", "json")
    read, _ = announced(ran.err)
    assert len(of(read, "iteration")) > 1
    seconds = re.compile(r'"seconds": [\d.]+')
    assert seconds.sub("", ran.out) == seconds.sub("", plain_run.out)


def test_a_fault_of_the_case_ends_it_and_its_text_follows(run, empty_folder):
    Path("case.yaml").write_text("model: none\n")
    ran = run("fit", "case.yaml", "--progress", "json")
    read, after = announced(ran.err)
    assert [event["event"] for event in read] == ["start", "end"]
    assert (ran.code, read[-1]["exit_code"]) == (1, 1)
    assert after.startswith("Error: ")
    assert read[-1]["error"].splitlines()[0] in after


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 3), (signal.SIGTERM, 143)])
def test_an_interrupted_fit_announces_its_end(run, empty_folder, monkeypatch, number, code):
    write = events.Events.write

    def interrupted(self, event, **content):
        write(self, event, **content)
        if content.get("number") == 2:
            signal.raise_signal(number)

    monkeypatch.setattr(events.Events, "write", interrupted)
    ran = run("fit", CASE, *LOCAL, "-o", "fit", "--progress", "json")
    read, _ = announced(ran.err)
    assert (ran.code, read[-1]["exit_code"]) == (code, code)
    assert read[-1]["verdict"] == "interrupted"
    assert Path("fit/result.json").exists()


def test_numbers_that_are_not_finite_are_null(capsys):
    watch = events.Events()
    watch.start("fit", [], [])
    watch.stage("case", "causes", 0, 1, float("nan"))
    watch.write("end", exit_code=0, verdict=float("inf"), folder=None, error=None)
    read, _ = announced(capsys.readouterr().err)
    assert read[1]["best_cost"] is read[2]["verdict"] is None


@pytest.mark.long
@pytest.mark.parametrize(
    ("command", "runs", "code"),
    [
        (("fit", CASE, *LOCAL, "--strategy", "dgn", "--strategy", "lm"), 2, 0),
        (("rank", CASE, *LOCAL, "--models", "AC1A,SEXS"), 2, None),
        (("batch", CASE, CONFIGS / "ac1a_good.yaml", "--search", "local", "--workers", "0"), 2, 0),
        (("run", CASE, "--no-plots"), 1, 0),
        (("profile", CASE, "KC", "--no-plots"), 0, 0),
        (("verify", RECORD, "--model", "AC1A", "--step", "0.05", "-o", "report.html"), 1, 0),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_every_command_announces_its_runs_and_its_end(run, empty_folder, command, runs, code):
    ran = run(*command, "--progress", "json")
    read, after = announced(ran.err)
    assert after == ""
    assert read[0]["command"] == command[0]
    assert str(command[1]) in read[0]["inputs"]
    assert len(of(read, "done")) == runs
    assert read[-1]["exit_code"] == ran.code
    assert code in (None, ran.code)
    assert read[-1]["folder"]
    assert len(of(read, "begin")) >= max(runs, 1)
    if command[0] == "batch":
        again, _ = announced(run(*command, "--progress", "json").err)
        assert len(of(again, "kept")) == runs
        assert of(again, "stage")[-1]["done"] == runs
