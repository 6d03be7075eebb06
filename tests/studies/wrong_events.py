"""Name what is wrong with files of grid events before a fit, and accuse no sound one.

Run it as ``python tests/studies/wrong_events.py [DRAWN]``. Thirty files with a fault and thirty
sound ones are described in tests/support/event_files.py. DRAWN further sound events (100) have
exciters, machines, operating points, swings, noise and rates that are drawn; the case has the
typical exciter and the machine of the collection, which is up to 40 % off the drawn one. Each of
them is looked at once as it is and once with a fault that is drawn.
"""

import os
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from event_files import BAD, FREE, GOOD, bad_file, good_file, noisy, sound_file
from unit_events import MACHINE, simulated

from exfit.errors import ExfitError
from exfit.verdict.diagnostics import event_warnings

MODELS = ("AC8B", "AC1A", "ST1A", "SEXS", "EXST1", "AC7B", "DC4B")
OFF = 0.4  # of the machine's data
SHOWN = 60  # letters of a message


def messages(file, folder):
    """Return what is said of a file before a fit."""
    try:
        return [*event_warnings(file.written(folder))]
    except ExfitError as fault:
        return [str(fault)]


def drawn_unit(rng):
    """Return how a drawn sound event is simulated."""
    reactances = rng.uniform(1.0 - 0.5 * OFF, 1.0 + 0.5 * OFF)
    machine = {
        name: value * (reactances if name.startswith("X") else 1.0)
        for name, value in MACHINE.items()
    }
    machine["H"] *= rng.uniform(1.0 - OFF, 1.0 + OFF)
    machine["Tpd0"] *= rng.uniform(1.0 - OFF, 1.0 + OFF)
    return {
        "model": MODELS[rng.integers(len(MODELS))],
        "machine": machine,
        "start": (rng.uniform(0.2, 0.95), rng.uniform(-0.15, 0.3)),
        "rate": int(rng.choice([50, 60])),
        "size": rng.uniform(0.5, 2.5),
        "swings": rng.uniform(0.3, 1.6),
        "damping": rng.uniform(0.1, 0.8),
        "fall": rng.uniform(-2.0, 3.0),
    }


def main() -> None:
    drawn = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    console, counts = Console(), Counter()
    table = Table("file", "named", "first message")
    with TemporaryDirectory() as name:
        folder = Path(name)
        course = simulated(folder)
        for fault, (_, word) in BAD.items():
            said = messages(bad_file(fault, course), folder)
            named = any(word in text for text in said)
            counts["named"] += named
            first = said[0].rpartition("/")[2][:SHOWN] if said else ""
            table.add_row(fault, "yes" if named else "other" if said else "no", first)
        for sound in GOOD:
            said = messages(good_file(sound, folder), folder)
            counts["accused"] += bool(said)
            if said:
                table.add_row(sound, "accused", said[0][:SHOWN])
        for seed in range(drawn):
            _look_at(seed, folder, counts, table)
    console.print(table)
    console.print(
        f"named: {counts['named']} of {len(BAD)}; accused: {counts['accused']} of {len(GOOD)}"
    )
    console.print(
        f"drawn: {counts['drawn named']} of {counts['drawn']} named, {counts['drawn said']} with "
        f"any message; sound ones accused: {counts['drawn accused']} of {counts['drawn']}"
    )


def _look_at(seed, folder, counts, table):
    """Count whether a drawn event is accused, and whether it is named with a fault."""
    rng = np.random.default_rng(seed)
    unit = drawn_unit(rng)
    try:
        course = simulated(folder, **unit)
    except ExfitError:  # the exciter cannot hold that operating point
        counts["without rest"] += 1
        return
    counts["drawn"] += 1
    case = {
        "model": unit["model"],
        "parameters": None if unit["model"] != "AC8B" else {"free": FREE},
    }
    file = sound_file(noisy(course, seed, rng.uniform(0.3, 4.0)), rng.uniform(-0.3, 0.3))
    file.case = case
    said = messages(file, folder)
    counts["drawn accused"] += bool(said)
    if said:
        table.add_row(f"drawn {seed}", "accused", said[0][:SHOWN])
    fault = [*BAD][rng.integers(len(BAD))]
    spoiled = bad_file(fault, course)
    spoiled.case = case
    said = messages(spoiled, folder)
    named = any(BAD[fault][1] in text for text in said)
    counts["drawn named"] += named
    counts["drawn said"] += bool(said)
    if not named:
        first = said[0].rpartition("/")[2][:SHOWN] if said else ""
        table.add_row(f"drawn {seed}: {fault}", "other" if said else "no", first)


if __name__ == "__main__":
    main()
