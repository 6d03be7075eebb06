"""The estimator beside SciPy's: NIST's data sets, the textbook's problems, the cases of configs/.

    python tests/studies/peers.py

writes docs/estimator.md from the template beside this file. It takes some minutes, nearly all of
them for the cases.
"""

import os
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import jinja2
import numpy as np
import scipy
from scipy.optimize import least_squares as scipy_least_squares

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from nist import SETS
from places import CONFIGS, ROOT
from solver_ends import WANTED_DIGITS, certified_ends, published_ends

from exfit.case.load import load_case
from exfit.errors import ExfitError
from exfit.estimate import least_squares
from exfit.fitting.parameters import UNIT
from exfit.fitting.search import fitted

PAGE = ROOT / "docs" / "estimator.md"
TEMPLATE = Path(__file__).with_suffix(".md.jinja")
TIGHT = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}
BY_COLUMNS = {"x_scale": "jac"}
METHODS = ("dgn", "lm", "lm-then-dgn", "auto")
PEERS = ("lm", "trf", "dogbox")
CASES = (
    "ac1a_typical", "ac1a_good", "ac1a_low", "ac1a_high", "ac8b_unit1", "ac8b_unit2",
    "ac8b_unit2_ka_free", "field_record",
)  # fmt: skip
COUNT, SEED = 7, 2026  # further starts of each case, drawn over its bounds
MOST = 1.01  # times the lowest cost: the same minimum

Solve = Callable[..., object]


@dataclass(frozen=True)
class Solver:
    """A solver, the tolerances and scale it is called with, and its name in the tables."""

    name: str
    solve: Solve
    bounded: bool = True


def ours(method, **options):
    return Solver(f"`{method}`", partial(least_squares, method=method, **options))


def theirs(method, words="", **options):
    name = f"SciPy `{method}`{words}"
    return Solver(
        name, partial(scipy_least_squares, method=method, **options), bounded=method != "lm"
    )


SOLVERS = (
    *(ours(method) for method in METHODS),
    *(theirs(method) for method in PEERS),
    *(theirs(method, ", tight", **TIGHT, **BY_COLUMNS) for method in PEERS),
)
BY_DIFFERENCES = (
    *(ours(method, jac="2-point") for method in METHODS),
    *(theirs(method, jac="2-point") for method in PEERS),
    *(theirs(method, ", tight", jac="2-point", **TIGHT, **BY_COLUMNS) for method in PEERS),
)


# ---- tables


def table(heads, rows):
    """A table in Markdown, between marks that say that a script wrote it."""
    lines = [heads, ["---"] * len(heads), *rows]
    body = "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
    return f"<!-- table -->\n{body}\n<!-- /table -->"


def place(start):
    name, number = start
    return f"{name}/{number}"


def starts_of(ends, chosen):
    """The starts whose end is as chosen, in words."""
    places = [place(start) for start, end in ends.items() if end is not None and chosen(end)]
    return ", ".join(places) or "none"


def calls(ends):
    return [sum(getattr(end, name) for end in ends if end is not None) for name in ("nfev", "njev")]


def certified_rows(solvers, by_differences=False):
    """What each solver comes to on the sets of NIST."""
    for solver in solvers:
        solve = solver.solve if not by_differences else without_jacobian(solver.solve)
        ends = certified_ends(solve)
        enough = sum(end is not None and end.digits >= WANTED_DIGITS for end in ends.values())
        wrong = starts_of(ends, lambda end: end.wrong)
        counts = calls(ends.values())
        yield [solver.name, enough, wrong, counts[0], *([] if by_differences else counts[1:])]


def without_jacobian(solve):
    """Take differences, and count what is called for them too, which SciPy does not."""

    def counted(fun, x0, _):
        calls = []

        def called(x):
            calls.append(x)
            return fun(x)

        result = solve(called, x0)
        fields = ("x", "cost", "fun", "jac", "success", "njev")
        return SimpleNamespace(nfev=len(calls), **{name: getattr(result, name) for name in fields})

    return counted


def digits_rows(solvers):
    """The certified digits of each set from both starts."""
    ends = [certified_ends(solver.solve) for solver in solvers]
    for name, certified in SETS.items():
        cells = [", ".join(shown_digits(each[name, k]) for k in (1, 2)) for each in ends]
        yield [name, certified["level"], *cells]


def shown_digits(end):
    if end is None:
        return "-"
    return f"{end.digits:.1f}" if end.digits >= 1.0 else ("**0**" if end.wrong else "0")


