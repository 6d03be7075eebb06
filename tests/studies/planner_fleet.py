"""From a planner's .dyr of 200 units and 40 records to the same file with what was verified.

Run it as ``python tests/studies/planner_fleet.py --units 200 --records 40``. Three commands:
`import --all`, `batch`, `export --all`. The units are of every kind of record that exfit knows, in
odd layouts, with governors and others between them that it does not know; 40 have a record of a
step whose true values the file has up to 1.5 times off. Checked is that every byte outside the
fields that `fitted.csv` names is as it was; counted is how near the written values are to the
truth, and how often their intervals hold it; with ``--given drawn`` all other values are off, too.
"""

import argparse
import csv
import os
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from dyr_words import changed_words
from planner_files import SEED, planner_file

from exfit.cli import main as command
from exfit.features.fleet.folder import read_fleet


def run(*arguments):
    """Run a command; return its exit code and the time that it took, s."""
    began = time.monotonic()
    try:
        command([str(argument) for argument in arguments], prog_name="exfit")
    except SystemExit as ended:
        return int(ended.code or 0), time.monotonic() - began
    return 0, time.monotonic() - began


def study(folder, made, batch_options):
    """Run the three commands, print what they came to; return 1 where a byte is not as it was."""
    cases, fleet, fitted = folder / "cases", folder / "fleet", folder / "fitted.dyr"
    times = {
        "import --all": run("import", "--all", made.dyr, "-o", cases, "--records", made.records,
                            "--step", "0.05", "--base", "efd=1"),
        "batch": run("batch", cases, "-o", fleet, "--quiet", *batch_options),
        "export --all": run("export", "--all", fleet, "-o", fitted),
    }  # fmt: skip
    for name, (code, seconds) in times.items():
        print(f"{name}: exit code {code}, {seconds:.1f} s")
    rows = read_fleet(fleet).cases
    print("cases:", dict(Counter(row.status for row in rows)))
    print("verdicts:", dict(Counter(row.verdict for row in rows if row.status == "done")))
    with fitted.with_suffix(".csv").open(newline="") as table:
        changes = [*csv.DictReader(table)]
    return report(made, fitted, changes)


def report(made, fitted, changes):
    """Print how near what was written is to the truth; return 1 where a byte is not as it was."""
    before, after = made.dyr.read_bytes(), fitted.read_bytes()
    words = changed_words(before.decode("latin-1"), after.decode("latin-1"))
    same = all(piece.encode("latin-1") in after for bus, piece in made.pieces.items()
               if bus not in {int(row["bus"]) for row in changes})  # fmt: skip
    sound = same and sorted(words) == sorted(
        (float(row["before"]), float(row["after"])) for row in changes
    )
    units = {row["bus"] for row in changes}
    print(f"units changed: {len(units)} of {len(made.truth)} with a record; fields: {len(words)}")
    print("every other byte as it was" if sound else "OTHER BYTES HAVE CHANGED")
    errors, held, intervals = [], 0, 0
    for row in changes:
        truth = made.truth[int(row["bus"])].get(row["parameter"])
        if truth is None or not (row["low"] and row["high"]):
            continue
        errors.append(abs(float(row["after"]) / truth - 1.0))
        intervals += 1
        held += float(row["low"]) <= truth <= float(row["high"])
    share = f"{100.0 * held / max(intervals, 1):.1f} %"
    print(f"determined values: {intervals}; intervals that hold the truth: {share}")
    print(f"difference to the truth: median {100 * np.median(errors):.2g} %, "
          f"largest {100 * max(errors):.2g} %")  # fmt: skip
    return int(not sound)


def main():
    """Make the files in a folder that is removed, and run the study."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--units", type=int, default=200)
    parser.add_argument("--records", type=int, default=40)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--search", choices=("global", "local"), default="global")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--given", choices=("exact", "drawn"), default="exact")
    given = parser.parse_args()
    options = ("--workers", given.workers, "--search", given.search)
    with TemporaryDirectory() as name:
        folder, drawn = Path(name), given.given == "drawn"
        made = planner_file(folder, given.units, given.records, given.seed, drawn)
        return study(folder, made, options)


if __name__ == "__main__":
    sys.exit(main())
