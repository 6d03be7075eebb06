"""Count how many starts reach the lowest minimum, by each way down, and how surely a fit finds it.

Run it as ``python tests/studies/global_search.py [STARTS [DRAWS [CASE ...]]]``. The first table has
STARTS starts within the bounds of each case, of a Sobol sequence and uniform ones, which descend on
the case's own grid alone, by way of the coarse grid, and by way of the linear phase. The second has
the default search from DRAWS starts of the user, drawn within the bounds: of each case of the
thesis all should find the lowest minimum. What the record does not tell apart from it counts.
"""

import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np

from exfit.case.case import Case
from exfit.case.load import load_case
from exfit.estimate import Descent
from exfit.estimate.starts import multistart, spread
from exfit.fitting.further_starts import legs_of
from exfit.fitting.parameters import UNIT
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import LIKELIHOOD_RATIO, fitted, search
from exfit.workflows.given_values import with_values

CONFIGS = Path(__file__).parents[2] / "configs"
THESIS = (
    "ac1a_typical", "ac1a_good", "ac1a_low", "ac1a_high", "ac8b_unit1", "ac8b_unit2",
    "ac8b_unit2_ka_free",
)  # fmt: skip
TRUTH = {
    "KA": 364.1523, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542, "KC": 0.486,
    "KD": 0.4039,
}  # fmt: skip
NOISE = 1e-4  # pu


@dataclass(frozen=True)
class Made:
    """A record of the AC1A that is simulated: the step (pu), its noise (pu), and limits."""

    step: float = 0.05
    noise: float = NOISE
    ceiling: float = 14.5
    floor: float = -14.5


MADE = {
    "ac1a, noise 1e-3": Made(noise=1e-3),
    "ac1a, step 2 %, noise 3e-4": Made(step=0.02, noise=3e-4),
    "ac1a, step 10 %": Made(step=0.10),
    "ac1a, VRMAX 7, VRMIN 0": Made(ceiling=7.0, floor=0.0),
    "ac1a, VRMAX 5, VRMIN 0": Made(ceiling=5.0, floor=0.0),
    "ac1a, VRMAX 3.5, VRMIN 0": Made(ceiling=3.5, floor=0.0),
}
CASES = (*THESIS, "ac8b_unit1_ka_free", *MADE)
STARTS, DRAWS, SEED = 64, 50, 2026
MOST_DRAWN = 2  # times as many: some have no state of rest


def residuals_named(name: str) -> Residuals:
    """Return the residuals of a case of the collection, or of one whose record is simulated."""
    made = MADE.get(name)
    _, problem = fitted(load_case(CONFIGS / f"{'ac1a_typical' if made else name}.yaml"))
    return problem.residuals if made is None else with_record(problem.residuals, made)


def with_record(residuals: Residuals, made: Made) -> Residuals:
    """Return residuals whose record is a simulation of the truth, with noise."""
    (experiment,) = residuals.experiments
    (channel,) = experiment.channels
    own = experiment.simulator
    steps = tuple(step._replace(step=made.step) for step in own.inputs.steps)
    simulator = own.remade(inputs=replace(own.inputs, steps=steps))
    limits = {"VRMAX": made.ceiling, "VRMIN": made.floor}
    limited = replace(
        residuals,
        fixed={**residuals.fixed, **limits},
        experiments=[replace(experiment, simulator=simulator)],
    )
    samples, _ = limited.experiments[0].samples(limited.completed(TRUTH))
    noise = made.noise * np.random.default_rng(SEED).standard_normal(len(samples))
    recorded = replace(channel, measured=samples[:, 0] + noise)
    recording = replace(experiment, simulator=simulator, channels=(recorded,))
    return replace(limited, experiments=[recording])


def uniform(bounds: tuple[np.ndarray, np.ndarray], count: int) -> np.ndarray:
    """Return points (count, N) drawn within bounds."""
    low, high = bounds
    return low + (high - low) * np.random.default_rng(SEED).random((count, len(low)))


