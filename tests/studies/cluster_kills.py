"""Fit generated cases on a Dask cluster whose workers are killed, and compare with a local batch.

Run it as ``python tests/studies/cluster_kills.py [CASES] [SECONDS] [SEARCH] [--rates]``. A
scheduler without exfit and two workers, each with one thread and a folder that nobody else has, run
on the loopback. Every so many seconds one of the workers, in turn, is killed with all of its
processes by SIGKILL, and another one is started in its place. Then the same cases are fitted by a
local batch: all must be done, each must have been counted once, and all files must be the same but
for the times.

``--rates`` first times the same cases without kills on an idle machine: by a local batch of one
worker, by one Dask worker, by two batches of half the cases each that know nothing of one another,
and by two Dask workers. The efficiency is the rate of two to twice that of one.
"""

import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
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


def rate(place, search, *batches):
    """Run batches of the cases at once, each with options of its own; return their cases per s."""

    def own(batch):
        folder, *options = batch
        arguments = ["-m", "exfit", "batch", "cases", "-q", "--search", search, "-o", folder]
        began = time.monotonic()
        subprocess.run([sys.executable, *arguments, *options], cwd=place, check=False)
        done = [*(place / folder).glob("*/result.json")]
        return len(done) / (time.monotonic() - began)

    with ThreadPoolExecutor() as pool:
        return sum(pool.map(own, batches))


def of_cases(*folders):
    """Return the files of the fits in folders of batches, without times."""
    files = {name: text for folder in folders for name, text in without_times(folder).items()}
    return {name: text for name, text in files.items() if "/" in name}


def print_rates(place, search):
    """Print how fast one and two work, alone and on a cluster, and whether the files are equal."""
    here = ("--workers", "1")
    with running_cluster(place / "cluster-1", workers=1) as cluster:
        there = ("--scheduler", cluster.address)
        rate(place, search, ("warm", *here, "--part", "1/20"))  # machine code and bytecode
        alone, one = rate(place, search, ("p1", *here)), rate(place, search, ("d1", *there))
        halves = [(f"p2-{k}", *here, "--part", f"{k}/2") for k in (1, 2)]
        apart = rate(place, search, *halves)
        cluster.add_worker()
        two = rate(place, search, ("d2", *there))
    for name, single, both in (("processes", alone, apart), ("Dask", one, two)):
        print(f"  {name}: {single:.3f} cases/s by one, {both:.3f} by two: efficiency "
              f"{both / single / 2:.3f}")  # fmt: skip
    whole = of_cases(place / "p1")
    others = (
        of_cases(place / "d1"),
        of_cases(place / "p2-1", place / "p2-2"),
        of_cases(place / "d2"),
    )
    equal = "equal" if all(each == whole for each in others) else "NOT EQUAL"
    print(f"  Dask to processes: {two / apart:.3f}; {len(whole)} files, {equal}", flush=True)


def main():
    """Print what becomes of the cases."""
    given = [word for word in sys.argv[1:] if word != "--rates"]
    count = int(given[0]) if given else CASES
    every = float(given[1]) if len(given) > 1 else EVERY
    search = given[2] if len(given) > 2 else SEARCH
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        generated_cases(place, count)
        if "--rates" in sys.argv:
            print_rates(place, search)
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
