"""Tests that judge the steps of a simulation: every model, with limits wide and narrowed.

A model stands on open circuit or on load with a reference that steps up and back, or is driven by a
grid event. Of each there are typical data and two draws; of each of these one set whose limits are
wide, and one whose limits are narrowed until the response meets them.
"""

import hashlib
import zlib
from functools import cache
from typing import NamedTuple

import numpy as np
from on_load import QUADRATIC, values_on_load
from oracle import EXCITERS, drawn_values, system_of, typical_values
from unit_events import driving

from exfit.engine.kernel import text_of
from exfit.engine.system import System
from exfit.errors import SimulationError
from exfit.features.events.grid_playback import grid_playback
from exfit.models import GOVERNORS, LIMITERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.models.sheet import contradictions, typical
from exfit.plants import GOVERNOR, MACHINE, NETWORK, STABILISER, VT0, Attached, Stabilised
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.unit import UnitOnLoad
from exfit.simulation.inputs import Inputs, InputStep, SplinedInput
from exfit.simulation.limits import _along_run, limits_at_rest, limits_hit
from exfit.simulation.simulator import Simulator

OPEN_CIRCUIT, ON_LOAD, EVENT = "open circuit", "on load", "event"
KINDS = (OPEN_CIRCUIT, ON_LOAD, EVENT)
END, RATE = 8.0, 100.0  # s, samples a second
UP, DOWN = (
    1.0,
    4.0,
)  # s, instants of the steps of the reference, of which the second is twice the first
SIZES = {OPEN_CIRCUIT: 0.05, ON_LOAD: 0.03}  # pu of the reference
# pu, of the governor's reference: a speed or a power
PREF = {"GGOV1": 0.004, "HYGOV": 0.004, "TGOV1": 0.005, "GAST": 0.1, "IEEEG1": 0.1, "IEESGO": 0.1}
OFF_LIMITS = {"GGOV1": {"Ldref": 1.1}}  # with 1.0 the load limiter rests where the valve is open
SETS = 3  # typical data, and draws
SPREAD = 1.3
COARSE = 1e-3  # s, of the runs that choose limits
MOST_WIDENINGS, MOST_DRAWS = 12, 40
LEAST_MOVE = 1e-3  # pu, of a signal towards a limit that is narrowed
FASTEST_GROWTH = 0.05  # 1/s: a unit on load that is not far from stable
VOLTAGES = 0.2, 3.0  # pu, between which vt stays
# what limiters need to act in that test: the exciter, the place, and values
LIMITING = {
    "OEL2C": ("ST1A", "takeover", {
        "TEN": 0.0, "IINST": 2.02, "ILIM": 0.1, "ITFPU": 99.0, "TROEL": 0.02, "KPOEL": 15.0,
        "VOELMAX1": 40.0}),
    "OEL3C": ("AC8C", "summing", {"ITFPU": 1.95, "TOEL": 0.3, "VOELMAX1": 0.1}),
    "OEL5C": ("ST1A", "takeover", {
        "KSCALE1": 0.5, "IFDPU": 1.0, "IFDLIM": 0.02, "IFDPULEV": 1.02, "TIFDLEV": 0.3,
        "IFDREF1": 1.0, "IFDREF2": 0.94, "IBIAS": 10.0, "VOELMAX": 10.0, "KIOEL": 60.0}),
    "UEL1": ("ST1A", "takeover", {"KUR": 1.53, "KUL": 20.0}),
    "UEL2C": ("AC8C", "summing", {
        "TUP": 0.5, "TUV": 0.5, "Q0": -0.15, "Q1": -0.15, "Q2": -0.12, "Q3": -0.05, "Q4": 0.16}),
    "SCL1C": ("AC8C", "summing", {
        "ISCLLIM": 0.8, "TIT": 0.05, "TQSCL": 0.04, "KPUEX": 0.3, "KIUEX": 2.0}),
    "SCL2C": ("ST1A", "takeover", {
        "ITFPU": 0.79, "ILIM": 0.785, "IINST": 0.85, "K2": 1.5, "KPUEL": 40.0, "KPOEL": 40.0,
        "FIXEDRU": 0.1, "FIXEDRD": -0.6, "TSCL": 0.3, "TMAX": 0.3, "TITSCL": 0.05}),
}  # fmt: skip


