"""What is done with a mutant, and what must be true of it.

Either a command works, or it refuses its input: exit code 1 or 2, a message of less than 100 lines
and 10 kB, no traceback, no warning, no control character of a terminal, nothing written by halves.
"""

import io
import json
import os
import re
import shutil
import sys
import time
import traceback
import unicodedata
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from unittest import mock

from mutants import Mutant
from places import ROOT

from exfit import cli, read_fleet
from exfit.errors import ExfitError
from exfit.util.text import to_json

CODES = (0, 1, 2, 3)  # done, bad input, wrong usage, does not hold
REFUSED = (1, 2)
MOST_LINES, MOST_BYTES = 100, 10_000  # of a message
MOST_SECONDS = 20.0  # of processor time
# what moves a cursor, names a window or turns text around: C0 but newline and tab, C1, bidi
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
PLOTTED = 40  # one of so many records is drawn, too: figures take longer than all else
OUT = "out"
CONFIGURATION = "configuration"  # of the user: what is trusted comes and goes there
READ_FLEET = "read_fleet"  # of Python: no command reads the folder of a batch alone
CASE_OF_RECORD = """model: FIRST_ORDER
plant: {type: none}
test: {vt0: 1.0, vref: [{at: 1.0, step: 0.05}]}
record: {file: %s, time: t, channels: {vt: vt}}
parameters: {fixed: {k: 1.0, a: 1.0}}
"""


class Finding(NamedTuple):
    """What is wrong: its kind, the place in exfit that identifies it, and what is known of it."""

    kind: str
    place: str
    text: str


class Ran(NamedTuple):
    """A command that ran: its exit code, what it printed, what it raised."""

    arguments: tuple[str, ...]
    code: int | None
    out: str
    err: str
    fault: BaseException | None
    seconds: float


def commands(mutant: Mutant, folder: Path) -> Iterator[tuple[str, ...]]:
    """Yield the commands that are given a mutant whose files lie in a folder."""
    main, number = mutant.main, mutant.number
    plots = "--plots" if number % PLOTTED == 1 else "--no-plots"
    to = ("-o", OUT, plots)
    match mutant.kind:
        case "case":
            yield ("simulate", main, *to)
            if number % 4 == 0:
                yield ("check", main)
        case "extremes":
            yield from of_case(main, number, to)
        case "samples":
            (folder / "values.yaml").write_text("parameters: {k: 2.5, a: 2.5}\n")
            yield from of_case(main, number, to)
        case "criteria":
            (folder / "values.yaml").write_text("parameters: {k: 2.5, a: 2.5}\n")
            yield ("validate", "case.yaml", "--parameters", "values.yaml", *to)
        case "programme":
            yield ("check", main)
        case "programme-run":
            yield ("run", main, *to)
            yield ("report", OUT, "-o", f"{OUT}/report.html")
        case "parameters":
            yield ("simulate", "case.yaml", "--parameters", main, "-o", OUT, "--no-plots")
        case "result":
            yield ("report", main, "-o", f"{OUT}/report.html")
            yield ("export", main, "-o", f"{OUT}/unit.dyr")
            yield ("show", main, *([], ["--all"], ["--history"])[number % 3])
            if number % 10 == 0:
                yield ("translate", main, "--model", "SEXS", *to)
                yield ("compare", main, main, *to)
        case "programme-result":
            yield ("report", ".", "-o", f"{OUT}/report.html")
        case "text" | "comtrade":
            yield from of_record(main, folder, to)
        case "workbook" | "mat" | "parquet":  # each is read in a process that takes long to begin
            turn = number // 10 % 4  # of each ten: some are drawn of all commands
            yield [*of_record(main, folder, to)][turn]
        case "play-in":
            yield ("inspect", main, *to)
            (folder / "event.yaml").write_text(CASE_OF_EVENT)
            yield ("simulate", "event.yaml", "-o", OUT, "--no-plots")
        case "dyr" | "dyd":
            yield ("import", main, "-o", f"{OUT}/unit.yaml")
            bus, machine = ("101", "1") if number % 2 else ("7", "G2")
            yield ("import", main, "--bus", bus, "--id", machine, "-o", f"{OUT}/unit_{bus}.yaml")
            yield ("import", main, "--all", "-o", f"{OUT}/cases")
        case "power-flow":
            yield ("import", "unit.dyr", "--all", "--raw", main, "-o", f"{OUT}/cases")
        case "cases":
            yield ("import", "unit.dyr", "--all", "--records", main, "-o", f"{OUT}/cases")
        case "batch":
            yield (READ_FLEET, ".")
        case "tests":
            yield ("new", "--model", "AC1A", "--tests", main, "-o", f"{OUT}/new.yaml")
        case "trust":
            yield from ((("trust",), ("trust", "own.py"), ("trust", "--withdraw"))[number % 3],)
            yield ("simulate", main, "-o", OUT, "--no-plots", *(["--trust"] * (number % 2)))
        case "options":
            yield tuple(json.loads((folder / main).read_text(encoding="utf-8")))


