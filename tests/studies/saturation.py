"""Count how often the intervals of a saturation test hold the truth.

Run it as ``python tests/studies/saturation.py [COUNT]``. The curves are synthetic: COUNT of each
form, 10 to 20 points up to 1.1 or 1.2 pu on both branches, with a loop of 2 % (of even width, as
the current, or closed at the top) and noise of 0.1 to 0.3 % in voltage and current; then points on
the rising branch alone.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from saturation_curves import QUANTITIES, drawn_curve, hits_of, shares

from exfit.features.programme.saturation import EXCESS

COUNT = 200
SEED = 2026
KINDS = {"both branches": (2, None), "rising branch alone": (1, "even")}


def main(count: int) -> None:
    """Print the table of the study."""
    table = Table("points", "form", "up to", "curves", *QUANTITIES, "half a width, median", "open")
    for kind, (branches, shape) in KINDS.items():
        for form in EXCESS:
            random = np.random.default_rng(SEED)
            curves = [drawn_curve(form, random, branches, shape) for _ in range(count)]
            hits = [hits_of(curve) for curve in curves]
            for top in (None, 1.1, 1.2):
                chosen = [
                    hit for curve, hit in zip(curves, hits, strict=True) if top in (None, curve.top)
                ]
                widths = np.array([hit.widths for hit in chosen])
                table.add_row(
                    kind,
                    form,
                    "both" if top is None else f"{top:g} pu",
                    f"{len(chosen)}",
                    *(f"{100.0 * share:.1f} %" for share in shares(chosen)),
                    ", ".join(f"{width:.2g}" for width in np.median(widths, axis=0)),
                    f"{int(np.isinf(widths).any(axis=1).sum())}",
                )
    Console(width=120).print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