class Scenario(NamedTuple):
    """One set of values in one test; ``compared`` are the outputs by which steps are judged."""

    model: str
    kind: str
    number: int
    narrowed: bool
    system: System
    inputs: Inputs
    compared: tuple[str, ...]
    values: dict[str, float]

    @property
    def name(self) -> str:
        limits = "narrowed" if self.narrowed else "wide"
        return f"{self.model}, {self.kind}, set {self.number}, limits {limits}"

    @property
    def times(self):
        return np.linspace(0.0, END, round(END * RATE) + 1)

    def simulator(self, step, located=False):
        """Return the simulator on a grid; with ``located`` crossings are located within steps."""
        more = {"located": True} if located else {}
        return Simulator(self.system, self.inputs, self.times, step, memory=np.inf, **more)

    @property
    def test_key(self) -> str:
        """Hash of the equations and of the test."""
        recorded = [(name, of.time, of.samples) for name, of in self.inputs.recorded.items()]
        driven = [(name, *map(np.ndarray.tobytes, arrays)) for name, *arrays in recorded]
        content = (text_of(self.system, self.compared), self.inputs.steps, driven, END, RATE)
        return hashlib.sha256(repr(content).encode()).hexdigest()


def models_of(kind: str) -> tuple[str, ...]:
    """Return what stands in a kind of test: exciters; on load what acts on them, too."""
    if kind == OPEN_CIRCUIT:
        return EXCITERS
    return (*EXCITERS, *STABILISERS, *GOVERNORS, *(LIMITERS if kind == ON_LOAD else ()))


@cache
def scenarios(model: str, kind: str) -> tuple[Scenario, ...]:
    """Return the scenarios of a model, those whose limits are narrowed behind those with wide."""
    system, values, inputs = _test(model, kind)
    outputs = {OPEN_CIRCUIT: ("vt",), ON_LOAD: ("vt", "p", "q"), EVENT: ("p", "q")}[kind]
    found: list[Scenario] = []
    for number in range(SETS):
        wide = next(
            filter(None, (_wide(system, inputs, v) for v in _draws(model, kind, values, number)))
        )
        sets = [
            wide,
            _narrowed(system, inputs, wide, zlib.crc32(f"{model} {kind} {number}".encode())),
        ]
        found += [
            Scenario(model, kind, number, bool(k), system, inputs, outputs, v)
            for k, v in enumerate(sets)
        ]
    return tuple(sorted(found, key=lambda each: each.narrowed))


# --- what is simulated ----------------------------------------------------------------------------


def _test(model, kind):
    """Return the system, typical values and inputs."""
    if kind == OPEN_CIRCUIT:
        return system_of(model), typical_values(model), _steps(SIZES[kind])
    exciter, added, limiters, unit = "AC8B", {}, (), {}
    if model in MODELS:
        exciter = model
    elif model in STABILISERS:
        exciter, part = "ST1A", STABILISERS[model]
        unit["stabiliser"] = Stabilised(part, part.inputs)
        added = {STABILISER + name: value for name, value in typical(part.sheet).items()}
    elif model in GOVERNORS:
        unit["governor"] = GOVERNORS[model]
        of_governor = typical(GOVERNORS[model].sheet) | OFF_LIMITS.get(model, {})
        added = {GOVERNOR + name: value for name, value in of_governor.items()}
    else:
        exciter, place, changed = LIMITING[model]
        limiter = Attached(LIMITERS[model], place)
        limiters = (limiter,)
        of_limiter = typical(limiter.model.sheet) | changed
        added = {limiter.prefix + name: value for name, value in of_limiter.items()}
    machine = MACHINES["GENROU"]
    values = values_on_load(machine, exciter=exciter, machine_D=2.0) | added
    if kind == ON_LOAD:
        inputs = ("vref", "pref") if model in GOVERNORS else ("vref",)
        plant = infinite_bus(MODELS[exciter], machine, QUADRATIC, inputs, limiters=limiters, **unit)
        return plant, values, _steps(SIZES[kind], PREF.get(model, 0.0))
    plant = grid_playback(
        UnitOnLoad(MODELS[exciter], machine, QUADRATIC, limiters=limiters, **unit)
    )
    levels = {VT0: 1.0, "p0": 0.8, "q0": 0.13, "speed0": 1.0}
    network = {NETWORK + "R": 0.003, NETWORK + "X": 0.1}
    values = {k: v for k, v in (values | levels | network).items() if k in plant.parameters}
    time, voltage, angle = driving(seconds=END + 0.1, size=1.5)
    recorded = {"vt": voltage - voltage[0], "angle": angle - angle[0]}
    splines = {name: SplinedInput(time, samples) for name, samples in recorded.items()}
    return plant, values, Inputs(0.0, END, (), splines)


