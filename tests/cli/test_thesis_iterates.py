"""`exfit fit` goes from iterate to iterate as the thesis' methods do, typed without exfit.

Both sides read the same record. What rounding leaves in R' is multiplied by the length of the step,
so iterates are compared in units of the longest one tried: of the start, or, for a full step of
Gauss-Newton from the typical values, of 75 starts.
"""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import typed_thesis
import yaml
from matplotlib.figure import Figure
from places import CONFIGS, SAMPLES
from tiers import few_of
from typed_thesis import Typed, residuals_of

from exfit.output import figures as plots

SAME = 1e-8
H = 0.01
VISIBLY = 1.0 - 1e-6
OPEN = -np.inf, np.inf
OF_ONE_FIT = ("overlay", "iterations", "convergence", "trajectories", "sensitivity", "correlation")
FIRST = {"k": 5.0, "a": 2.5}  # where the thesis' 3.3 begins
TYPICAL = {
    "KA": 766.0, "KF": 0.024, "TE": 1.3, "TF": 1.0, "TA": 0.02, "KC": 0.486, "KD": 0.3556,
}  # fmt: skip
SYSTEMS = {
    "first_order": ("first_order", FIRST, typed_thesis.first_order),
    "ac1a": ("ac1a_typical", TYPICAL, typed_thesis.ac1a),
}
SETTINGS = {
    "dgn": {"strategy": "dgn", "dgn": {"step": "full", "cut": "half"}},
    "lm_ratio": {"strategy": "lm", "lm": {"update": "ratio"}},
    "lm_armijo": {"strategy": "lm", "lm": {"update": "armijo"}},
}


@pytest.fixture(autouse=True)
def _no_figures(empty_folder, monkeypatch):
    for name in OF_ONE_FIT:
        monkeypatch.setattr(plots, name, lambda *_: Figure(figsize=(1, 1)))


def system(name):
    """Return the case of a system, its start, its response, and its record."""
    case, start, response = SYSTEMS[name]
    content = yaml.safe_load((CONFIGS / f"{case}.yaml").read_text())
    del content["validate"]
    file = SAMPLES / Path(content["record"]["file"]).name
    content["simulation"] = {"step": typed_thesis.STEP}
    content["record"]["file"] = str(file)
    times, measured, *_ = np.loadtxt(file, delimiter=",", skiprows=1).T
    return content, start, response, times, measured


def fitted(run, content):
    """Return the history of `exfit fit`, as far as f falls: rounding decides on what follows."""
    Path("case.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    ran = run("fit", "case.yaml", "-o", "fit")
    assert ran.code in (0, 3), ran.err  # some iterations are not enough
    history = json.loads(Path("fit/result.json").read_text())["history"]
    falling = [line["cost"] < VISIBLY * last["cost"] for last, line in pairwise(history)]
    return history[: [*falling, False].index(False) + 1]


def within(factor):
    """Return bounds that are a factor from the typical values."""
    return {name: (value / factor, value * factor) for name, value in TYPICAL.items()}


NONE = {}
ABOVE = {"k": (4.4, 6.0)}  # k = 4 lies outside
# a system, its method, the scale of x, what h is, the bounds
CASES = [
    ("first_order", "dgn", "raw", "relative", NONE),
    ("ac1a", "dgn", "start", "absolute", NONE),
    ("ac1a", "lm_armijo", "start", "absolute", within(1.2)),
    ("first_order", "lm_ratio", "start", "absolute", ABOVE),
    ("first_order", "lm_armijo", "start", "absolute", NONE),
    ("ac1a", "lm_ratio", "start", "relative", NONE),
    ("first_order", "lm_ratio", "raw", "absolute", NONE),
    ("ac1a", "dgn", "start", "absolute", within(2.0)),
    ("first_order", "dgn", "start", "relative", ABOVE),
    ("first_order", "lm_armijo", "raw", "relative", ABOVE),
    ("ac1a", "lm_armijo", "start", "absolute", NONE),
    ("ac1a", "lm_ratio", "start", "absolute", within(1.2)),
]


def as_in_a_case(bounds):
    """Return the keys of bounds."""
    return dict(zip(("min", "max"), bounds, strict=True)) if bounds else {"bounds": "none"}


@pytest.mark.parametrize(("name", "method", "scale", "differences", "bounds"), few_of(CASES, 2))
def test_each_iterate_is_that_of_the_methods_typed_again(
    run, name, method, scale, differences, bounds
):
    content, start, response, times, measured = system(name)
    content["parameters"]["free"] = {
        name: {"start": value, "scale": scale, **as_in_a_case(bounds.get(name))}
        for name, value in start.items()
    }
    content["estimate"] = {
        **SETTINGS[method],
        "search": "local",
        "jacobian": "central",
        "difference_step": H,
        "differences": differences,
        "iterations": 5,
    }
    history = fitted(run, content)

    p = np.array([*start.values()])
    size = p if scale == "start" else np.ones(len(p))
    errors = residuals_of(response, times, measured)
    typed = Typed(
        lambda x: errors(x * size),
        (lambda x: H * np.abs(x)) if differences == "relative" else (lambda x: np.full(len(x), H)),
        *(limits / size for limits in np.transpose([bounds.get(name, OPEN) for name in start])),
    )
    rows = getattr(typed, method)(p / size, len(history) - 1)
    assert len(history) == 6 if name == "ac1a" else len(history) > 2
    longest = 1.0
    for line, (before, _), (x, rejected) in zip(history, [rows[0], *rows], rows, strict=False):
        longest = max(longest, 2.0**rejected * np.linalg.norm((x - before) * size / p))
        found = np.array([line["values"][name] for name in start])
        assert np.abs(found / p - x * size / p).max() <= SAME * longest
        assert line["inner"] == rejected
    at_bound = any((x == typed.low).any() or (x == typed.high).any() for x, _ in rows)
    assert at_bound == bool(bounds)
