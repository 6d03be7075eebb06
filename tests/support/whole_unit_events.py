"""Grid events of a whole unit by another simulation, and the case that finds twelve of its data.

A salient machine, an exciter K / (1 + sTE), a stabiliser of one lead-lag and HYGOV behind a line to
a source that swings and dips, integrated by DOP853 and sampled as a measurement unit does.
"""

from functools import cache
from math import radians

import numpy as np
import yaml
from event_sets import LENGTHS, OPERATING, REST, angle_at, bounds
from typed_governors import TypedUnit, integrated
from whole_unit import EXCITER, GOVERNOR, MACHINE

STABILISER = {"KS": 12.0, "T5": 8.0, "T1": 0.18, "T2": 0.03}
R, X, E = 0.005, 0.3, 1.0
COURSES = (  # that no limit is reached
    (7.0, 0.9, 0.25, 0.03, 0.8),
    (-5.0, 1.3, 0.35, 0.015, 0.6),
    (20.0, 0.6, 0.30, 0.04, 0.9),
)
RATE = 30.0  # samples a second
NOISE = {"vt": 1e-4, "angle": 6e-5, "p": 2e-4, "q": 2e-4}  # pu and rad
FREE = {  # start, and what factor the bounds are away
    "": {"K": (120.0, 5), "TE": (0.12, 5)},
    "machine": {"H": (2.8, 2), "Tpd0": (4.5, 2), "Xd": (1.2, 1.5)},
    "stabiliser": {"KS": (20.0, 10), "T1": (0.1, 5)},
    "governor": {"R": (0.06, 5), "r": (0.6, 5), "Tr": (4.0, 5), "TW": (0.9, 4), "Tg": (0.4, 5)},
}
PARTS = {"machine": MACHINE, "stabiliser": STABILISER, "governor": GOVERNOR}
TRUTH = EXCITER | {f"{part}.{name}": v for part, own in PARTS.items() for name, v in own.items()}


class StabilisedUnit(TypedUnit):
    """A unit with KS sT5 / (1 + sT5) (1 + sT1) / (1 + sT2) of its speed; two states more, last."""

    def start(self, *at):
        x, vref, pref = super().start(*at)
        return [*x, 0.0, 0.0], vref, pref

    def slopes(self, x, vref, pref, fs, E, R, X, turned=0.0):
        s, (washed, lagged) = STABILISER, x[-2:]
        high = s["KS"] * (x[5] - washed)
        vs = lagged + s["T1"] / s["T2"] * (high - lagged)
        own = super().slopes(x[:-2], vref + vs, pref, fs, E, R, X, turned)
        return [*own, (x[5] - washed) / s["T5"], (high - lagged) / s["T2"]]


@cache
def exact(number):
    """Return time and the columns vt, angle, p, q of an event without noise."""
    p0, course, length = OPERATING[number][0], COURSES[number], LENGTHS[number]
    unit = StabilisedUnit("GENSAL", MACHINE, EXCITER, "HYGOV", GOVERNOR)
    x0, vref, pref = unit.start(1.01, E, R, X, p0)
    time = np.arange(0.0, length + 1e-9, 1.0 / RATE)

    def turned(t):
        return radians(angle_at(t, *course))

    def slopes(t, x):
        return unit.slopes(x, vref, pref, 0.0, E, R, X, turned(t))

    rows = []
    for t, x in zip(time, integrated(slopes, x0, time, [REST], step=np.inf).T, strict=True):
        seen = unit.signals(x, E, R, X, turned(t))
        v_d, v_q, *_ = unit.machine.stator([*x[:4], x[4] - turned(t), x[5]], E, R, X)
        rows.append([seen["vt"], x[4] - np.arctan2(v_d, v_q), seen["p"], seen["q"]])
    return time, dict(zip(NOISE, np.transpose(rows), strict=True))


def write_records(folder, seed):
    """Write the records of the three events with new noise."""
    rng = np.random.default_rng([2026, seed])
    for number in range(len(COURSES)):
        time, clean = exact(number)
        noisy = [y + NOISE[name] * rng.standard_normal(len(time)) for name, y in clean.items()]
        np.savetxt(folder / f"event{number}.csv", np.transpose([time, *noisy]), "%.7g", ",",
                   header=",".join(["t", *NOISE]), comments="")  # fmt: skip


def write_case(folder, **sections):
    """Write the case of the records, and return its path."""
    given = {
        part: {
            "parameters": {k: v for k, v in data.items() if k not in FREE[part]},
            "free": bounds(FREE[part]),
        }
        for part, data in PARTS.items()
    }
    given["stabiliser"]["parameters"] |= {
        "A1": 0.0, "A2": 0.0, "T3": 0.0, "T4": 0.0, "T6": 0.0, "VSTMAX": 1.0, "VSTMIN": -1.0
    }  # fmt: skip
    channels = {"vt": "vt", "angle": {"column": "angle", "unit": "rad"}, "p": "p", "q": "q"}
    content = {
        "model": "SEXS",
        "given": "exact",
        "plant": {"type": "grid-playback", "machine": "GENSAL", "network": {"f0": 60},
                  **given["machine"]},
        "stabiliser": {"model": "PSS1A", "inputs": ["speed"], **given["stabiliser"]},
        "governor": {"model": "HYGOV", **given["governor"]},
        "records": [
            {"name": f"event-{k}",
             "record": {"file": f"event{k}.csv", "time": "t", "channels": channels}}
            for k in range(len(COURSES))
        ],
        "parameters": {"fixed": {"TATB": 1.0, "TB": 0.0, "EMAX": 8.0, "EMIN": -8.0},
                       "free": bounds(FREE[""])},
        **sections,
    }  # fmt: skip
    path = folder / "case.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path
