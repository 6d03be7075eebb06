"""Time the search from many starts on AC1A, with one thread and with two, and show what it finds.

Run it as ``python tests/benchmarks/starts.py [COUNT]``. Starts lie anywhere within a tenth and ten
times the typical values; each is refined to convergence. The fastest of some runs counts.
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
from exfit.estimate import multistart
from exfit.fitting.build import build_experiments
from exfit.fitting.parameters import UNIT
from exfit.fitting.problem import residuals_of

CASE = Path(__file__).parents[2] / "configs" / "ac1a_typical.yaml"
COUNT = 1000
WORKERS = (1, 2)
REPEATS = 3
METHODS = ("lm-then-dgn",)


def problem():
    """Return the residuals of the case."""
    case = load_case(CASE)
    return residuals_of(
        case, [setup.with_enough_substeps(case.values()) for setup in build_experiments(case)]
    )


def timed(p, count, workers, method):
    """Return what a search finds, the seconds and the processor's seconds that it takes."""
    begin, busy = time.perf_counter(), time.process_time()
    found = multistart(
        p, p.exact, p.bounds, count, x0=p.start, workers=workers, method=method, x_scale=UNIT
    )
    return found, time.perf_counter() - begin, time.process_time() - busy


def row(count, seconds, busy, alone):
    """Return starts per second, processor's time per start, and how much faster than one thread."""
    return f"{count / seconds:.1f}", f"{1e3 * busy / count:.0f} ms", f"{alone / seconds:.2f}"


def main():
    """Print the tables."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    console, p = Console(), problem()
    multistart(p, p.exact, p.bounds, 2, x_scale=UNIT)  # compiles
    columns = ("method", "threads", "starts per second", "processor per start", "times one thread")
    speeds = Table(*columns, title=f"{count} starts, the best of {REPEATS} runs")
    for method in METHODS:
        alone = None
        for workers in WORKERS:
            runs = [timed(p, count, workers, method) for _ in range(REPEATS)]
            found, seconds, busy = min(runs, key=lambda run: run[1])
            alone = alone or seconds
            speeds.add_row(method, str(workers), *row(count, seconds, busy, alone))
        minima = Table("cost", "starts", *(one.name for one in p.free))
        minima.title = f"{method}: {len(found.minima)} minima, {found.failed} starts failed"
        for one in found.minima:
            values = [f"{one.value(float(x)):.4g}" for one, x in zip(p.free, one.x, strict=True)]
            minima.add_row(f"{one.cost:.4e}", str(one.starts), *values)
        console.print(minima)
    console.print(speeds)
    costs = np.sort(found.end_costs[np.isfinite(found.end_costs)])
    share = np.mean(costs <= costs[0] * (1.0 + 1e-6))
    console.print(f"{share:.0%} of the ends reach the lowest cost")


if __name__ == "__main__":
    main()
