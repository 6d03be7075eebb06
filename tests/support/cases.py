"""Cases that several tests start from, and what a fit of the small one leaves behind.

Their search is local: what a global one does is tested by itself.
"""

from dataclasses import replace

import numpy as np
from places import CONFIGS

from exfit.case.load import load_case

# k/(s + a) with k = 4 and a = 2, a unit step at 0.5 s from rest
TIME = np.linspace(0.0, 3.0, 61)
TRUTH = np.where(TIME < 0.5, 0.0, 2.0 - 2.0 * np.exp(-2.0 * (TIME - 0.5)))
FIRST_ORDER = {
    "model": "FIRST_ORDER",
    "given": "exact",
    "plant": {"type": "none"},
    "test": {"vt0": 0.0, "vref": [{"at": 0.5, "step": 1.0}]},
    "parameters": {
        "free": {
            "k": {"start": 1.0, "min": 0.1, "max": 100.0},
            "a": {"start": 1.0, "min": 0.1, "max": 100.0},
        }
    },
    "simulation": {"step": 0.01},
    "estimate": {"search": "local"},
}
FILES_OF_A_FIT = {
    "result.json",
    "parameters.yaml",
    "parameters_lm.yaml",
    "overlay_lm.png",
    "history.csv",
    "response.csv",
    "overlay.png",
    "iterations.csv",
    "iterations.png",
    "convergence.png",
    "trajectories.png",
    "sensitivities.csv",
    "sensitivity.png",
    "correlation.png",
    "down-step.csv",
    "down-step.png",
}


def with_local_search(content):
    """Return the content of a case with a local search, unless it says otherwise."""
    return content | {"estimate": {"search": "local", **content.get("estimate", {})}}


def local_case(name):
    """Return a case of the collection that is fitted from its own start alone."""
    case = load_case(CONFIGS / f"{name}.yaml")
    return replace(case, estimate=case.estimate.model_copy(update={"search": "local"}))
