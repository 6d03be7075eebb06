"""Run valid but extreme cases under their memory limit, and count the peaks above it.

    python tests/studies/memory.py FOLDER [--cases 500] [--seed 1] [--seconds 30]

Each case of tests/support/extreme_cases.py is run by `simulate`, `fit` or `check` in a
process of its own, for at most so many seconds of processor time; its peak of memory is what the
system counted. A case that is refused must name a key. Each adds a line to FOLDER/cases.jsonl; 500
take about two hours of a processor.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from extreme_cases import COMMANDS, run, write_case

GIGABYTE = 1e9
OUT_OF_TIME = (-9, -24)  # SIGKILL, SIGXCPU
KEYS = ("simulation.", "record.", "memory", "estimate.", "test.", "records")


def main() -> None:
    """Run the cases that FOLDER does not have, and print what all of them came to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=int, default=30)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    kept = given.folder / "cases.jsonl"
    done = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    for number in range(len(done), given.cases):
        rng, command = np.random.default_rng((given.seed, number)), COMMANDS[number % 4]
        with tempfile.TemporaryDirectory() as name:
            memory = write_case(Path(name), rng, command)
            ended = run(Path(name), command, given.seconds)
        done.append({"command": command, "memory": memory, **ended._asdict()})
        with kept.open("a") as file:
            print(json.dumps(done[-1]), file=file)
    above = [case for case in done if case["peak"] > GIGABYTE * case["memory"]]
    refused = [case for case in done if case["code"] == 1]
    unnamed = [case for case in refused if not any(key in case["error"] for key in KEYS)]
    torn = [case for case in done if "Traceback" in case["error"]]
    late = [case for case in done if case["code"] in OUT_OF_TIME]
    largest = max((case["peak"] / GIGABYTE / case["memory"] for case in done), default=0.0)
    print(f"{len(done)} cases: {len(above)} above their memory (largest {largest:.2f} of it), "
          f"{len(refused)} refused, {len(unnamed)} of them without a key, {len(torn)} tracebacks, "
          f"{len(late)} out of time")  # fmt: skip


if __name__ == "__main__":
    main()
