"""ARMA models of each block of an AC1A by itself, from records of its input and its output.

The regulator, the rate feedback and the exciter are of first order, by the bilinear rule; rectifier
and demagnetising are static. No brushless unit has such records: they are simulated at the truth,
with noise, which is the best that can be hoped for.

Source: Oppenheim & Schafer 2010, section 7.2.2 (bilinear rule); IEEE 421.5-2005, 6.1 (blocks).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from coverage_cases import HARD_CASES
from linearised import autoregressive
from related_work import SEED, Estimate, Method, Residuals, Subject, samples
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import least_squares
from scipy.signal import lfilter

from exfit.fitting.experiment import Channel

FIELD_NOISE = 3e-4  # pu: that of ifd in the sample records
REGULATOR_NOISE = 1e-4  # pu: that of vt
NEAR_LIMIT = 0.05  # pu: where the regulator is taken to be at its limit
FIELD = ("VA", "VE", "efd", "ifd")
EVERY = (1, 2, 5)  # samples: the rates that are tried

Signals = Mapping[str, np.ndarray]


class FirstOrder(NamedTuple):
    """y[k] = a y[k-1] + b (u[k] + sign u[k-1]): a lag with sign 1, a washout with -1."""

    a: float
    b: float
    sign: float

    def response(self, u: np.ndarray, first: float) -> np.ndarray:
        """Return the response to u (M,) from a first output."""
        state = [first - self.b * u[0]]
        return lfilter([self.b, self.sign * self.b], [1.0, -self.a], u, zi=state)[0]

    def gain_and_time(self, interval: float) -> tuple[float, float]:
        """Return K and T of K / (1 + sT), or of sK / (1 + sT); nan where there are none."""
        if not 0.0 < self.a < 1.0:
            return np.nan, np.nan
        time = 0.5 * interval * (1.0 + self.a) / (1.0 - self.a)
        doubled = 2.0 * time + interval
        return self.b * doubled / (interval if self.sign > 0.0 else 2.0), time


def equation_error(u: np.ndarray, y: np.ndarray, used: np.ndarray, sign: float) -> FirstOrder:
    """Return the least squares of y[k] less what the model makes of y[k-1], where used."""
    rows = np.column_stack([y[:-1], u[1:] + sign * u[:-1]])[used[1:]]
    return FirstOrder(*np.linalg.lstsq(rows, y[1:][used[1:]], rcond=None)[0], sign)


def output_error(u: np.ndarray, y: np.ndarray, used: np.ndarray, sign: float) -> FirstOrder:
    """Return the least squares of the response, simulated from the last sample that is not used."""
    first = equation_error(u, y, used, sign)
    begin = 0 if used.all() else int(np.flatnonzero(~used)[-1])

    def errors(x: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            model = FirstOrder(x[0], x[1], sign)
            return np.nan_to_num(model.response(u[begin:], x[2]) - y[begin:])

    end = least_squares(errors, [first.a, first.b, y[begin]], x_scale="jac", max_nfev=50)
    return FirstOrder(end.x[0], end.x[1], sign)


Fit = Callable[[np.ndarray, np.ndarray, np.ndarray, float], FirstOrder]


def block(fit: Fit, times, u, y, used, sign) -> tuple[float, float]:
    """Return K and T of a block by the rate of sampling whose steps ahead are nearest."""
    best, least = (np.nan, np.nan), np.inf
    for every in EVERY:
        some = slice(None, None, every)
        whole = np.array([used[k : k + every].all() for k in range(len(used))])[some]
        model = fit(u[some], y[some], whole, sign)
        K, T = model.gain_and_time(every * (times[1] - times[0]))
        if not np.isfinite(K * T):
            continue
        response = model.response(u[some], y[0])
        error = float(np.mean((response - y[some])[whole] ** 2))
        if error < least:
            best, least = (K, T), error
    return best


def saturation(ve: np.ndarray, p: Mapping[str, float]) -> np.ndarray:
    """Return VX of the quadratic curve through the two points of a data sheet."""
    root = np.sqrt(p["E1"] * p["SE1"] / (p["E2"] * p["SE2"]))
    knee = (root * p["E2"] - p["E1"]) / (root - 1.0)
    return p["E1"] * p["SE1"] / (p["E1"] - knee) ** 2 * np.maximum(ve - knee, 0.0) ** 2


def parameters(fit: Fit, times: np.ndarray, s: Signals, p: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters of an AC1A, block by block; ``p`` has those of its data sheet."""
    error = s["vref"] - s["vt"] - s["vf"]
    inside = np.abs(s["VA"]) < min(p["VAMAX"], p["VRMAX"]) - NEAR_LIMIT
    inside[np.flatnonzero(np.diff(s["vref"]))[:, None] + np.arange(2)] = False  # the step
    KA, TA = block(fit, times, error, s["VA"], inside, 1.0)
    KF, TF = block(fit, times, s["vfe"], s["vf"], np.ones(len(times), bool), -1.0)
    ve, ifd = s["VE"], s["ifd"]
    driven = cumulative_trapezoid(s["VA"] - s["vfe"], times, initial=0.0)
    moved = ve - ve[0]
    if fit is equation_error:
        driven, moved = np.diff(driven), np.diff(moved)
    TE = (driven @ driven) / (driven @ moved)
    KC = np.sqrt(3.0) * (ifd @ (ve - s["efd"])) / (ifd @ ifd)
    KD = ifd @ (s["vfe"] - p["KE"] * ve - saturation(ve, p)) / (ifd @ ifd)
    return {"KA": KA, "TA": TA, "KF": KF, "TF": TF, "TE": TE, "KC": KC, "KD": KD}


