"""Run exfit on mutants of files, and list what is neither done nor refused with a message.

Run it as ``python tests/studies/fuzz.py [MUTANTS] [--seed S] [--kinds case,mat,...] [--first N]``;
``--one KIND SEED NUMBER`` makes one mutant again, leaves it in a folder and shows what exfit says.
The mutants of a kind run one after the other in a process of their own, which may take 1 GB more
than before a mutant; where it dies or hangs a new one goes on with the next mutant. What is wrong
is listed once for each place in exfit; at the end stands the table of docs/robustness.md.
"""

import argparse
import faulthandler
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ["COLUMNS"] = "80"
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from mutant_files import KINDS, mutant
from mutant_runs import Finding, tried

MUTANTS, SEED = 100_000, 1
IN_A_PROCESS = 250  # mutants of a kind in turn, then a new one begins with an empty memory
HANGS = 600.0  # s by the clock of a busy computer
MOST_SECONDS = 25  # of processor time for a mutant, then its process ends; 20 are allowed
MEGABYTE, GIGABYTE = 1 << 20, 1 << 30
MOST_MEMORY = GIGABYTE  # more than before a mutant
MOST_ADDRESSES = 4 * GIGABYTE  # then an allocation fails
TAIL = 1500  # characters of a text that are kept


def work(kind: str, seed: int, first: int, end: int, log: Path) -> None:
    """Run mutants and note each, before and after, in a file."""
    with tempfile.TemporaryDirectory() as name, log.open("a", buffering=1) as notes:
        for number in range(first, end):
            faulthandler.dump_traceback_later(HANGS, exit=True)
            limit_time()
            one = mutant(kind, seed, number)
            notes.write(json.dumps({"start": number, "mutant": str(one)[:TAIL]}) + "\n")
            before = limit_memory()
            result = tried(one, Path(name))
            wrong = result.wrong
            grown = peak_memory() - before
            if grown > MOST_MEMORY:
                wrong.append(Finding("memory", kind, f"{grown / GIGABYTE:.2f} GB"))
            for each in wrong:
                entry = {**each._asdict(), "number": number, "mutant": str(one)[:TAIL]}
                notes.write(json.dumps(entry | {"text": each.text[-TAIL:]}) + "\n")
            end = {"end": number, "refused": result.refused, "seconds": result.seconds}
            notes.write(json.dumps(end | {"grown": grown}) + "\n")
            if grown > MOST_MEMORY:
                break  # its peak hides that of the next
        os.chdir("/")


def limit_time() -> None:
    """End this process, with its traceback, once it has used so much more processor time."""
    try:
        import resource
    except ImportError:
        return  # this system has no such limit
    used = resource.getrusage(resource.RUSAGE_SELF)
    most = math.ceil(used.ru_utime + used.ru_stime + MOST_SECONDS)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (most, hard))
    faulthandler.register(signal.SIGXCPU, chain=True)


def limit_memory() -> int:
    """Let this process allocate so much more than now; return what it has had at most, bytes."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except (ImportError, OSError):
        return 0  # this system has no such limit
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MOST_ADDRESSES, hard))
    return peak_memory()


def peak_memory() -> int:
    """Return the most memory that this process has had, bytes; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def worked(kind: str, seed: int, first: int, end: int, folder: Path) -> Iterator[dict]:
    """Yield what workers note about the mutants of a kind; one that dies is a note of its own."""
    while first < end:
        log, errors = folder / f"{kind}-{first}.jsonl", folder / f"{kind}-{first}.txt"
        arguments = [sys.executable, __file__, "--work", kind, *map(str, (seed, first, end, log))]
        with errors.open("wb") as stream:
            code = subprocess.run(arguments, stderr=stream, stdout=stream, check=False).returncode
        lines = log.read_text().splitlines() if log.exists() else []
        notes = [json.loads(line) for line in lines]
        yield from notes
        begun = [note for note in notes if "start" in note]
        last = begun[-1]["start"] if begun else first
        tail = errors.read_text(errors="replace")
        if code:
            yield {
                "kind": "hang" if "Timeout" in tail or code == -signal.SIGXCPU else "death",
                "place": place_of_death(tail),
                "text": f"exit code {code}\n{tail[:TAIL]}",
                "number": last,
                "mutant": begun[-1]["mutant"] if begun else "not made",
            }
        elif "panicked" in tail:
            yield {"kind": "leak", "place": kind, "text": tail[:TAIL], "number": last, "mutant": ""}
        first = last + 1


