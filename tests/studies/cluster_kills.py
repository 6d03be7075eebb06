"""Fit generated cases on a Dask cluster whose workers are killed, and compare with a local batch.

Run it as ``python tests/studies/cluster_kills.py [CASES] [SECONDS] [SEARCH]``. A scheduler without
exfit and two workers, each with one thread and a folder that nobody else has, run on the loopback.
Every so many seconds one of the workers, in turn, is killed with all of its processes by SIGKILL,
and another one is started in its place. Then the same cases are fitted by a local batch: all must
be done, each must have been counted once, and all files must be the same but for the times.
"""

import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from batches import Events
from clusters import kill_group, running_cluster, without_times
from generated_cases import MODELS, generated_cases

import exfit

CASES, EVERY, SEARCH = 1000, 20.0, "global"


class Killer:
    """Kills the workers of a cluster in turn, every so many seconds, and starts others."""

    def __init__(self, cluster, every):
        self.cluster, self.every, self.kills = cluster, every, 0
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self._kill)

    def _kill(self):
        while not self.ended.wait(self.every):
            worker = self.cluster.workers.pop(0)
            kill_group(worker)
            worker.wait()
            self.kills += 1
            self.cluster.add_worker()

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.thread.join()


def main():
    """Print what becomes of the cases."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else CASES
    every = float(sys.argv[2]) if len(sys.argv) > 2 else EVERY
    search = sys.argv[3] if len(sys.argv) > 3 else SEARCH
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        generated_cases(place, count)
        events, began = Events(), time.monotonic()
        with running_cluster(place / "cluster") as cluster, Killer(cluster, every) as killer:
            exfit.batch(
                place / "cases", place / "there", scheduler=cluster.address, search=search,
                observer=events,
            )  # fmt: skip
        seconds = time.monotonic() - began
        local = exfit.batch(place / "cases", place / "here", workers=2, search=search)
        there, here = without_times(place / "there"), without_times(place / "here")
    ends = Counter(event[1] for event in events.events if event[0] not in ("begun", "started"))
    kinds = Counter(event[0] for event in events.events if event[0] not in ("begun", "started"))
    results = [name for name in there if name.endswith("/result.json")]
    print(f"{count} cases of {len(MODELS)} models in {seconds:.0f} s, {killer.kills} kills")
    print(f"  {', '.join(f'{number} {kind}' for kind, number in kinds.items())}")
    print(f"  {len(results)} results; counted twice: {sum(times - 1 for times in ends.values())}")
    differ = [name for name in there.keys() | here.keys() if there.get(name) != here.get(name)]
    print(f"  {len(here)} files of a local batch: {local.counts}")
    print(f"  {len(differ)} files differ: {sorted(differ)[:5]}")


if __name__ == "__main__":
    main()
