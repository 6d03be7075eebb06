"""Time the command ``exfit fit`` on AC1A beside a process that imports NumPy, and what figures add.

Run it as ``python tests/benchmarks/fit.py [RUNS]``. Processes take turns, so that another load of
the machine hits all of them; the fastest run of each counts, for elapsed time and processor time
each. All are given in units of the process that imports NumPy.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else every process compiles all of exfit

from rich.console import Console
from rich.table import Table

CASE = Path(__file__).parents[2] / "configs" / "ac1a_typical.yaml"
COMMAND = "from exfit.cli import main; main()"
RUNS = 7
UNIT, LOCAL, DEFAULT, FIGURES = (
    "import numpy",
    "fit --search local --no-plots",
    "fit --no-plots",
    "fit",
)


def arguments(process, folder):
    """Return the command line of a process."""
    if process == UNIT:
        return [sys.executable, "-c", UNIT]
    command, *options = process.split()
    return [sys.executable, "-c", COMMAND, command, str(CASE), "-q", "-o", folder, *options]


def timed(process, folder):
    """Return the seconds, elapsed and of the processor, that a process takes."""
    before, begin = os.times(), time.perf_counter()
    subprocess.run(arguments(process, folder), check=True)
    elapsed, after = time.perf_counter() - begin, os.times()
    busy = after.children_user + after.children_system
    return elapsed, busy - before.children_user - before.children_system


def main():
    """Print the table."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    seconds = {process: [] for process in (UNIT, LOCAL, DEFAULT, FIGURES)}
    with tempfile.TemporaryDirectory() as folder:
        for process in seconds:
            timed(process, folder)  # compiles, and fills the caches of files
        for _ in range(runs):
            for process, spent in seconds.items():
                spent.append(timed(process, folder))
    least = {
        process: [min(kind) for kind in zip(*spent, strict=True)]
        for process, spent in seconds.items()
    }
    table = Table("process", "elapsed", "processor", "elapsed : unit", "processor : unit")
    table.title = f"exfit fit {CASE.name}, the best of {runs} runs"
    for process, spent in least.items():
        ratios = [f"{own / unit:.1f}" for own, unit in zip(spent, least[UNIT], strict=True)]
        table.add_row(process, *(f"{each:.2f} s" for each in spent), *ratios)
    added = least[FIGURES][0] - least[DEFAULT][0]
    console = Console()
    console.print(table)
    console.print(f"Figures add {added / least[UNIT][0]:.1f} units of elapsed time")


if __name__ == "__main__":
    main()