def told_apart(cost: float, residuals: Residuals) -> float:
    """Return the cost from which on a record tells a minimum from one of this cost."""
    freedom = residuals.count - len(residuals.free)
    return cost * (1.0 + LIKELIHOOD_RATIO / freedom)


def descents(name: str, count: int) -> tuple[Residuals, dict[tuple[str, str], np.ndarray]]:
    """Return the costs (count,) where starts end, by how they are drawn and their way down."""
    residuals = residuals_named(name)
    points = {"Sobol": spread(residuals.bounds, count), "uniform": uniform(residuals.bounds, count)}
    own = Descent(
        functions=residuals,
        bounds=residuals.bounds,
        method="dgn",
        ftol=1e-8,
        x_scale=UNIT,
    )
    legs, _ = legs_of(residuals, own)
    ways = {
        "own grid": (replace(own, method="lm-then-dgn"),),
        "coarse grid first": legs[-2:],
        "linear phase first": legs,
    }
    ends = {
        (drawn, way): multistart(starts, of_way).end_costs
        for drawn, starts in points.items()
        for way, of_way in ways.items()
    }
    return residuals, ends


def of_starts(count: int, names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield how many starts of each case reach the lowest minimum, by each way down."""
    for name in names:
        residuals, ends = descents(name, count)
        lowest = min(float(np.nanmin(costs)) for costs in ends.values())
        limit = told_apart(lowest, residuals)
        for drawn in ("Sobol", "uniform"):
            counts = [int(np.sum(c <= limit)) for (of, _), c in ends.items() if of == drawn]
            yield name, f"{lowest:.4e}", drawn, *map(str, counts)


def of_fits(draws: int, names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield how many fits of each case find the lowest minimum that any of them found."""
    for name in names:
        case = replace(load_case(CONFIGS / f"{name}.yaml"), validations=())
        residuals, costs = residuals_named(name), dict[str, list[float]]()
        for reach in ("local", "global"):
            estimate = case.estimate.model_copy(update={"search": reach})
            of_search, begin = replace(case, estimate=estimate), time.process_time()
            costs[reach] = [
                cost_found(with_values(of_search, start))
                for start in drawn_starts(residuals, draws)
            ]
            spent = 1e3 * (time.process_time() - begin) / draws
        limit = told_apart(min(map(min, costs.values())), residuals)
        counts = [sum(cost <= limit for cost in of_search) for of_search in costs.values()]
        yield name, *map(str, counts), f"{spent:.0f}"


def cost_found(case: Case) -> float:
    """Return the cost that the search of a case comes to."""
    _, problem = fitted(case)
    found = search(case, problem, case.estimate.strategy, lambda _: None, lambda _: None)
    return found.best.cost


def drawn_starts(residuals: Residuals, draws: int) -> list[dict[str, float]]:
    """Return start values by name, drawn within the bounds; a fit refuses those without a rest."""
    points = uniform(residuals.bounds, MOST_DRAWN * draws)
    reached = [residuals.values(x) for x in points if np.isfinite(residuals(x)).all()]
    names = [free.name for free in residuals.free]
    return [{name: values[name] for name in names} for values in reached[:draws]]


def show(heads: Sequence[str], rows: Iterator[tuple[str, ...]]) -> None:
    """Print a table, each row as soon as it is there."""
    print("\n| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|")
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def main(starts: int, draws: int, names: Sequence[str]) -> None:
    """Print both tables."""
    ways = ("own grid", "coarse grid first", "linear phase first")
    show(("case", "lowest cost", f"{starts} starts", *ways), of_starts(starts, names))
    searches = ("local search", "global search", "processor ms of a global one")
    thesis = [name for name in names if name in THESIS]
    show((f"case, {draws} fits", *searches), of_fits(draws, thesis))


if __name__ == "__main__":
    arguments = sys.argv[1:]
    counts = [int(text) for text in arguments[:2]]
    main(*counts, *(STARTS, DRAWS)[len(counts) :], arguments[2:] or CASES)
