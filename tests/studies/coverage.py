"""Count how often the 95 % intervals of AC1A hold the truth, on records made by simulation.

Run it as ``python tests/studies/coverage.py [COUNT]``. The unit and its test are those of
configs/ac1a_typical.yaml, with KD fixed: that record does not determine it. Each record is the
response to the true parameters with new noise, fitted from a start nearby.

Linear theory can only hold where the response is linear over the standard errors. Here it is not:
KC shows in those 2 % of the samples alone in which the rectifier is in its second mode, and VA
peaks 0.7 % below VAMAX. The profiles ask for no linearity; and so that the intervals are judged
by themselves as well, the same is done with KC fixed, and with the limit out of reach.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import binomtest, chi2, f

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from linearised import autoregressive

from exfit.case.load import load_case
from exfit.estimate import least_squares
from exfit.fitting.build import build_experiments
from exfit.fitting.parameters import UNIT
from exfit.fitting.problem import problem_of, residuals_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import uncertainty_at
from exfit.inference import LEVEL

CASE = Path(__file__).parents[2] / "configs" / "ac1a_typical.yaml"
# what the record of that case was made with: sample_data/README.md
TRUTH = {"KA": 364.1523, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542, "KC": 0.486}
TRUTH |= {"KD": 0.4039}
STILL = {name: TRUTH[name] for name in ("KD", "KC")}
CASES = {
    "KD fixed": {"KD": TRUTH["KD"]},
    "KD, KC fixed": STILL,
    "KD, KC fixed, VAMAX 20": {**STILL, "VAMAX": 20.0, "VRMAX": 20.0},
}
COUNT, SEED = 1000, 2026
NOISE = 1e-4  # pu
PHI = 0.6  # of each error in the next one, 10 ms later
ASIDE = 0.05  # of the truth: how far a start may be from it
BAND = (0.93, 0.97)
WORKERS = 2  # processes
CHUNK = 5  # records at once


@dataclass(frozen=True)
class Setting:
    """Which of CASES it is, what noise the records have, and whether the fit is told how much."""

    case: str
    phi: float
    given: float | None
    profiled: bool = False

    @property
    def title(self):
        """Return what it is called."""
        kind = f"AR(1) noise of {self.phi:g}" if self.phi else "white noise"
        told = "estimated" if self.given is None else "given"
        return f"{self.case}; {kind}, {told}"


NOISES = ((0.0, None), (PHI, None), (0.0, NOISE), (PHI, NOISE))
SETTINGS = (
    Setting("KD fixed", 0.0, None, profiled=True),
    Setting("KD fixed", PHI, None),
    Setting("KD, KC fixed", 0.0, None, profiled=True),
    *(Setting("KD, KC fixed, VAMAX 20", *noise) for noise in NOISES),
)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a fit came to: logarithms of estimate : truth, their standard errors, both (N,).

    ``inside`` tells which intervals hold the truth (N,), nan where there is none, ``ellipsoid``
    whether that of all does, ``profiled`` which intervals of the profiles do (N,).
    """

    missed: np.ndarray
    told: np.ndarray
    inside: np.ndarray
    ellipsoid: bool
    profiled: np.ndarray
    inflation: float
    converged: bool


@cache
def problem(name):
    """Return the residuals of one of CASES, their samples the exact response to the truth."""
    case, fixed = load_case(CASE), CASES[name]
    values = {**case.values(), **TRUTH, **fixed}
    (setup,) = build_experiments(case)
    setup = setup.with_enough_substeps(values)
    whole = residuals_of(case, (setup,))
    exact = setup.experiment.samples(values)[0][:, 0]
    (channel,) = setup.channels
    experiment = replace(setup.experiment, channels=(replace(channel, measured=exact),))
    return with_fixed(Residuals([experiment], whole.free, whole.fixed, whole.ties), fixed)


def with_fixed(residuals, values):
    """Return residuals some of whose parameters are fixed."""
    free = [one for one in residuals.free if one.name not in values]
    still = {**residuals.fixed, **values}
    return Residuals(residuals.experiments, free, still, residuals.ties)


def with_noise(residuals, noise, given):
    """Return residuals whose one channel has noise (M,) on it, pu."""
    (experiment,), (channel,) = residuals.experiments, residuals.channels
    noisy = replace(channel, measured=channel.measured + noise, noise=given)
    seen = replace(experiment, channels=(noisy,))
    return Residuals([seen], residuals.free, residuals.fixed, residuals.ties)


def fitted(residuals, start):
    """Return what a fit finds from a start, logarithms (N,)."""
    return least_squares(
        residuals, start, residuals.exact, residuals.bounds, "lm-then-dgn", x_scale=UNIT
    )