def of_record(record: str, folder: Path, to: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the commands that read a recorder's file."""
    yield ("inspect", record, *to)
    yield ("new", "--model", "AC1A", "--record", record, "-o", f"{OUT}/new.yaml")
    (folder / "record.yaml").write_text(CASE_OF_RECORD % record)
    yield ("simulate", "record.yaml", "-o", OUT, "--no-plots")
    yield ("compare", record, record, "-o", f"{OUT}/compared", "--no-plots")


def of_case(case: str, number: int, to: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield one of the commands of a case, in turn; of a fit what shows it, too."""
    match number % 8:
        case 0:
            values = Path("values.yaml")
            given = ("--parameters", str(values)) if values.exists() else ("--as-found",)
            yield ("validate", case, *given, *to)
        case 1:
            yield ("identify", case, *to)
        case 2:
            yield ("profile", case, *to)
        case 3:
            yield ("rank", case, "--models", "FIRST_ORDER,SEXS", "--search", "local", *to)
        case 4:
            yield ("simulate", case, *to)
            yield ("check", case)
        case 5:
            yield ("fit", case, "--search", "local", "--json", *to)
            yield ("translate", OUT, "--model", "SEXS", "-o", f"{OUT}/other", "--no-plots")
        case 6:
            yield ("fit", case, "--search", "local", "-v", *to)
            yield ("report", OUT, "-o", f"{OUT}/report.html")
            yield ("show", OUT, "--all")
        case 7:
            yield ("fit", case, "--search", "local", "-q", *to)
            yield ("export", OUT, "-o", f"{OUT}/unit.dyr")
            yield ("compare", OUT, "record.csv", "-o", f"{OUT}/compared", "--no-plots")


CASE_OF_EVENT = """\
model: SEXS
plant: {type: grid-playback, machine: GENSAL, network: {f0: 60, P: 0.5, Q: 0.1}}
record: {file: event.plb, time: t, channels: {vt: vt, frequency: frequency}}
"""


def prepared(workplace: Path) -> Path:
    """Return a folder for mutants, with the sample records beside it."""
    samples = workplace / "sample_data"
    if not samples.exists():
        shutil.copytree(ROOT / "sample_data", samples, ignore=shutil.ignore_patterns("andes"))
    return workplace / "mutant"


class Tried(NamedTuple):
    """What came of a mutant: all that is wrong, whether each command refused it, seconds taken."""

    wrong: list[Finding]
    refused: bool
    seconds: float


def tried(mutant: Mutant, workplace: Path) -> Tried:
    """Return what exfit does with a mutant; works in a folder of its own, the current one then."""
    folder = prepared(workplace)
    shutil.rmtree(folder, ignore_errors=True)
    for name, data in mutant.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    os.chdir(folder)
    wrong: list[Finding] = []
    codes, seconds = [], 0.0
    for arguments in commands(mutant, folder):
        before = _listing(folder)
        with mock.patch.dict(os.environ, EXFIT_CONFIG=str(folder / CONFIGURATION)):
            ran = run(arguments)
        wrong += judged(ran)
        wrong += written(ran, folder, before)
        codes.append(ran.code)
        seconds += ran.seconds
    return Tried(wrong, all(code in REFUSED for code in codes), seconds)


def run(arguments: Sequence[str]) -> Ran:
    """Run a command in this process, without a terminal, with warnings as errors."""
    own = sys.stdin, sys.stdout, sys.stderr
    out, err = io.BytesIO(), io.BytesIO()
    fault: BaseException | None = None
    code: int | None = None
    began = time.process_time()
    sys.stdin = io.StringIO()
    sys.stdout, sys.stderr = (io.TextIOWrapper(b, "utf-8", write_through=True) for b in (out, err))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            if arguments[0] == READ_FLEET:
                print(to_json(read_fleet(arguments[1]).to_dict(), ascii_only=True))
                code = 0
            else:
                cli.main(args=list(arguments), prog_name="exfit")
    except ExfitError as refusal:
        code = 1
        print(f"Error: {refusal}", file=sys.stderr)
    except SystemExit as ended:
        code = int(ended.code or 0) if not isinstance(ended.code, str) else None
    except KeyboardInterrupt:
        raise
    except BaseException as raised:  # also what a reader in another language panics with
        fault = raised
    finally:
        streams = sys.stdout, sys.stderr
        sys.stdin, sys.stdout, sys.stderr = own
        for stream in streams:
            stream.flush()
    texts = (buffer.getvalue().decode("utf-8", "replace") for buffer in (out, err))
    return Ran(tuple(arguments), code, *texts, fault, time.process_time() - began)


def judged(ran: Ran) -> Iterator[Finding]:
    """Yield what is wrong with how a command ended and with what it printed."""
    command = ran.arguments[0]
    if ran.fault is not None:
        kind = "warning" if isinstance(ran.fault, Warning) else "traceback"
        text = "".join(traceback.format_exception(ran.fault))
        yield Finding(kind, f"{type(ran.fault).__name__} {place_of(ran.fault)}", text)
    elif ran.code not in CODES:
        yield Finding("exit code", command, f"{ran.code}: {ran.err[:500]}")
    if ran.code in REFUSED:
        if ran.err.count("\n") >= MOST_LINES or len(ran.err.encode()) >= MOST_BYTES:
            size = f"{ran.err.count(chr(10))} lines, {len(ran.err.encode())} bytes"
            yield Finding("long message", command, f"{size}: {ran.err[:2000]}")
        if "Error" not in ran.err and "Usage" not in ran.err:
            yield Finding("no message", command, ran.err[:500])
    for name, text in (("output", ran.out), ("message", ran.err)):
        if "Traceback (most recent" in text or "Warning: " in _without_own(text):
            yield Finding("leak", f"{command} {name}", text[:2000])
        control = CONTROL.search(text)
        if control is not None:
            around = text[max(control.start() - 300, 0) : control.end() + 100]
            what = unicodedata.name(control[0], repr(control[0]))
            yield Finding("control character", f"{command} {name}", f"{what}: {around!r}")
    if ran.seconds > MOST_SECONDS:
        yield Finding("slow", command, f"{ran.seconds:.1f} s")


def _without_own(text: str) -> str:
    """Return a text without the warnings that commands give in words of their own."""
    return re.sub(r"(?m)^Warning: .*$", "", text)


def place_of(fault: BaseException) -> str:
    """Return the innermost place in exfit at which an exception was raised."""
    frames = traceback.extract_tb(fault.__traceback__)
    own = [frame for frame in frames if f"{Path('exfit')}/" in frame.filename.replace("\\", "/")]
    if not frames:
        return ""
    frame = own[-1] if own else frames[-1]
    tail = "/".join(Path(frame.filename).parts[-2:])
    return f"{tail}:{frame.lineno} {frame.name}"


def _listing(folder: Path) -> dict[str, int]:
    """Return the files below a folder, by name, with the time when each was changed."""
    files = (
        path
        for path in folder.rglob("*")
        if path.is_file() and path.relative_to(folder).parts[0] != CONFIGURATION
    )
    return {path.relative_to(folder).as_posix(): path.stat().st_mtime_ns for path in files}


def written(ran: Ran, folder: Path, before: dict[str, int]) -> Iterator[Finding]:
    """Yield files that a command has left by halves, or in spite of a refusal."""
    after = _listing(folder)
    changed = [name for name in after if after[name] != before.get(name)]
    of_several = ran.arguments[0] in ("run", "batch") or "--all" in ran.arguments
    if ran.code in REFUSED and changed and not of_several:
        yield Finding("written in spite of a refusal", ran.arguments[0], ", ".join(changed))
    lost = [name for name in before if name not in after]
    if lost:
        yield Finding("removed", ran.arguments[0], ", ".join(lost))
    for name in changed:
        path = folder / name
        if path.suffix == ".tmp" or not path.stat().st_size:
            yield Finding("half a file", ran.arguments[0], name)
        if path.suffix == ".json":
            try:
                json.loads(path.read_bytes(), parse_constant=_refuse)
            except ValueError as fault:
                yield Finding("no JSON", ran.arguments[0], f"{name}: {fault}")


def _refuse(text: str) -> None:
    raise ValueError(text)
