"""Sets of grid events of one unit whose data are known: exciter, stabiliser, governor, machine."""

from dataclasses import replace

import numpy as np
import yaml

from exfit.case.load import load_case
from exfit.fitting.build import plain_simulator
from exfit.simulation.inputs import SplinedInput

MACHINE = {
    "Tpd0": 6.27, "Tppd0": 0.059, "Tpq0": 0.7, "Tppq0": 0.096, "H": 4.471, "D": 0.0, "Xd": 2.014,
    "Xq": 1.96, "Xpd": 0.331, "Xpq": 0.466, "Xppd": 0.2059, "Xl": 0.129, "S10": 0.14, "S12": 0.56,
}  # fmt: skip
EXCITERS = {
    "EXST1": {"TR": 0.01, "TC": 1.0, "TB": 8.0, "KA": 200.0, "TA": 0.02, "KC": 0.05, "KF": 0.0,
              "TF": 1.0, "VRMAX": 6.0, "VRMIN": -5.0},
    "REXS": {"KVP": 30.0, "KVI": 15.0, "TA": 0.01, "KF": 0.02, "TF": 0.7, "KIP": 5.0, "KII": 5.0},
}  # fmt: skip
STABILISER = {"KS1": 12.0, "T1": 0.20, "T2": 0.03, "T3": 0.18, "T4": 0.025, "T10": 0.0, "T11": 0.0,
              "T7": 10.0, "KS2": 10.0 / (2.0 * 4.471), "TW2": 10.0}  # fmt: skip
GOVERNOR = {"R": 0.05, "Kpgov": 8.0, "Kigov": 1.5, "Tact": 0.5, "Kturb": 1.5, "Tb": 0.6, "Tc": 0.0}
LINE = {"f0": 60, "R": 0.005, "X": 0.35}
RATE = 30.0  # samples a second
OPERATING = ((0.8, 0.1), (0.6, 0.25), (0.9, -0.05))  # P, Q of the events
LENGTHS = (60.0, 40.0, 30.0)  # s
REST = 5.0  # s


def angle_at(time, size, swing, damping, fall, recovery):
    """Return the angle (degrees) of a grid at times (s): a swing on a frequency that dips."""
    after = np.maximum(time - REST, 0.0)
    begun = 1.0 - np.exp(-((after / 0.15) ** 2))  # a PMU filters what jumps
    lost = after - 2.0 * (1.0 - np.exp(-after / 2.0))  # integrals of the two exponentials
    regained = after - 12.0 * (1.0 - np.exp(-after / 12.0))
    angle = 360.0 * fall * (recovery * regained - lost)
    return angle + begun * size * np.exp(-damping * after) * np.sin(2.0 * np.pi * swing * after)


COURSES = (
    (20.0, 0.9, 0.25, 0.03, 0.8),
    (-25.0, 1.3, 0.35, 0.015, 0.6),
    (30.0, 0.6, 0.30, 0.04, 0.9),
)


def driven(case, moves):
    """Return a simulator of a case whose source moves by smooth courses, with its values and those.

    ``moves`` returns the courses (M,) by their signals at times (M,), s; no table is as smooth.
    """
    values = case.values()
    simulator, levels = plain_simulator(case, values)
    moved = moves(simulator.times)
    inputs = {name: SplinedInput(simulator.times, course) for name, course in moved.items()}
    simulator = simulator.remade(inputs=replace(simulator.inputs, steps=(), recorded=inputs))
    return simulator, {**values, **levels}, moved


