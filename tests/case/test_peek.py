"""fit --watch: fits again when a file of the case changes, and a fault does not end it."""

import os
import re
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH

from exfit import cli
from exfit.case import watching
from exfit.case.peek import files_of, free_of, parameters_of

PATIENCE = 60  # s, until a test gives up; a fit of this case takes tenths of a second
CASE = {**FIRST_ORDER, "record": {"file": "up.csv", "time": "t", "channels": {"vt": "v"}}}
RUN = """\
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
from exfit.cli import main
main()
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Work in a folder with a case and its record."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EXFIT_CACHE", os.environ.get("EXFIT_CACHE", str(tmp_path / "cache")))
    write_record(TRUTH)
    write_case(CASE)
    return tmp_path


def write_record(samples):
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(TIME, samples, strict=True))
    replace_by("up.csv", "\n".join(["t,v", *rows]) + "\n")


def write_case(content):
    replace_by("case.yaml", content if isinstance(content, str) else yaml.safe_dump(content))


def replace_by(name, text):
    """Write a file as editors do: beside it, then in its place."""
    Path(f"{name}.new").write_text(text)
    Path(f"{name}.new").replace(name)


class Watched:
    """A running command, read line by line."""

    def __init__(self, process):
        self.process = process

    def until(self, pattern):
        """Return all lines up to one that holds a pattern."""
        seen = []
        for line in self.process.stdout:
            seen.append(line)
            if re.search(pattern, line):
                return "".join(seen)
        raise AssertionError(f"no {pattern!r} in:\n{''.join(seen)}")


@contextmanager
def watched(*arguments):
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "80"}
    with subprocess.Popen(
        [sys.executable, "-c", RUN, "fit", "case.yaml", "--watch", "--no-plots", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    ) as process:
        clock = threading.Timer(PATIENCE, process.kill)
        clock.start()
        try:
            yield Watched(process)
        finally:
            clock.cancel()
            process.kill()


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="sends a signal of POSIX")
def test_every_change_is_fitted_a_fault_waits_and_ctrl_c_ends_with_0(place):
    with watched() as run:
        first = run.until("watching case.yaml, up.csv; Ctrl-C ends")
        assert "verdict: " in first
        assert "before" not in first

        other = yaml.safe_load(yaml.safe_dump(CASE))
        other["parameters"]["free"]["k"]["start"] = 3.0
        write_case(other)
        second = run.until("watching")
        assert re.search("─ case.yaml changed, .*─", second)
        start, before, fitted = re.search(r"^k +(\S+) +(\S+) +(\S+)", second, re.M).groups()
        assert float(start) == 3.0
        assert float(before) == pytest.approx(4.0, rel=1e-4)
        assert float(fitted) == pytest.approx(4.0, rel=1e-4)

        write_case("model: [")
        assert "Error: case.yaml:" in run.until("watching case.yaml; Ctrl-C ends")

        write_case({**CASE, "record": {**CASE["record"], "file": "none.csv"}})
        assert "none.csv" in run.until("watching case.yaml, none.csv")

        write_case(CASE)
        assert "verdict: " in run.until("watching")

        write_record(np.where(TRUTH > 0.0, 0.5 * TRUTH, 0.0))
        last = run.until("watching")
        assert "up.csv changed" in last
        before, fitted = re.search(r"^k +\S+ +(\S+) +(\S+)", last, re.M).groups()
        assert float(before) == pytest.approx(4.0, rel=1e-4)
        assert float(fitted) == pytest.approx(2.0, rel=1e-4)

        run.process.send_signal(signal.SIGINT)
        rest, _ = run.process.communicate()
        assert "Traceback" not in rest
        assert run.process.returncode == 0


def test_given_values_hold_in_every_fit_and_their_file_is_watched(place, monkeypatch, capsys):
    def change_once(stamps):
        assert Path("values.yaml") in stamps
        if "k: 5.0" in Path("values.yaml").read_text():
            raise KeyboardInterrupt
        replace_by("values.yaml", "parameters: {k: 5.0, a: 2.0}\n")
        return (Path("values.yaml"),)

    replace_by("values.yaml", "parameters: {k: 3.0, a: 2.0}\n")
    monkeypatch.setattr(watching, "changed", change_once)
    given = ["--parameters", "values.yaml", "--set", "a=1.5"]
    with pytest.raises(SystemExit) as ended:
        cli.main(
            args=["fit", "case.yaml", "--watch", "--verbose", "--no-plots", *given],
            prog_name="exfit",
        )
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    assert re.findall(r"^k +(\S+)", printed, re.M) == ["3", "5"]
    assert re.findall(r"^a +(\S+)", printed, re.M) == ["1.5", "1.5"]
    assert printed.count("note: the fit starts from k") == 2


@pytest.mark.parametrize("option", ["--json", "--quiet"])
def test_watching_in_silence_is_refused(place, option, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(args=["fit", "case.yaml", "--watch", option], prog_name="exfit")
    assert ended.value.code == 2
    assert "--watch" in capsys.readouterr().err


def test_a_case_that_is_not_there_is_not_waited_for(place, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(args=["fit", "cose.yaml", "--watch"], prog_name="exfit")
    assert ended.value.code == 1
    assert "cose.yaml" in capsys.readouterr().err


def test_a_change_before_the_waiting_begins_is_seen(place):
    stamps = watching.stamps_of(Path("case.yaml"))
    write_record(0.5 * TRUTH)
    assert watching.changed(stamps) == (Path("up.csv"),)


def test_a_file_that_comes_or_goes_is_a_change(place):
    case = Path("case.yaml")
    Path("up.csv").unlink()
    stamps = watching.stamps_of(case)
    write_record(TRUTH)
    assert watching.changed(stamps) == (Path("up.csv"),)
    stamps = watching.stamps_of(case)
    Path("up.csv").unlink()
    assert watching.changed(stamps) == (Path("up.csv"),)


@pytest.mark.long
def test_a_change_in_a_folder_that_is_not_there_yet_is_waited_for(place):
    write_case({**CASE, "record": {**CASE["record"], "file": "later/up.csv"}})
    stamps = watching.stamps_of(Path("case.yaml"))

    def come():
        Path("later").mkdir()
        Path("up.csv").replace("later/up.csv")

    late = threading.Timer(0.3, come)
    late.start()
    assert watching.changed(stamps) == (Path("later/up.csv"),)
    late.join()


def test_a_case_names_its_model_and_all_its_records(place):
    write_case(
        {
            "model": "mine.py",
            "records": [
                {"name": "a", "record": {"file": "a.csv"}},
                {"record": {"file": "b/b.csv"}},
            ],
            "validate": [{"record": {"file": "c.csv"}}, {"record": {"file": "a.csv"}}],
        }
    )
    found = files_of(Path("case.yaml"))
    assert [str(one) for one in found] == ["case.yaml", "mine.py", "a.csv", "b/b.csv", "c.csv"]


@pytest.mark.parametrize(
    ("named", "beside", "found"),
    [
        ("a.cfg", "a.DAT", ["a.cfg", "a.DAT"]),
        ("a.cfg", "b.dat", ["a.cfg", "a.dat"]),
        ("a.dat", "a.cfg", ["a.dat", "a.cfg"]),
        ("a.dat", "a.csv", ["a.dat"]),
        ("there/a.cfg", "a.dat", ["there/a.cfg", "there/a.dat"]),
    ],
)
def test_both_parts_of_a_comtrade_record_are_named(place, named, beside, found):
    write_case({"record": {"file": named}})
    Path(beside).write_text("")
    assert [str(one) for one in files_of(Path("case.yaml"))] == ["case.yaml", *found]


@pytest.mark.parametrize(
    "text", ["", "[", "- 1", "record: 3", "parameters: [1]", "parameters: {free: {KA}}", "model: 1"]
)
def test_a_glance_at_any_text_does_no_harm(place, text):
    write_case(text)
    assert files_of(Path("case.yaml"))[0] == Path("case.yaml")
    assert set(free_of(Path("case.yaml"))) <= {"KA"}
    assert files_of(Path("nowhere.yaml")) == (Path("nowhere.yaml"),)


def test_a_glance_names_parameters_as_the_system_does(place):
    write_case(
        {
            "parameters": {"free": {"KA": {}, "TE": {}}, "fixed": {"KE": 1.0, "KA": 2.0}},
            "plant": {"parameters": {"Xd": 1.8}, "free": {"Tpd0": {}}, "network": {"X": 0.3}},
            "stabiliser": {"parameters": {"K1": 1.0}},
        }
    )
    case = Path("case.yaml")
    assert free_of(case) == ("KA", "TE", "machine.Tpd0")
    assert parameters_of(case) == (
        *("KA", "TE", "KE", "machine.Tpd0", "machine.Xd", "network.X", "stabiliser.K1"),
    )
