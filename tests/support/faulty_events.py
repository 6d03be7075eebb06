"""Grid events of units that are otherwise than their case says in one thing, drawn at random.

The record of a unit behind a line to a source that swings, with the noise of a phasor measurement
unit; the case of the unit as it is, and one that lacks what KINDS names or has it otherwise. The
source swings without corners: 60 samples a second miss them, and the record then is that of a unit
with 0.1 % less inertia, five standard errors.
"""

from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from grid_events import EVENT, FIXED, LINE, TRUTH, UNIT

from exfit.case.load import load_case
from exfit.workflows import simulate

Content = dict[str, Any]

NOISE = {"vt": 1e-4, "angle": 2e-4, "p": 2e-4, "q": 2e-4}  # pu, rad
REACTANCES = {
    "Xd": 1.8, "Xq": 1.7, "Xpd": 0.3, "Xpq": 0.5, "Xppd": 0.22, "Tpq0": 0.6,
}  # fmt: skip
START = {"K": 50.0, "TE": 0.1}
TRANSFORMER = 0.12  # pu
GOVERNORS = {
    "TGOV1": {"R": 0.05, "VMAX": 1.2},
    "IEEEG1": {},
    "HYGOV": {},
    "GAST": {"VMAX": 1.2},
}
STABILISER = {"model": "STAB1", "parameters": {"K_T": 2.0, "T": 5.0, "T1_T3": 3.0, "T2_T4": 1.0}}
CORNER = 0.1  # s: within as much of its corners the angle of the source turns
FINE = 1.0 / 320.0  # s: bends between samples of the record are drawn by lines


def without_corners(table: list[list[float]]) -> list[list[float]]:
    """Return the table of an angle as the mean of the angle about each instant."""
    about = np.linspace(-CORNER, CORNER, 65)
    weights = np.hanning(len(about)) / np.sum(np.hanning(len(about)))
    given = np.array(table, dtype=float).T
    bends = [np.arange(at - CORNER, at + CORNER, FINE) for at in given[0, 1:-1]]
    time = np.unique(np.round([given[0, 0], *np.concatenate(bends), given[0, -1]], 9))
    means = np.array([np.interp(at + about, *given) @ weights for at in time])
    means[[0, -1]] = given[1, [0, -1]]
    return np.column_stack([time, means]).tolist()


SWING = {"angle": {**EVENT["angle"], "table": without_corners(EVENT["angle"]["table"])}}


@dataclass(frozen=True)
class EventFault:
    """The case of a unit as it is, and one in which one thing is wrong."""

    sound: Path
    faulty: Path


def governed(name):
    return {"governor": {"model": name, "parameters": GOVERNORS[name]}}


# what the unit has, what its case has: sections, and keys of the plant
KINDS = {
    "dialect andes": ({"dialect": "andes"}, {}, "dialect: andes"),
    "dialect standard": ({}, {"dialect": "andes"}, "dialect: standard"),
    "TGOV1": (governed("TGOV1"), {}, "a governor that the case lacks"),
    "IEEEG1": (governed("IEEEG1"), {}, "a governor that the case lacks"),
    "HYGOV": (governed("HYGOV"), {}, "a governor that the case lacks"),
    "GAST": (governed("GAST"), {}, "a governor that the case lacks"),
    "stabiliser": ({"stabiliser": STABILISER}, {}, "a stabiliser that the case lacks"),
    "idle governor": ({}, governed("TGOV1"), "the governor TGOV1"),
    "idle stabiliser": ({}, {"stabiliser": STABILISER}, "the stabiliser STAB1"),
    "H": ({"H": 1.25}, {}, "machine.H"),
    "D": ({"D": 2.0}, {}, "machine.D"),
    "transformer": ({"X": TRANSFORMER}, {}, "network.X"),
    "place of powers": (
        {"X": TRANSFORMER, "power_at": "terminals"}, {"X": TRANSFORMER}, "power_at: terminals",
    ),
}  # fmt: skip


def drawn(kind: str, seed: int, folder: Path) -> EventFault:
    """Return the case of a kind of fault with the record of its event, and the case without it."""
    rng = np.random.default_rng(seed)
    level = {"P": float(rng.uniform(0.5, 0.85)), "Q": float(rng.uniform(-0.1, 0.25))}
    unit, case, _ = KINDS[kind]
    name = f"{kind.replace(' ', '-')}-{seed}"
    recorded(folder / f"{name}.csv", unit, level, rng)
    paths = [folder / f"{name}-{which}.yaml" for which in ("sound", "faulty")]
    for path, has in zip(paths, (unit, case), strict=True):
        path.write_text(yaml.safe_dump(playback_content(has, f"{name}.csv"), sort_keys=False))
    return EventFault(*paths)


def machine(has: Content) -> Content:
    """Return the data of the machine of a unit."""
    return UNIT | REACTANCES | {"H": UNIT["H"] * has.get("H", 1.0), "D": has.get("D", 0.0)}


def sections(has: Content) -> Content:
    return {name: has[name] for name in ("governor", "stabiliser") if name in has}


def playback_content(has: Content, file: str) -> Content:
    """Return the case of a grid event of a unit, of which K and TE are fitted."""
    plant = {
        "type": "grid-playback", "machine": "GENROU", "parameters": machine(has),
        "network": {"f0": 60, "X": has.get("X", 0.0)}, "dialect": has.get("dialect", "standard"),
        "power_at": has.get("power_at", "recorded-voltage"),
    }  # fmt: skip
    free = {k: {"start": v, "min": v / 10, "max": v * 10} for k, v in START.items()}
    channels = {signal: signal for signal in NOISE}
    return deepcopy({
        "model": "SEXS", "given": "exact", "plant": plant, **sections(has),
        "parameters": {"fixed": FIXED, "free": free},
        "record": {"file": file, "time": "t", "channels": channels},
    })  # fmt: skip


def recorded(path: Path, has: Content, level: Content, rng: np.random.Generator) -> None:
    """Write the record of a unit in an event, at its terminals or behind its transformer."""
    plant = {
        "type": "infinite-bus", "machine": "GENROU", "parameters": machine(has),
        "network": {**LINE, **level}, "dialect": has.get("dialect", "standard"),
    }  # fmt: skip
    content = {
        "model": "SEXS", "given": "exact", "plant": plant, **sections(has),
        "test": {"vt0": 1.0, "duration": 12.0, **SWING},
        "parameters": {"fixed": {**FIXED, **TRUTH}},
        "simulation": {"output_step": 1.0 / 60.0, "step": 1.0 / 960.0},
    }  # fmt: skip
    file = path.with_suffix(".yaml")
    file.write_text(yaml.safe_dump(deepcopy(content)))
    response = simulate(load_case(file), {}).response
    time, (vt, p, q) = response.time, (response.signals[name] for name in ("vt", "p", "q"))
    current = (p - 1j * q) / vt
    source = vt - (LINE["R"] + 1j * LINE["X"]) * current
    table = np.array(SWING["angle"]["table"], dtype=float).T
    turned = np.exp(1j * (np.radians(np.interp(time, *table)) - np.angle(source)))
    far = (vt - 1j * has.get("X", 0.0) * current) * turned
    power = p + 1j * q
    if has.get("power_at") != "terminals":
        power = far * np.conj(current * turned)
    columns = {
        "t": time, "vt": np.abs(far), "angle": np.unwrap(np.angle(far)), "p": power.real,
        "q": power.imag,
    }  # fmt: skip
    for name, noise in NOISE.items():
        columns[name] = columns[name] + noise * rng.standard_normal(len(time))
    rows = np.transpose([*columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
