"""From a recorder's file of twenty minutes and a planner's .dyr to a fit, for fifty units.

Run it as ``python tests/studies/new_cases.py --records 50 --results new_cases.json``. Each file has
four tests of a unit whose truth is known; the .dyr carries values that are up to 50 % off. `exfit
new` makes the case, with the base of vt and the table of the tests alone; it is fitted as it is,
as the command fits. Counted is how often a printed 95 % interval holds the truth, over all
parameters and files, and the processor time of the fit. What is in the file of results is not done
again, so that a study that was interrupted goes on.
"""

import argparse
import json
import os
import sys
import time
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from programme_files import BUS, programme_file
from truths import holds

from exfit.case.load import load_case
from exfit.cli import main as command
from exfit.util.files import write
from exfit.workflows import fit

RECORDS = 50
BAND = (0.92, 0.98)
LONGEST = 15.0  # s of a fit


def case_of(made, folder):
    """Return the case that `exfit new` makes of a file."""
    case = folder / "case.yaml"
    command(
        [
            *("new", "--record", str(made.record), "--tests", str(made.table)),
            *("--dyr", str(made.dyr), "--bus", str(BUS), "--base", f"vt={made.base}kV"),
            *("-o", str(case)),
        ],
        standalone_mode=False,
    )
    return load_case(case)


def outcome_of(number):
    """Return what the fit of one file came to."""
    with TemporaryDirectory() as folder:
        made = programme_file(number, Path(folder))
        began = time.process_time(), time.monotonic()
        case = case_of(made, Path(folder))
        between = time.process_time(), time.monotonic()
        result = fit(case)
        seconds = time.process_time() - between[0], time.monotonic() - between[1]
    truth = dict(made.truth)
    for name, (at, _), level in zip(names_of(case), made.tests, made.levels, strict=True):
        truth |= {f"{name}.vref.at": at, f"{name}.vt0": level}
    return {
        "model": made.model,
        "verdict": result.verdict.verdict,
        "new": between[0] - began[0],
        "seconds": seconds[0],
        "elapsed": seconds[1],
        "success": result.success,
        "parameters": {
            name: {
                "value": each.value,
                "truth": truth[name],
                "interval": each.interval,
                "method": each.interval_method,
            }
            for name, each in result.parameters.items()
        },
    }


def names_of(case):
    """Return the names of all records in order of their time."""
    recordings = [*case.recordings, *case.validations]
    return [each.name for each in sorted(recordings, key=lambda each: each.test.instants[0])]


def main():
    """Fit what is not fitted yet, print the table; exit code 1 where a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--records", type=int, default=RECORDS)
    parser.add_argument("--results", type=Path, default=Path("new_cases.json"))
    given = parser.parse_args()
    done = json.loads(given.results.read_text()) if given.results.exists() else {}
    for number in range(given.records):
        if str(number) not in done:
            done[str(number)] = outcome_of(number)
            write(given.results, json.dumps(done, indent=1))
    outcomes = [done[str(number)] for number in range(given.records)]
    return report(outcomes)


def report(outcomes):
    """Print the table of outcomes by model; return 1 where a figure is missed."""
    table = Table("model", "files", "intervals", "hold the truth", "longest fit s", "verdicts")
    by_model = defaultdict(list)
    for outcome in outcomes:
        by_model[outcome["model"]].append(outcome)
    for model, own in {**by_model, "all": outcomes}.items():
        held, printed = coverage(own)
        verdicts = sorted({outcome["verdict"] for outcome in own})
        table.add_row(
            model,
            str(len(own)),
            str(printed),
            f"{100.0 * held / max(printed, 1):.1f} %",
            f"{max(outcome['seconds'] for outcome in own):.1f}",
            ", ".join(f"{word} {sum(o['verdict'] == word for o in own)}" for word in verdicts),
        )
    Console(width=110).print(table)
    held, printed = coverage(outcomes)
    low, high = binomtest(held, printed).proportion_ci(0.95, "exact")
    seconds = np.array([outcome["seconds"] for outcome in outcomes])
    print(f"{held} of {printed} intervals hold the truth: {100 * held / printed:.1f} %", end=" ")
    print(f"({100 * low:.1f} ... {100 * high:.1f})")
    print(f"processor time of a fit: median {np.median(seconds):.1f} s, longest {max(seconds):.1f}")
    return int(not BAND[0] <= held / printed <= BAND[1] or max(seconds) > LONGEST)


def coverage(outcomes):
    """Return how many intervals hold the truth, and how many are printed."""
    each = [
        holds(parameter["interval"], parameter["truth"])
        for outcome in outcomes
        for parameter in outcome["parameters"].values()
        if parameter["interval"] is not None
    ]
    return sum(each), len(each)


if __name__ == "__main__":
    sys.exit(main())
