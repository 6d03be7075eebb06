"""Time whole commands against a process that only imports NumPy.

Run it as ``python tests/benchmarks/processes.py [ROUNDS]``. All take turns, so that a busy machine
slows them alike, and the best round of each counts. As after an installation, bytecode and machine
code are there before the first round. The case is the thesis' first with the step that is the
default, not its literal grid.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import yaml
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
ROUNDS = 10
CASE = "case.yaml"
LOCAL = ("fit", CASE, "--search", "local", "--quiet")
EXFIT = ("-m", "exfit")
WAYS = {
    "import numpy": ("-c", "import numpy"),
    "exfit --help": (*EXFIT, "--help"),
    "fit, search: local, no figures": (*EXFIT, *LOCAL, "--no-plots"),
    "fit, default search, no figures": (*EXFIT, "fit", CASE, "--quiet", "--no-plots"),
    "fit, search: local, all figures": (*EXFIT, *LOCAL),
    "simulate, no figures": (*EXFIT, "simulate", CASE, "--quiet", "--no-plots"),
    "check": (*EXFIT, "check", CASE),
}


class Spent(NamedTuple):
    """What a process took (s)."""

    elapsed: float
    processor: float


def spent(arguments, room, codes=(0,)):
    """Run a process in a folder of its own, which ends with one of ``codes``; return its times."""
    environment = {
        **{name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"},
        "PYTHONPATH": str(ROOT),
        "PYTHONPYCACHEPREFIX": f"{room}/bytecode",
    }
    output = ("-o", f"{room}/run") if "--quiet" in arguments else ()
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *arguments, *output],
        stdout=subprocess.DEVNULL,
        cwd=room,
        env=environment,
    )
    _, status, used = os.wait4(process.pid, 0)
    assert os.waitstatus_to_exitcode(status) in codes, arguments
    return Spent(time.perf_counter() - begin, used.ru_utime + used.ru_stime)


def write_case(folder):
    """Write the case into a folder."""
    own = ROOT / "configs" / "ac1a_typical.yaml"
    case = yaml.safe_load(own.read_text())
    for record in (case["record"], case["validate"][0]["record"]):
        record["file"] = str((own.parent / record["file"]).resolve())
    del case["simulation"]
    (Path(folder) / CASE).write_text(yaml.safe_dump(case))


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    with tempfile.TemporaryDirectory() as room:
        write_case(room)
        for arguments in WAYS.values():
            spent(arguments, room)
        runs = [[spent(arguments, room) for arguments in WAYS.values()] for _ in range(rounds)]
    best = {
        way: Spent(*(min(times) for times in zip(*own, strict=True)))
        for way, own in zip(WAYS, zip(*runs, strict=True), strict=True)
    }
    alone = best["import numpy"]
    table = Table(title=f"Whole processes, best of {rounds} in turns; ratios to a NumPy import")
    table.add_column("process")
    for heading in ("elapsed ms", "processor ms", "elapsed", "processor"):
        table.add_column(heading, justify="right")
    for way, times in best.items():
        table.add_row(
            way,
            *(f"{1e3 * seconds:.0f}" for seconds in times),
            *(f"{time / other:.1f}" for time, other in zip(times, alone, strict=True)),
        )
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
