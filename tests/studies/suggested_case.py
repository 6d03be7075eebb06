"""Compare a case as `exfit inspect` suggests it with the plain one, on records made by simulation.

Run it as ``python tests/studies/suggested_case.py [REPEATS]``. Each of 20 records has vt, efd and
ifd (or two of them) of a unit drawn by a seeded generator, with noise that differs by channel and
what no model matches: the ripple of a bridge in efd, an error of calibration or a slow drift in
ifd, errors that are coloured, coarse rounding, spikes. The suggested case has the channels and the
weights that the inspection of the file writes; the plain one has the channels alone. Both search
from the same start.

Compared is the error of the free parameters in per cent, root mean square over the parameters and
REPEATS drawings of the noise.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
import yaml
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from channel_records import response_of
from records import write

import exfit
from exfit.case.case import Case
from exfit.case.case_draft import CaseDraft
from exfit.case.suggestion import record_section, weights_section
from exfit.records.formats import open_table
from exfit.records.inspection import inspect

MODELS = Path(__file__).parents[2] / "configs" / "models"
FREE = {
    "ac1a": ("KA", "TE", "KF", "TF", "TA"),
    "ac8b": ("KPR", "KIR", "KDR", "TE"),
    "sexs": ("K", "TB", "TE"),
    "dc1a": ("KA", "TA", "KF", "TF"),
    "exst1": ("KA", "TA", "KF", "TF"),
}
RECORDS, REPEATS, SEED = 20, 3, 1403
STEP, SAMPLING, DURATION = 0.02, 0.01, 10.0  # pu, s, s: the step meets no limit
SPREAD = 1.6  # of a true value to what is typical, and of a start to the true value, a factor
NOISE = {"vt": (2e-5, 3e-4), "efd": (1e-3, 3e-2), "ifd": (3e-4, 1e-2)}  # pu, drawn between these
RIPPLE, CALIBRATION, DRIFT = 0.15, 0.01, 0.01  # pu crest, share, pu: at most
WORKERS = 2  # processes
LIMIT = 1.1  # of the plain case's error


@dataclass(frozen=True)
class Unit:
    """A unit with its true values, the case of its record, and what disturbs the record."""

    name: str
    content: dict
    truth: dict
    noise: dict
    disturbance: str


DISTURBANCES = ("none", "ripple", "calibration", "drift", "coloured", "coarse", "spikes")


def unit(number):
    """Return one of the 20 units, drawn by its number."""
    rng = np.random.default_rng([SEED, number])
    name = [*FREE][number % len(FREE)]
    content = yaml.safe_load((MODELS / f"{name}.yaml").read_text())
    fixed, free, truth = content["parameters"]["fixed"], {}, {}
    for symbol in FREE[name]:
        truth[symbol] = fixed.pop(symbol) * SPREAD ** rng.uniform(-1.0, 1.0)
        start = truth[symbol] * SPREAD ** rng.uniform(-1.0, 1.0)
        free[symbol] = {"start": start, "min": start / 10.0, "max": start * 10.0}
    signals = ("vt", "efd", "ifd") if number % 4 else ("vt", "ifd")
    content["test"] = {"vt0": 1.0, "vref": [{"at": 1.0, "step": STEP}]}
    content["record"] = {"channels": {signal: signal for signal in signals}}
    content["parameters"]["free"] = free
    noise = {signal: np.exp(rng.uniform(*np.log(NOISE[signal]))) for signal in signals}
    return Unit(name, content, truth, noise, DISTURBANCES[number % len(DISTURBANCES)])


def recorded(made, clean, time, rng):
    """Return the channels as a recorder shows them."""
    shown = {name: y + made.noise[name] * rng.standard_normal(len(y)) for name, y in clean.items()}
    aside = "efd" if "efd" in shown else "ifd"
    if made.disturbance == "ripple":
        angle = (2.0 * np.pi * 50.0 * 1.0007 * time) % (np.pi / 3.0)
        shown[aside] += RIPPLE * (np.cos(angle + 0.7) - np.cos(0.7 + np.pi / 6.0))
        shown[aside][angle < 0.05] -= 3.0 * RIPPLE
    elif made.disturbance == "calibration":
        shown["ifd"] *= 1.0 + CALIBRATION
    elif made.disturbance == "drift":
        shown["ifd"] += DRIFT * time / time[-1]
    elif made.disturbance == "coloured":
        shown[aside] += 3.0 * made.noise[aside] * coloured(len(time), 0.9, rng)
    elif made.disturbance == "coarse":
        shown = {name: np.round(y / (3.0 * made.noise[name])) * 3.0 * made.noise[name]
                 for name, y in shown.items()}  # fmt: skip
    elif made.disturbance == "spikes":
        places = rng.choice(np.arange(20, len(time) - 20), 3, replace=False)
        shown["vt"][places] += 0.02
    return shown


def coloured(count, phi, rng):
    """Return an autoregressive sequence (count,) of unit variance."""
    shocks = rng.standard_normal(count) * np.sqrt(1.0 - phi**2)
    values = np.empty(count)
    last = rng.standard_normal()
    for k, shock in enumerate(shocks):
        last = values[k] = phi * last + shock
    return values


def errors(made, channels, sections, record):
    """Return the errors of the free parameters (N,), %, of a fit with these channels."""
    content = {**made.content, "record": {"channels": channels}, **sections}
    result = exfit.fit(Case.from_dict(content, record))
    return [100.0 * (result.parameters[name].value / made.truth[name] - 1.0) for name in made.truth]


def suggested(record, signals, folder):
    """Return channels and estimate section that the inspection of a record's file suggests."""
    file = write(folder / "record.csv", t=record.time, **record.signals)
    inspection = inspect(open_table(file))
    section = yaml.safe_load(CaseDraft(record_section(inspection, file.name)).text)
    channels = {signal: section["record"]["channels"][signal] for signal in signals}
    comparison = {
        signal: {"column": signal, **(entry if isinstance(entry, dict) else {})}
        for signal, entry in channels.items()
    }
    return comparison, yaml.safe_load(CaseDraft(weights_section(inspection)).text)


