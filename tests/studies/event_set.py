"""Fit ten parameters of exciter, stabiliser, governor and machine to three grid events of a unit.

The start is a wrong baseline; that of EXST1, with TB and TC exchanged, is unstable. Prints the
processor time until there are intervals, and the largest distance to the truth in standard errors.
"""

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from event_sets import EXCITERS, FREE, GOVERNOR, MACHINE, STABILISER, recorded, set_case

from exfit.case.load import load_case
from exfit.workflows import fit


def main(names: list[str]) -> None:
    """Run the study of these exciters."""
    for exciter in names or [*FREE]:
        with tempfile.TemporaryDirectory() as folder:
            recorded(Path(folder), exciter)
            case = load_case(set_case(Path(folder), exciter, estimate={"causes": 0}))
            begun = time.process_time()
            result = fit(case)
        spent = time.process_time() - begun
        truth = EXCITERS[exciter] | {
            f"{part}.{name}": value
            for part, own in (
                ("machine", MACHINE), ("stabiliser", STABILISER), ("governor", GOVERNOR)
            )
            for name, value in own.items()
        }  # fmt: skip
        off = {n: (own.value - truth[n]) / own.std_error for n, own in result.parameters.items()}
        worst = max(off, key=lambda name: abs(off[name]))
        print(f"{exciter}: {spent:.0f} s, cost {result.cost:.4e}, {worst} {off[worst]:+.1f} errors")


if __name__ == "__main__":
    main(sys.argv[1:])
