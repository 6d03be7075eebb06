"""Output that fails keeps no command from its files, and ends none with a traceback."""

import errno
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from cases import FILES_OF_A_FIT, TIME, TRUTH
from places import ROOT
from tiers import few_of

from exfit import cli
from exfit.cli.streams import Outlet, output_is_lost, unfailing_output

CASE = ROOT / "configs" / "first_order.yaml"
TABLES = {name for name in FILES_OF_A_FIT if not name.endswith(".png")}
# every command with what makes it print, and a file that it leaves
COMMANDS = {
    "fit": ([CASE, "--search", "local", "--no-plots"], "runs/first_order-fit/result.json"),
    "fit --json": (
        [CASE, "--search", "local", "--no-plots", "--json"],
        "runs/first_order-fit/result.json",
    ),
    "simulate": ([CASE, "--no-plots"], "runs/first_order-simulate/response.csv"),
    "validate": (
        [CASE, "--no-plots", "--parameters", "values.yaml"],
        "runs/first_order-validate/validation.json",
    ),
    "check": ([CASE], None),
    "profile": ([CASE, "--no-plots"], "runs/first_order-profile/profile.json"),
    "identify": ([CASE, "--no-plots"], "runs/first_order-identify/identify.json"),
    "inspect": (["vt.csv", "--no-plots"], "runs/vt.csv-inspect/inspect.json"),
    "new": (["--model", "AC1A", "--record", "vt.csv", "-o", "new.yaml"], "new.yaml"),
    "compare": (["vt.csv", "vt.csv", "--no-plots"], "runs/compare/compare.json"),
    "models": ([], None),
    "schema": ([], None),
    "--help": ([], None),
}


class Failing(io.RawIOBase):
    """A file to which nothing can be written."""

    def __init__(self, number):
        self.number = number

    def writable(self):
        return True

    def write(self, data):
        raise OSError(self.number, os.strerror(self.number))


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch):
    """Work in a folder with a record and values."""
    monkeypatch.chdir(tmp_path)
    rows = (f"{t:.6g},{1.0 + 0.1 * v:.9g}" for t, v in zip(TIME, TRUTH, strict=True))
    Path("vt.csv").write_text("\n".join(["time (s),vt", *rows]) + "\n")
    Path("values.yaml").write_text("parameters: {k: 4.0, a: 2.0}\n")


@pytest.fixture
def run(monkeypatch):
    """Return a function that runs a command with given streams: its code, and its errors."""

    def command(out, arguments, err=None):
        heard = io.BytesIO()
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr(sys, "stderr", err or io.TextIOWrapper(heard, "utf-8"))
        with pytest.raises(SystemExit) as ended:
            cli.main(args=[str(word) for word in arguments], prog_name="exfit")
        assert sys.stdout is out
        return int(ended.value.code or 0), heard.getvalue().decode()

    return command


def words(name):
    return [*name.split(), *COMMANDS[name][0]]


def failing(number):
    return io.TextIOWrapper(io.BufferedWriter(Failing(number)), "utf-8")


@pytest.mark.parametrize("name", few_of(COMMANDS, 5))
def test_a_reader_that_has_seen_enough_is_a_warning(run, name):
    code, errors = run(failing(errno.EPIPE), words(name))
    assert code == 0
    assert errors == "Warning: standard output: Broken pipe: not all of it was written\n"
    left = COMMANDS[name][1]
    assert left is None or Path(left).is_file()


@pytest.mark.parametrize("name", few_of(COMMANDS, 5))
def test_a_full_device_is_an_error_but_costs_no_file(run, name):
    code, errors = run(failing(errno.ENOSPC), words(name))
    assert code == 1
    assert errors == (
        "Error: standard output: No space left on device: not all of it was written\n"
    )
    left = COMMANDS[name][1]
    assert left is None or Path(left).is_file()


@pytest.mark.parametrize("name", few_of(["fit --json", "fit", "schema"], 1))
def test_nobody_may_be_listening_at_all(run, name):
    closed, full = failing(errno.EPIPE), failing(errno.ENOSPC)
    assert run(None, words(name), closed) == (0, "")
    assert run(closed, words(name), closed) == (0, "")
    assert run(full, words(name), full) == (1, "")


