"""What exfit is compared with: the float run of the same equations, and systems to run."""

import re
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from exfit.engine.kernel import LinearKernel, Span
from exfit.engine.sampling import Course, Courses, SampleRows, Segment
from exfit.engine.system import System, parameters_used
from exfit.engine.tangents import TangentKernel
from exfit.engine.trace import clip
from exfit.models import MODELS
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES
from exfit.models.sheet import Parameter, typical
from exfit.plants import MACHINE, SATURATION, VT0
from exfit.plants.alone import alone
from exfit.plants.open_circuit import open_circuit

WITHOUT_PLANT = ("FIRST_ORDER",)
EXCITERS = tuple(name for name in MODELS if name not in WITHOUT_PLANT)
# every machine, and every form of the exciter's saturation: neither knows of the other
SURROUNDINGS = (
    *((machine, "quadratic") for machine in MACHINES),
    *(("GENROU", form) for form in SATURATION if form != "quadratic"),
)
# a machine and a form of saturation have equations of their own, the same behind every exciter:
# each exciter stands in the first of the surroundings; one with a rotating rectifier and one with
# a commutator stand in all of them
SURROUNDED = (
    *((name, *SURROUNDINGS[0]) for name in EXCITERS),
    *((name, *around) for around in SURROUNDINGS[1:] for name in ("AC1A", "DC1A")),
)
SATURATED = (
    *((name, "quadratic") for name in MODELS),
    *((name, form) for name, machine, form in SURROUNDED if form != "quadratic"),
)
MACHINE_SATURATION = {"S10": 0.12, "S12": 0.4}
OF_CURRENT = {"Kis": 0.1, "Kw": 0.05}  # of those machines that saturate by the current, too


def saturated(machine):
    """Return typical data of a machine that saturates, by the current too where it has that."""
    values = typical(machine.sheet)
    of_current = {symbol: value for symbol, value in OF_CURRENT.items() if symbol in values}
    return values | MACHINE_SATURATION | of_current


@cache
def system_of(name: str, machine: str = "GENROU", saturation: str = "quadratic") -> System:
    """Return the closed system of a catalogue model, the same object every time."""
    model = MODELS[name]
    if name in WITHOUT_PLANT:
        return alone(model)
    return open_circuit(model, MACHINES[machine], SATURATION[saturation])


def typical_values(name: str, machine: str = "GENROU", **changes: float) -> dict[str, float]:
    """Return typical data of a model on a saturated machine; ``machine_S10=0`` changes its own."""
    values = typical(MODELS[name].sheet)
    if name in WITHOUT_PLANT:
        values[VT0] = 0.0
    else:
        of_machine = saturated(MACHINES[machine])
        values |= {MACHINE + symbol: value for symbol, value in of_machine.items()} | {VT0: 1.0}
    return values | {symbol.replace("machine_", MACHINE): v for symbol, v in changes.items()}


def lively_values(name: str, machine: str = "GENROU", **changes: float) -> dict[str, float]:
    """Return typical data with no block bypassed: every lag takes part.

    Where 0 means that a value is computed at the start, it is given: there is a jump at 0.
    """
    system, values = system_of(name, machine), typical_values(name, machine)
    for symbol in system.time_constants:
        values[symbol] = values[symbol] or 0.03
    rest = LinearKernel(system).rest(vector(system, values))
    for setpoint, found in zip(system.setpoints, rest.r, strict=True):
        symbol = setpoint.removesuffix("0")
        if values.get(symbol) == 0.0:
            values[symbol] = float(found)
    return values | {symbol.replace("machine_", MACHINE): v for symbol, v in changes.items()}


def drawn_values(
    name: str, seed: int, machine: str = "GENROU", spread: float = 1.3
) -> dict[str, float]:
    """Return lively data, each value moved by a factor of at most ``spread`` that a seed decides.

    The reactances and the points of the saturation curves move together, so that none overtakes
    another.
    """
    rng = np.random.default_rng(seed)
    values = lively_values(name, machine)
    together = spread ** rng.uniform(-1.0, 1.0)
    for symbol in values:
        factor = spread ** rng.uniform(-1.0, 1.0)
        bare = symbol.removeprefix(MACHINE)
        if symbol != VT0:
            moves_together = bare[0] in "XS" or bare in ("E1", "E2")
            values[symbol] *= together if moves_together else factor
    return values


