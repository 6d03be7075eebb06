"""Show what least squares in the frequency domain come to, and the least spread that can be.

    python tests/studies/related_frequency.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from frequency_weights import autoregressive, curve, equal, least_spread, smoothed, weighted
from related_work import each, show, subject

SHARES = (0.6, 0.9, 0.95, 0.99)  # of each error in the next one
METHODS = {
    "frequency domain, equal weights": each(weighted(equal)),
    "frequency domain, smoothed spectrum": each(weighted(smoothed)),
    "frequency domain, AR(1) of the residuals": each(weighted(autoregressive)),
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


if __name__ == "__main__":
    show(METHODS)
    show_least_spread()