def signals(of: Subject) -> dict[str, np.ndarray]:
    """Return the exact signals inside a unit at the truth, (M,) each."""
    (experiment,) = of.residuals.experiments
    p = experiment.parameters(of.residuals.values(of.truth))
    s = dict(experiment.simulator.response(p).signals)
    vfe = p["KE"] * s["VE"] + saturation(s["VE"], p) + p["KD"] * s["ifd"]
    return {**s, "vfe": vfe, "vf": p["KF"] / p["TF"] * (vfe - s["VF"])}


def errors_of_all(of: Subject) -> np.ndarray:
    """Return the standard errors (N,) of least squares of the records of all blocks at once.

    In those of least squares of vt alone, by linear theory, for white noise.
    """
    (experiment,) = of.residuals.experiments
    exact_signals, sizes = signals(of), {"vt": REGULATOR_NOISE} | dict.fromkeys(FIELD, FIELD_NOISE)
    channels = tuple(
        Channel(name, exact_signals[name], weight=1.0 / size) for name, size in sizes.items()
    )
    whole = replace(of.residuals, experiments=[replace(experiment, channels=channels)])
    of_vt = of.residuals.exact(of.truth) / REGULATOR_NOISE
    variances = [np.diag(np.linalg.inv(J.T @ J)) for J in (whole.exact(of.truth), of_vt)]
    return np.sqrt(variances[0] / variances[1])


def blocks(of: Subject, fit: Fit) -> Method:
    """Return the method for a unit all of whose signals are recorded; starts do not matter."""
    exact_signals, hard = signals(of), HARD_CASES[of.hard]
    noise = dict.fromkeys((*FIELD, "vfe"), FIELD_NOISE) | {"vf": REGULATOR_NOISE}

    def method(records: Sequence[Residuals], _: np.ndarray) -> list[Estimate]:
        rng, estimates = np.random.default_rng(SEED), {}
        for record in dict.fromkeys(records):
            s = dict(exact_signals) | {"vt": samples(record)}
            for name, size in noise.items():
                s[name] = s[name] + size * autoregressive(rng, hard.phi, len(s[name]))
            times = record.experiments[0].simulator.times
            values = parameters(fit, times, s, record.values(record.start))
            with np.errstate(all="ignore"):
                scaled = [free.scaled(values[free.name]) for free in record.free]
            estimates[record] = Estimate(np.clip(scaled, *record.bounds), 0)
        return [estimates[record] for record in records]

    return method