def leads_of(lag: str, rows: Mapping[str, Parameter]) -> list[str]:
    """Return the leads that a lag of zero bypasses with it: what they mean says it."""
    meaning = re.sub(r"\blag\b", "lead", rows[lag].meaning)
    return [symbol for symbol in rows if symbol != lag and rows[symbol].meaning == meaning]


def levels(steps: int, *changes: tuple[int, float]) -> np.ndarray:
    """Return an input (steps + 1, 1) with changes, each a ramp up to its grid point."""
    u = np.zeros((steps + 1, 1))
    for at, change in changes:
        u[at:] += change
    return u


def vector(system: System, values: Mapping[str, float]) -> np.ndarray:
    """Return the values in the system's order."""
    return np.array([values[name] for name in system.parameters])


def rates_at_rest(system: System, values: Mapping[str, float]) -> np.ndarray:
    """Return the eigenvalues (1/s) of a system at rest, without those of bypassed blocks."""
    code, p = LinearKernel(system), vector(system, values)
    rest = code.rest(p)
    _, jacobian = code.motion(p, rest.r, rest.x, np.zeros(len(system.inputs)))
    moving = np.abs(jacobian).max(axis=1) > 0.0  # the state of a bypassed block stays put
    return np.linalg.eigvals(jacobian[np.ix_(moving, moving)])


def fastest_rate(system: System, values: Mapping[str, float]) -> float:
    """Return the fastest rate (1/s) of a system: of its modes at rest, and of its lags."""
    used = parameters_used(system)
    lags = [1.0 / values[T] for T in system.time_constants if T in used and values[T] >= SHORTEST]
    return max(lags + list(np.abs(rates_at_rest(system, values))))


def tangent_run(
    code: TangentKernel,
    p: np.ndarray,
    dp: np.ndarray,
    spans: Sequence[Span],
    moved: Sequence[np.ndarray] = (),
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return, for each span, outputs (n + 1, ny) and their derivatives (n + 1, ny, N).

    ``p`` is (np,), ``dp`` (np, N); ``moved`` (n + 1, moving, N) are, for each span, the tangents of
    the inputs that move.
    """
    count = dp.shape[1]
    shapes = moved or [None] * len(spans)
    segments = [Segment(s.u, s.step, du) for s, du in zip(spans, shapes, strict=True)]
    ends = np.cumsum([len(span.u) for span in spans])
    rows = np.arange(ends[-1])[:, None]
    course = Course(segments, SampleRows(rows, np.ones(rows.shape)))
    courses = Courses([course], np.array([[span.parts for span in spans]]))
    rates = np.tile(np.eye(count), (1, len(code.moving), 1, 1)) if code.moving else None
    outputs, slopes, _ = code.samples(p[None], dp[None], courses, rates)
    return np.split(outputs[0], ends[:-1]), np.split(slopes[0], ends[:-1])


def float_run(
    system: System, values: Mapping[str, object], outputs: Sequence[str], spans: Sequence[Span]
) -> list[np.ndarray]:
    """Simulate with the plain equations: classical Runge-Kutta, states clamped after each step.

    Values may be floats or arrays (W,) of sets side by side; the outputs of each span come as
    (n + 1, outputs) or (n + 1, outputs, W).
    """
    begin = system.rest(values)
    x, r = dict(begin.states), begin.setpoints

    def motion(x, u):
        return system.motion(values, r, x, dict(zip(system.inputs, u, strict=True)))

    def advanced(x, h, slopes):
        return {name: x[name] + h * slopes[name] for name in x}

    def step(x, u, change, h):
        k1 = motion(x, u).slopes
        k2 = motion(advanced(x, h / 2, k1), u + change / 2).slopes
        k3 = motion(advanced(x, h / 2, k2), u + change / 2).slopes
        k4 = motion(advanced(x, h, k3), u + change).slopes
        mean = {n: (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]) / 6.0 for n in x}
        free = advanced(x, h, mean)
        limits = motion(free, u + change).limits
        return {n: clip(v, *limits[n]) if n in limits else v for n, v in free.items()}

    def row(x, u):
        told = motion(x, u).outputs
        return np.array(np.broadcast_arrays(*[told[name] for name in outputs]))

    results = []
    for span in spans:
        rows, h = [], span.step / span.parts
        for now, then in zip(span.u[:-1], span.u[1:], strict=True):
            rows.append(row(x, now))
            change = (then - now) / span.parts
            for part in range(span.parts):
                x = step(x, now + part * change, change, h)
        results.append(np.array([*rows, row(x, span.u[-1])]))
    return results
