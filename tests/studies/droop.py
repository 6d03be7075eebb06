"""Permanent droop and dead band from an hour of normal operation: how often intervals hold them.

    python tests/studies/droop.py 200

Governors with a dead band, a TGOV1 by its gate and by its power and the gate of a hydro governor
with a transient droop, follow a frequency that wanders as that of a grid: by 18 to 48 mHz,
correlated over 1 to 3 minutes. Speed (1 mHz), gate (0.1 %) and power (0.2 %) are recorded once a
second with noise. Then 12 points of gate over power of a HYGOV at rest, with noise of 0.1 %.
"""

import sys
from collections import Counter, defaultdict
from math import inf
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from exfit.features.programme.governor_curve import droop_curve, gate_curve  # noqa: E402
from exfit.fitting.parameters import FreeParameter  # noqa: E402
from exfit.models import GOVERNORS  # noqa: E402
from exfit.models.sheet import typical  # noqa: E402

LENGTH, SAMPLING, STEP = 3600.0, 1.0, 0.02  # s
NOISE = {"speed": 1.0 / 60e3, "gate": 1e-3, "p": 2e-3}  # pu
T2, T3 = 2.5, 8.0  # s


def behind(u, T):
    """Return 1 / (1 + sT) of samples at STEP, from rest."""
    share = 1.0 - np.exp(-STEP / T)
    return lfilter([share], [1.0, share - 1.0], u - u[0]) + u[0]


def drawn(generator, kind="steam"):
    """Return the truth, and the columns of an hour."""
    truth = {
        "R": generator.uniform(0.03, 0.08),
        "DBH": generator.uniform(1e-4, 6e-4),
        "DBL": -generator.uniform(1e-4, 6e-4),
    }
    size, memory = generator.uniform(3e-4, 8e-4), generator.uniform(60.0, 180.0)
    count, decay = round(LENGTH / STEP), np.exp(-STEP / memory)
    kicks = generator.normal(0.0, size * np.sqrt(1.0 - decay**2), count)
    dw = behind(lfilter([1.0], [1.0, -decay], kicks), 4.0)  # s: the inertia of a grid
    demand = 0.6 - (dw - np.clip(dw, truth["DBL"], truth["DBH"])) / truth["R"]
    if kind == "hydro":
        transient, reset = generator.uniform(0.2, 0.5), generator.uniform(3.0, 8.0)
        slow = behind(demand, reset * (1.0 + transient / truth["R"]))
        demand = slow + truth["R"] / (truth["R"] + transient) * (demand - slow)
    gate = behind(demand, generator.uniform(0.3, 1.0))
    power = behind(gate, T3) + T2 / T3 * (gate - behind(gate, T3))
    every = round(SAMPLING / STEP)
    signals = {"speed": 1.0 + dw[::every], "gate": gate[::every], "p": power[::every]}
    noisy = {
        name: signal + generator.normal(0.0, NOISE[name], len(signal))
        for name, signal in signals.items()
    }
    return truth, {"time": np.arange(0.0, LENGTH, SAMPLING), **noisy}


def fitted(columns, generator, answer="gate"):
    """Return the curve of an hour, from a start that is off by up to a half."""
    free = [
        FreeParameter("R", 0.05 * generator.uniform(0.6, 1.5), 0.01, 0.3, logarithmic=True),
        FreeParameter("DBH", 3e-4, 0.0, 5e-3, logarithmic=False),
        FreeParameter("DBL", -3e-4, -5e-3, 0.0, logarithmic=False),
    ]
    answered = answer, columns[answer]
    data = typical(GOVERNORS["TGOV1"].sheet)
    return droop_curve(GOVERNORS["TGOV1"], data, columns["time"], columns["speed"], answered, free)


def points(generator, count=12):
    """Return the truth, and the gate curve of a HYGOV by points at rest."""
    truth = {"At": generator.uniform(1.0, 1.4), "qNL": generator.uniform(0.03, 0.12)}
    power = np.linspace(0.05, 0.85, count)
    gate = power / truth["At"] + truth["qNL"] + generator.normal(0.0, NOISE["gate"], count)
    free = [
        FreeParameter("At", 1.2, 0.5, 2.0, logarithmic=True),
        FreeParameter("qNL", 0.05, 0.0, 0.3, logarithmic=False),
    ]
    governor = GOVERNORS["HYGOV"]
    return truth, gate_curve(governor, typical(governor.sheet), power, gate, free)


def held(curve, truth):
    """Return whether each interval holds the truth, and its width over that, by name."""
    found = {}
    for name, value in truth.items():
        low, high = curve.parameters[name].interval or (None, None)
        low, high = -inf if low is None else low, inf if high is None else high
        found[name] = (low <= value <= high, (high - low) / abs(value))
    return found


def curves(seed):
    """Yield what is fitted, the truth and the curve, of each kind in turn."""
    for kind, answer in (("steam", "gate"), ("steam", "p"), ("hydro", "gate")):
        generator = np.random.default_rng(seed)
        truth, columns = drawn(generator, kind)
        yield f"{kind}, {answer}", truth, fitted(columns, generator, answer)
    yield "gate over p", *points(np.random.default_rng(seed))


def study(count):
    """Print how often each interval holds, and how wide they are."""
    holds, widths = Counter(), defaultdict(list)
    for seed in range(count):
        for kind, truth, curve in curves(seed):
            for name, (inside, width) in held(curve, truth).items():
                holds[kind, name] += inside
                widths[kind, name].append(width)
    for (kind, name), each in widths.items():
        share, width = 100.0 * holds[kind, name] / count, 100.0 * float(np.median(each))
        print(f"{kind}: {name}: {share:.1f} % hold, width {width:.2g} %")


if __name__ == "__main__":
    study(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
