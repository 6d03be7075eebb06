"""Fit twelve parameters of exciter, stabiliser, governor and machine to three events, many times.

``python tests/studies/both_halves.py 100`` takes about 7 s for each draw of the noise. The records
are those of tests/support/whole_unit_events.py, by another simulation; the start is a wrong
baseline. Prints the seconds of processor, and how often the 95 % intervals hold the truth.
``--vt 2e-4`` is other noise of the voltage, which drives the unit.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from truths import holds
from whole_unit_events import NOISE, TRUTH, write_case, write_records

from exfit.case.load import load_case
from exfit.workflows import fit


def main():
    """Run the study and print its figures as they come."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("draws", type=int, nargs="?", default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--vt", type=float, default=NOISE["vt"])
    given = parser.parse_args()
    NOISE["vt"] = given.vt
    counts, missed = Counter(), Counter()
    for seed in range(given.first, given.first + given.draws):
        with tempfile.TemporaryDirectory() as folder:
            write_records(Path(folder), seed)
            case = load_case(write_case(Path(folder)))
            begun = time.process_time()
            result = fit(case)
        spent, out = time.process_time() - begun, []
        for name, parameter in result.parameters.items():
            if parameter.interval is None:
                counts["none"] += 1
                continue
            inside = holds(parameter.interval, TRUTH[name])
            counts["hold" if inside else "miss"] += 1
            if not inside:
                out.append(name)
        missed.update(out)
        closed = counts["hold"] + counts["miss"]
        share = 100.0 * counts["hold"] / max(closed, 1)
        says = result.verdict.verdict
        print(f"{seed}: {spent:.0f} s, {says}, misses {out}; so far {counts['hold']} of {closed} "
              f"hold ({share:.1f} %), {counts['none']} without", flush=True)  # fmt: skip
    print(f"missed: {dict(missed)}")


if __name__ == "__main__":
    main()