def published_rows(solvers):
    """What each solver comes to on the textbook's problems."""
    for solver in solvers:
        ends = published_ends(solver.solve)
        each = [end for end in ends.values() if end is not None]
        yield [
            solver.name,
            sum(end.success and end.reached == "lowest" for end in each),
            sum(end.success and end.reached == "local" for end in each),
            sum(not end.success for end in each) + len(ends) - len(each),
            starts_of(ends, lambda end: end.wrong),
            *calls(each),
        ]


# ---- cases


@dataclass(frozen=True)
class CaseEnd:
    """Where a fit ended: cost, calls of the residuals and of the Jacobian, claim of success."""

    cost: float
    nfev: int
    njev: int
    success: bool


FAILED = CaseEnd(np.inf, 0, 0, success=False)
FITTERS = (
    *(ours(method, x_scale=UNIT) for method in METHODS[:3]),
    *(theirs(method, x_scale=UNIT) for method in PEERS),
)


def ends_of_case(name):
    """The ends of all fitters from the case's own start and from further ones."""
    _, problem = fitted(load_case(CONFIGS / f"{name}.yaml"))
    residuals = problem.compressed
    low, high = residuals.bounds
    drawn = low + (high - low) * np.random.default_rng(SEED).random((COUNT, len(low)))
    starts = [residuals.start, *(x for x in drawn if np.isfinite(residuals(x)).all())]
    return [[fit(solver, residuals, x) for x in starts] for solver in FITTERS]


def fit(solver, residuals, x):
    within = {"bounds": residuals.bounds} if solver.bounded else {}
    try:
        end = solver.solve(residuals, x, residuals.exact, **within)
    except (ValueError, ArithmeticError, ExfitError):
        return FAILED
    return CaseEnd(float(end.cost), end.nfev, end.njev or 0, bool(end.success))


def case_tables():
    """From the case's own start, and from all starts: each a list of rows."""
    own, all_starts = [], []
    for name in CASES:
        ends = ends_of_case(name)
        bounded = [row for solver, row in zip(FITTERS, ends, strict=True) if solver.bounded]
        lowest = min(end.cost for row in bounded for end in row)
        own.append([f"`{name}`", *(shown_end(row[0], lowest) for row in ends)])
        all_starts.append([f"`{name}`", *(shown_ends(row, lowest) for row in ends)])
        print(own[-1], all_starts[-1], flush=True)
    return own, all_starts


def shown_end(end, lowest):
    if not np.isfinite(end.cost):
        return "failed"
    share = end.cost / lowest
    cost = f"{share:.3g}" if share >= 1.001 else ("1" if share > 0.999 else "below 1")
    return f"{cost}; {end.nfev} ({end.njev})" + ("" if end.success else ", no success")


def shown_ends(ends, lowest):
    reached = sum(end.cost <= MOST * lowest for end in ends)
    mean = np.mean([end.nfev + end.njev for end in ends])
    return f"{reached} of {len(ends)}; {mean:.0f}"


def page():
    """The page, made anew."""
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    own, all_starts = case_tables()
    count = len(published_ends(lambda *_: raised()))
    fitters = [solver.name for solver in FITTERS]
    return environment.from_string(TEMPLATE.read_text(encoding="utf-8")).render(
        scipy=scipy.__version__,
        count=count,
        drawn=COUNT,
        certified=table(
            ["solver", "six digits or more, of 54", "wrong successes", "calls of fun", "of jac"],
            certified_rows(SOLVERS),
        ),
        differences=table(
            ["solver", "six digits or more, of 54", "wrong successes", "calls of fun"],
            certified_rows(BY_DIFFERENCES, by_differences=True),
        ),
        digits=table(
            ["set", "level", *(solver.name for solver in DIGITS)], digits_rows(DIGITS)
        ),
        published=table(
            ["solver", "lowest minimum", "another", "no success", "wrong successes",
             "calls of fun", "of jac"],
            published_rows(SOLVERS),
        ),
        own=table(["case", *fitters], own),
        all_starts=table(["case", *fitters], all_starts),
    )  # fmt: skip


DIGITS = (
    *(ours(method) for method in METHODS[:3]),
    *(theirs(method) for method in PEERS[:2]),
    *(theirs(method, ", tight", **TIGHT, **BY_COLUMNS) for method in PEERS[:2]),
)


def raised():
    raise ValueError


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # SciPy warns of overflow on far trials
        PAGE.write_text(page(), encoding="utf-8")
