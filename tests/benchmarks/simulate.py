"""Time simulations and Jacobians against the same loop in C and against SciPy's LSODA.

Run it as ``python tests/benchmarks/simulate.py``; it needs gcc. All ways run in one process, taking
turns, so that a busy machine slows them alike.
"""

import ctypes
import itertools
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from estimators import ByHand
from oracle import system_of, typical_values, vector

from exfit.engine.kernel import Kernel, Span
from exfit.engine.located_runs import located_kernel
from exfit.simulation.inputs import Direction, Inputs, InputStep, each
from exfit.simulation.simulator import Simulator

HERE = Path(__file__).parent
STEP, STEPS, AT, RISE = 1e-3, 10_000, 1_000, 0.05
LOCATED = 2e-2  # s, steps whose crossings of limits are located
FINE = 2e-5  # s, of the grid with which these are compared
FREE = ("KA", "KF", "TE", "TF", "TA", "KC", "KD")
THESIS = {"KA": 364.1523, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542}
VALUES = typical_values("AC1A", **THESIS, KC=0.486, KD=0.4039, VRMAX=14.5, VRMIN=-14.5)
HIT = VALUES | {"VAMAX": 9.0, "VAMIN": -9.0}  # a limit that the response meets
SYSTEM = system_of("AC1A")
ROUNDS, CALLS = 60, 5
SETS = 32  # in one call


def loop_in_c():
    """Compile the hand-written loop and return it as a function that gives vt (n + 1,)."""
    folder = Path(tempfile.mkdtemp())
    library = folder / "ac1a.so"
    flags = ["-O3", "-march=native", "-std=gnu11", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, str(HERE / "ac1a.c"), "-o", str(library), "-lm"], check=True)
    simulate = ctypes.CDLL(str(library)).simulate
    number, whole, pointer = ctypes.c_double, ctypes.c_long, ctypes.c_void_p
    simulate.argtypes = [pointer, number, whole, whole, number, pointer]
    simulate.restype = None
    p, vt = vector(SYSTEM, VALUES), np.empty(STEPS + 1)

    def run():
        simulate(p.ctypes.data, STEP, STEPS, AT, RISE, vt.ctypes.data)
        return vt

    return run


def kernel(lanes):
    """Return the bare machine code of exfit, for sets side by side."""
    code, p = Kernel(SYSTEM, ("vt",), lanes), np.tile(vector(SYSTEM, VALUES)[:, None], lanes)
    spans = bump()

    def run():
        before, after = code.run(p, code.start(p), spans)
        return np.concatenate([before[:-1, 0, 0], after[:, 0, 0]])

    return run


def bump():
    """Return the inputs of the bump test, with the step on the grid."""
    flat, raised = np.zeros((AT + 1, 1)), np.full((STEPS - AT + 1, 1), RISE)
    return [Span(flat, STEP, 1), Span(raised, STEP, 1)]


def located(values):
    """Return the bare machine code of exfit that locates crossings of limits."""
    code, p = located_kernel(SYSTEM, ("vt",), 1), vector(SYSTEM, values)[None]
    course, once = [simulator().located_course()], np.array([1])
    return lambda: code.samples(p, course, once)


def simulator(step=LOCATED, located=True, smooth=False):
    """Return exfit's own way of a fit: sub-steps found, samples at the times of a recorder."""
    times, change = np.arange(1001) / 100.0, InputStep(AT * STEP, RISE, smooth=smooth)
    inputs = Inputs(0.0, STEPS * STEP, (change,))
    return Simulator(SYSTEM, inputs, times, step, located=located)


def fitted_step(values):
    """Return a function for the Jacobian of a fit of the step's instant and size as well."""
    unit = simulator(smooth=True)
    (change,) = unit.inputs.steps
    directions = (
        *each(FREE),
        Direction(steps={0: (1.0, 0.0)}),
        Direction(steps={0: (0.0, 1.0)}),
        Direction(delay=1.0),
    )

    def run():
        now = next(values)
        moved = change._replace(at=change.at + now["KA"] - VALUES["KA"])
        return unit.with_inputs((moved,), 0.0123).tangents(now, ("vt",), directions)

    return run


