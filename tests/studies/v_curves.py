"""V-curve points of machines with known data: how often the printed intervals hold them.

    python tests/studies/v_curves.py 200

Every set has 15 points at three powers, noise of 0.3 % of the base of ifd, other data, another base
and another start of the fit.
"""

import sys
from collections import Counter, defaultdict
from math import inf
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from exfit.features.programme.v_curve import (  # noqa: E402
    FieldMeasurement,
    PointsOnLoad,
    field_on_load,
    v_curve,
)
from exfit.fitting.parameters import FreeParameter  # noqa: E402
from exfit.models.machines import MACHINES  # noqa: E402
from exfit.models.sheet import typical  # noqa: E402

NOISE = 0.003  # pu
POWERS = np.repeat([0.05, 0.4, 0.8], 5)
REACTIVE = np.tile([-0.3, -0.1, 0.1, 0.3, 0.5], 3)
LIMITS = {"Xd": (0.4, 5.0), "Xq": (0.35, 5.0), "S10": (0.0, 1.0), "S12": (0.0, 2.0)}
LOWEST_XQ = {"GENROU": 0.56, "GENROE": 0.56}  # above X'q


def drawn(machine, generator):
    """Return a machine's data, and a start of the fit some 20 % off."""
    data = typical(machine.sheet)
    data["Xd"] *= generator.uniform(0.85, 1.15)
    data["Xq"] = min(data["Xq"] * generator.uniform(0.85, 1.0), 0.98 * data["Xd"])
    data["S10"] = generator.uniform(0.05, 0.2)
    data["S12"] = data["S10"] * generator.uniform(3.0, 5.0)
    start = {name: data[name] * generator.uniform(0.8, 1.2) for name in LIMITS}
    return data, start


def study(name, count):
    machine, holds, widths, left_open = MACHINES[name], Counter(), defaultdict(list), Counter()
    for seed in range(count):
        generator = np.random.default_rng(seed)
        data, start = drawn(machine, generator)
        base = generator.uniform(300.0, 1500.0)
        p = POWERS + generator.normal(0.0, 0.01, len(POWERS))
        q = REACTIVE + generator.normal(0.0, 0.02, len(POWERS))
        vt = 1.0 + 0.05 * (q - 0.1)
        ifd = field_on_load(machine, data, p, q, vt) + generator.normal(0.0, NOISE, len(p))
        guess = base * generator.uniform(0.8, 1.25)
        free_base = FreeParameter("ifd.base", guess, 100.0, 5000.0, logarithmic=True)
        reading = FieldMeasurement(base * ifd, "A", guess, free_base=free_base)
        free = []
        for symbol, (low, high) in LIMITS.items():
            low = LOWEST_XQ.get(name, low) if symbol == "Xq" else low
            free.append(FreeParameter(symbol, max(start[symbol], low), low, high, low > 0.0))
        points = PointsOnLoad(p, q, vt, {"ifd": reading})
        curve = v_curve(machine, data, points, free)
        truth = {**data, "ifd.base": base}
        for parameter, fitted in curve.parameters.items():
            low, high = fitted.interval or (None, None)
            low, high = -inf if low is None else low, inf if high is None else high
            holds[parameter] += low <= truth[parameter] <= high
            left_open[parameter] += not fitted.determined
            widths[parameter].append((high - low) / truth[parameter])
    for parameter in widths:
        width = float(np.median(widths[parameter]))
        print(
            f"{name} {parameter}: {100.0 * holds[parameter] / count:.1f} % hold, "
            f"width {100.0 * width:.2g} %, open {100.0 * left_open[parameter] / count:.0f} %"
        )


if __name__ == "__main__":
    for machine_name in ("GENSAL", "GENROU"):
        study(machine_name, int(sys.argv[1]) if len(sys.argv) > 1 else 20)