def _steps(size, pref=0.0):
    sizes = (("vref", size), ("pref", pref)) if pref else (("vref", size),)
    steps = [(InputStep(UP, k, name), InputStep(DOWN, -2.0 * k, name)) for name, k in sizes]
    return Inputs(0.0, END, tuple(step for pair in steps for step in pair))


def _draws(model, kind, values, number):
    """Yield typical values (number 0), or draws around them, of which none contradicts itself."""
    if number == 0:
        yield values
        return
    for seed in range(number * MOST_DRAWS, (number + 1) * MOST_DRAWS):
        # draws that are not stable narrow down to what is
        spread = SPREAD ** (1.0 - (seed % MOST_DRAWS) / MOST_DRAWS)
        on_load = kind != OPEN_CIRCUIT
        drawn = (
            _drawn(values, seed, spread) if on_load else drawn_values(model, seed, spread=spread)
        )
        parts = ("", MACHINE, STABILISER, GOVERNOR, "oel.", "uel.", "scl.")
        own = (
            {k.removeprefix(part): v for k, v in drawn.items() if k.startswith(part)}
            for part in parts
        )
        if not any(fault for each in own for fault in contradictions(each)):
            yield drawn


def _drawn(values, seed, spread):
    """Return values moved by a factor of at most ``spread``; curves and reactances together."""
    rng = np.random.default_rng(seed)
    together, result = spread ** rng.uniform(-1.0, 1.0), {}
    for name, value in values.items():
        factor, bare = spread ** rng.uniform(-1.0, 1.0), name.rpartition(".")[2]
        joint = (name.startswith(MACHINE) and bare[0] in "XS") or bare in ("E1", "E2", "SE1", "SE2")
        fixed = name.startswith(NETWORK) or name in (VT0, "p0", "q0", "speed0")
        fixed = fixed or bare in ("M", "N", "SW1", "SCT", "Rselect", "Flag", "FBF", "VOS")
        result[name] = value * (1.0 if fixed else together if joint else factor)
    return result


# --- limits ---------------------------------------------------------------------------------------


def _probe(system, inputs):
    return Simulator(system, inputs, np.linspace(0.0, END, 161), COARSE)


def _sound(system, inputs, values) -> bool:
    """Return whether there is a rest, it is no limit, and the response stays near it."""
    probe = _probe(system, inputs)
    try:
        response = probe.response(values, ("vt",)).signals["vt"]
        growth = probe.rates_at_rest(values).real.max()
    except SimulationError:
        return False
    voltages = np.all((response > VOLTAGES[0]) & (response < VOLTAGES[1]))
    return bool(voltages and growth < FASTEST_GROWTH) and not _resting_on(system, values)


def _resting_on(system, values):
    """Return the limits at rest that parameters set; limiters and switches wait at theirs."""
    return {name for name in limits_at_rest(system, values) if {*name.split(", ")} & {*values}}


def _wide(system, inputs, values):
    """Return values whose limits the response does not meet as far as parameters set them."""
    for _ in range(MOST_WIDENINGS):
        try:
            hits = {hit.limit for hit in limits_hit(_probe(system, inputs), values)}
        except SimulationError:
            hits = {name for name in values if "MAX" in name or "MIN" in name}
        hits |= _resting_on(system, values)
        names = [n for hit in hits for n in hit.split(", ") if n in values]
        if not names:
            break
        values = values | {name: _farther(name, values[name]) for name in names}
    return values if _sound(system, inputs, values) else None


def _farther(name, value):
    if "MIN" in name:
        return -2.0 * max(abs(value), 1.0)
    return value * 2.0 if value else 1.0


def _narrowed(system, inputs, wide, seed):
    """Return values whose limits lie within the moves of the response, where it stays sound."""
    rng, values = np.random.default_rng(seed), wide
    for limiter, value, bound, _ in _along_run(_probe(system, inputs), wide)[1]:
        name, towards = limiter.limit, limiter.sign * (value - value[0])
        peak, share = int(np.argmax(towards)), rng.uniform(0.3, 0.8)
        level = value[0] + share * (value[peak] - value[0])
        if name not in values or not towards[peak] > LEAST_MOVE:
            continue
        plain = limiter.bound.op == "symbol" or bound[peak] == wide[name]
        narrow = level if plain else wide[name] * level / bound[peak]
        changed = values | {name: float(narrow)}
        inward = (narrow - values[name]) * limiter.sign < 0.0
        if inward and not any(contradictions(changed)) and _sound(system, inputs, changed):
            values = changed
    return values