def of_many(sets):
    """Return functions for the samples and the Jacobians of so many sets in one call."""
    unit, rng = simulator(), np.random.default_rng(1)
    drawn = [
        VALUES | {name: VALUES[name] * rng.uniform(0.9, 1.1) for name in FREE} for _ in range(sets)
    ]
    directions = [each(FREE)] * sets
    return (
        lambda: unit.samples_of_many(drawn, ("vt",)),
        lambda: unit.tangents_of_many(drawn, ("vt",), directions),
    )


def lsoda():
    """Return an adaptive integration of equations in Python, at the times of a recorder."""
    unit, times = ByHand(VALUES), np.arange(1001) / 100.0

    def run():
        (x, vref), parts = unit.rest(), []
        for first, last, rise in ((0, 100, 0.0), (100, 1000, RISE)):
            inside = times[first : last + 1]
            ends, level = (inside[0], inside[-1]), (vref + rise,)
            solved = solve_ivp(
                unit.slopes, ends, x, "LSODA", inside, args=level, rtol=1e-6, atol=1e-9
            )
            x = solved.y[:, -1]
            parts.append(solved.y)
        return parts

    return run


def timed(ways, rounds):
    """Return the times (rounds, ways) in ms of functions that take turns.

    A turn is of several calls, one behind the other as a search makes them, and one before them
    that is not counted: behind 32 sets it would find no memory of its own in the cache.
    """
    times = np.empty((rounds, len(ways)))
    for row in times:
        for column, way in enumerate(ways):
            way()
            begin = time.perf_counter()
            for _ in range(CALLS):
                way()
            row[column] = 1e3 * (time.perf_counter() - begin) / CALLS
    return times


def main():
    in_c, one, slow = loop_in_c(), kernel(1), lsoda()
    unit = simulator()
    # values asked for a second time in a row cost less: a fit never does
    ever_new = (VALUES | {"KA": VALUES["KA"] + 1e-9 * n} for n in itertools.count())
    many_samples, many_jacobians = of_many(SETS)
    error = np.abs(in_c() - one()).max()
    assert error < 1e-9, f"C and exfit differ by {error:g}"
    fine = simulator(FINE, located=False)
    errors = [np.abs(located(at)()[0] - fine.samples(at, ("vt",))[0]).max() for at in (VALUES, HIT)]
    assert max(errors) < 1e-6, f"located crossings: {errors}"
    ever_hit = (HIT | {"KA": HIT["KA"] + 1e-9 * n} for n in itertools.count())
    ways = {
        "C, gcc -O3 -march=native, 1 ms": in_c,
        "exfit on the grid of 1 ms, bare machine code": one,
        "exfit with located crossings, bare": located(VALUES),
        "the same where a limit is hit": located(HIT),
        "exfit, sub-steps and samples": lambda: unit.samples(next(ever_new), ("vt",)),
        "the same where a limit is hit ": lambda: unit.samples(next(ever_hit), ("vt",)),
        "exfit, Jacobian of 7 and samples": lambda: unit.tangents(
            next(ever_new), ("vt",), each(FREE)
        ),
        "exfit, of 7, a step and the delay": fitted_step(ever_new),
        f"exfit, a set of {SETS}: samples": many_samples,
        f"exfit, a set of {SETS}: Jacobian of 7": many_jacobians,
    }
    sets = [SETS if f"of {SETS}" in name else 1 for name in ways]
    timed(list(ways.values()), 5)
    times = timed(list(ways.values()), ROUNDS) / sets
    several = timed([slow], 5)
    found = f"{errors[0]:.0e} and, with a limit hit, {errors[1]:.0e}"
    table = Table(title=f"AC1A, 10 s, ms ({ROUNDS} rounds; errors of vt at 20 ms {found})")
    table.add_column("way")
    for heading in ("median", "best", "median : C", "best : C"):
        table.add_column(heading, justify="right")
    rows = [*zip(ways, times.T, strict=True), ("SciPy, LSODA 1e-6, equations in Python", several)]
    middle, least = np.median(times[:, 0]), times[:, 0].min()
    for name, found in rows:
        here, best = np.median(found), found.min()
        ratios = (f"{here / middle:.2f}", f"{best / least:.2f}")
        table.add_row(name, f"{here:.3f}", f"{best:.3f}", *ratios)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
