"""Records of configs/programmes/hydro_unit.yaml: both halves of a unit, typed for them alone.

``python tests/support/whole_unit.py sample_data`` writes them anew. A salient machine, an exciter
K / (1 + sTE) and HYGOV, integrated by DOP853; noise as a recorder of 16 bits has it, ten samples a
second.
"""

import sys
from pathlib import Path

import numpy as np
from typed_governors import TypedUnit, integrated

MACHINE = {
    "Tpd0": 5.6, "Tppd0": 0.05, "Tppq0": 0.08, "H": 3.6, "D": 0.0, "Xd": 1.05, "Xq": 0.68,
    "Xpd": 0.31, "Xppd": 0.24, "Xl": 0.15, "S10": 0.11, "S12": 0.37,
}  # fmt: skip
EXCITER = {"K": 60.0, "TE": 0.06}
GOVERNOR = {
    "R": 0.045, "r": 0.38, "Tr": 6.5, "Tf": 0.05, "Tg": 0.25, "VELM": 0.12, "TW": 1.3, "At": 1.15,
    "Dturb": 0.3, "qNL": 0.07,
}  # fmt: skip
NOISE = {"vt": 2e-4, "efd": 5e-3, "speed": 3e-5, "p": 1e-3, "gate": 1e-3}
SAMPLES = 10.0  # a second
ISOLATED = 1.0 / (0.5 - 0.15j)  # the load
TESTS = {  # seconds, channels, start (vt, E, R, X, P), changes of vref, pref, fs and the load
    "avr": (12.0, "vt efd", (1.0, 0.0, 1e9, 0.0), {"vref": ((1.0, 0.03),)}),
    "load": (60.0, "speed p gate", (1.0, 0.0, ISOLATED.real, ISOLATED.imag),
             {"load": ((2.03, 0.05),)}),
    "reference": (60.0, "speed p gate", (1.02, 1.0, 0.0, 0.25, 0.6), {"pref": ((2.03, -0.005),)}),
    "injection": (80.0, "speed p gate", (1.02, 1.0, 0.0, 0.25, 0.6),
                  {"fs": ((2.03, 0.003), (40.03, -0.003))}),
}  # fmt: skip


def response(test, unit):
    """Return the samples of a test by channel, with time, without noise."""
    seconds, channels, start, moves = test
    time = np.arange(0.0, seconds + 1e-9, 1.0 / SAMPLES)
    x0, vref, pref = unit.start(*start)
    E, R, X = start[1:4]

    def change(signal, t):
        return sum(size for at, size in moves.get(signal, ()) if t >= at)

    def network(t):
        if "load" not in moves:
            return E, R, X
        z = 1.0 / (1.0 / complex(R, X) + change("load", t))
        return E, z.real, z.imag

    def slopes(t, x):
        return unit.slopes(
            x, vref + change("vref", t), pref + change("pref", t), change("fs", t), *network(t)
        )

    breaks = [at for steps in moves.values() for at, _ in steps]
    states = integrated(slopes, x0, time, breaks, step=np.inf)
    seen = [unit.signals(x, *network(t)) for t, x in zip(time, states.T, strict=True)]
    columns = {"t": time}
    for channel in channels.split():
        columns[channel] = np.array([each[channel] for each in seen])
    return columns


def noisy(columns, rng):
    """Return samples of channels with the noise of a recorder."""
    noise = {name: NOISE[name] * rng.standard_normal(len(columns["t"]))
             for name in columns if name != "t"}  # fmt: skip
    return {name: samples + noise.get(name, 0.0) for name, samples in columns.items()}


def save(path, columns):
    """Write columns as a recorder of 16 bits does, by its digits."""
    form = ["%.2f", *["%.5f"] * (len(columns) - 1)]
    header = ",".join(columns)
    np.savetxt(path, np.transpose([*columns.values()]), form, ",", header=header, comments="")


def write(folder):
    """Write the record of each test to a file of a folder."""
    rng = np.random.default_rng(2026)
    unit = TypedUnit("GENSAL", MACHINE, EXCITER, "HYGOV", GOVERNOR)
    for name, test in TESTS.items():
        save(folder / f"hydro_unit_{name}.csv", noisy(response(test, unit), rng))


if __name__ == "__main__":
    write(Path(sys.argv[1]))
