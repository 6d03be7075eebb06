"""Count and time whole fits of AC1A from four starts: exfit's estimator against SciPy's.

Run it as ``python tests/benchmarks/estimators.py``. All use the same residuals and exact Jacobians.
Last comes, from one start, what one would write with SciPy alone.
"""

import csv
import os
import sys
import time
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import optimize
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from oracle import system_of, typical_values

from exfit.estimate import least_squares
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.parameters import UNIT, FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

RECORD = Path(__file__).parents[2] / "sample_data" / "ac1a_up.csv"
TYPICAL = {"KA": 766, "KF": 0.024, "TE": 1.3, "TF": 1.0, "TA": 0.02, "KC": 0.486, "KD": 0.3556}
TRUTH = {"KA": 364.1523, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542, "KC": 0.486}
TRUTH |= {"KD": 0.4039}
LIMITS = {"VAMAX": 14.5, "VAMIN": -14.5, "VRMAX": 14.5, "VRMIN": -14.5}
MACHINE = {"Tpd0": 6.0, "Tppd0": 0.035, "Xd": 1.8, "Xpd": 0.3, "Xppd": 0.25, "Xl": 0.2}
STARTS = {
    "typical": TYPICAL,
    "good": TYPICAL | {"KA": 400},
    "low": {name: 0.5 * value for name, value in TYPICAL.items()},
    "high": {name: 1.5 * value for name, value in TYPICAL.items()},
}
SYSTEM = system_of("AC1A")
FIXED = typical_values("AC1A", **LIMITS, **{f"machine_{k}": v for k, v in MACHINE.items()})
STEP_AT, RISE = 1.0, 0.05
GOOD_ENOUGH = 2e-4  # pu
RANDOM_STARTS, SEED, MARGIN = 24, 7, 0.15  # of the width of the bounds, kept free on either side
PATIENCE = 100  # evaluations by LSODA, most with a Jacobian of seven more
RAMP = 0.01  # pu


def record():
    """Return times and voltages of the record."""
    with RECORD.open() as file:
        rows = list(csv.DictReader(file))
    return tuple(np.array([float(row[name]) for row in rows]) for name in ("t", "vt"))


def problem(start):
    """Return the residuals of a start; its bounds are a tenth and ten times of it."""
    times, measured = record()
    course = Inputs(times[0], times[-1], (InputStep(STEP_AT, RISE),))
    simulator = Simulator(SYSTEM, course, times, 1e-3)
    free = [FreeParameter(name, v, 0.1 * v, 10.0 * v, True) for name, v in start.items()]
    return Residuals([Experiment(simulator, (Channel("vt", measured),))], free, FIXED)


@dataclass
class Counted:
    """Residuals and Jacobian that count how often they are asked for."""

    residuals: Residuals
    nfev: int = 0
    njev: int = 0

    def fun(self, x):
        self.nfev += 1
        return self.residuals(x)

    def jac(self, x):
        self.njev += 1
        return self.residuals.exact(x)


def with_exfit(method):
    def solve(p, x, bounds):
        return least_squares(p.fun, x, p.jac, bounds, method, x_scale=UNIT, good_enough=GOOD_ENOUGH)

    return solve


def with_minpack(p, x, bounds):
    with np.errstate(over="ignore"):  # without bounds it may go anywhere
        return optimize.least_squares(p.fun, x, p.jac, method="lm")


def with_trf(p, x, bounds):
    return optimize.least_squares(p.fun, x, p.jac, bounds, method="trf", x_scale="jac")


WAYS = {
    "exfit lm-then-dgn": with_exfit("lm-then-dgn"),
    "exfit auto": with_exfit("auto"),
    "MINPACK lm, unbounded": with_minpack,
    "SciPy trf": with_trf,
}


