"""Made-up rows of a batch: as many as are asked for, of several models, some of them failed."""

import hashlib
from pathlib import Path

import numpy as np

from exfit.features.fleet.folder import (
    CaseSummary,
    Fleet,
    SummaryCurve,
    SummaryParameter,
    SummaryValidation,
)

MODELS = {
    "AC1A": {"KA": 400.0, "TA": 0.02, "TE": 0.8},
    "AC7B": {"KPR": 4.24, "KIR": 4.24, "TE": 1.1},
    "AC8B": {"KPR": 80.0, "KIR": 5.0, "KDR": 10.0},
    "ST1A": {"KA": 190.0, "TC": 1.0, "TB": 10.0},
    "ST4B": {"KPR": 10.75, "KIR": 10.75, "KPM": 1.0},
}
VERDICTS = (
    ("good", "the residuals are the noise of the record"),
    ("good", "the residuals are the noise of the record"),
    ("good", "the residuals are the noise of the record"),
    ("matches, not all determined", "TA is not determined by the record"),
    ("misses the record", "the residuals of vt are 8 times the noise of the record"),
    ("no match", "the response matches worse than a constant would"),
    ("not converged", "the search ended after 200 iterations"),
)
CAUSE = "a limiter acted that the model lacks: name it under `limiters`"
FAILURES = (
    ("failed", "plant.machine_parameters.Tpd0: 0 must be above 0"),
    ("timed out", "not finished after 300 s"),
    ("crashed", "the process ended by signal 11"),
    ("refused", "avr.py: not run: you have not trusted it yet"),
    ("no record", "the case has no record: nothing to fit"),
    ("not run", ""),
)
TIME = np.linspace(0.0, 10.0, 100)


def parameter(value, error=None, source="fitted", unit="pu"):
    """Return a parameter with the interval of an error; without one it is not determined."""
    low, high = (None, None) if error is None else (value - 1.96 * error, value + 1.96 * error)
    return SummaryParameter(value, low, high, source, unit, source == "fitted")


def row(name, model="AC1A", **content):
    """Return a row of a fit that is good, with anything in it replaced."""
    values = {
        symbol: parameter(value, 0.01 * value) for symbol, value in MODELS.get(model, {}).items()
    }
    standard = {
        "case": f"../cases/{name}.yaml",
        "key": hashlib.sha256(name.encode()).hexdigest()[:32],
        "status": "done",
        "reason": VERDICTS[0][1],
        "unit": name,
        "machine_model": "GENROU",
        "verdict": "good",
        "holds": True,
        "rmse": {"vt": 4.1e-4},
        "parameters": values,
    }
    return CaseSummary(name=name, model=model, **{**standard, **content})


def curve(rng, signal="vt", misfit=0.0):
    """Return a step response beside a simulation that differs by a slow wave."""
    damping, size = rng.uniform(0.4, 1.5), rng.uniform(0.02, 0.06)
    since = np.maximum(TIME - 1.0, 0.0)
    clean = 1.0 + size * (1.0 - np.exp(-damping * since) * np.cos(1.5 * since))
    noise = 4e-4 * rng.standard_normal(len(TIME))
    simulated = clean + misfit * size * np.sin(0.7 * since)
    return SummaryCurve("up", signal, TIME, clean + noise, simulated)


def fleet(count, folder=Path("fleet"), seed=1):
    """Return a batch of so many cases; one in twenty is no fit, the others have any verdict."""
    rng = np.random.default_rng(seed)
    rows = [_row(k, rng) for k in range(count)]
    return Fleet(folder, tuple(sorted(rows, key=lambda case: case.name)))


def _row(k, rng):
    name, models = f"unit_{k + 1:04d}", [*MODELS]
    model = models[int(rng.integers(len(models)))]
    content = {
        "key": f"{k:032x}",
        "unit": f"bus {101 + k}, machine 1",
        "bus": 101 + k,
        "machine_id": "1",
        "seconds": round(float(rng.lognormal(1.0, 0.5)), 3),
    }
    if rng.random() < 0.05:
        status, reason = FAILURES[int(rng.integers(len(FAILURES)))]
        bare = {"rmse": {}, "parameters": {}, "verdict": "", "holds": False}
        key = "" if status in ("refused", "no record") else content["key"]
        return row(
            name, model, **{**content, **bare, "status": status, "reason": reason, "key": key}
        )
    verdict, reason = VERDICTS[int(rng.integers(len(VERDICTS)))]
    holds = verdict in ("good", "matches, not all determined")
    values = {
        symbol: parameter(value * (1.0 + 0.02 * rng.standard_normal()), 0.01 * value)
        for symbol, value in MODELS[model].items()
    }
    first = next(iter(values))
    if rng.random() < 0.02:
        values[first] = parameter(1.5 * values[first].value, 0.01 * values[first].value)
    unresolved, cause = (), "" if holds else CAUSE
    if verdict.startswith("matches"):
        *_, last = values
        unresolved = (last,)
        cause = f"{last} is not determined: fix it if it is known, or plan a test that shows it"
        values[last] = parameter(values[last].value)
    rmse = float(4e-4 * (1.0 if holds else rng.uniform(3.0, 20.0)))
    return row(
        name,
        model,
        **content,
        verdict=verdict,
        reason=reason,
        holds=holds,
        rmse={"vt": rmse, "efd": 20.0 * rmse},
        validation=SummaryValidation("accepted" if holds else "not accepted", 1.2 * rmse),
        unresolved=unresolved,
        cause=cause,
        parameters={**values, "machine.Xd": parameter(1.8, source="nameplate")},
        curves=(curve(rng, "vt", 0.0 if holds else 0.2), curve(rng, "efd", 0.0 if holds else 0.2)),
    )
