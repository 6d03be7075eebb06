"""Problems of least squares with known minima, and random ones with bounds.

Moré, Garbow & Hillstrom 1981 (data and minima), and the nonlinear regression sets of the NIST
Statistical Reference Datasets with their certified values (eleven digits).
"""

from dataclasses import dataclass

import numpy as np
from more_garbow_hillstrom import PUBLISHED
from nist import SETS, residuals_of


@dataclass(frozen=True)
class Case:
    """A residual function, where to start, and the sum of squares and point to be found.

    ``deviations``: the standard deviations that are certified.
    """

    fun: object
    starts: tuple
    squares: float
    minimum: tuple | None = None
    deviations: tuple | None = None

    def jac(self, x):
        """Complex step: exact to rounding, for functions that accept complex numbers."""
        columns = [np.imag(self.fun(x + 1e-30j * unit)) / 1e-30 for unit in np.eye(len(x))]
        return np.column_stack(columns)


def published(name, minimum=None):
    problem = PUBLISHED[name]
    return Case(problem.fun, (problem.start,), problem.minima[0], minimum)


TEXTBOOK = {
    "rosenbrock": published("Rosenbrock", (1.0, 1.0)),
    "powell singular": published("Powell singular"),
    "beale": published("Beale", (3.0, 0.5)),
    "box3d": published("Box"),
    "wood": published("Wood", (1.0, 1.0, 1.0, 1.0)),
    "kowalik-osborne": published("Kowalik-Osborne"),
    "meyer": published("Meyer"),
    "osborne 1": published("Osborne 1"),
}
CERTIFIED = {
    name: Case(
        residuals_of(name),
        tuple(tuple(start) for start in certified["starts"]),
        certified["sum_of_squares"],
        tuple(certified["minimum"]),
        tuple(certified["standard_deviations"]),
    )
    for name, certified in SETS.items()
}
FEW = ("Misra1a", "MGH09", "MGH10", "BoxBOD", "Eckerle4", "Thurber", "Lanczos3")
KNOWN = {**TEXTBOOK, **{name: CERTIFIED[name] for name in FEW}}


def random_problem(seed):
    """A sum of exponentials with noise, its start, and bounds of which some bind."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 60)
    truth = rng.uniform([0.5, 0.2, 0.5, 1.5], [2.0, 1.0, 2.0, 4.0])
    model = lambda x: x[0] * np.exp(-x[1] * t) + x[2] * np.exp(-x[3] * t)  # noqa: E731
    data = model(truth) + 1e-2 * rng.standard_normal(len(t))
    low = truth * rng.uniform(0.4, 1.1, 4)
    high = low + truth * rng.uniform(0.1, 0.8, 4)
    fun = lambda x: model(x) - data  # noqa: E731
    return fun, Case(fun, (), 0.0).jac, 0.5 * (low + high), (low, high)
