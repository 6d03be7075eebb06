"""The fits of the thesis, made by exfit: its starts, its methods, its options, without bounds."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from places import CONFIGS, SAMPLES
from thesis_numbers import (
    CURVES,
    DGN,
    FIRST_A,
    FIRST_K,
    INSTANTS,
    LM,
    LM_DGN,
    RESULTS,
    STARTS,
    TOOLBOX,
    A,
    K,
)

import exfit
from exfit.case.case import Case
from exfit.features.compare.agreement import compare
from exfit.features.compare.curves import Difference
from exfit.fitting.search import fitted
from exfit.output import run_folder
from exfit.results.comparisons import Comparison

Array = NDArray[np.float64]
Values = Mapping[str, float]

# what the sample records were made with: sample_data/README.md
TRUTH = {
    "ac1a": RESULTS["ac1a_good", DGN],
    "ac8b_unit1": RESULTS["ac8b_unit1", DGN] | {"KPR": 78.84, "KDR": 37.05},
    "ac8b_unit2": RESULTS["ac8b_unit2", DGN],
}
UNBOUNDED = {"bounds": "none", "scale": "start"}
MOST_TRIALS = 30  # of an iteration of Levenberg-Marquardt


def content_of(name: str) -> dict[str, Any]:
    """Return the sections of a case of configs/."""
    content: dict[str, Any] = yaml.safe_load((CONFIGS / f"{name}.yaml").read_text("utf-8"))
    return content


THESIS = content_of("thesis/ac1a_table_1")["estimate"]
MOST_ITERATIONS = THESIS["iterations"]  # of each phase, as in 4.3 and 4.4


def thesis_case(name: str, start: Values, strategy: str) -> Case:
    """Return a case with the thesis' settings, whose parameters are relative to their start."""
    content = content_of(name)
    parameters = content["parameters"]
    fixed = {key: value for key, value in parameters.get("fixed", {}).items() if key not in start}
    free = {key: {"start": value, **UNBOUNDED} for key, value in start.items()}
    content["parameters"] = {"fixed": fixed, "free": free}
    content["estimate"] = {**THESIS, "strategy": strategy}
    return Case.from_dict(content, folder=CONFIGS, name=name)


def unit_of(name: str) -> str:
    """Return the unit whose record a case has."""
    return "ac1a" if name.startswith("ac1a") else name


@dataclass(frozen=True)
class Fits:
    """All fits of a case: by the methods of the thesis, and as exfit does without settings.

    ``cost_of_truth`` is f of the values that the record was made with.
    """

    name: str
    by_method: Mapping[str, exfit.FitResult]
    default: exfit.FitResult
    auto: exfit.FitResult
    cost_of_truth: float

    @property
    def every(self) -> dict[str, exfit.FitResult]:
        """All fits by what they are called."""
        return {**self.by_method, "default": self.default, "auto": self.auto}


@cache
def fits_of(name: str) -> Fits:
    """Fit a case by each method for which the thesis has a result."""
    methods = [method for case, method in RESULTS if case == name]
    results: dict[str, exfit.FitResult] = {}
    for method in methods:
        start = STARTS[name] if method != LM_DGN else values_of(results[LM], STARTS[name])
        results[method] = exfit.fit(thesis_case(name, start, strategy_of(name, method)))
    own = CONFIGS / f"{name}.yaml"
    at_truth = exfit.simulate(own, TRUTH[unit_of(name)]).comparison
    assert at_truth is not None
    return Fits(name, results, exfit.fit(own), exfit.fit(own, strategy="auto"), at_truth.cost)


def strategy_of(name: str, method: str) -> str:
    """Return the strategy of exfit that a method of the thesis is."""
    if method == TOOLBOX:
        return "gn" if name == "ac1a_good" else "robust"
    return "lm" if method == LM else "dgn"


def values_of(result: exfit.FitResult, names: Values) -> dict[str, float]:
    """Return the values that a fit found, those of time constants that are bypassed too."""
    return {name: result.values[name] for name in names}


# ---- Levenberg-Marquardt as the thesis' tables show it

LEAST_DAMPING = 1e-3  # what is raised is at least this, what is lowered below it is zero
POOR, GOOD = 0.25, 0.75  # ratios of the decrease to the promised one


@dataclass(frozen=True)
class Trialled:
    """An iteration: what the program prints, and f of the point at which it really is."""

    gradient_norm: float
    cost: float
    trials: int
    cost_there: float


def stale_levenberg_marquardt(name: str) -> list[Trialled]:
    """Run Levenberg-Marquardt that renews f, gradient and Jacobian after two trials or more only.

    So did levmar, the program of Kelley 1999, until July 2016, as a comment in it says: where the
    first trial is accepted the point moves, but all else remains that of the point before. The
    parameters are relative to their start.
    """
    _, problem = fitted(thesis_case(name, STARTS[name], "lm"))
    errors_at, jacobian_at = problem.residuals, problem.residuals.exact
    x = problem.residuals.start
    errors, jacobian = errors_at(x), jacobian_at(x)
    nu = norm(jacobian.T @ errors)
    rows = [Trialled(nu, half_square(errors), 0, half_square(errors))]
    for _ in range(MOST_ITERATIONS):
        step, trials, nu = accepted_step(errors_at, x, errors, jacobian, nu)
        x = x + step
        if trials > 1:
            errors, jacobian = errors_at(x), jacobian_at(x)
        gradient_norm, there = norm(jacobian.T @ errors), half_square(errors_at(x))
        rows.append(Trialled(gradient_norm, half_square(errors), trials, there))
    return rows


