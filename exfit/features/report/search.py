"""How the parameters were found, and how well the records determine them."""

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite

import numpy as np

from exfit.features.report.charts import (
    BINS,
    HALF,
    LEVEL,
    LOW,
    MILLI,
    SMALL,
    TALL,
    TIME,
    line_style,
)
from exfit.features.report.matches import line, range_of
from exfit.features.report.words import DASH, number
from exfit.fitting.uncertainty import Sensitivity
from exfit.output.blocks import (
    Block,
    Cell,
    Chart,
    Facts,
    Heading,
    Note,
    Panel,
    Rule,
    Series,
    Table,
    TableColumn,
    columns,
    row,
)
from exfit.output.iterations import COLUMNS, COST, DAMPINGS, GRADIENT, LEGEND
from exfit.results.comparisons import IterationResponses
from exfit.results.model import FitResult, FittedParameter, Iteration, Minima
from exfit.results.thinning import drawn_responses
from exfit.signals import label_of
from exfit.util.arrays import Array
from exfit.util.text import show
from exfit.util.vocabulary import HISTORY_PHASES

SHADES = 9  # of the style sheet, from the start to the fit
MOST_PRINTED = 8  # columns of parameters beside which a history is read on paper
PERCENT = 1e-2
UNKNOWN = "Not known: the search did not end at a minimum with finite derivatives."
TOGETHER = (
    "Near 1 or -1 the records determine a combination of two parameters better than each alone."
)
OF_MINIMA = (
    "Chi-square: how far a minimum lies above the lowest one, in variances of the residuals. "
    "Above 3.84 the records reject it (likelihood ratio, 95 %)."
)


def search(result: FitResult) -> Iterator[Block]:
    """Yield facts, history, minima and charts of the search of a fit."""
    yield Facts(tuple(_facts(result)))
    history = result.history
    if history:
        yield _history(result)
    else:
        yield Note("The result holds no history.", mark="faint")
    if result.minima is not None and result.minima.minima:
        yield _minima(result.minima, tuple(result.parameters))
        yield Note(OF_MINIMA)
        yield waterfall(result.minima, result.cost)
    if history:
        yield convergence(history)
        for k, (name, parameter) in enumerate(result.parameters.items()):
            yield trajectory(f"path-{k}", name, parameter, history)
    responses = {
        match.name: match.iteration_responses
        for match in result.comparisons
        if match.iteration_responses is not None
    }
    if responses:
        yield Heading("The response after each iteration", 2)
    for k, (name, each) in enumerate(responses.items()):
        yield iterations(f"steps-{k}", name, drawn_responses(each, len(history)))


def _facts(result: FitResult) -> Iterator[tuple[str, str]]:
    def square(cost: float) -> str:
        return f"{cost:.4e} pu²" if isfinite(cost) else "none"

    yield "strategy", result.strategy
    yield "stopped because", result.message
    yield "cost at the start", square(result.start_cost)
    yield "cost at the end", square(result.cost)
    yield "iterations", show(result.nit)
    for end in result.phase_ends:
        errors = ", ".join(f"{match.rmse:.2e}" for match in end.comparisons)
        place = f"iteration {end.iteration}, cost {square(end.cost)}"
        yield f"end of {end.phase}", f"{place}, rmse {errors} pu"
    yield "residuals and Jacobians", f"{result.nfev:g} and {result.njev:g}"
    yield "simulations", show(result.simulations)
    if result.minima is not None:
        yield "search", result.minima.summary(result.cost)
    yield "sub-steps of a step", show(result.substeps)


def _history(result: FitResult) -> Table:
    """Make the table of the iterations; on paper many parameters are left to its file."""
    names = [*result.parameters]
    columns = [each for each in COLUMNS if each.expendable != 1]
    heads = (
        TableColumn(each.title, each.number, "pu²" if each.title == COST else "")
        for each in columns
    )
    aside = 1 if len(names) > MOST_PRINTED else 0
    values = (TableColumn(name, number=True, expendable=aside) for name in names)
    rows = (
        row(
            *(each.text(line, DASH) for each in columns),
            *(number(line.values[name]) for name in names),
        )
        for line in result.history
    )
    return Table(
        (*heads, *values),
        tuple(rows),
        "Iterations; line 0 is the start",
        style="history",
        summary=f"History of {len(result.history) - 1} iterations",
        legend=LEGEND,
    )