def compare(number, repeats):
    """Return a unit's row: name, disturbance, errors of both cases, largest ratio, what differs."""
    made = unit(number)
    time = np.arange(0.0, DURATION, SAMPLING)
    clean = response_of(made.content, made.truth, time)
    plain_errors, suggested_errors, outliers = [], [], []
    with TemporaryDirectory() as folder:
        for repeat in range(repeats):
            rng = np.random.default_rng([SEED, number, repeat])
            record = exfit.Record.from_arrays(time, recorded(made, clean, time, rng))
            channels, sections = suggested(record, clean, Path(folder))
            plain = made.content["record"]["channels"]
            plain_errors.append(errors(made, plain, {}, record))
            suggested_errors.append(errors(made, channels, sections, record))
            outliers += [name for name, entry in channels.items() if "outliers" in entry]
    return made, np.array(plain_errors), np.array(suggested_errors), sorted(set(outliers))


def rms(values):
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def main(repeats):
    """Print the table; exit code 1 where a suggested case is worse by more than a tenth."""
    table = Table("unit", "channels", "disturbance", "outliers", "plain %", "suggested %", "ratio")
    ratios = []
    with ProcessPoolExecutor(WORKERS) as pool:
        for row in pool.map(compare, range(RECORDS), [repeats] * RECORDS):
            made, plain, own, outliers = row
            ratios.append(rms(own) / rms(plain))
            cells = (made.name, ", ".join(made.noise), made.disturbance, ", ".join(outliers) or "-")
            numbers = (f"{rms(plain):.2f}", f"{rms(own):.2f}", f"{ratios[-1]:.2f}")
            table.add_row(*cells, *numbers)
            print("| " + " | ".join((*cells, *numbers)) + " |", flush=True)
    Console().print(table)
    print(f"ratio: median {np.median(ratios):.2f}, largest {max(ratios):.2f}")
    return int(max(ratios) > LIMIT)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS))
