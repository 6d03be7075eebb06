"""Count how often the intervals of drawn units with governors hold, and what planted faults say.

``python tests/studies/governors.py --draws 3`` takes half an hour: ten units of four governors,
three tests each by another simulation (tests/support/drawn_units.py), so many records with new
noise, and forty planted faults. A verdict on a fault is right where it is not that of a match.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from drawn_units import FAULTS, DrawnUnit
from truths import holds

import exfit
from exfit.results.verdict import GOOD, MATCHES

UNITS, FAULTS_OF_EACH = 10, 4


def fitted(unit, draw, fault=None):
    """Return the fit of a unit's programme, and its seconds of processor."""
    with tempfile.TemporaryDirectory() as folder:
        path = unit.write(Path(folder), draw, fault)
        begun = time.process_time()
        return exfit.run(path).fit, time.process_time() - begun


def held(result, truth):
    """Return whether each interval holds the truth, None where there is none."""
    found = {}
    for name, parameter in result.parameters.items():
        known = parameter.interval
        found[name] = None if known is None else holds(known, truth[name])
    return found


def main():
    """Run the study and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=3)
    parser.add_argument("--units", type=int, default=UNITS)
    given = parser.parse_args()
    counts, verdicts, right, faults = Counter(), Counter(), Counter(), Counter()
    for number in range(given.units):
        unit = DrawnUnit(number)
        for draw in range(given.draws):
            result, seconds = fitted(unit, draw)
            inside = held(result, unit.truth)
            counts.update(inside.values())
            verdicts[result.verdict.verdict] += 1
            out = [name for name, holds in inside.items() if not holds]
            print(
                unit.kind, number, draw, f"{seconds:.0f} s", result.verdict.verdict, out, flush=True
            )
        for k in range(FAULTS_OF_EACH):
            fault = [*FAULTS][(FAULTS_OF_EACH * number + k) % len(FAULTS)]
            result, seconds = fitted(unit, given.draws + k, fault)
            says = result.verdict.verdict
            faults[fault] += 1
            right[fault] += says not in (GOOD, MATCHES)
            print(unit.kind, number, fault, f"{seconds:.0f} s:", says, flush=True)
    closed = counts[True] + counts[False]
    print(f"{counts[True]} of {closed} intervals hold ({100.0 * counts[True] / closed:.1f} %), "
          f"{counts[None]} without one; verdicts {dict(verdicts)}")  # fmt: skip
    each = ", ".join(f"{name} {right[name]} of {count}" for name, count in faults.items())
    print(f"{right.total()} of {faults.total()} faults are no match: {each}")


if __name__ == "__main__":
    main()
