"""Fits of records that are simulated as a designed test would give them."""

import numpy as np

import exfit

START = 1.05  # of the truth: where the fits begin


def contents(case_content, design, stage, truth):
    """Return the case of a test: with its steps, its channels and their noise, from a start."""
    test = {
        "vt0": design.vt0,
        "vref": [{"at": step.at, "step": step.step} for step in stage.steps],
    }
    channels = {
        signal: {"column": signal, "noise": design.noise[signal]} for signal in stage.channels
    }
    parameters = case_content["parameters"]
    free = {
        name: {**parameters["free"][name], "start": START * value} for name, value in truth.items()
    }
    kept = {key: case_content[key] for key in ("model", "plant", "saturation")}
    return {
        **kept,
        "test": test,
        "record": {"channels": channels},
        "parameters": {**parameters, "free": free},
        "estimate": {"search": "local"},
    }


def response(case_content, design, stage, truth):
    """Return the clock and the channels of a test at the true values."""
    content = contents(case_content, design, stage, truth)
    content.pop("record")
    content["test"]["duration"] = stage.duration
    content["simulation"] = {"output_step": 1.0 / design.rate}
    simulated = exfit.simulate(exfit.Case.from_dict(content), truth).response
    return simulated.time, {signal: simulated.signals[signal] for signal in stage.channels}


def spread_of_fits(case_content, design, stage, truth, count, seed):
    """Return the relative errors (count, N) of fits of as many noisy records."""
    rng = np.random.default_rng(seed)
    time, signals = response(case_content, design, stage, truth)
    content = contents(case_content, design, stage, truth)
    errors = []
    for _ in range(count):
        noisy = {
            signal: samples + design.noise[signal] * rng.standard_normal(len(time))
            for signal, samples in signals.items()
        }
        record = exfit.Record.from_arrays(time, noisy)
        fitted = exfit.fit(exfit.Case.from_dict(content, record)).values
        errors.append([fitted[name] / value - 1.0 for name, value in truth.items()])
    return np.array(errors)
