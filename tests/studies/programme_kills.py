"""Kill `exfit run` at moments spread over its run, and count what the next run does again.

Run it as ``python tests/studies/programme_kills.py [KILLS]``. Each run is that of
configs/programmes/ac8b_unit1.yaml, figures included, in a process and a folder of its own; SIGKILL
meets it at one of the moments, spread evenly over the time of a run, and a second run goes on.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from killed_programmes import killed_and_resumed, report_of, whole_run
from programmes import EXAMPLE

KILLS = 20


def main():
    """Print what kills at moments spread over a run leave, and what the next run does."""
    kills = int(sys.argv[1]) if len(sys.argv) > 1 else KILLS
    counts = Counter()
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        content, seconds = whole_run(EXAMPLE, place / "whole")
        expected = report_of(place / "whole")
        tests = ", ".join(test["name"] for test in content["tests"])
        print(f"a run of {tests} takes {seconds:.1f} s", flush=True)
        for kill in range(kills):
            moment = (kill + 0.5) / kills * seconds
            resumed = killed_and_resumed(EXAMPLE, place / f"{kill}", moment, expected)
            counts[f"killed with {len(resumed.done)} tests done"] += 1
            counts["tests done twice"] += len(resumed.again)
            counts["results lost"] += len(resumed.lost)
            counts["reports that differ"] += not resumed.same_report
            counts["temporary files left"] += resumed.temporary
            print(f"  {moment:6.1f} s: {resumed}", flush=True)
    print(f"{kills} kills")
    for text, times in sorted(counts.items()):
        print(f"  {times:4} {text}")


if __name__ == "__main__":
    main()
