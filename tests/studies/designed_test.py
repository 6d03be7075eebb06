"""Count what designed tests gain: the spread of fits of records simulated with new noise.

    python tests/studies/designed_test.py [RECORDS] [CASE ...]

For each case the best single step and the best test within 0.05 pu of vt and 4 pu of efd, with the
same duration and channels, are each simulated so many times with noise, and fitted. Printed are the
standard errors predicted, the spread of the fitted values, and how these of both tests compare.
"""

import sys
from pathlib import Path

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from designed_fits import spread_of_fits

import exfit

CONFIGS = Path(__file__).parents[2] / "configs"
CASES = ("ac1a_typical:vt,efd", "ac8b_unit1:vt,efd", "ac1a_typical:vt")
LIMITS = {"vt": 0.05, "efd": 4.0}
RECORDS, SEED = 200, 2026


def main():
    """Print the table."""
    records = int(sys.argv[1]) if len(sys.argv) > 1 else RECORDS
    print(
        "| case | parameter | best single step, %: predicted | fits | "
        "designed, %: predicted | fits | ratio predicted | fits |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for entry in sys.argv[2:] or CASES:
        name, _, channels = entry.partition(":")
        path = CONFIGS / f"{name}.yaml"
        content = yaml.safe_load(path.read_text())
        design = exfit.design_test(path, limits=LIMITS, channels=channels.split(","))
        truth = {key: each["start"] for key, each in content["parameters"]["free"].items()}
        stages = (design.single, design.best)
        spread = [
            np.std(spread_of_fits(content, design, stage, truth, records, SEED), axis=0)
            for stage in stages
        ]
        for k, key in enumerate(truth):
            cells = [
                f"{100.0 * figure:.3g}"
                for stage, own in zip(stages, spread, strict=True)
                for figure in (stage.errors[key], own[k])
            ]
            ratios = (design.ratios[key], spread[1][k] / spread[0][k])
            row = (entry, key, *cells, *(f"{ratio:.2f}" for ratio in ratios))
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
