"""Count how often the stated error of a step's instant holds the truth.

Run it as ``python tests/studies/instants.py [COUNT]``. The records are synthetic: AC1A, AC8B, ST1A
and ST6B with typical data on open circuit, steps of 1 to 5 % up and down, sampled every 5 or 10 ms,
with noise of 1e-5 to 1e-3 of the level of each channel. The instant lies anywhere between samples.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from step_records import step_record

from exfit.records.inspection import inspect

COUNT = 40
KINDS = {
    "vt, efd, ifd": (("vt", "efd", "ifd"), False),
    "vt, efd, ifd, vref": (("vt", "efd", "ifd", "vref"), True),
    "vt, ifd": (("vt", "ifd"), False),
    "vt": (("vt",), False),
}


def main(count: int) -> None:
    """Print the table of the study."""
    table = Table("channels", "records", "one step", "held", "median error", "worst")
    for title, (channels, with_reference) in KINDS.items():
        outcomes = [outcome(seed, channels, with_reference) for seed in range(count)]
        found = [pair for pair in outcomes if pair is not None]
        off, stated = np.array(found).T
        held = int(np.sum(np.abs(off) <= stated))
        low = binomtest(held, len(found)).proportion_ci(0.95, "wilson").low
        table.add_row(
            title,
            f"{count}",
            f"{len(found)}",
            f"{held} ({100.0 * held / len(found):.0f} %, > {100.0 * low:.0f} %)",
            f"{np.median(stated):.2g} samples",
            f"{np.max(stated):.2g}",
        )
    Console().print(table)


def outcome(seed, channels, with_reference):
    """Return how far off an instant is and its stated error, in samples; None unless one step."""
    record = step_record(seed, with_reference)
    table = type(record.table)({name: record.table.content[name] for name in ("t", *channels)})
    steps = inspect(table).steps
    if len(steps) != 1:
        return None
    return (steps[0].at - record.at) / record.interval, steps[0].error / record.interval


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
