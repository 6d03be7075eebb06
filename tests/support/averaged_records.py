"""Records of a bump test by recorders that average, or do not; their cases do not say so."""

from functools import cache

import numpy as np
from records import config

from exfit.case.case import Case
from exfit.records.record import Record
from exfit.workflows import simulate

TRUTH = {"KA": 400.0, "TA": 0.02, "TE": 0.8, "KF": 0.03, "TF": 1.0}
OTHERS = {"KC": 0.2, "KD": 0.38}
START_ASIDE = 1.4  # times, or its inverse
STEP, AT, END = 0.05, 2.0, 20.0  # pu, s, s
FINE = 0.0005  # s: so finely the truth is simulated
FIRST = 0.5  # s: of the record


@cache
def course():
    """Return the time (s) and vt of the test, finely."""
    content = config("ac1a_typical")
    parameters = {"fixed": {**content["parameters"]["fixed"], **OTHERS, **TRUTH}}
    test = {"vt0": 1.0, "duration": END, "vref": [{"at": AT, "step": STEP}]}
    grid = {"step": FINE, "output_step": FINE}
    sections = {key: content[key] for key in ("model", "saturation", "plant")}
    case = Case.from_dict({**sections, "parameters": parameters, "test": test, "simulation": grid})
    response = simulate(case, {}).response
    return response.time, response.signals["vt"]


def recorded(rate, window=0.0, trailing=False, noise=0.0, seed=0):
    """Return the record of samples, or of the mean over a window (s) about or before each instant.

    Its clock is anywhere between that of the test and a sample later.
    """
    rng = np.random.default_rng(seed)
    time, vt = course()
    at = np.arange(FIRST + rng.uniform(0.0, 1.0 / rate), END - 0.5, 1.0 / rate)
    if window:
        area = np.concatenate([[0.0], np.cumsum(0.5 * FINE * (vt[1:] + vt[:-1]))])
        end = at if trailing else at + 0.5 * window
        samples = (np.interp(end, time, area) - np.interp(end - window, time, area)) / window
    else:
        samples = np.interp(at, time, vt)
    return Record.from_arrays(at, {"vt": samples + noise * rng.standard_normal(len(at))})


def unsaid(record, channel="vt", late=0.0, **estimate):
    """Return the case of a record whose instant is to be found, as a new case has it."""
    content = config("ac1a_typical")
    at = AT + late
    free = {
        name: {
            "start": value * START_ASIDE ** (-1) ** k, "min": value / 10.0, "max": value * 10.0,
        }
        for k, (name, value) in enumerate(TRUTH.items())
    }  # fmt: skip
    content |= {
        "test": {
            "vt0": {"start": "auto"},
            "vref": [{"at": {"start": at, "min": at - 0.25, "max": at + 0.25}, "step": STEP}],
        },
        "parameters": {"fixed": {**content["parameters"]["fixed"], **OTHERS}, "free": free},
        "record": {"channels": {"vt": channel}},
        "estimate": estimate,
    }
    del content["validate"]
    return Case.from_dict(content, record)
