"""Show what stochastic approximation comes to: SPSA, Robbins-Monro, and its Gauss-Newton form.

    python tests/studies/related_stochastic.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
The first two are shown as start values too.
The gains are those of least median cost from eight other starts on ac1a_up, of gains from 0.003 to
0.3, perturbations of 0.003 to 0.05 and both decays: 0.602 and 1. A run of Robbins-Monro gives
derivatives as well, and takes about the time of five others.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from related_work import show
from stochastic_approximation import recursive_gauss_newton, robbins_monro, spsa

METHODS = {
    "SPSA": spsa(3000, gain=0.1, perturbation=0.03, decay=1.0),
    "Robbins-Monro": robbins_monro(500, gain=0.03),
}
WITH_METRIC = {"recursive Gauss-Newton": recursive_gauss_newton(200, first=0.3)}

if __name__ == "__main__":
    show(METHODS, then_descent=True)
    show(WITH_METRIC)
