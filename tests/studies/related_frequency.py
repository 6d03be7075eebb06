"""Show what least squares in the frequency domain come to, and the least spread that can be.

    python tests/studies/related_frequency.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import numpy as np
from coverage_cases import HARD_CASES
from frequency_weights import (
    by_share,
    curve,
    equal,
    least_spread,
    smoothed,
    weighted,
    whitened_in_time,
)
from related_work import Subject, each, show, subject

SHARES = (0.6, 0.9, 0.95, 0.99)  # of each error in the next one
SLOW_DRAWS = 100
METHODS = {
    "frequency domain, equal weights": each(weighted(equal)),
    "frequency domain, smoothed spectrum": each(weighted(smoothed)),
    "frequency domain, AR(1) of the residuals": each(weighted(by_share)),
    "whitened in time by an AR(1)": each(whitened_in_time),
    "curve of the frequency response, to 10 Hz": each(curve(10.0)),
}


def show_least_spread() -> None:
    """Print what weights by the true spectrum could gain, by linear theory."""
    print("\n| record | share of each error in the next | spread over that of equal weights |")
    print("|---|---|---|")
    for name in ("ac1a_up", "coloured"):
        of = subject(name)
        slopes = of.residuals.exact(of.truth)
        for share in SHARES:
            of_equal, least = least_spread(slopes, share)
            print(f"| {name} | {share} | " + " ".join(f"{x:.3f}" for x in least / of_equal) + " |")


def with_share(share: float) -> Subject:
    """Return the record with coloured noise, of which each error repeats another share."""
    name = f"coloured, {share}"
    HARD_CASES[name] = replace(HARD_CASES["coloured"], phi=share)
    return subject(name)


def show_slow_noise() -> None:
    """Print the root mean square errors with noise that is slower, over those of equal weights."""
    print("\n| share of each error in the next | method | error over that of equal weights |")
    print("|---|---|---|")
    for share in SHARES[1:]:
        of = with_share(share)
        records, starts = of.drawn(SLOW_DRAWS), np.tile(of.residuals.start, (SLOW_DRAWS, 1))
        errors = {
            title: np.array([end.point for end in method(records, starts)]) - of.truth
            for title, method in list(METHODS.items())[:4]
        }
        sizes = {title: np.sqrt(np.mean(own**2, axis=0)) for title, own in errors.items()}
        of_equal, *_ = sizes.values()
        for title, size in sizes.items():
            ratios = " ".join(f"{ratio:.2f}" for ratio in size / of_equal)
            print(f"| {share} | {title} | {ratios} |", flush=True)


if __name__ == "__main__":
    show(METHODS)
    show_least_spread()
    show_slow_noise()