def recorded(folder, exciter="EXST1", noise=2e-4, seed=1, lengths=LENGTHS):
    """Write the records of so many events; p and q are of the base of the machine."""
    rng = np.random.default_rng(seed)
    events = zip(OPERATING, lengths, COURSES, strict=False)
    for number, ((p0, q0), length, course) in enumerate(events, 1):
        content = {
            "model": exciter,
            "given": "exact",
            "plant": {"type": "infinite-bus", "machine": "GENROU", "parameters": MACHINE,
                      "network": {**LINE, "P": p0, "Q": q0}},
            "stabiliser": {"model": "PSS2B", "parameters": STABILISER},
            "governor": {"model": "GGOV1", "parameters": GOVERNOR},
            "test": {"vt0": 1.01, "duration": length,
                     "angle": [{"at": REST, "step": 1.0, "unit": "deg"}]},
            "parameters": {"fixed": EXCITERS[exciter]},
            "simulation": {"output_step": 1.0 / 240.0, "step": 1.0 / 960.0},
        }  # fmt: skip
        file = folder / f"truth{number}.yaml"
        file.write_text(yaml.safe_dump(content))

        def moves(time, course=course):
            return {"angle": np.radians(angle_at(time, *course))}

        simulator, values, moved = driven(load_case(file), moves)
        response = simulator.response(values)
        keep = slice(None, None, round(240.0 / RATE))
        at = response.time[keep]
        vt, p, q = (response.signals[name][keep] for name in ("vt", "p", "q"))
        source = vt - (LINE["R"] + 1j * LINE["X"]) * (p - 1j * q) / vt
        phase = moved["angle"][keep] - np.angle(source)
        columns = [at, vt, np.unwrap(phase), p, q]
        for column in (1, 3, 4):
            columns[column] = columns[column] + noise * rng.standard_normal(len(at))
        columns[2] = columns[2] + 0.3 * noise * rng.standard_normal(len(at))
        np.savetxt(folder / f"event{number}.csv", np.transpose(columns), delimiter=",",
                   header="t,vt,angle,p,q", comments="", fmt="%.10g")  # fmt: skip


FREE = {  # start, and what factor the bounds are away; the start of the set is a wrong baseline
    "EXST1": {"KA": (120.0, 5), "TC": (8.0, 20), "TB": (1.0, 20)},
    "REXS": {"KVP": (15.0, 10), "KVI": (30.0, 10), "TF": (1.5, 5)},
}
OTHERS = {
    "machine": {"H": (3.5, 2), "Tpd0": (5.0, 2), "Xd": (1.8, 1.5)},
    "stabiliser": {"KS1": (20.0, 10)},
    "governor": {"Kpgov": (4.0, 10), "Kigov": (4.0, 10), "Tb": (1.2, 10)},
}


def bounds(entries):
    """Return the free parameters as a case has them."""
    return {
        name: {"start": at, "min": at / by, "max": at * by} for name, (at, by) in entries.items()
    }


def set_case(folder, exciter="EXST1", count=3, **sections):
    """Write the case of the events with ten free parameters, and return its path."""
    free = FREE[exciter]
    parts = {"machine": MACHINE, "stabiliser": STABILISER, "governor": GOVERNOR}
    given = {
        part: {
            "parameters": {name: at for name, at in parts[part].items() if name not in own},
            "free": bounds(own),
        }
        for part, own in OTHERS.items()
    }
    angle = {"column": "angle", "unit": "rad"}
    channels = {"vt": "vt", "angle": angle, "p": "p", "q": "q"}
    content = {
        "model": exciter,
        "given": "exact",
        "plant": {
            "type": "grid-playback", "machine": "GENROU", "network": {"f0": 60},
            **given["machine"],
        },
        "stabiliser": {"model": "PSS2B", **given["stabiliser"]},
        "governor": {"model": "GGOV1", **given["governor"]},
        "records": [
            {
                "name": f"event-{k}",
                "record": {"file": f"event{k}.csv", "time": "t", "channels": channels},
            }
            for k in range(1, count + 1)
        ],
        "parameters": {
            "fixed": {name: at for name, at in EXCITERS[exciter].items() if name not in free},
            "free": bounds(free),
        },
        **sections,
    }  # fmt: skip
    path = folder / "case.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path
