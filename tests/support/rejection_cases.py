"""Cases of a machine alone whose breaker opens, with records of the equations typed again."""

import numpy as np
from scipy.optimize import brentq
from typed_rejection import Load, TypedMachine, recorded_rejection

from exfit.case.case import Case
from exfit.records.record import Record

TRUE = {
    "Tpd0": 6.2, "Tppd0": 0.045, "Tpq0": 0.6, "Tppq0": 0.08, "H": 3.5, "D": 0.0, "Xd": 1.75,
    "Xq": 1.68, "Xpd": 0.29, "Xpq": 0.5, "Xppd": 0.22, "Xl": 0.15, "S10": 0.12, "S12": 0.4,
}  # fmt: skip
D_AXIS = {"Xd": 1.1, "Xpd": 1.3, "Xppd": 0.8, "Tpd0": 0.8, "Tppd0": 1.5}  # starts, of the truth
Q_AXIS = {"Xq": 1.1, "Xpq": 1.2, "Xppd": 0.9, "Tpq0": 0.8, "Tppq0": 1.3, "H": 1.2}
NOISE, RATE = 2e-4, 1000.0  # pu, Hz
REACTIVE = Load(0.0, -0.3)
OPENS = 1.0003  # s; between two samples


def content_of(load, free, signals, search="local", **breaker):
    """Return the content of a case whose free data start at a share of the truth."""
    return {
        "given": "exact",
        "plant": {
            "type": "machine-on-load",
            "machine": "GENROU",
            "parameters": {name: value for name, value in TRUE.items() if name not in free},
            "network": {"P": load.P, "Q": load.Q},
            "free": {
                name: {"start": share * TRUE[name], "min": TRUE[name] / 3, "max": TRUE[name] * 3}
                for name, share in free.items()
            },
        },
        "test": {"breaker": {"opens": OPENS} | breaker},
        "record": {"channels": {signal: {"noise": NOISE} for signal in signals}},
        "estimate": {"search": search},
    }


def case_of(
    load, free, signals=("vt", "ifd"), end=10.0, seed=0, driving=(), search="local", **breaker
):
    """Return a case with a record at 1 kHz, in which some signals drive the simulation."""
    time = np.arange(0.0, end + 0.5 / RATE, 1.0 / RATE)
    shown = recorded_rejection("GENROU", TRUE, load, OPENS, time, NOISE, seed)
    record = Record.from_arrays(time, {signal: shown[signal] for signal in (*signals, *driving)})
    content = content_of(load, free, signals, search, **breaker)
    content["record"]["channels"] |= {signal: {} for signal in driving}
    return Case.from_dict(content, record)


def of_machine(result):
    """Return the fitted parameters by their symbols."""
    return {name.removeprefix("machine."): p for name, p in result.parameters.items()}


def on_the_q_axis(power):
    """Return the load whose current has no part along d."""
    typed = TypedMachine("GENROU", TRUE)
    return Load(power, brentq(lambda q: typed.start(Load(power, q))[2], -0.25, 0.1))