def accepted_step(
    errors_at: Callable[[Array], Array], x: Array, errors: Array, jacobian: Array, nu: float
) -> tuple[Array, int, float]:
    """Return the first step (N,) that does not raise f, the trials it took, and the next nu."""
    cost, gradient = half_square(errors), jacobian.T @ errors
    for trials in range(1, MOST_TRIALS + 1):
        rows = np.vstack([jacobian, np.sqrt(nu) * np.eye(len(x))])
        step = -np.linalg.lstsq(rows, np.append(errors, np.zeros(len(x))), rcond=None)[0]
        ratio = (cost - half_square(errors_at(x + step))) / (-0.5 * float(gradient @ step))
        if ratio >= 0.0:
            return step, trials, next_damping(nu, ratio)
        nu = max(2.0 * nu, LEAST_DAMPING)
    raise ArithmeticError(f"no step lowers f in {MOST_TRIALS} trials")


def next_damping(nu: float, ratio: float) -> float:
    """Return nu after a step whose decrease was ``ratio`` times the promised one."""
    if ratio < POOR:
        return max(2.0 * nu, LEAST_DAMPING)
    if ratio <= GOOD:
        return nu
    return 0.5 * nu if 0.5 * nu >= LEAST_DAMPING else 0.0


def norm(vector: Array) -> float:
    """Return the Euclidean norm."""
    return float(np.linalg.norm(vector))


def half_square(errors: Array) -> float:
    """Return f; infinite errors have an infinite one."""
    return 0.5 * float(errors @ errors)


def gradient_ratios(name: str) -> tuple[float, float]:
    """Return the norm of g over f at the start: of g over the parameters themselves, and of g over
    the parameters relative to their start.
    """
    _, problem = fitted(thesis_case(name, STARTS[name], "lm"))
    residuals = problem.residuals
    errors, jacobian = residuals(residuals.start), residuals.exact(residuals.start)
    start = np.array([parameter.start for parameter in residuals.free])
    relative = jacobian.T @ errors
    cost = half_square(errors)
    return norm(relative / start) / cost, norm(relative) / cost


# ---- the Jacobian of 3.3


@dataclass(frozen=True, eq=False)
class Jacobians:
    """dv/dk and dv/da (16, 2) at a point: by central differences, exact, and in closed form."""

    differences: Array
    exact: Array
    closed: Array


def jacobians_at(k: float, a: float) -> Jacobians:
    """Return the Jacobian of the step response of k/(s + a) at the instants of 3.3."""
    time = np.array(INSTANTS)
    content = content_of("first_order")
    content["record"] = {"channels": {"vt": "v"}}
    free = content["parameters"]["free"]
    free["k"]["start"], free["a"]["start"] = k, a
    record = exfit.Record.from_arrays(time, {"vt": K / A * (1.0 - np.exp(-A * time))})
    content.pop("validate")
    _, problem = fitted(Case.from_dict(content, record))
    residuals = problem.residuals
    # the estimator sees logarithms
    pairs = zip(residuals.free, residuals.start, strict=True)
    units = np.array([parameter.slope(x) for parameter, x in pairs])
    fading = np.exp(-a * time)
    closed = np.column_stack([(1.0 - fading) / a, k * (time * fading / a - (1.0 - fading) / a**2)])
    return Jacobians(
        residuals.central(residuals.start) / units, residuals.exact(residuals.start) / units, closed
    )


def first_order_fit() -> exfit.FitResult:
    """Return the fit of k/(s + a) from the start of 3.3."""
    return exfit.fit(thesis_case("first_order", {"k": FIRST_K, "a": FIRST_A}, "dgn"))


# ---- other simulators, other steps


@dataclass(frozen=True)
class Simulated:
    """The same values in two programs, exfit and ANDES, and how far each is from the record."""

    exfit: Difference
    andes: Difference
    between: Difference


@cache
def simulated_twice(name: str) -> Simulated:
    """Compare exfit's response to the values of a curve of sample_data/andes with that curve.

    It is what ``exfit compare RUN CURVE --record RECORD`` does.
    """
    case, method = CURVES[name]
    simulation = exfit.simulate(thesis_case(case, RESULTS[case, method], "dgn"))
    with TemporaryDirectory() as folder:
        run = Path(folder)
        run_folder.write_simulation(simulation, name, run)
        sources = (run, SAMPLES / "andes" / f"{name}.csv")
        agreement = compare(sources, SAMPLES / "ac1a_up.csv")
    ours, andes = (entry for entry in agreement.from_reference if entry.signal == "vt")
    (between,) = agreement.between
    return Simulated(ours, andes, between)


LATE = 0.05  # s


def replays(name: str, result: exfit.FitResult) -> dict[str, Comparison]:
    """Return the step down of a unit replayed in several ways, with the values of a fit."""
    content = content_of(name)
    (section,) = content["validate"]
    file = section["record"].pop("file")
    record = exfit.read_record(CONFIGS / file, "t", {"vt": "vt"})
    late = exfit.Record.from_arrays(record.time + LATE, dict(record.signals))
    at_rest = {**section, "test": {"vref": [{"at": 1.0, "step": -0.05}]}}
    found = {**section["record"], "delay": {"start": 0.0, "min": -0.2, "max": 0.2}}
    ways = {
        "with the step up before it": (section, record),
        "as if it began at rest": (at_rest, record),
        f"the record {1e3 * LATE:g} ms late": (section, late),
        "the same, the delay found": ({**section, "record": found}, late),
    }
    matches = {}
    for label, (validation, measured) in ways.items():
        content["validate"] = [validation]
        case = Case.from_dict(content, {validation["name"]: measured}, CONFIGS, name)
        *_, matches[label] = exfit.validate(case, result)
    return matches
