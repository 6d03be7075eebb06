"""How the parameters were found: facts, history, minima, and charts of the way."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from exfit.dsp.decimation import envelope
from exfit.features.report.charts import SMALL
from exfit.features.report.layout import BINS, HALF, LOW, TALL, TIME
from exfit.results.comparisons import IterationResponses
from exfit.results.model import FitResult, FittedParameter, Iteration, Minima, Minimum
from exfit.results.thinning import drawn_responses
from exfit.show.blocks import Chart, Panel, Rule, Series
from exfit.signals import label_of
from exfit.util.strategies import HISTORY_PHASES
from exfit.util.text import show

SHADES = 9  # of the style sheet, from the start to the fit


@dataclass(frozen=True)
class SearchView:
    """How the parameters, ``names``, were found."""

    names: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    history: tuple[Iteration, ...]
    minima: tuple[Minimum, ...]
    waterfall: Chart | None
    convergence: Chart | None
    trajectories: tuple[Chart, ...]
    iterations: tuple[Chart, ...]


def search(result: FitResult) -> SearchView:
    """Collect facts, history, minima and charts of the search of a fit."""
    history = result.history
    trajectories = (
        trajectory(f"path-{k}", name, parameter, history)
        for k, (name, parameter) in enumerate(result.parameters.items())
        if history
    )
    responses = (
        (match.name, match.iteration_responses)
        for match in result.comparisons
        if match.iteration_responses is not None
    )
    return SearchView(
        names=tuple(result.parameters),
        facts=tuple(_facts(result)),
        history=history,
        minima=() if result.minima is None else result.minima.minima,
        waterfall=None if result.minima is None else waterfall(result.minima, result.cost),
        convergence=convergence(history) if history else None,
        trajectories=tuple(trajectories),
        iterations=tuple(
            iterations(f"steps-{k}", name, drawn_responses(each, len(history)))
            for k, (name, each) in enumerate(responses)
        ),
    )


def _facts(result: FitResult) -> Iterator[tuple[str, str]]:
    yield "strategy", result.strategy
    yield "ended because", result.message
    yield "cost at the start", _square(result.start_cost)
    yield "cost at the end", _square(result.cost)
    yield "iterations", show(result.nit)
    for end in result.phase_ends:
        errors = ", ".join(f"{match.rmse:.2e}" for match in end.comparisons)
        yield (
            f"end of {end.phase}",
            (f"iteration {end.iteration}, cost {_square(end.cost)}, rmse {errors} pu"),
        )
    yield "residuals and Jacobians", f"{result.nfev:g} and {result.njev:g}"
    yield "simulations", show(result.simulations)
    if result.minima is not None:
        yield "search", result.minima.summary(result.cost)
    yield "sub-steps of a step", show(result.substeps)


def _square(cost: float) -> str:
    return f"{cost:.4e} pu²" if isfinite(cost) else "none"


def convergence(history: Sequence[Iteration]) -> Chart:
    """Return cost, gradient and damping over the iterations."""
    rows = (
        ("cost", "cost f (pu²)"),
        ("gradient_norm", "norm of the gradient"),
        ("damping", "damping ν, or step length λ"),
    )
    panels = tuple(
        Panel(title, tuple(_by_phase(history, name)), LOW, logarithmic=True) for name, title in rows
    )
    first, last = history[0], history[-1]
    return Chart(
        key="convergence",
        title="Cost, gradient and damping over the iterations",
        text=f"Over {last.number} iterations the cost goes from {_short(first.cost)} to "
        f"{_short(last.cost)} pu², the norm of its gradient from {_short(first.gradient_norm)} to "
        f"{_short(last.gradient_norm)}.",
        x_title="iteration",
        panels=panels,
        whole=True,
    )


def waterfall(search: Minima, cost: float) -> Chart:
    """Return the costs that all descents led to, in rising order."""
    ended = search.end_costs[np.isfinite(search.end_costs)]
    order = np.argsort(search.end_costs[np.isfinite(search.end_costs)], kind="stable")
    starts = search.start_costs[np.isfinite(search.end_costs)][order]
    rank = np.arange(1.0, len(order) + 1.0)
    series = (
        Series("start", rank, starts, "measured", dots=True),
        Series("end", rank, ended[order], "start", dots=True),
    )
    return Chart(
        key="waterfall",
        title="Where the descents of the search ended, in the order of their costs",
        text=search.summary(cost),
        x_title="descent, by the cost that it led to",
        panels=(Panel("cost f (pu²)", series, HALF, logarithmic=True),),
        whole=True,
    )


def trajectory(
    key: str, name: str, parameter: FittedParameter, history: Sequence[Iteration]
) -> Chart:
    """Return a parameter over the iterations, with those of its bounds that it comes near."""
    number = np.array([float(line.number) for line in history])
    values = np.array([line.values[name] for line in history])
    bounds = (parameter.min, parameter.max)
    near = [bound for bound in bounds if values.min() <= bound <= values.max()]
    unit = f" ({parameter.unit})" if parameter.unit else ""
    lines = (Series("", number, values, "start thin"), Series("", number, values, "start", True))
    return Chart(
        key=key,
        title=name,
        text=f"{name} from {values[0]:.5g} to {values[-1]:.5g} {parameter.unit} "
        f"in {len(values) - 1} iterations.",
        x_title="iteration",
        panels=(Panel(name + unit, lines, LOW, rules=tuple(Rule(at) for at in near)),),
        width=SMALL,
        whole=True,
    )


def iterations(key: str, name: str, responses: IterationResponses) -> Chart:
    """Return the response after some of the iterations, fading in from the start to the fit."""
    time, signal = responses.time, responses.signal
    measured = envelope(time, responses.measured, BINS)
    lines = [Series("measured", *measured, "measured", dots=True)]
    steps = max(len(responses.numbers) - 1, 1)
    for k, (number, samples) in enumerate(zip(responses.numbers, responses.samples, strict=True)):
        label = f"iteration {number}" if number else "start"
        style = f"fade fade{round(SHADES * k / steps)}"
        lines.append(Series(label, *envelope(time, samples, BINS), style))
    return Chart(
        key=key,
        title=f"{name}: the response after each iteration",
        text=f"Measured {signal}, and simulated with the values after iterations "
        f"{', '.join(map(str, responses.numbers))}; 0 is the start.",
        x_title=TIME,
        panels=(Panel(label_of(signal), tuple(lines), TALL),),
        x_range=(float(time[0]), float(time[-1])),
    )


def _by_phase(history: Sequence[Iteration], name: str) -> Iterator[Series]:
    """Yield a quantity of the history, the points of each phase of the search by themselves."""
    number = np.array([float(line.number) for line in history])
    values = np.array([getattr(line, name) for line in history], dtype=np.float64)
    yield Series("", number, values, "measured thin")
    for phase in dict.fromkeys(line.phase for line in history):
        rows = np.array([line.phase == phase for line in history])
        label = HISTORY_PHASES.get(phase, phase)
        yield Series(label, number[rows], values[rows], f"phase-{phase}", dots=True)


def _short(value: float) -> str:
    return f"{value:.3g}" if isfinite(value) else "none"
