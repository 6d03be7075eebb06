"""The nonlinear regression sets of the NIST Statistical Reference Datasets.

The models are typed from the descriptions of the sets; data, starts and certified values are read
from ``reference/nist_strd.json``.
"""

import json

import numpy as np
from places import REFERENCE

LEVELS = ("lower", "average", "higher")  # of difficulty, as NIST grades the sets


def exponentials(b, x):
    return sum(b[k] * np.exp(-b[k + 1] * x) for k in range(0, len(b), 2))


def peak(height, middle, width, x):
    return height * np.exp(-((x - middle) ** 2) / width**2)


def gauss(b, x):
    return exponentials(b[:2], x) + peak(b[2], b[3], b[4], x) + peak(b[5], b[6], b[7], x)


def ratio(b, x):
    """A polynomial over one of the same degree whose constant is one."""
    degree = len(b) // 2
    above = sum(b[k] * x**k for k in range(degree + 1))
    return above / (1.0 + sum(b[degree + k] * x**k for k in range(1, degree + 1)))


def saturation(b, x):
    return b[0] * (1.0 - np.exp(-b[1] * x))


def chwirut(b, x):
    return np.exp(-b[0] * x) / (b[1] + b[2] * x)


def cycle(b, x):
    """The cycle of a period b[0]."""
    phase = 2.0 * np.pi * x / b[0]
    return b[1] * np.cos(phase) + b[2] * np.sin(phase)


def enso(b, x):
    return b[0] + cycle((12.0, b[1], b[2]), x) + cycle(b[3:6], x) + cycle(b[6:9], x)


MODELS = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1.0 / b[2]),
    "BoxBOD": saturation,
    "Chwirut1": chwirut,
    "Chwirut2": chwirut,
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "ENSO": enso,
    "Eckerle4": lambda b, x: b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": gauss,
    "Gauss2": gauss,
    "Gauss3": gauss,
    "Hahn1": ratio,
    "Kirby2": ratio,
    "Lanczos1": exponentials,
    "Lanczos2": exponentials,
    "Lanczos3": exponentials,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * np.exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Misra1a": saturation,
    "Misra1b": lambda b, x: b[0] * (1.0 - (1.0 + b[1] * x / 2.0) ** -2.0),
    "Misra1c": lambda b, x: b[0] * (1.0 - (1.0 + 2.0 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1.0 + b[1] * x),
    "Nelson": lambda b, x, celsius: b[0] - b[1] * x * np.exp(-b[2] * celsius),
    "Rat42": lambda b, x: b[0] / (1.0 + np.exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1.0 + np.exp(b[1] - b[2] * x)) ** (1.0 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - np.arctan(b[2] / (x - b[3])) / np.pi,
    "Thurber": ratio,
}
SETS = json.loads((REFERENCE / "nist_strd.json").read_text(encoding="utf-8"))


def residuals_of(name):
    """The residuals of a set as a function of its parameters."""
    y, x = np.array(SETS[name]["y"]), np.array(SETS[name]["x"])
    measured = np.log(y) if name == "Nelson" else y  # whose model is that of log(y)
    return lambda b: MODELS[name](b, *x) - measured
