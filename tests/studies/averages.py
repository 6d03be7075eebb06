"""Fit records of samples and of averages with a case that does not say which they are.

    python tests/studies/averages.py [DRAWS]

draws each kind of record so many times: a step of AC1A whose instant is free, at several rates,
with noise. It counts how often the verdict names averages, how often it says that the record does
not tell, and how many intervals miss the truth. docs/uncertainty.md has the figures.
"""

import os
import sys
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from averaged_records import TRUTH, recorded, unsaid

from exfit.results.model import FitResult
from exfit.workflows import fit

DRAWS = 20
NOISES = (1e-4, 3e-5)  # pu


class Kind(NamedTuple):
    """A kind of record: its rate (Hz), its window (s), and whether this ends at the sample."""

    rate: float
    window: float = 0.0
    trailing: bool = False


KINDS = (
    *(Kind(rate) for rate in (10.0, 50.0, 100.0, 1000.0)),
    Kind(10.0, 0.1),
    Kind(10.0, 0.1, trailing=True),
    Kind(50.0, 0.1),
    Kind(50.0, 0.1, trailing=True),
    Kind(50.0, 0.02),
)


def misses(result: FitResult) -> int:
    """Return how many closed intervals do not hold the truth."""
    intervals = {name: result.parameters[name].interval or (None, None) for name in TRUTH}
    closed = {name: each for name, each in intervals.items() if None not in each}
    return sum(not low <= TRUTH[name] <= high for name, (low, high) in closed.items())


def main() -> None:
    """Print a row of each kind of record."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    print("| record | noise | named | in doubt | good | intervals that miss |")
    print("|---|---|---|---|---|---|")
    for kind in KINDS:
        for noise in NOISES:
            named = doubted = good = missed = 0
            for seed in range(draws):
                record = recorded(*kind, noise, seed)
                result = fit(unsaid(record, late=0.5 * kind.window * kind.trailing))
                said = " ".join(cause.cause for cause in result.verdict.causes)
                named += "recorder averages" in said
                doubted += "recorder may average" in said
                good += result.verdict.verdict == "good"
                missed += misses(result)
            what = f"means of {1e3 * kind.window:g} ms" if kind.window else "samples"
            late = ", of the time before" if kind.trailing else ""
            row = f"{what}{late}, {kind.rate:g} Hz | {noise:g} | {named} | {doubted} | {good}"
            print(f"| {row} | {missed} of {draws * len(TRUTH)} |", flush=True)


if __name__ == "__main__":
    main()