def _minima(search: Minima, names: Sequence[str]) -> Table:
    several = sum(minimum.valley == 0 for minimum in search.minima) > 1
    rows = []
    for minimum in search.minima:
        by_record = {None: "", True: "rejected", False: "not rejected"}[minimum.refuted]
        if minimum.valley == 0 and several:
            by_record += ", in the valley of the result"
        above = "" if minimum.chi_square is None else number(minimum.chi_square, 3)
        values = (number(minimum.values[name], 4) for name in names)
        rows.append(row(number(minimum.cost), str(minimum.starts), above, by_record, *values))
    numbers = ("cost (pu²)", "runs", "chi-square")
    heads = columns(*numbers, "by the record", *names, numbers=(*numbers, *names))
    title = "Distinct minima that the runs converged to, lowest first"
    return Table(heads, tuple(rows), title, leading=0, style="minima")


def convergence(history: Sequence[Iteration]) -> Chart:
    """Draw cost, gradient and damping over the iterations."""
    rows = {
        "cost": f"{COST} (pu²)",
        "gradient_norm": GRADIENT,
        "damping": DAMPINGS,
    }
    numbers = np.array([float(each.number) for each in history])
    panels = []
    for name, title in rows.items():
        values = np.array([getattr(each, name) for each in history], dtype=np.float64)
        series = [Series("", numbers, values, "measured thin")]
        for phase in dict.fromkeys(each.phase for each in history):
            own = np.array([each.phase == phase for each in history])
            label = HISTORY_PHASES.get(phase, phase)
            series.append(Series(label, numbers[own], values[own], f"phase-{phase}", dots=True))
        panels.append(Panel(title, tuple(series), LOW, logarithmic=True))

    def short(value: float) -> str:
        return f"{value:.3g}" if isfinite(value) else "none"

    first, last = history[0], history[-1]
    return Chart(
        key="convergence",
        title="Cost, gradient and damping over the iterations",
        text=f"Over {last.number} iterations the cost goes from {short(first.cost)} to "
        f"{short(last.cost)} pu², the norm of its gradient from {short(first.gradient_norm)} to "
        f"{short(last.gradient_norm)}.",
        x_title="iteration",
        panels=tuple(panels),
        whole=True,
    )


def waterfall(search: Minima, cost: float) -> Chart:
    """Draw the costs that all descents led to, in rising order."""
    done = np.isfinite(search.end_costs)
    order = np.argsort(search.end_costs[done], kind="stable")
    rank = np.arange(1.0, len(order) + 1.0)
    series = (
        Series("start", rank, search.start_costs[done][order], "measured", dots=True),
        Series("end", rank, search.end_costs[done][order], "start", dots=True),
    )
    return Chart(
        key="waterfall",
        title="Costs where the runs of the search ended, in rising order",
        text=search.summary(cost),
        x_title="run, in the order of the costs reached",
        panels=(Panel("cost f (pu²)", series, HALF, logarithmic=True),),
        whole=True,
    )


def trajectory(
    key: str, name: str, parameter: FittedParameter, history: Sequence[Iteration]
) -> Chart:
    """Draw a parameter over the iterations, with those of its bounds that it comes near."""
    numbers = np.array([float(each.number) for each in history])
    values = np.array([each.values[name] for each in history])
    bounds = (parameter.min, parameter.max)
    near = [bound for bound in bounds if values.min() <= bound <= values.max()]
    unit = f" ({parameter.unit})" if parameter.unit else ""
    lines = (Series("", numbers, values, "start thin"), Series("", numbers, values, "start", True))
    return Chart(
        key=key,
        title=name,
        text=f"{name} from {values[0]:.5g} to {values[-1]:.5g} {parameter.unit} "
        f"in {len(values) - 1} iterations.",
        x_title="iteration",
        panels=(Panel(name + unit, lines, LOW, rules=tuple(Rule(at) for at in near)),),
        width=SMALL,
        whole=True,
        group="The parameters over the iterations",
    )


