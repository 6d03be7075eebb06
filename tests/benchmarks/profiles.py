"""Count and time the profiles of all parameters of a case: processor and elapsed, by threads.

Run it as ``python tests/benchmarks/profiles.py [CASE ...]``. The thread counts take turns; the
best of several turns counts.
"""

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

from rich.console import Console
from rich.table import Table

from exfit import estimate
from exfit.case.load import load_case
from exfit.fitting.parameters import UNIT
from exfit.fitting.search import fitted, names_of_records, search
from exfit.fitting.uncertainty import uncertainty_at

CONFIGS = Path(__file__).parents[2] / "configs"
CASES = ("ac1a_typical", "ac8b_unit2")
POINTS = {"interval": 3, "figure": 5}  # of a side
TURNS = 5


@dataclass(eq=False)
class Counted:
    """Residuals and Jacobians that count the points they are asked for, and the calls."""

    functions: estimate.Functions
    residual_points: int = 0
    jacobian_points: int = 0
    calls: int = 0

    def residuals(self, points):
        self.residual_points += len(points)
        self.calls += 1
        return self.functions.residuals(points)

    def jacobians(self, points):
        self.jacobian_points += len(points)
        self.calls += 1
        return self.functions.jacobians(points)


def minimum_of(path):
    """Return the residuals of a case, its minimum by a local search, and the rises."""
    case = load_case(path)
    setups, problem = fitted(case)
    options = case.estimate.model_copy(update={"search": "local"})
    best = search(
        case, problem, "lm-then-dgn", lambda _: None, lambda _: None, options=options
    ).best
    rises = uncertainty_at(problem, best.x, names_of_records(setups)).rises
    return problem.compressed, best.x, dict(enumerate(rises.values()))


def main():
    names = sys.argv[1:] or [str(CONFIGS / f"{name}.yaml") for name in CASES]
    heads = ("threads", "residuals", "Jacobians", "calls", "processor s", "elapsed s")
    table = Table("case", "points", *heads)
    for name in map(Path, names):
        residuals, x, rises = minimum_of(name)

        def profiled(points, workers, residuals=residuals, x=x, rises=rises):
            """Return how often functions were called, processor and elapsed time."""
            functions = Counted(residuals)
            began, used = time.perf_counter(), time.process_time()
            estimate.profiles(
                functions, x, rises, residuals.bounds, points=points, workers=workers, x_scale=UNIT
            )
            return time.process_time() - used, time.perf_counter() - began, functions

        for purpose, points in POINTS.items():
            turns = [(profiled(points, 1), profiled(points, 2)) for _ in range(TURNS)]
            for workers, runs in enumerate(zip(*turns, strict=True), start=1):
                processor, elapsed = (min(run[k] for run in runs) for k in (0, 1))
                count = runs[0][2]
                figures = (count.residual_points, count.jacobian_points, count.calls)
                cells = (workers, *figures, f"{processor:.3f}", f"{elapsed:.3f}")
                table.add_row(f"{name.stem}, {len(x)} free", purpose, *map(str, cells))
    Console().print(table)


if __name__ == "__main__":
    main()
