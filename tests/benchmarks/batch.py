"""Time `exfit batch` with one and with two workers, and beside fits in a process that is warm.

Run it as ``python tests/benchmarks/batch.py [CASES] [SEARCH]`` on a machine that does nothing else:
the efficiency is one of elapsed times. The cases are generated, of eight models. Each worker has
one thread, as has the process that fits the same cases by `exfit.fit`, one after the other, once it
has fitted one of each model. As after an installation, bytecode and machine code are there before.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
SUPPORT = ROOT / "tests" / "support"
sys.path.insert(0, str(SUPPORT))

from generated_cases import MODELS, generated_cases
from rich.console import Console
from rich.table import Table

CASES = 40
SEARCH = "global"
WORKERS = (1, 2)
MOST_WARM = 200  # fits in the warm process: of more cases some, spread evenly
COMMAND = "from exfit.cli import main; main()"
WARM = """
import json, sys, time
import exfit
search, count, *cases = sys.argv[1:]
first, others = cases[:int(count)], cases[int(count):]
for case in first:
    exfit.fit(case, search=search)
began = time.process_time()
for case in others:
    exfit.fit(case, search=search)
print(json.dumps((time.process_time() - began) / len(others)))
"""


class Spent(NamedTuple):
    """What a process and its children took, s."""

    elapsed: float
    processor: float


def environment():
    """Return the environment of all processes: one thread each."""
    return {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "EXFIT_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }


def warm_seconds(cases, search):
    """Return the processor time of an `exfit.fit` in a warm process, s, on average."""
    spread = cases[:: -(-len(cases) // MOST_WARM)]
    arguments = [
        search,
        str(len(MODELS)),
        *(str(case) for case in (*cases[: len(MODELS)], *spread)),
    ]
    done = subprocess.run(
        [sys.executable, "-c", WARM, *arguments],
        env=environment(), check=True, capture_output=True, text=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def batch(cases, folder, workers, search):
    """Run a batch in a process of its own; return what it took, and its rows."""
    arguments = ["batch", str(cases), "-o", str(folder), "--json", "--search", search]
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *arguments, "--workers", str(workers)],
        env=environment(), stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    content = json.loads(process.stdout.read())
    _, _, used = os.wait4(process.pid, 0)  # with the workers, which it has waited for
    return Spent(time.perf_counter() - began, used.ru_utime + used.ru_stime), content["cases"]


def main():
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else CASES
    search = sys.argv[2] if len(sys.argv) > 2 else SEARCH
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        cases = generated_cases(place, count)
        generated_cases(place / "first", len(MODELS))
        batch(place / "first" / "cases", place / "first" / "fleet", 1, search)
        warm = warm_seconds(cases, search)
        runs = {}
        for workers in WORKERS:
            runs[workers] = batch(place / "cases", place / f"fleet-{workers}", workers, search)
    table = Table(title=f"{count} cases of {len(MODELS)} models, search: {search}")
    headings = ("elapsed s", "processor s", "a case", "in workers", "to a warm fit", "efficiency")
    for heading in ("workers", *headings):
        table.add_column(heading, justify="right")
    alone = runs[WORKERS[0]][0].elapsed
    for workers, (spent, rows) in runs.items():
        a_case, in_workers = spent.processor / count, sum(row["seconds"] for row in rows) / count
        table.add_row(
            f"{workers}", f"{spent.elapsed:.1f}", f"{spent.processor:.1f}", f"{a_case:.3f}",
            f"{in_workers:.3f}", f"{a_case / warm:.3f}", f"{alone / (workers * spent.elapsed):.3f}",
        )  # fmt: skip
    Console(width=100).print(table)
    print(f"a warm exfit.fit takes {warm:.3f} s of the processor")
    kinds = {row["verdict"] or row["status"] for _, rows in runs.values() for row in rows}
    print(f"verdicts: {', '.join(sorted(kinds))}")


if __name__ == "__main__":
    main()