def outcome(residuals, aside, profiled):
    """Fit from a start that is aside (N,) of the truth, and return what it came to."""
    truth = np.log([TRUTH[one.name] for one in residuals.free])
    found = fitted(residuals, truth + aside)
    told = uncertainty_at(problem_of(residuals), found.x, ())
    known, missed, values = told.confidence, found.x - truth, np.exp(found.x)
    covariance = known.covariance / np.outer(values, values)
    distance = float(missed @ np.linalg.solve(covariance, missed))
    return Outcome(
        missed=missed,
        told=np.sqrt(np.diag(covariance)),
        inside=np.array([holds(one, TRUTH[name]) for name, one in known.parameters.items()]),
        ellipsoid=distance <= limit(len(truth), known.dof),
        profiled=in_profiles(residuals, found, told.rises) if profiled else np.zeros(0),
        inflation=known.noise[0].inflation,
        converged=found.success,
    )


def holds(one, truth):
    """Return whether the interval of a parameter holds the truth, nan if it has none."""
    return np.nan if one.interval is None else one.interval[0] <= truth <= one.interval[1]


def in_profiles(residuals, found, rises):
    """Return for each parameter whether its profile, at the truth, is no higher than its rise."""
    costs = [
        fitted(with_fixed(residuals, {one.name: TRUTH[one.name]}), np.delete(found.x, k)).cost
        for k, one in enumerate(residuals.free)
    ]
    return np.array(costs) <= found.cost + np.array(list(rises.values()))


def limit(count, dof):
    """Return how far the truth may be from the estimate, in the ellipsoid's own measure."""
    return chi2.ppf(LEVEL, count) if np.isinf(dof) else count * f.ppf(LEVEL, count, dof)


def outcome_of(task):
    """Return the outcome of a setting for one series of noise (M,) and one start."""
    setting, noise, aside = task
    noisy = with_noise(problem(setting.case), noise, setting.given)
    return outcome(noisy, aside, setting.profiled)


def outcomes(setting, count):
    """Return the outcomes of fits to so many records."""
    exact, rng = problem(setting.case), np.random.default_rng(SEED)
    noise = NOISE * autoregressive(rng, setting.phi, (count, exact.count))
    aside = np.log1p(ASIDE * rng.uniform(-1.0, 1.0, (count, len(exact.free))))
    tasks = [(setting, one, start) for one, start in zip(noise, aside, strict=True)]
    with ProcessPoolExecutor(WORKERS) as pool:
        found = pool.map(outcome_of, tasks, chunksize=CHUNK)
        return list(track(found, setting.title, count))


def shares(held):
    """Return the share that holds, of those (K,) that are not nan, with its 95 % bounds."""
    held = held[np.isfinite(held)]
    bounds = binomtest(int(np.sum(held)), len(held)).proportion_ci(0.95, "exact")
    return f"{100 * np.mean(held):.1f}", f"{100 * bounds.low:.1f} ... {100 * bounds.high:.1f}"


def table_of(names, setting, found):
    """Return the table of a setting."""
    inside, missed, told = (
        np.array([getattr(one, name) for one in found], dtype=float)
        for name in ("inside", "missed", "told")
    )
    spread, mean = missed.std(axis=0, ddof=1), missed.mean(axis=0)
    table = Table(title=setting.title)
    headings = ("parameter", "holds %", "95 % bounds", "none", "spread %", "told : spread", "bias")
    for heading in (*headings, *(("profile %",) if setting.profiled else ())):
        table.add_column(heading, justify="right")
    for k, name in enumerate(names):
        figures = (
            str(np.count_nonzero(np.isnan(inside[:, k]))),
            f"{100 * spread[k]:.2f}",
            f"{np.nanmedian(told[:, k]) / spread[k]:.2f}",
            f"{mean[k] / spread[k]:+.2f}",
        )
        profiled = [one.profiled[k] for one in found if setting.profiled]
        more = [shares(np.array(profiled))[0]] if profiled else []
        table.add_row(name, *shares(inside[:, k]), *figures, *more)
    table.add_section()
    table.add_row("ellipsoid", *shares(np.array([one.ellipsoid for one in found])))
    table.add_row("all at once", *shares(np.min(inside, axis=1)))
    share = np.nanmean(inside, axis=0)
    out = [name for name, s in zip(names, share, strict=True) if not BAND[0] <= s <= BAND[1]]
    converged = sum(one.converged for one in found)
    wider = np.sqrt(np.mean([one.inflation for one in found]))
    table.caption = (
        f"{converged} converged; intervals {wider:.2f} times wider; "
        f"outside {BAND[0]:.0%} to {BAND[1]:.0%}: {', '.join(out) or 'none'}"
    )
    return table


def main():
    """Print a table for each setting."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    console = Console(width=100)
    for setting in SETTINGS:
        names = [one.name for one in problem(setting.case).free]
        console.print(table_of(names, setting, outcomes(setting, count)))


if __name__ == "__main__":
    main()
