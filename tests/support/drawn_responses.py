"""Drawn records of second-order responses with noise and ripple, whose features have formulas."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import exfit
from exfit.dsp.features import BAND, LABELS, RISE_LEVELS

MODEL = Path(__file__).with_name("second_order.py")
NAMES = tuple(name for _, name, _ in LABELS)
FREQUENCIES = (2.0, 10.0)  # rad/s
DAMPINGS = (0.2, 0.8)
SIZES = (0.01, 0.05)  # pu, up or down
RESTS = (1.0, 3.0)  # s before the step
DECAYS = 12.0  # e-foldings after the step: the response ends within 6e-6 of its way
RATES = (50.0, 100.0, 200.0)  # Hz
NOISES = (1e-3, 1e-2)  # of the step: the standard deviation of the white noise
AMPLITUDES = (0.5, 5.0)  # of that: the ripple
MAINS = (50.0, 60.0)  # Hz
DEVIATION = 0.05  # Hz, of the mains from these
HARMONICS = (1, 2, 3, 6, 12)
FEWEST_PERIODS = 4.0  # of the ripple as it is sampled
START = 1.2  # of the truth: where fits start
WRONG = 1.03  # of the damping ratio: that of the poor model


@dataclass(frozen=True, eq=False)
class DrawnResponse:
    """A record (M,) of a step by ``size`` (pu) at ``step_at`` (s), and its ripple beside it.

    ``truth`` are the features of the response that nothing disturbs, by name.
    """

    time: np.ndarray
    quiet: np.ndarray
    ripple: np.ndarray
    w: float
    z: float
    size: float
    step_at: float
    frequency: float
    truth: dict


def response(t, w, z):
    """Return the share (M,) of its way that a second-order response has gone t (M,) s after."""
    t = np.maximum(t, 0.0)
    damped = w * np.sqrt(1.0 - z**2)
    return 1.0 - np.exp(-z * w * t) * (np.cos(damped * t) + z * w / damped * np.sin(damped * t))


def features_by_formula(w, z, size):
    """Return the features of a response from 1 pu, by formulas and roots of the closed form."""
    damped = w * np.sqrt(1.0 - z**2)
    peak = np.pi / damped

    def crossing(level, low, high):
        return brentq(lambda t: float(response(t, w, z)) - level, low, high, xtol=1e-12)

    begin, end = (crossing(level, 0.0, peak) for level in RISE_LEVELS)
    # it turns at the multiples of the peak time, by ever less
    turns = int(np.ceil(np.log(1.0 / BAND) / (z * np.pi / np.sqrt(1.0 - z**2)))) + 1
    outside = [k for k in range(1, turns) if abs(response(k * peak, w, z) - 1.0) > BAND]
    last = max(outside, default=0)
    edge = 1.0 + BAND if response(last * peak, w, z) > 1.0 else 1.0 - BAND
    return {
        "initial_value": 1.0,
        "final_value": 1.0 + size,
        "rise_time": end - begin,
        "overshoot_percent": 100.0 * np.exp(-np.pi * z / np.sqrt(1.0 - z**2)),
        "peak_time": peak,
        "settling_time": crossing(edge, last * peak, (last + 1) * peak),
    }


def folded(frequency, rate):
    """Return the frequency (Hz) that sampling shows in place of another one."""
    return abs(frequency - rate * round(frequency / rate))


def drawn_response(seed, like=None):
    """Return the record of a seed, of a unit of its own or one ``like`` that of another record."""
    rng = np.random.default_rng(seed)
    w, z = rng.uniform(*FREQUENCIES), rng.uniform(*DAMPINGS)
    if like is not None:
        w, z = like.w, like.z
    size = rng.choice([-1.0, 1.0]) * rng.uniform(*SIZES)
    rate = rng.choice(RATES)
    step_at = rng.uniform(*RESTS)
    time = np.arange(0.0, step_at + DECAYS / (z * w), 1.0 / rate)
    frequency = 0.0
    while not FEWEST_PERIODS / time[-1] < frequency < 0.5 * rate - FEWEST_PERIODS / time[-1]:
        mains = rng.choice(MAINS) + rng.uniform(-DEVIATION, DEVIATION)
        # a recorder that samples by its own clock folds a harmonic to anywhere
        frequency = folded(rng.choice(HARMONICS) * mains, rate * rng.uniform(0.9, 1.1))
    noise = abs(size) * np.exp(rng.uniform(*np.log(NOISES)))
    amplitude = noise * np.exp(rng.uniform(*np.log(AMPLITUDES)))
    angle = 2.0 * np.pi * frequency * time + rng.uniform(0.0, 2.0 * np.pi)
    quiet = 1.0 + size * response(time - step_at, w, z) + rng.normal(0.0, noise, len(time))
    truth = features_by_formula(w, z, size)
    ripple = amplitude * np.cos(angle)
    return DrawnResponse(time, quiet, ripple, w, z, size, step_at, frequency, truth)


def case_of(drawn, rippled=True, sine=False, poor=False, validated=()):
    """Return the case of a drawn record, with its ripple and a sine for it, or without.

    A poor model has a wrong damping ratio; ``validated`` are drawn records that are not fitted.
    """
    channel = {"column": "vt"} | ({"sine": {"frequency": {"start": "auto"}}} if sine else {})
    free = {"w": drawn.w} | ({} if poor else {"z": drawn.z})
    content = {
        "model": str(MODEL),
        "given": "exact",
        "plant": {"type": "none"},
        **_recording(drawn, channel),
        "parameters": {
            "fixed": {"z": float(WRONG * drawn.z)} if poor else {},
            "free": {
                name: {
                    "start": float(START * value),
                    "min": float(value / 5.0),
                    "max": float(value * 5.0),
                }
                for name, value in free.items()
            },
        },
        "estimate": {"search": "local"},
        "validate": [
            {"name": f"validated{k}", **_recording(each, channel)}
            for k, each in enumerate(validated)
        ],
    }
    records = {
        name: exfit.Record.from_arrays(each.time, {"vt": each.quiet + rippled * each.ripple})
        for name, each in zip(
            ("fit", *(entry["name"] for entry in content["validate"])),
            (drawn, *validated),
            strict=True,
        )
    }
    return exfit.Case.from_dict(content, records)


def _recording(drawn, channel):
    step = {"at": float(drawn.step_at), "step": float(drawn.size)}
    return {
        "test": {"vt0": 1.0, "vref": [step]},
        "record": {"channels": {"vt": channel}},
    }


def fit_of(drawn, **case):
    """Return the fit of a drawn record."""
    return exfit.fit(case_of(drawn, **case))


def held(drawn, measured):
    """Return whether each feature that is stated with an interval holds the truth, by name."""
    return {
        name: abs(getattr(measured, name) - drawn.truth[name]) <= half
        for name, half in measured.errors.items()
        if name in NAMES
    }
