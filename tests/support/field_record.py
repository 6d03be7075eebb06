"""A record as a plant's recorder writes it: the AC1A of the sample records in kV and amperes.

    python tests/field_record.py

writes sample_data/field_record.csv anew. The unit is simulated with the true values that
sample_data/README.md lists; what a recorder adds comes from a seeded generator.
"""

import tempfile
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import yaml
from places import ROOT

from exfit.case.load import load_case
from exfit.workflows import simulate

FILE = ROOT / "sample_data" / "field_record.csv"
SEED = 20
BEGAN = datetime(2015, 9, 20, 10, 51, 42)
FRACTION = 8_589_222  # of the first second, in units of 100 ns
LENGTH = 12.0  # s
STEPS = (4.6e-3, 5.0e-3)  # s between two samples
FINE = 1e-3  # s, of the simulation, between whose samples the record reads lines: 1e-6 pu off
AT, STEP, VT0 = 2.137, 0.05, 0.9972  # s after the first sample, pu, pu
UNIT = {
    "KA": 364.1523, "TA": 0.0542, "KF": 0.0413, "TF": 1.458, "TE": 1.6724, "KC": 0.486, "KD": 0.4039
}  # fmt: skip
RATED, AIR_GAP = 15.75, 550.0  # kV; A, the field current on the air-gap line at rated voltage
QUANTUM = {"vt": 5.5e-5 * RATED, "ifd": 0.1}  # kV, A
NOISE = {"vt": 1e-4 * RATED, "ifd": 0.4}  # kV, A
SPIKES = {"vt": {1.3: 0.25, 5.61: -0.31, 7.94: 0.22}, "ifd": {6.72: 45.0}}  # s: kV, A
GAP = (9.0, 9.04)  # s, long after the step has settled
HEAD = """\
Unit 2, breaker open, rated speed: step of the voltage reference by +5 %
Recorder channels 1 and 4
Date;Time;Ugen;If
;;kV;A
"""


def field_record() -> str:
    """Return the text of the record."""
    rng = np.random.default_rng(SEED)
    time = clock(rng)
    course, signals = response()
    recorded = {}
    for name, base in (("vt", RATED), ("ifd", AIR_GAP)):
        samples = base * np.interp(time, course, signals[name])
        samples += rng.normal(0.0, NOISE[name], len(time))
        for at, size in SPIKES[name].items():
            samples[np.searchsorted(time, at)] += size
        recorded[name] = QUANTUM[name] * np.round(samples / QUANTUM[name])
    kept = (time <= GAP[0]) | (time >= GAP[1])
    rows = zip(time[kept], recorded["vt"][kept], recorded["ifd"][kept], strict=True)
    return HEAD + "".join(row(*one) for one in rows)


def clock(rng: np.random.Generator) -> np.ndarray:
    """Return the instants (M,), s since the first, whole multiples of 100 ns."""
    steps = rng.uniform(*STEPS, round(LENGTH / STEPS[0]))
    time = np.concatenate([[0.0], np.cumsum(np.round(steps, 7))])
    return time[time <= LENGTH]


def response() -> tuple[np.ndarray, dict]:
    """Return the instants (M,) and the signals (M,) of the unit, per unit."""
    content = yaml.safe_load((ROOT / "configs" / "ac1a_typical.yaml").read_text(encoding="utf-8"))
    del content["record"], content["validate"]
    content["test"] = {"vt0": VT0, "duration": LENGTH, "vref": [{"at": AT, "step": STEP}]}
    content["simulation"] = {"output_step": FINE}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        case = load_case(path)
    found = simulate(case, case.values() | UNIT).response
    return found.time, dict(found.signals)


def row(time: float, vt: float, ifd: float) -> str:
    """Return a line: date, time of day, voltage and current with decimal commas."""
    ticks = round(time * 1e7) + FRACTION
    at = BEGAN + timedelta(seconds=ticks // 10_000_000)
    numbers = f"{vt:.6f};{ifd:.1f}".replace(".", ",")
    return f"{at:%d.%m.%Y};{at:%H:%M:%S}.{ticks % 10_000_000:07d};{numbers}\n"


if __name__ == "__main__":
    FILE.write_text(field_record(), encoding="utf-8")
