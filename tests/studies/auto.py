"""Count how strategy auto ends from the starts of the thesis, and from random ones.

Run it as ``python tests/studies/auto.py [COUNT [CASE ...]]``. Each case of configs/ that stands
for one of the thesis is fitted from its own start and from COUNT random ones within its bounds,
with its validation and without. An end is trusted where the exit code of the command would be 0:
then its cost must be within 1.01 of the lowest one that is known, and its validation within the
limit.
"""

import os
import sys
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table

import exfit
from exfit.case.load import load_case
from exfit.fitting.search import fitted

CONFIGS = Path(__file__).parents[2] / "configs"
CASES = (
    "ac1a_typical", "ac1a_good", "ac1a_low", "ac1a_high",
    "ac8b_unit1", "ac8b_unit2", "ac8b_unit1_ka_free", "ac8b_unit2_ka_free",
)  # fmt: skip
COUNT, SEED = 24, 2026
STARTS = 64  # of the search that says which cost is the lowest
MOST = 1.01  # times the lowest cost


@dataclass(frozen=True)
class Fit:
    """How one fit by auto ended."""

    cost: float
    trusted: bool
    validation: float  # rmse over its limit, 0 without a validation
    stage: str
    simulations: int


def random_starts(case, count):
    """Return start values by name, uniform over the bounds on the scale of each parameter."""
    _, problem = fitted(case)
    residuals = problem.residuals
    low, high = residuals.bounds
    points = low + (high - low) * np.random.default_rng(SEED).random((count, len(low)))
    names = [parameter.name for parameter in residuals.free]
    return [{name: residuals.values(x)[name] for name in names} for x in points]


def fit_from(case, start):
    """Return how auto ends from a start."""
    result = exfit.fit(case, "auto", values=start)
    phases = {line.phase for line in result.history}
    stage = "search" if "search" in phases else "lm-then-dgn" if "lm" in phases else "dgn"
    return Fit(
        cost=result.cost,
        trusted=result.holds,
        validation=max((match.rmse / match.limit for match in result.validation), default=0.0),
        stage=stage,
        simulations=result.simulations,
    )


def lowest_cost(case):
    """Return the lowest cost that a search from many starts finds."""
    estimate = case.estimate.model_copy(update={"starts": STARTS, "strategy": "lm-then-dgn"})
    return exfit.fit(replace(case, estimate=estimate, validations=())).cost


def study(name, count):
    """Yield the row of a case with its validation, and without."""
    case = load_case(CONFIGS / f"{name}.yaml")
    starts = [{}, *random_starts(case, count)]
    variants = {name: case, f"{name}, no validation": replace(case, validations=())}
    fits = {label: [fit_from(own, start) for start in starts] for label, own in variants.items()}
    every = [fit.cost for label in fits for fit in fits[label]]
    lowest = min(lowest_cost(case), *every)
    for label, own in fits.items():
        trusted = [fit for fit in own if fit.trusted]
        stages = Counter(fit.stage for fit in own)
        simulations = [fit.simulations for fit in own]
        yield (
            label,
            len(own),
            len(trusted),
            max((fit.cost / lowest for fit in trusted), default=np.nan),
            max((fit.validation for fit in trusted), default=np.nan),
            *(stages[stage] for stage in ("dgn", "lm-then-dgn", "search")),
            float(np.median(simulations)),
            max(simulations),
        )


def main(count, names):
    """Print the table; exit code 1 where an end that is trusted is not good."""
    heads = (
        "case", "starts", "exit 0", "worst cost", "worst validation", "dgn", "lm-then-dgn",
        "further starts", "median simulations", "most",
    )  # fmt: skip
    table, bad = Table(*heads), False
    for name in names:
        for row in study(name, count):
            text = [cell if isinstance(cell, str) else f"{cell:.4g}" for cell in row]
            print("| " + " | ".join(text) + " |", flush=True)
            table.add_row(*text)
            bad = bad or row[3] > MOST or row[4] > 1.0
    Console().print(table)
    return int(bad)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    sys.exit(main(int(arguments[0]) if arguments else COUNT, arguments[1:] or CASES))
