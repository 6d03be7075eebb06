"""How solvers do on the problems with known minima: the comparison of estimator.md and its tests.

A solver is called as ``solve(fun, x0, jac)`` and returns what SciPy's `least_squares` returns.
"""

from dataclasses import dataclass

import numpy as np
from known_minima import CERTIFIED, Case
from more_garbow_hillstrom import PUBLISHED
from nist import SETS

MOST_DIGITS = 11.0  # that NIST certifies
WANTED_DIGITS = 6.0
HIGHER = 1.01  # times the sum of squares of a minimum: another one
EXACT = 1e-16  # times that of the data: residuals that are only rounding (Lanczos1)
VANISHED = 1e-10  # a sum of squares that counts as none
STATIONARY = 1e-3  # largest cosine of the residuals and a column of J, where a minimum may be


@dataclass(frozen=True)
class End:
    """Where a solver ended: certified digits, sum of squares, whether it claims success."""

    digits: float
    squares: float
    success: bool
    nfev: int
    njev: int
    stationary: bool
    reached: str  # "lowest", "local" (another minimum) or "" (none)

    @property
    def wrong(self):
        """Whether success is claimed where there is no minimum or, by NIST, not the one meant."""
        return self.success and not self.reached


def digits(x, minimum):
    """How many digits of all parameters are right, 0 to 11."""
    minimum = np.array(minimum)
    with np.errstate(all="ignore"):
        apart = np.nan_to_num(abs(x - minimum) / abs(minimum), nan=1.0, posinf=1.0)
    return float(np.clip(-np.log10(np.maximum(apart.max(), 1e-300)), 0.0, MOST_DIGITS))


def stationary(result):
    """Whether the residuals are nearly orthogonal to all columns of J, as at any minimum."""
    r, J = np.asarray(result.fun), np.asarray(result.jac)
    with np.errstate(all="ignore"):
        cosines = abs(J.T @ r) / (np.linalg.norm(J, axis=0) * np.linalg.norm(r))
    return bool(np.nan_to_num(cosines).max() < STATIONARY)


def end_of(result, minimum, reached):
    return End(
        digits(result.x, minimum) if minimum is not None else np.nan,
        2.0 * result.cost,
        bool(result.success),
        result.nfev,
        result.njev or 0,
        stationary(result),
        reached,
    )


def certified_ends(solve):
    """The end from each start of each set of NIST, by set and start; None where it raises."""
    return {
        (name, k): attempt(solve, case.fun, start, case.jac, case.minimum, meant(name, case))
        for name, case in CERTIFIED.items()
        for k, start in enumerate(case.starts, 1)
    }


def meant(name, case):
    """What says whether a sum of squares is the certified one."""
    most = HIGHER * case.squares + EXACT * float(np.sum(np.array(SETS[name]["y"]) ** 2))
    return lambda squares, _: "lowest" if squares <= most else ""


def published_ends(solve):
    """The end from each start of each problem of Moré, Garbow & Hillstrom."""
    return {
        (name, k): attempt(solve, problem.fun, start, jac_of(problem.fun), None, among(problem))
        for name, problem in PUBLISHED.items()
        for k, start in enumerate(problem.starts)
    }


def among(problem):
    """What says at which of the minima a sum of squares is; others than listed are stationary."""
    lowest = problem.minima[0]

    def reached(squares, result):
        if squares <= HIGHER * lowest + VANISHED:
            return "lowest"
        return "local" if stationary(result) else ""

    return reached


def jac_of(fun):
    return Case(fun, (), 0.0).jac


def attempt(solve, fun, start, jac, minimum, reached):
    try:
        with np.errstate(all="ignore"):
            result = solve(fun, np.array(start, dtype=float), jac)
    except (ValueError, np.linalg.LinAlgError):  # residuals that are not finite
        return None
    return end_of(result, minimum, reached(2.0 * result.cost, result))
