"""Recorder's files of twenty minutes with four tests, of units whose truth is known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from channel_records import response_of
from places import CONFIGS

from exfit.features.planner.psse import record_text
from exfit.features.planner.records import alternatives
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical

FREE = {  # what is off in the planner's file, of models as `configs/models` has them
    "AC8B": ("KPR", "KIR", "KDR", "TDR", "TE"),
    "AC1A": ("KA", "TE", "KF", "TF", "TA"),
    "ST1A": ("KA", "TC", "TB"),
    "SEXS": ("K", "TATB", "TB", "TE"),
    "DC1A": ("KA", "TA", "KF", "TF", "TE"),
    "EXST1": ("KA", "TA", "KF", "TF"),
}
SEED = 1501
LENGTH = 1200.0  # s
FIRST, APART = (60.0, 200.0), (150.0, 300.0)  # s: before the first test, between two
SIZES = (0.02, 0.03, 0.05)  # pu
INTERVALS = (0.01, 0.02)  # s between two samples
NOISE = (5e-5, 4e-4)  # pu of vt
SPREAD = 1.5  # of a true value to what is typical, and of the planner's to the true one: a factor
RATED = (10.5, 13.8, 15.75, 18.0)  # kV, line to line
NAMES = {"t": "Time (s)", "vt": "Ugen (kV)", "ifd": "If (A)"}
BUS = 101


@dataclass(frozen=True)
class ProgrammeFile:
    """A recorder's file with four tests and the planner's file of its unit, and their truth.

    ``table`` is what was noted of the tests, ``tests`` are pairs (s, pu), ``levels`` (pu) those of
    vt before them, ``truth`` the exciter's values, ``base`` (kV) that of vt.
    """

    record: Path
    table: Path
    dyr: Path
    model: str
    tests: tuple[tuple[float, float], ...]
    levels: tuple[float, ...]
    truth: dict[str, float]
    base: float


def drawn_tests(rng):
    """Return four steps (s, pu) of the reference, each back to where it was."""
    at, tests = rng.uniform(*FIRST), []
    for size in rng.choice(SIZES, 2):
        sign = rng.choice([1.0, -1.0])
        for step in (sign * size, -sign * size):
            tests.append((round(float(at), 3), float(step)))
            at += rng.uniform(*APART)
    return tuple(tests)


def programme_file(number, folder, seed=SEED):
    """Write one of the files, drawn by its number, and return what is in them."""
    rng = np.random.default_rng([seed, number])
    name = [*FREE][number % len(FREE)]
    content = yaml.safe_load((CONFIGS / "models" / f"{name.lower()}.yaml").read_text("utf-8"))
    values = {**typical(MODELS[name].sheet), **content["parameters"].get("fixed", {})}
    values |= {key: free["start"] for key, free in content["parameters"].get("free", {}).items()}
    truth = {key: values[key] * SPREAD ** rng.uniform(-1.0, 1.0) for key in FREE[name]}
    planned = {key: value * SPREAD ** rng.uniform(-1.0, 1.0) for key, value in truth.items()}
    tests = drawn_tests(rng)
    interval, noise = float(rng.choice(INTERVALS)), float(np.exp(rng.uniform(*np.log(NOISE))))
    base = float(rng.choice(RATED))
    time = np.arange(0.0, LENGTH, interval)
    clean = _response({**content, "parameters": {"fixed": {**values, **truth}}}, tests, time)
    noisy = clean["vt"] + noise * rng.standard_normal(len(time))
    record = folder / f"unit{number}.csv"
    rows = np.column_stack([time, base * noisy, 700.0 * clean["ifd"]])
    header = ",".join(NAMES.values())
    np.savetxt(record, rows, ("%.3f", "%.5f", "%.2f"), ",", header=header, comments="")
    dyr = folder / f"unit{number}.dyr"
    dyr.write_text(_dyr(content["plant"], name, {**values, **truth, **planned}))
    table = folder / f"unit{number}-tests.csv"
    noted = "".join(f"{at:.0f},{step:g}\n" for at, step in tests)
    table.write_text("at,step\n" + noted)
    before = np.searchsorted(time, [at - 1.0 for at, _ in tests])
    levels = tuple(map(float, clean["vt"][before]))
    return ProgrammeFile(record, table, dyr, name, tests, levels, {**values, **truth}, base)


def _response(content, tests, time):
    """Return vt and ifd (M,) of a unit, tested as said."""
    steps = [{"at": at, "step": step} for at, step in tests]
    content = {
        **content,
        "test": {"vt0": 1.0, "vref": steps},
        "record": {"channels": {"vt": "vt", "ifd": "ifd"}},
    }
    return response_of(content, {}, time)


def _dyr(plant, name, values):
    machine = MACHINES[plant["machine"]]
    data = {**typical(machine.sheet), **plant["parameters"]}
    records = [
        record_text(alternatives(model)[0], given, BUS, "1")
        for model, given in ((machine, data), (MODELS[name], values))
    ]
    return "\n".join(records) + "\n"
