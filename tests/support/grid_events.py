"""Grid events of a unit whose data are known: its terminals, recorded behind a line to a source."""

import numpy as np
import yaml

from exfit.case.load import load_case
from exfit.workflows import simulate

TRUTH = {"K": 80.0, "TE": 0.06}
UNIT = {"Tpd0": 6.0, "Tppd0": 0.05, "Tppq0": 0.08, "H": 4.0, "Xl": 0.13, "S10": 0.1, "S12": 0.4}
LINE = {"f0": 60, "R": 0.01, "X": 0.3}
SAMPLES = 60.0  # a second, as of a phasor measurement unit
EVENT = {  # the grid swings, and its frequency falls; nothing jumps, as splines need
    "angle": {"table": [[0, 0], [2, 0], [2.5, -25], [3.2, 10], [4, -12], [12, -30]], "unit": "deg"}
}
SIGNALS = ("vt", "angle", "p", "q")
FIXED = {"TATB": 0.2, "TB": 5.0, "EMIN": -9.0, "EMAX": 9.0}


def recorded(path, P=0.8, Q=0.1, vt0=1.0, noise=0.0, seed=1, vs=None, **truth):
    """Write the record of an event from its own operating point; return its columns.

    The angle is that of the terminals; that of the source is zero before the event. ``vs`` are the
    rows of a signal at the stabiliser's input, s and pu.
    """
    test = EVENT | ({} if vs is None else {"vs": {"table": vs}})
    content = {
        "model": "SEXS",
        "given": "exact",
        "plant": {
            "type": "infinite-bus", "machine": "GENROU", "parameters": UNIT,
            "network": {**LINE, "P": P, "Q": Q},
        },
        "test": {"vt0": vt0, "duration": 12.0, **test},
        "parameters": {"fixed": {**FIXED, **TRUTH, **truth}},
        "simulation": {"output_step": 1.0 / 240.0, "step": 1.0 / 960.0},
    }  # fmt: skip
    file = path.with_suffix(".yaml")
    file.write_text(yaml.safe_dump(content))
    response = simulate(load_case(file), {}).response
    keep = slice(None, None, round(240.0 / SAMPLES))
    time = response.time[keep]
    vt, p, q, efd = (response.signals[name][keep] for name in ("vt", "p", "q", "efd"))
    # the source is seen from the terminals: E = V - (R + jX) (P - jQ) / V
    source = vt - (LINE["R"] + 1j * LINE["X"]) * (p - 1j * q) / vt
    table = np.array(EVENT["angle"]["table"], dtype=float).T
    angle = np.radians(np.interp(time, *table)) - np.angle(source)
    columns = {"t": time, "vt": vt, "angle": angle, "p": p, "q": q, "efd": efd}
    rng = np.random.default_rng(seed)
    for name in ("vt", "angle", "p", "q", "efd"):
        columns[name] = columns[name] + noise * rng.standard_normal(len(time))
    if vs is not None:
        columns["vs"] = np.interp(time, *np.array(vs, dtype=float).T)
    rows = np.transpose([*columns.values()])
    header = ",".join(columns)
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.10g")
    return columns


def event_case(folder, *names, validate=(), free=True, signals=SIGNALS, **sections):
    """Return a case of a unit in one event, or in several, beside records that lie in a folder."""

    def entry(name):
        channels = {signal: signal for signal in signals}
        return {"record": {"file": f"{name}.csv", "time": "t", "channels": channels}}

    start = {"K": 50.0, "TE": 0.1}
    content = {
        "model": "SEXS",
        "given": "exact",
        "plant": {
            "type": "grid-playback", "machine": "GENROU", "parameters": UNIT,
            "network": {"f0": 60},
        },
        "parameters": {
            "fixed": FIXED if free else FIXED | TRUTH,
            "free": {
                name: {"start": value, "min": value / 10, "max": value * 10}
                for name, value in start.items()
            } if free else {},
        },
        "estimate": {"search": "local"},
        **sections,
    }  # fmt: skip
    if len(names) == 1:
        content |= entry(names[0])
    else:
        content["records"] = [{"name": name, **entry(name)} for name in names]
    if validate:
        content["validate"] = [{"name": name, **entry(name)} for name in validate]
    path = folder / "case.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path