class ByHand:
    """AC1A on its machine as one would type it in Python for one study, in plain floats.

    VA comes to its limit over a narrow ramp: LSODA does not get past a slope that jumps.
    """

    def __init__(self, values):
        self.v = v = {name.removeprefix("machine."): value for name, value in values.items()}
        self.exciter = self.curve(v["E2"], v["SE2"], v["E1"], v["SE1"])
        self.machine = self.curve(1.0, v["S10"], 1.2, v["S12"])
        inner = v["Xpd"] - v["Xl"]
        self.share = (v["Xppd"] - v["Xl"]) / inner
        self.coupling = (v["Xd"] - v["Xpd"]) * (v["Xpd"] - v["Xppd"]) / inner**2

    @staticmethod
    def curve(e1, s1, e2, s2):
        ratio = sqrt(e1 * s1 / (e2 * s2))
        knee = (e1 - ratio * e2) / (1.0 - ratio)
        gain = e2 * s2 / (e2 - knee) ** 2
        return lambda e: gain * (e - knee) ** 2 if e > knee else 0.0

    def demand(self, ve, ifd):
        return self.v["KE"] * ve + self.exciter(ve) + self.v["KD"] * ifd

    def rest(self):
        v = self.v
        ifd = 1.0 + self.machine(1.0)
        low, high = 0.0, 100.0
        while high - low > 1e-14 * high:
            ve = (low + high) / 2
            low, high = (ve, high) if self.efd(ve, ifd) < ifd else (low, ve)
        vfe = self.demand(ve, ifd)
        return [1.0, 1.0, vfe, ve, vfe], 1.0 + vfe / v["KA"]

    def efd(self, ve, ifd):
        load = self.v["KC"] * ifd / max(ve, 1e-9)
        if load <= sqrt(3.0) / 4.0:
            return ve * (1.0 - load / sqrt(3.0))
        return ve * (sqrt(0.75 - load**2) if load < 0.75 else sqrt(3.0) * max(1.0 - load, 0.0))

    def slopes(self, t, x, vref):
        v, (eq, psi, va, ve, washed) = self.v, x
        vt = self.share * eq + (1.0 - self.share) * psi
        ifd = eq + self.coupling * (eq - psi) + self.machine(vt)
        vfe = self.demand(ve, ifd)
        dwashed = (vfe - washed) / v["TF"]
        dva = (v["KA"] * (vref - vt - v["KF"] * dwashed) - va) / v["TA"]
        room = (v["VAMAX"] - va if dva > 0.0 else va - v["VAMIN"]) / RAMP
        return [
            (self.efd(ve, ifd) - ifd) / v["Tpd0"],
            (eq - psi) / v["Tppd0"],
            dva * min(max(room, 0.0), 1.0),
            (min(max(va, v["VRMIN"]), v["VRMAX"]) - vfe) / v["TE"],
            dwashed,
        ]


def by_lsoda(start):
    """Fit as SciPy alone would: LSODA, difference quotients, equations in Python."""
    times, measured = record()
    before, after = times[times <= STEP_AT], times[times >= STEP_AT]

    def residuals(x):
        unit = ByHand(FIXED | dict(zip(start, np.exp(x), strict=True)))
        state, vref = unit.rest()
        found = []
        for inside, rise in ((before, 0.0), (after, RISE)):
            ends, level = (inside[0], inside[-1]), (vref + rise,)
            solved = solve_ivp(
                unit.slopes, ends, state, "LSODA", inside, args=level, rtol=1e-6, atol=1e-9
            )
            state = solved.y[:, -1]
            found.append(unit.share * solved.y[0] + (1.0 - unit.share) * solved.y[1])
        return np.concatenate([found[0], found[1][1:]]) - measured

    x = np.log(list(start.values()))
    bounds = (x - np.log(10.0), x + np.log(10.0))
    begin = time.perf_counter()
    done = optimize.least_squares(
        residuals, x, "2-point", bounds, diff_step=1e-3, x_scale="jac", max_nfev=PATIENCE
    )
    return done, time.perf_counter() - begin


def from_random_starts():
    """Return, for each way, how many random starts lead to the lowest minimum found."""
    low, high = problem(TYPICAL).bounds
    draws = np.random.default_rng(SEED).random((RANDOM_STARTS, len(low)))
    starts = low + (high - low) * (MARGIN + (1.0 - 2.0 * MARGIN) * draws)
    costs = {}
    for way, solve in WAYS.items():
        costs[way] = [solve(Counted(problem(TYPICAL)), x, (low, high)).cost for x in starts]
    least = min(map(min, costs.values()))
    return {way: sum(cost < least * (1.0 + 1e-4) for cost in found) for way, found in costs.items()}


def main():
    table = Table(title="AC1A, 7 free parameters, ac1a_up.csv")
    for heading in ("start", "way"):
        table.add_column(heading)
    for heading in ("residuals", "Jacobians", "cost : truth's", "KA", "TE", "ms"):
        table.add_column(heading, justify="right")
    fastest = {}
    for name, start in STARTS.items():
        truth = problem(start)
        at_truth = truth(np.log([TRUTH[symbol] for symbol in start]))
        floor = 0.5 * float(at_truth @ at_truth)
        for way, solve in WAYS.items():
            spent = []
            for _ in range(3):
                counted = Counted(problem(start))
                x, bounds = counted.residuals.start, counted.residuals.bounds
                begin = time.perf_counter()
                result = solve(counted, x, bounds)
                spent.append(time.perf_counter() - begin)
            values = counted.residuals.values(result.x)
            fastest[name, way] = min(spent)
            table.add_row(
                name,
                way,
                str(counted.nfev),
                str(counted.njev),
                f"{result.cost / floor:.6f}",
                f"{values['KA']:.2f}",
                f"{values['TE']:.4f}",
                f"{1e3 * min(spent):.0f}",
            )
        table.add_section()
    console = Console(width=110)
    console.print(table)
    reached = ", ".join(f"{way} {count}" for way, count in from_random_starts().items())
    console.print(f"Of {RANDOM_STARTS} random starts reach the minimum: {reached}")
    done, seconds = by_lsoda(STARTS["typical"])
    ours = fastest["typical", "exfit lm-then-dgn"]
    console.print(
        f"LSODA 1e-6 and difference quotients, start typical: {seconds:.1f} s, "
        f"{done.nfev} residuals and {done.njev} Jacobians, cost {done.cost / floor:.6f} of the "
        f"truth's: {seconds / ours:.0f} times the time of exfit"
    )


if __name__ == "__main__":
    main()
