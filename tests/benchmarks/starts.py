"""Time the search from many starts on AC1A, with one thread and with two, and show what it finds.

Run it as ``python tests/benchmarks/starts.py [COUNT]``. Starts lie anywhere within a tenth and ten
times the typical values; each is refined to convergence by way of the linear phase and the coarse
grid, and linear phases that end alike go on as one, as in the search of a fit. The fastest of some
runs counts; one thread and two take turns.
"""

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table

from exfit.case.load import load_case
from exfit.estimate.starts import multistart, spread
from exfit.fitting.further_starts import MERGED, last_leg, legs_of
from exfit.fitting.search import fitted

CASE = Path(__file__).parents[2] / "configs" / "ac1a_typical.yaml"
COUNT = 1000
WORKERS = (1, 2)
REPEATS = 2


def legs():
    """Return the residuals of the case and the legs of its further starts."""
    _, problem = fitted(load_case(CASE))
    return problem.residuals, legs_of(problem.residuals, last_leg(problem))[0]


def timed(points, of_case, workers):
    """Return what a search finds, the seconds and the processor's seconds that it takes."""
    begin, busy = time.perf_counter(), time.process_time()
    found = multistart(points, of_case, workers=workers, merged=MERGED)
    return found, time.perf_counter() - begin, time.process_time() - busy


def main():
    """Print the tables."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    residuals, of_case = legs()
    points = spread(residuals.bounds, count)
    multistart(points[:32], of_case, merged=MERGED)  # compiles
    runs = [
        (workers, timed(points, of_case, workers)) for _ in range(REPEATS) for workers in WORKERS
    ]
    columns = ("threads", "starts per second", "processor per start", "times one thread")
    speeds = Table(*columns, title=f"{count} starts, the best of {REPEATS} runs")
    fastest = {
        workers: min((run for of, run in runs if of == workers), key=lambda run: run[1])
        for workers in WORKERS
    }
    for workers, (_, seconds, busy) in fastest.items():
        speeds.add_row(
            str(workers),
            f"{count / seconds:.1f}",
            f"{1e3 * busy / count:.1f} ms",
            f"{fastest[WORKERS[0]][1] / seconds:.2f}",
        )
    found = fastest[WORKERS[0]][0]
    minima = Table("cost", "starts", *(free.name for free in residuals.free))
    minima.title = f"{len(found.minima)} minima, {found.failed} starts failed"
    for local in found.minima:
        values = residuals.values(local.x)
        texts = [f"{values[free.name]:.4g}" for free in residuals.free]
        minima.add_row(f"{local.cost:.4e}", str(local.starts), *texts)
    console = Console()
    console.print(minima)
    console.print(speeds)
    same = all(np.array_equal(found.end_costs, run[0].end_costs) for _, run in runs)
    console.print(f"{'The same' if same else 'Not the same'} ends, to the bit, with each")


if __name__ == "__main__":
    main()