def iterations(key: str, name: str, responses: IterationResponses) -> Chart:
    """Draw the response after some of the iterations, fading in from the start to the fit."""
    time, signal = responses.time, responses.signal
    lines = [line("measured", time, responses.measured, "measured", dots=True)]
    steps = max(len(responses.numbers) - 1, 1)
    for k, (count, samples) in enumerate(zip(responses.numbers, responses.samples, strict=True)):
        label = f"iteration {count}" if count else "start"
        lines.append(line(label, time, samples, f"fade fade{round(SHADES * k / steps)}"))
    return Chart(
        key=key,
        title=f"{name}: the response after each iteration",
        text=f"Measured {signal}, and simulated with the values after iterations "
        f"{', '.join(map(str, responses.numbers))}; 0 is the start.",
        x_title=TIME,
        panels=(Panel(label_of(signal), tuple(lines), TALL),),
        x_range=range_of(time),
    )


def identifiability(result: FitResult) -> Iterator[Block]:
    """Yield what the records determine: sensitivities and correlations, if they are known."""
    known = result.knowledge
    if known is None:
        yield Note(UNKNOWN, mark="faint")
        return
    if known.sentences:
        yield Note("The records do not determine every parameter", see="findings")
    else:
        yield Note("The records determine every parameter, and every combination of them.")
    if known.effects:
        numbers = (*(f"{label}, rms (pu)" for label in known.effects[0].rms), "of noise")
        rows = (
            row(
                each.label,
                *(number(change, 3) for change in each.rms.values()),
                number(each.of_noise, 2),
            )
            for each in known.effects
        )
        title = "Change for 1 % of each parameter, strongest first"
        yield Table(columns("parameter", *numbers, numbers=numbers), tuple(rows), title)
    labels = {effect.parameter: effect.label for effect in known.effects}
    for k, channel in enumerate(known.sensitivity):
        moved = {labels.get(name, name): PERCENT * each for name, each in channel.moved.items()}
        yield sensitivity(f"moved-{k}", channel, moved)
    yield Note(TOGETHER)
    correlation = known.confidence.correlation
    cells = (
        (Cell(name), *(_correlation(value) for value in values))
        for name, values in zip(correlation.names, correlation.matrix.tolist(), strict=True)
    )
    heads = columns("", *correlation.names, numbers=correlation.names)
    yield Table(heads, tuple(cells), "Correlation of the estimates", style="correlation")


def sensitivity(key: str, channel: Sensitivity, moved: Mapping[str, Array]) -> Chart:
    """Draw the change (M,) of a signal over time for 1 % more of each parameter."""
    lines = tuple(
        line(name, channel.time, MILLI * samples, line_style(place), BINS // 2)
        for place, (name, samples) in enumerate(moved.items())
    )
    most = [(float(np.max(np.abs(samples))), name) for name, samples in moved.items()]
    largest = ", ".join(f"{name} {MILLI * size:.2g}" for size, name in sorted(most, reverse=True))
    title, what = f"change of {channel.label} (1e-3 pu)", "1 % more of each parameter"
    return Chart(
        key=key,
        title=f"What {what} does to {channel.label}",
        text=f"Largest change of {channel.label} in 1e-3 pu for {what}: {largest}.",
        x_title=TIME,
        panels=(Panel(title, lines, TALL, rules=(LEVEL,)),),
        x_range=range_of(channel.time),
    )


def _correlation(value: float) -> Cell:
    """Write a correlation, shaded in five steps to each side."""
    if not isfinite(value):
        return Cell(DASH)
    return Cell(f"{value:.2f}", shade=int(5.0 * value))
