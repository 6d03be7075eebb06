"""Show what exfit's own ways come to, beside which the methods of related work are set.

    python tests/studies/related_search.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import numpy as np
from places import CONFIGS
from related_work import Estimate, Residuals, each, local, matched, show

from exfit.case.load import load_case
from exfit.fitting.problem import problem_of
from exfit.fitting.residuals import SimulationCounter
from exfit.fitting.search import search

CASE = load_case(CONFIGS / "ac1a_typical.yaml")  # its settings are the defaults


def default_search(record: Residuals, start: np.ndarray) -> Estimate:
    """Return what the default search comes to, where the case starts."""
    pairs = zip(record.free, start, strict=True)
    free = [replace(parameter, start=parameter.value(float(x))) for parameter, x in pairs]
    problem, counter = problem_of(replace(record, free=free)), SimulationCounter()
    method = CASE.estimate.strategy
    result = search(CASE, problem, method, lambda _: None, lambda _: None, counter)
    return Estimate(result.best.x, counter.simulations)


METHODS = {"default search": each(default_search), "descent from the start": each(local)}
AS_STARTS = {"linear phase": each(matched)}

if __name__ == "__main__":
    show(METHODS)
    show(AS_STARTS, then_descent=True)
