"""Which curve of which program each model is compared with, and by how much vt differs.

Run it as ``python tests/studies/programs.py``: it writes the table into docs/verification.md.
Limits act where the response changes with all of them a thousand times as wide.
"""

import re
import sys
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "plants"))

from test_andes import UNITS, in_a_dip, read, unit_of
from two_buses import case_of, cases, reference

from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"
MARKS = "<!-- programs -->", "<!-- /programs -->"
CATALOGUES = (MODELS, STABILISERS, GOVERNORS, LOAD_CONTROLLERS, LIMITERS, MACHINES)
RHEOSTATS = ("DC3A", "IEEET4")  # whose VRMAX and VRMIN are part of a rate, too
NO_LIMIT, WIDE, ACTS = 900.0, 1e3, 1e-8


def models_of(unit):
    """Return the names of the models of a unit."""
    stabiliser = None if unit.stabiliser is None else unit.stabiliser.model
    parts = (unit.exciter, unit.machine, stabiliser, unit.governor)
    names = [part.name for part in parts if part is not None]
    moved = unit.governor is not None and any("load_controller" in x for x in unit.governor.states)
    return [*names, *(LOAD_CONTROLLERS if moved else ())]


def widened(values, exciter):
    """Return the limits among values that are some, a thousand times as wide."""
    rates = ("VRMAX", "VRMIN") if exciter in RHEOSTATS else ()
    limits = (name for name in values if re.search(r"(MAX|MIN)\d?$", name) and name not in rates)
    acting = {name: values[name] for name in limits if 0.0 < abs(values[name]) < NO_LIMIT}
    return {
        name: limit / WIDE if limit > 0.0 and "MIN" in name else limit * WIDE
        for name, limit in acting.items()
    }


def compared(name):
    """Return the models of a case of a program, its difference, and whether limits act.

    The difference is that of vt, or where the program shows none that of the rotor's angle.
    """
    told, rows = reference(name)
    times, case = [row["t"] for row in rows], case_of(told)
    signal = "vt" if "vt" in rows[0] else "degrees"
    got = [row[signal] for row in case.shown(times)]
    wide = widened(case.values, case.unit.exciter.name)
    free = [row[signal] for row in case_of(told, **wide).shown(times)]
    apart = max(abs(ours - row[signal]) for ours, row in zip(got, rows, strict=True))
    acts = max(abs(a - b) for a, b in zip(got, free, strict=True)) > ACTS
    models = models_of(case.unit)
    if "machine" in told:  # its exciter holds the field voltage
        models.remove(case.unit.exciter.name)
    unit = "" if signal == "vt" else "°"
    return models, (f"{told['program']} {told['version']}", unit), apart, acts


def table():
    """Return the rows of the table: model, program, vt, limits."""
    found = defaultdict(list)
    for name in cases():
        models, *row = compared(name)
        for model in models:
            found[model].append(row)
    for name in UNITS:
        apart, _ = in_a_dip(name)
        for model in models_of(unit_of(read(f"andes_load_{name}")[0])[0]):
            found[model].append([("ANDES 2.0.0", ""), float(apart["vt"]), False])
    yield "| model | program | curves | vt differs by, pu, or the rotor's angle, ° | limits act |"
    yield "|---|---|---|---|---|"
    without = []
    for model in sorted(name for catalogue in CATALOGUES for name in catalogue):
        programs = defaultdict(list)
        for program, *row in found[model]:
            programs[program].append(row)
        for (program, unit), rows in programs.items():
            worst = max(apart for apart, _ in rows)
            acts = "yes" if any(acts for _, acts in rows) else "no"
            yield f"| {model} | {program} | {len(rows)} | {worst:.1e}{unit} | {acts} |"
        without += [] if programs else [model]
    yield ""
    yield f"No curve on load: {', '.join(without)}. Those rest on diagrams and second typings."


def main():
    """Write the table."""
    before, rest = PAGE.read_text("utf-8").split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    text = "\n".join([MARKS[0], "", *table(), "", MARKS[1]])
    PAGE.write_text(before + text + after, "utf-8")


if __name__ == "__main__":
    main()
