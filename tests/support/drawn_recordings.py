"""Recorder's files of every kind of test, named in six languages or not at all; truth is known.

A unit is a transient machine with one exciter at a bus behind a reactance, integrated here by
SciPy's LSODA: nothing of exfit takes part. It makes bump tests without and on load, load
rejections, steady points, and grid events; `drawn(seed)` draws one with its channels, units, names
and clock.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

BUMP, EVENT, REJECTION, STEADY = "bump test", "grid event", "load rejection", "steady point"
RECORDERS, EVENTS = 40, 20
KINDS = 8 * (BUMP, BUMP, REJECTION, BUMP, STEADY)  # of the recorders' files, in turn
NOISE = {"angle": 2e-4, "frequency": 2e-6, "speed": 2e-6, "efd": 2e-3, "ifd": 5e-4}  # pu, rad
# signal -> what it is called in English, German, French, Spanish, Portuguese, Italian
WORDS = {
    "vt": (
        "Terminal Volts", "Klemmenspannung", "Tension bornes", "Tensión bornes",
        "Tensão gerador", "Tensione statore",
    ),
    "efd": (
        "Field Voltage", "Läuferspannung", "Tension rotor", "Tensión de campo",
        "Tensão de campo", "Tensione di campo",
    ),
    "ifd": (
        "Field Current", "Läuferstrom", "Courant rotor", "Corriente de campo",
        "Corrente de campo", "Corrente di campo",
    ),
    "p": (
        "MW Output", "Wirkleistung", "Puissance active", "Potencia activa", "Potência ativa",
        "Potenza attiva",
    ),
    "q": (
        "MVAR Output", "Blindleistung", "Puissance réactive", "Potencia reactiva",
        "Potência reativa", "Potenza reattiva",
    ),
    "frequency": (
        "Frequency", "Netzfrequenz", "Fréquence", "Frecuencia", "Frequência", "Frequenza",
    ),
    "angle": (
        "Voltage Angle", "Spannungswinkel", "Angle tension", "Ángulo tensión", "Ângulo tensão",
        "Angolo tensione",
    ),
    "speed": (
        "Shaft Speed", "Drehzahl", "Vitesse", "Velocidad", "Velocidade", "Velocità",
    ),
    "vref": (
        "AVR Setpoint", "Spannungssollwert", "Consigne tension", "Consigna tensión",
        "Referência tensão", "Riferimento tensione",
    ),
    "temperature": (
        "Bearing Temp", "Lagertemperatur", "Temp palier", "Temp cojinete", "Temp mancal",
        "Temp cuscinetto",
    ),
    "gate": ("Gate", "Leitapparat", "Vannage", "Álabes", "Distribuidor", "Distributore"),
}  # fmt: skip
LETTERS = {
    "vt": "v", "efd": "e", "ifd": "i", "p": "p", "q": "q", "frequency": "f", "angle": "a",
    "speed": "n", "vref": "r", "temperature": "h", "gate": "g",
}  # fmt: skip
PHASES = ("phase 0", "phase 1", "phase 2")


@dataclass(frozen=True)
class Column:
    """A column: the signal that it is ``of``, what 1 pu is in its numbers, the unit it is given."""

    header: str
    of: str
    base: float
    unit: str


@dataclass(frozen=True)
class NamelessFile:
    """A drawn file: its kind, its columns with their numbers (M,), what happens in it and when.

    ``size`` is that of the step in pu, 0 of other kinds.
    """

    name: str
    kind: str
    columns: tuple[Column, ...]
    time: np.ndarray
    numbers: dict[str, np.ndarray]
    clock: str
    unit_row: bool
    loaded: bool
    at: float
    size: float

    def write(self, folder: Path) -> Path:
        """Write the file; return its path."""
        path = folder / f"{self.name}.csv"
        lines = [";".join([self.clock, *self.numbers])]
        if self.unit_row:
            lines.append(";".join(["s", *(column.unit for column in self.columns)]))
        rows = np.column_stack([self.time, *self.numbers.values()])
        lines += [";".join(f"{value:.8g}" for value in row) for row in rows]
        path.write_text("\n".join(lines) + "\n", "utf-8")
        return path


# ---- the unit


def _unit(rng, kind, loaded, at, length, rate, f0):
    """Return the time (M,) and the signals (M,) of a unit; see IEEE 1110, model 1.0."""
    salient = rng.random() < 0.5
    xd, xq = (1.1, 0.7) if salient else (1.8, 1.7)
    xpd, xe = 0.3, float(rng.uniform(0.15, 0.35))
    tpd0, inertia = float(rng.uniform(4.0, 8.0)), float(rng.uniform(3.0, 5.0))
    gain = float(rng.uniform(80.0, 200.0)) if rng.random() < 0.5 else float(rng.uniform(20.0, 40.0))
    lag = 0.02 if gain > 60.0 else 0.15
    omega0, saturation = 2.0 * np.pi * f0, float(rng.uniform(0.02, 0.1))
    p0 = float(rng.uniform(0.3, 0.9)) if loaded else 0.0
    q0 = float(rng.uniform(-0.2, 0.3)) if loaded else 0.0
    v0 = float(rng.uniform(0.97, 1.04))
    sizes = (0.02, -0.02, 0.03) if loaded else (0.05, -0.05, 0.03, -0.03)
    size = float(rng.choice(sizes)) if kind == BUMP else 0.0
    off = float(rng.choice([0.0, 0.0, 0.003, -0.003])) if not loaded else 0.0

    def excess(eq):
        return saturation * max(eq - 0.8, 0.0) ** 2

    current = (p0 - 1j * q0) / v0  # with the angle of the voltage 0
    behind = v0 + 1j * xq * current
    delta0 = np.angle(behind)
    id0 = abs(current) * np.sin(delta0 - np.angle(current))
    grid0 = v0 - 1j * xe * current
    eq0 = v0 * np.cos(delta0) + xpd * id0
    efd0 = eq0 + (xd - xpd) * id0 + excess(eq0)
    vref0 = v0 + efd0 / gain

    sag, swing_at = float(rng.uniform(0.02, 0.08)), float(rng.uniform(0.4, 0.9))
    clears = float(rng.choice([0.1, 3.0, np.inf]))
    fall = float(rng.choice([0.0, 0.0015, 0.004]))  # of the frequency, pu

    def source(t):
        """Return the voltage of the grid and its speed, pu."""
        if kind != EVENT or t < at:
            return abs(grid0), 0.0
        ago = t - at
        swing = 0.006 * np.exp(-0.3 * ago) * np.sin(2.0 * np.pi * swing_at * ago)
        low = sag * (1.0 - np.exp(-ago / 0.03)) * (ago < clears)
        return abs(grid0) * (1.0 - low + swing), -fall * (1.0 - np.exp(-ago / 2.0)) + 0.1 * swing

    def algebra(t, state):
        eq, turned, slip, _ = state
        if not loaded or (kind == REJECTION and t >= at):
            speed = 1.0 + (off if not loaded else slip)
            return 0.0, 0.0, 0.0, eq * speed  # the voltage is induced by speed
        voltage, _ = source(t)
        iq = voltage * np.sin(turned) / (xq + xe)
        i_d = (eq - voltage * np.cos(turned)) / (xpd + xe)
        return i_d, iq, xq * iq, eq - xpd * i_d

    def slopes(t, state):
        eq, _, slip, efd = state
        i_d, iq, vd, vq = algebra(t, state)
        reference = vref0 + (size if t >= at else 0.0)
        wanted = np.clip(gain * (reference - np.hypot(vd, vq)), -5.0, 6.0)
        of_grid = source(t)[1]
        power = vd * i_d + vq * iq
        gate = p0 - 15.0 * min(max(slip, -0.02), 0.04 if loaded else 0.0)
        pushed = (gate - power - (4.0 * (slip - of_grid))) / (2.0 * inertia) if loaded else 0.0
        return [
            (efd - eq - (xd - xpd) * i_d - excess(eq)) / tpd0,
            omega0 * (slip - of_grid),
            pushed,
            (wanted - efd) / lag,
        ]

    # the field current that a regulator at rest has, by its own voltage
    time = np.arange(0.0, length, 1.0 / rate)
    start = [eq0, delta0 - np.angle(grid0), 0.0, efd0]
    if not loaded:
        start[0] = v0 / (1.0 + off)
        start[3] = start[0] + excess(start[0])
        vref0 = v0 + start[3] / gain
    options = {"method": "LSODA", "rtol": 1e-8, "atol": 1e-9, "max_step": 0.02}
    first, second = time[time < at], time[time >= at]
    before = solve_ivp(slopes, (0.0, at), start, t_eval=first, **options)
    after = solve_ivp(slopes, (at, length), before.y[:, -1], t_eval=second, **options)
    states = np.hstack([before.y, after.y])
    i_d, iq, vd, vq = np.array([algebra(*each) for each in zip(time, states.T, strict=True)]).T
    slips = np.array([source(t)[1] for t in time])
    turned = np.cumsum(slips) / rate * omega0 if loaded else omega0 * off * time
    angle = 0.6 + turned + states[1] - np.arctan2(vd, vq) if loaded else 0.6 + turned
    if kind == REJECTION:
        angle = np.where(
            time < at,
            angle,
            angle[time < at][-1] + omega0 / rate * np.cumsum(np.where(time < at, 0.0, states[2])),
        )
    wander = 2e-5 * np.sin(2.0 * np.pi * 0.11 * time + rng.uniform(0.0, 6.0))
    frequency = 1.0 + np.gradient(angle, time) / omega0 + wander
    speed = 1.0 + (states[2] if loaded else off) + wander
    signals = {
        "vt": np.hypot(vd, vq), "efd": states[3],
        "ifd": states[0] + (xd - xpd) * i_d + np.array([excess(eq) for eq in states[0]]),
        "p": vd * i_d + vq * iq, "q": vq * i_d - vd * iq, "angle": angle,
        "frequency": frequency, "speed": speed,
        "vref": vref0 - efd0 / gain + np.where(time >= at, size, 0.0) if loaded
        else v0 + np.where(time >= at, size, 0.0),
        "temperature": 61.0 + 0.02 * time, "gate": 0.34 + 1e-3 * np.sin(0.2 * time),
    }  # fmt: skip
    crest = np.sqrt(2.0 / 3.0) * signals["vt"]
    turns = omega0 * time + angle
    signals |= {
        name: crest * np.cos(turns - 2.0 * np.pi * k / 3.0) for k, name in enumerate(PHASES)
    }
    return time, signals, size


# ---- the file


def _units(rng, style, f0, kv, mva):
    """Return what 1 pu of each signal is in the numbers of a file, and its unit."""
    engineering = {
        "vt": [(kv, "kV"), (1e3 * kv, "V"), (110.0, "V"), (kv / np.sqrt(3.0), "kV")],
        "efd": [(95.0, "V")], "ifd": [(640.0, "A"), (38.4, "mV")], "p": [(mva, "MW")],
        "q": [(mva, "Mvar")], "frequency": [(f0, "Hz")],
        "angle": [(180.0 / np.pi, "deg"), (1.0, "rad")], "speed": [(300.0, "rpm")],
        "vref": [(100.0, "%"), (kv, "kV")], "temperature": [(1.0, "°C")], "gate": [(100.0, "%")],
        **{phase: [(kv, "kV"), (110.0, "V")] for phase in PHASES},
    }  # fmt: skip
    if style == "engineering":
        return {of: choices[int(rng.integers(len(choices)))] for of, choices in engineering.items()}
    scale, unit = (100.0, "%") if style == "per cent" else (1.0, "pu")
    other = {of: engineering[of][0] for of in ("frequency", "angle", "temperature", "gate")}
    if style == "per unit" and rng.random() < 0.5:
        other["frequency"] = (1.0, "pu")
    return {of: other.get(of, (scale, unit)) for of in engineering}


def _channels(rng, kind, loaded):
    """Return the signals of a file of a kind."""
    extras = [of for of in ("temperature", "gate") if rng.random() < 0.4]
    if kind == EVENT:
        turning = [["frequency"], ["angle"], ["frequency", "angle"]][int(rng.integers(3))]
        return ["vt", *turning, "p", "q", *(["ifd"] if rng.random() < 0.3 else []), *extras]
    if kind == BUMP and not loaded and rng.random() < 0.25:
        return [*PHASES, "efd", "ifd", *extras]
    own = ["vt", "efd", "ifd"]
    own += ["p", "q"] if loaded else []
    own += ["vref"] if kind == BUMP and rng.random() < 0.25 else []
    turning = str(rng.choice(["frequency", "speed", ""], p=[0.5, 0.25, 0.25]))
    return [*own, *([turning] if turning or kind == REJECTION else []), *extras]


def drawn(number: int, seed: int = 34) -> NamelessFile:
    """Return a drawn file: of recorders below RECORDERS, then of events."""
    rng = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)] if number < RECORDERS else EVENT
    loaded = kind != BUMP or bool(rng.random() < 0.35)
    f0, at = float(rng.choice([50.0, 60.0])), round(float(rng.uniform(2.0, 4.0)), 2)
    signals = [of for of in _channels(rng, kind, loaded) if of]
    waves = PHASES[0] in signals
    rate = 1000.0 if waves else float(rng.choice([30.0, 60.0] if kind == EVENT else [50.0, 100.0]))
    length = float(rng.choice([10.0, 15.0]) if waves else rng.choice([15.0, 25.0]))
    time, made, size = _unit(rng, kind, loaded, at, length, rate, f0)
    kv, mva = float(rng.choice([10.5, 13.8, 15.75])), float(rng.choice([48.0, 95.0, 220.0]))
    if kind == EVENT and rng.random() < 0.3:
        kv = 525.0
    style = str(rng.choice(["engineering", "engineering", "per unit", "per cent"]))
    units = _units(rng, style, f0, kv, mva)
    units |= dict.fromkeys(PHASES, units[PHASES[0]])
    naming = str(rng.choice(["words", "words", "none", "none", "letters"]))
    language, mark = int(rng.integers(6)), str(rng.choice(["ch", "Kanal ", "AI", "Trace_"]))
    said = str(rng.choice(["no", "row", "name"]))  # whether and where units are
    if naming == "words" and said == "no" and style != "per unit":
        said = "row"
    order = rng.permutation(len(signals))
    columns, numbers = [], {}
    for place, k in enumerate(order, 1):
        of = signals[k]
        base, unit = units[of]
        header = (
            f"{mark}{place}"
            if naming == "none" or of not in WORDS
            else (WORDS[of][language] if naming == "words" else f"{LETTERS[of]}A")
        )
        if of in PHASES and naming != "none":
            header = (
                f"U{'ABC'[PHASES.index(of)]}"
                if naming == "letters"
                else (f"{WORDS['vt'][language]} L{PHASES.index(of) + 1}")
            )
        header += f" [{unit}]" if said == "name" and unit not in ("", "pu") else ""
        columns.append(Column(header, of, base, unit if said != "no" else ""))
        scatter = NOISE.get(of, 1e-4)
        noisy = made[of] + rng.normal(0.0, scatter, len(time))
        if of == "vref":
            noisy = made[of]
        if of == "angle" and rng.random() < 0.5:
            noisy = np.angle(np.exp(1j * noisy))
        if of in ("temperature", "gate"):
            noisy = made[of] + rng.normal(0.0, 0.01 if of == "temperature" else 1e-4, len(time))
        numbers[header] = base * noisy
    clock = "t" if rng.random() < 0.5 else "Time (s)"
    return NamelessFile(
        f"{number:02d}_{kind.replace(' ', '_')}", kind, tuple(columns), time, numbers, clock,
        said == "row", loaded, at, size,
    )  # fmt: skip


FILES = RECORDERS + EVENTS