@pytest.mark.long
def test_the_code_of_a_fit_that_did_not_converge_stays_where_its_output_is_lost(run):
    hurried = {
        **yaml.safe_load(CASE.read_text()),
        "validate": [],
        "estimate": {"search": "local", "iterations": 1},
    }
    hurried["record"]["file"] = str(ROOT / "sample_data" / "first_order.csv")
    Path("hurried.yaml").write_text(yaml.safe_dump(hurried))
    code, _ = run(failing(errno.ENOSPC), ["fit", "hurried.yaml", "--no-plots"])
    assert code == 3


@pytest.mark.parametrize(
    "encoding",
    ["cp1252", *(pytest.param(other, marks=pytest.mark.long) for other in ("ascii", "utf-8"))],
)
@pytest.mark.parametrize("name", few_of(COMMANDS, 5))
def test_an_encoding_that_lacks_characters_ends_no_command(run, name, encoding):
    out = io.BytesIO()
    assert run(io.TextIOWrapper(out, encoding), words(name)) == (0, "")
    assert out.getvalue().decode(encoding)


@pytest.mark.parametrize("name", ["models", "check"])
def test_the_locale_c_ends_no_command(run, name):
    """There Python gives streams an error handler that knows undecodable names only."""
    out = io.BytesIO()
    stream = io.TextIOWrapper(out, "ascii", errors="surrogateescape")
    assert run(stream, words(name) if name != "models" else ["models", "AC1A"]) == (0, "")
    assert b"?" in out.getvalue() or name == "check"


def test_nobody_is_asked_where_standard_input_is_closed(run, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    assert run(io.TextIOWrapper(io.BytesIO(), "utf-8"), words("new")) == (0, "")
    assert "?" in Path("new.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-8"])
def test_json_holds_every_character_in_every_encoding(run, encoding):
    name, out = "試 ä.csv", io.BytesIO()
    Path("vt.csv").rename(name)
    code, _ = run(io.TextIOWrapper(out, encoding), ["inspect", name, "--no-plots", "--json"])
    assert code == 0
    assert name in json.loads(out.getvalue().decode(encoding)).values()


def test_a_case_on_standard_output_is_utf_8_as_a_case_is_read(run):
    name, out = "試 ä.csv", io.BytesIO()
    Path("vt.csv").rename(name)
    arguments = ["new", "--model", "AC1A", "--record", name]
    assert run(io.TextIOWrapper(out, "cp1252"), arguments)[0] == 0
    assert yaml.safe_load(out.getvalue().decode("utf-8"))["record"]["file"] == name


def test_an_outlet_hands_all_on_until_it_fails():
    target = io.BytesIO()
    outlet = Outlet(target)
    assert outlet.write(b"abc") == 3
    assert (target.getvalue(), outlet.fault) == (b"abc", None)
    outlet.target = Failing(errno.EPIPE)
    assert outlet.write(b"de") == 2
    outlet.target = target
    assert outlet.write(b"f") == 1
    assert target.getvalue() == b"abc"
    assert outlet.fault.errno == errno.EPIPE


def test_a_run_that_goes_on_can_ask_whether_anybody_listens(monkeypatch):
    monkeypatch.setattr(sys, "stdout", failing(errno.EPIPE))
    with unfailing_output():
        assert not output_is_lost()
        print("anybody?", flush=True)
        assert output_is_lost()


@pytest.mark.long
def test_a_real_pipe_that_is_closed_costs_no_file_and_shows_no_traceback():
    reader, writer = os.pipe()
    os.close(reader)
    program = [sys.executable, "-c", "from exfit.cli import main; main()"]
    ran = subprocess.run(
        [*program, "fit", str(CASE), "--search", "local", "--no-plots", "-o", "run"],
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        timeout=120,
        check=False,
    )
    os.close(writer)
    assert ran.returncode == 0
    assert len(ran.stderr.splitlines()) == 1
    assert ran.stderr.startswith("Warning: standard output: ")
    assert {path.name for path in Path("run").iterdir()} == TABLES
