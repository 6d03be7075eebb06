"""Count how often the intervals of drawn units with governors hold, and what planted faults say.

``python tests/studies/governors.py --draws 3`` takes an hour: ten units of four governors,
three tests each by another simulation (tests/support/drawn_units.py), so many records with new
noise, and forty planted faults. Each record is fitted with given values that are true, and exact by
the case: its intervals are of noise alone; and again with given values that lie as far off as
their default errors say. Counted are the intervals of all that is fitted, given values too.

A verdict on a fault is right where it is not that of a match, or where it is not good and the first
two lines name the fault: a given value that is wrong is fitted with its error, so that the response
matches, and the record contradicts it.
"""

import argparse
import re
import sys
import tempfile
import time
from collections import Counter, defaultdict
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from drawn_units import FAULTS, WORDS, DrawnUnit
from truths import holds

import exfit
from exfit.results.verdict import GOOD, MATCHES

UNITS, FAULTS_OF_EACH = 10, 4
GIVEN = ("exact", "drawn")
LINES = 2  # in which the cause should stand


def fitted(unit, draw, fault=None, given="stated"):
    """Return the fit of a unit's programme, and its seconds of processor."""
    with tempfile.TemporaryDirectory() as folder:
        path = unit.write(Path(folder), draw, fault, given)
        begun = time.process_time()
        result = exfit.run(path).fit
        return result, time.process_time() - begun


def held(result, truth):
    """Return whether each interval holds the truth, None where there is none."""
    found = {}
    for name, parameter in result.parameters.items():
        known = parameter.interval
        if name in truth:  # the unit has no limits
            found[name] = None if known is None else holds(known, truth[name])
    return found


def names(verdict, fault):
    """Return whether the first lines below a verdict name a fault."""
    return any(re.search(WORDS[fault], cause.cause) for cause in verdict.causes[:LINES])


def main():
    """Run the study and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=3)
    parser.add_argument("--units", type=int, default=UNITS)
    parser.add_argument("--given", nargs="*", choices=GIVEN, default=GIVEN)
    parser.add_argument("--faults", type=int, default=FAULTS_OF_EACH, help="of each unit")
    given = parser.parse_args()
    counts, verdicts, faults = defaultdict(Counter), defaultdict(Counter), defaultdict(Counter)
    for number in range(given.units):
        unit = DrawnUnit(number)
        for draw, values in product(range(given.draws), given.given):
            result, seconds = fitted(unit, draw, given=values)
            inside = held(result, unit.truth)
            counts[values].update(inside.values())
            verdicts[values][result.verdict.verdict] += 1
            out = [name for name, holds in inside.items() if holds is False]
            print(unit.kind, number, draw, values, f"{seconds:.0f} s", result.verdict.verdict, out)
            if result.verdict.verdict != GOOD:
                print("   ", result.verdict.reason)
            print(*(f"    {each.cause}" for each in result.verdict.causes), sep="\n", flush=True)
        for k in range(given.faults):
            fault = [*FAULTS][(FAULTS_OF_EACH * number + k) % len(FAULTS)]
            result, seconds = fitted(unit, given.draws + k, fault)
            verdict, named = result.verdict, names(result.verdict, fault)
            matched = verdict.verdict in (GOOD, MATCHES)
            right = verdict.verdict == MATCHES and named if matched else True
            faults[fault].update(all=1, right=int(right), matched=int(matched), named=int(named))
            print(unit.kind, number, fault, f"{seconds:.0f} s:", verdict.verdict, verdict.reason)
            print("    right" if right else "    wrong")
            print(*(f"    {each.cause}" for each in verdict.causes), sep="\n", flush=True)
    for values, found in counts.items():
        closed = found[True] + found[False]
        print(f"given values {values}: {found[True]} of {closed} intervals hold "
              f"({100.0 * found[True] / closed:.1f} %), {found[None]} without one; "
              f"verdicts {dict(verdicts[values])}")  # fmt: skip
    for fault, found in {**faults, "all faults": sum(faults.values(), Counter())}.items():
        print(f"{fault}: {found['right']} of {found['all']} right, {found['matched']} match; "
              f"{found['named']} named in {LINES} lines")  # fmt: skip


if __name__ == "__main__":
    main()
