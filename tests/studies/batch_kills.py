"""Kill `exfit batch` at random moments, and compare what the next run comes to.

Run it as ``python tests/studies/batch_kills.py [KILLS] [CASES]``. Each run is one of generated
cases of eight models in two workers, in a folder of its own. SIGKILL meets the batch alone or all
of its processes, in turns, at a moment drawn evenly from the time of a run; a second run goes on.
It needs a system with signals of POSIX.
"""

import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from batches import table_of
from generated_cases import generated_cases
from killed_batches import killed_and_resumed, whole_batch

KILLS, CASES = 50, 24
SEED = 5


def main():
    """Print what kills leave, and what the runs after them do again."""
    kills = int(sys.argv[1]) if len(sys.argv) > 1 else KILLS
    count = int(sys.argv[2]) if len(sys.argv) > 2 else CASES
    rng, counts = random.Random(SEED), Counter()
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        generated_cases(place, count)
        whole_batch(place / "cases", place / "first")  # compiles
        _, seconds = whole_batch(place / "cases", place / "whole")
        expected = table_of(place / "whole")
        print(f"a batch of {count} cases takes {seconds:.1f} s", flush=True)
        for kill in range(kills):
            moment, with_workers = rng.uniform(0.0, seconds), bool(kill % 2)
            folder = place / f"{kill}"
            resumed = killed_and_resumed(place / "cases", folder, moment, expected, with_workers)
            counts["whole"] += resumed.whole
            counts["tables that differ"] += not resumed.same
            counts["results lost"] += resumed.lost
            counts["cases begun twice"] += resumed.repeated
            counts["workers left"] += resumed.left
            counts["temporary files left"] += resumed.temporary
            whom = "all processes" if with_workers else "the batch alone"
            print(f"  {moment:6.1f} s, {whom}: {resumed}", flush=True)
            shutil.rmtree(folder)
    print(f"{kills} kills")
    for text, times in sorted(counts.items()):
        print(f"  {times:4} {text}")


if __name__ == "__main__":
    main()
