"""Count how often the intervals of measured step features hold the truth.

    python tests/studies/step_features.py [RECORDS]

Second-order responses of drawn frequency and damping, up and down, with white noise, and with a
ripple: a harmonic of the mains as a sampling rate of its own folds it, of drawn amplitude and
phase. Each is fitted with a sine and without one, and with a damping ratio that is 3 % wrong and
held. The truth is that of formulas. Printed is, for each feature, how often its 95 % interval holds
the truth, in how many records it is stated, and the median of half the interval.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from drawn_responses import NAMES, drawn_response, fit_of, held

RECORDS = 200
WAYS = {
    "no ripple": {"rippled": False},
    "ripple, sine fitted": {"sine": True},
    "ripple, no sine": {},
    "no ripple, poor model": {"rippled": False, "poor": True},
    "ripple, no sine, poor model": {"poor": True},
}


def main(records: int) -> None:
    """Print the table of the study."""
    table = Table("records", "removed from", *(name.replace("_", " ") for name in NAMES))
    for label, way in WAYS.items():
        hits, halves, removed = {n: [] for n in NAMES}, {n: [] for n in NAMES}, 0
        for seed in range(records):
            drawn = drawn_response(seed)
            measured = fit_of(drawn, **way).comparison.features.measured
            removed += bool(measured.without)
            for name, hit in held(drawn, measured).items():
                hits[name].append(hit)
                halves[name].append(measured.errors[name])
        cells = (
            f"{100.0 * np.mean(hits[n]):.1f} % of {len(hits[n])}, {np.median(halves[n]):.2g}"
            for n in NAMES
        )
        table.add_row(label, f"{removed}", *cells)
    Console(width=180).print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RECORDS)