def place_of_death(text: str) -> str:
    """Return the innermost place in exfit that a traceback of the interpreter names."""
    own = [
        line.strip() for line in text.splitlines() if f"exfit{os.sep}" in line and "File" in line
    ]
    own = [line for line in own if f"{os.sep}tests{os.sep}" not in line]
    return own[0].rpartition(f"exfit{os.sep}")[2] if own else re.sub(r"\d+", "N", text)[:80]


def show(kind: str, places: dict[tuple[str, str], list[dict]]) -> None:
    """Print what is wrong, once for each place."""
    for (what, place), notes in sorted(places.items(), key=lambda item: -len(item[1])):
        first = notes[0]
        print(f"{kind}: {what}: {place}: {len(notes)} times")
        print(f"    {first['mutant'][:300]}")
        print("    " + first["text"].strip()[-600:].replace("\n", "\n    "))


def again(kind: str, seed: int, number: int) -> None:
    """Make one mutant again, leave it in a folder, and print what is wrong with it."""
    folder = Path(tempfile.mkdtemp(prefix="mutant-"))
    one = mutant(kind, seed, number)
    print(one, folder / "mutant", sep="\n")
    for finding in tried(one, folder).wrong:
        print(finding.kind, finding.place, finding.text, sep="\n")


@dataclass
class Tally:
    """What came of the mutants of a kind."""

    mutants: int = 0
    refused: int = 0
    slowest: float = 0.0
    most_grown: int = 0
    wrong: dict[tuple[str, str], list[dict]] = field(default_factory=dict)

    def add(self, note: dict) -> None:
        """Count what a worker noted."""
        if "start" in note:
            self.mutants += 1
        elif "end" in note:
            self.refused += note["refused"]
            self.slowest = max(self.slowest, note["seconds"])
            self.most_grown = max(self.most_grown, note["grown"])
        else:
            self.wrong.setdefault((note["kind"], note["place"]), []).append(note)

    def row(self, kind: str) -> str:
        """Return the row of a kind in the table of the documentation."""
        count, share = self.mutants, 100.0 * self.refused / max(self.mutants, 1)
        found = sum(map(len, self.wrong.values()))
        grown = f"{self.most_grown / MEGABYTE:.0f} MB"
        return f"| {kind} | {count:,} | {share:.0f} % | {self.slowest:.1f} s | {grown} | {found} |"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("mutants", type=int, nargs="?", default=MUTANTS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--one", nargs=3)
    parser.add_argument("--work", nargs=5)
    given = parser.parse_args()
    if given.work:
        kind, seed, first, end, log = given.work
        work(kind, int(seed), int(first), int(end), Path(log))
    elif given.one:
        kind, seed, number = given.one
        again(kind, int(seed), int(number))
    else:
        study(given.kinds.split(","), given.mutants, given.seed, given.first)


def study(kinds: list[str], mutants: int, seed: int, first: int) -> None:
    """Run mutants of all kinds in turn; print what is wrong, and the table after each turn."""
    tallies, began = {kind: Tally() for kind in kinds}, time.monotonic()
    end = first + math.ceil(mutants / len(kinds))
    with tempfile.TemporaryDirectory() as folder:
        for start in range(first, end, IN_A_PROCESS):
            for kind, tally in tallies.items():
                turn = Tally()
                for note in worked(kind, seed, start, min(start + IN_A_PROCESS, end), Path(folder)):
                    tally.add(note)
                    turn.add(note)
                minutes = (time.monotonic() - began) / 60.0
                print(f"{minutes:6.1f} min  {tally.row(kind)}", flush=True)
                show(kind, turn.wrong)
            print("| kind | mutants | refused | longest | most memory | findings |")
            print("|---|---|---|---|---|---|")
            for kind, tally in tallies.items():
                print(tally.row(kind))
            used = os.times()
            seconds = used.user + used.system + used.children_user + used.children_system
            total = sum(tally.mutants for tally in tallies.values())
            print(f"{total:,} mutants, {seconds / 60.0:.1f} min of processor time", flush=True)


if __name__ == "__main__":
    main()
