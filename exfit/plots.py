"""Figures of results: functions that return one, and touch nothing else."""

import io
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exfit.inference import sensitivity as sensitivities
from exfit.knowledge import Knowledge
from exfit.profiles import Profiles
from exfit.result import Comparison, FitResult, Minima, Overlay
from exfit.simulate import Response

Array = NDArray[np.float64]

MEASURED, SIMULATED, START, LIMIT = "#8a8f98", "#c1272d", "#2b6cb0", "#b7791f"
PHASES: Mapping[str, str] = {"lm": "#2b6cb0", "dgn": "#c1272d", "gn": "#2f855a"}
PHASE_NAMES: Mapping[str, str] = {
    "lm": "Levenberg-Marquardt",
    "dgn": "damped Gauss-Newton",
    "gn": "Gauss-Newton",
}
WIDTH = 9.0  # inches
DPI = 120
MILLI = 1e3
PERCENT = 1e-2
COLORS = ("#1f4e9c", "#c1272d", "#2f855a", "#b7791f", "#6b46c1", "#0e7490", "#9d174d")
STYLES = ("-", "--", ":")
WANTED_STATES = 12  # panels of states that are still readable

LABELS: Mapping[str, str] = {
    "vt": "terminal voltage vt (pu)",
    "vref": "reference vref (pu)",
    "efd": "field voltage efd (pu)",
    "ifd": "field current ifd (pu)",
    "p": "active power p (pu)",
    "q": "reactive power q (pu)",
}
SHOWN_OTHERWISE = ("dw",)  # as speed
UNITS: Mapping[str, str] = {"delta": "rad"}  # of signals that are not per unit


def png(figure: Figure) -> bytes:
    """Return a figure as the bytes of a PNG file."""
    out = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(out, format="png", dpi=DPI)
    return out.getvalue()


def overlay(comparison: Comparison, title: str) -> Figure:
    """Return measured and simulated signals on one axis each, with their difference below."""
    count = len(comparison.overlays)
    figure = Figure(figsize=(WIDTH, 1.0 + 4.2 * count), layout="constrained")
    axes = figure.subplots(
        2 * count, 1, sharex=True, height_ratios=[3.0, 1.0] * count, squeeze=False
    )
    for k, (signal, one) in enumerate(comparison.overlays.items()):
        _signal(axes[2 * k, 0], comparison, signal, one)
        _error(axes[2 * k + 1, 0], comparison, one)
    axes[-1, 0].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=11)
    return figure


def _signal(axes: Axes, comparison: Comparison, signal: str, one: Overlay) -> None:
    time = comparison.time
    axes.plot(time, one.measured, ".", color=MEASURED, markersize=3, label="measured")
    if one.start is not None:
        axes.plot(time, one.start, "--", color=START, linewidth=1.2, label="start values")
    label = "fitted" if one.start is not None else "simulated"
    axes.plot(time, one.simulated, "-", color=SIMULATED, linewidth=1.4, label=label)
    axes.set_ylabel(LABELS[signal])
    axes.legend(loc="best", frameon=False)
    text = f"rmse {one.rmse:.3g} pu, fit {one.fit_percent:.2f} %"
    axes.set_title(text, fontsize=9, loc="right")
    _tidy(axes)


def _error(axes: Axes, comparison: Comparison, one: Overlay) -> None:
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.plot(comparison.time, MILLI * one.error, color=SIMULATED, linewidth=0.7)
    axes.set_ylabel("simulated\n- measured\n(1e-3 pu)")
    _tidy(axes)


def convergence(result: FitResult) -> Figure:
    """Return cost, gradient and damping over the iterations."""
    figure = Figure(figsize=(WIDTH, 7.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    rows = (
        ("cost", "cost f (pu²)", "o"),
        ("gradient_norm", "norm of the gradient", "o"),
        ("damping", "damping ν, or\nstep length λ", "s"),
    )
    for ax, (name, label, marker) in zip(axes, rows, strict=True):
        values = [float(getattr(line, name)) for line in result.history]
        # an undamped step and a vanished gradient have no place on a logarithmic axis
        _by_phase(ax, result, [v if v > 0.0 else float("nan") for v in values], marker)
        if any(value > 0.0 for value in values):
            ax.set_yscale("log")
        ax.set_ylabel(label)
        _tidy(ax)
    axes[0].legend(loc="upper right", frameon=False)
    axes[-1].set_xlabel("iteration")
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.suptitle(f"{result.name}: {result.strategy}; {result.message}", fontsize=11)
    return figure


def _by_phase(axes: Axes, result: FitResult, values: Sequence[float], marker: str) -> None:
    numbers = [line.number for line in result.history]
    axes.plot(numbers, values, "-", color=MEASURED, linewidth=0.8)
    for phase in dict.fromkeys(line.phase for line in result.history):
        chosen = [k for k, line in enumerate(result.history) if line.phase == phase]
        axes.plot(
            [numbers[k] for k in chosen],
            [values[k] for k in chosen],
            marker,
            color=PHASES[phase],
            markersize=4,
            clip_on=False,
            label=PHASE_NAMES[phase],
        )


def trajectories(result: FitResult) -> Figure:
    """Return every free parameter over the iterations, between its bounds."""
    names = list(result.parameters)
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(WIDTH, 1.0 + 2.0 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for ax, name in zip(grid.flat, names, strict=False):
        one = result.parameters[name]
        values = [line.values[name] for line in result.history]
        _by_phase(ax, result, values, "o")
        for limit in (one.min, one.max):
            if min(values) <= limit <= max(values):
                ax.axhline(limit, color=LIMIT, linewidth=1.0, linestyle=":")
        bound = f" (on its {one.at_bound})" if one.at_bound else ""
        ax.set_title(f"{name} = {one.value:.5g} {one.unit}{bound}", fontsize=9)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        _tidy(ax)
    for k, ax in enumerate(grid.flat):
        lowest = k + columns >= len(names)
        ax.tick_params(labelbottom=lowest)
        ax.set_xlabel("iteration" if lowest else "")
        ax.set_visible(k < len(names))
    phases = dict.fromkeys(line.phase for line in result.history)
    if len(phases) > 1:
        handles = grid[0, 0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower right", ncols=len(phases), frameon=False)
    figure.suptitle(f"{result.name}: the parameters on their way", fontsize=11)
    return figure


def sensitivity(known: Knowledge, times: Sequence[Array], title: str) -> Figure:
    """Return by how much 1 % more of each parameter moves each signal over time.

    ``times`` are those of the samples of each channel. What belongs to a record is left out.
    """
    linear = known.linear
    shown = [k for k, of_record in enumerate(linear.nuisances) if not of_record]
    moved = PERCENT * MILLI * sensitivities(linear)
    count = len(linear.channels)
    figure = Figure(figsize=(WIDTH, 1.2 + 3.0 * count), layout="constrained")
    panels = figure.subplots(count, 1, squeeze=False)[:, 0]
    for axes, channel, time in zip(panels, linear.channels, times, strict=True):
        for place, k in enumerate(shown):
            color, style = COLORS[place % len(COLORS)], STYLES[place // len(COLORS) % len(STYLES)]
            axes.plot(
                time,
                moved[channel.rows, k],
                style,
                color=color,
                linewidth=1.3,
                label=linear.names[k],
            )
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylabel(f"change of {channel.label}\nfor +1 % (1e-3 pu)")
        _tidy(axes)
    panels[-1].set_xlabel("time (s)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
    figure.suptitle(f"{title}: what each parameter does to the response", fontsize=11)
    return figure


def correlation(known: Knowledge, title: str) -> Figure:
    """Return the correlations of the estimates as a map; what has none is left blank."""
    names, values = known.linear.names, known.confidence.correlation
    side = max(4.2, 1.6 + 0.62 * len(names))
    figure = Figure(figsize=(side + 1.2, side), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.set_xticks(range(len(names)), names, rotation=45, ha="right")
    axes.set_yticks(range(len(names)), names)
    for row, line in enumerate(values):
        for column, value in enumerate(line):
            if np.isfinite(value):
                color = "white" if abs(value) > 0.7 else "black"
                axes.text(
                    column, row, f"{value:.2f}", ha="center", va="center", color=color, fontsize=8
                )
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    figure.colorbar(image, ax=axes, label="correlation of the estimates", shrink=0.8)
    figure.suptitle(f"{title}: which parameters move together", fontsize=11)
    return figure


def waterfall(found: Minima, title: str) -> Figure:
    """Return the costs that all starts led to, in rising order, with those they began at."""
    figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    axes = figure.subplots()
    refined = np.flatnonzero(np.isfinite(found.end_costs))
    order = refined[np.argsort(found.end_costs[refined], kind="stable")]
    ranks = np.arange(1, len(order) + 1)
    axes.plot(ranks, found.start_costs[order], ".", color=MEASURED, markersize=3, label="start")
    axes.step(
        ranks, found.end_costs[order], where="mid", color=SIMULATED, linewidth=1.4, label="refined"
    )
    axes.set_yscale("log")
    axes.set_xlabel("start, by the cost that it led to")
    axes.set_ylabel("cost f (pu²)")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower right", ncols=2, frameon=False)
    best = found.minima[0].starts
    axes.set_title(
        f"{best} of {len(order)} refined starts led to the lowest minimum", fontsize=9, loc="right"
    )
    _tidy(axes)
    figure.suptitle(f"{title}: the minima that {len(found.start_costs)} starts found", fontsize=11)
    return figure


def profiles(found: Profiles) -> Figure:
    """Return the profile of each parameter: the rise of the cost in units of that at the limit."""
    columns = min(3, len(found.profiles))
    rows = -(-len(found.profiles) // columns)
    figure = Figure(figsize=(WIDTH, 1.1 + 2.4 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, one in zip(grid.flat, found.profiles, strict=False):
        rise = (one.costs - found.cost) / one.rise
        axes.plot(one.at, rise, "o-", color=SIMULATED, linewidth=1.3, markersize=3)
        axes.axhline(1.0, color=LIMIT, linewidth=1.0, linestyle=":")
        for limit in (one.low, one.high):
            if limit is not None:
                axes.axvline(limit, color=LIMIT, linewidth=1.0)
        axes.plot([one.value], [0.0], "s", color=START, markersize=5)
        axes.set_xlabel(f"{one.name} ({one.unit})" if one.unit else one.name)
        axes.set_ylim(-0.05, 1.5)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        _tidy(axes)
    for k, axes in enumerate(grid.flat):
        axes.set_visible(k < len(found.profiles))
    figure.supylabel("rise of the cost / rise at the 95 % limit", fontsize=10)
    figure.suptitle(f"{found.name}: the cost along each parameter, the others fitted", fontsize=11)
    return figure


def response(simulated: Response, title: str) -> Figure:
    """Return every signal of a simulation over time; vref and vt share an axis."""
    together = [name for name in ("vref", "vt") if name in simulated.signals]
    others = [name for name in simulated.signals if name not in (*together, *SHOWN_OTHERWISE)]
    names = [name for name in others if np.ptp(simulated.signals[name]) > 0.0][:WANTED_STATES]
    still = [name for name in others if np.ptp(simulated.signals[name]) == 0.0]
    columns = 2 if len(names) > 2 else 1
    rows = 1 + -(-len(names) // columns)
    figure = Figure(figsize=(WIDTH, 2.6 + 1.6 * (rows - 1)), layout="constrained")
    grid = figure.add_gridspec(rows, columns, height_ratios=[1.6, *[1.0] * (rows - 1)])
    first = figure.add_subplot(grid[0, :])
    time = simulated.time
    for name in together:
        color = SIMULATED if name == "vt" else MEASURED
        first.plot(time, simulated.signals[name], color=color, linewidth=1.3, label=name)
    first.set_ylabel(f"{', '.join(together)} (pu)")
    first.legend(loc="best", frameon=False)
    _tidy(first)
    for k, name in enumerate(names):
        ax = figure.add_subplot(grid[1 + k // columns, k % columns], sharex=first)
        ax.plot(time, simulated.signals[name], color=START, linewidth=1.1)
        ax.set_ylabel(f"{name} ({UNITS.get(name, 'pu')})")
        ax.tick_params(labelbottom=k + columns >= len(names))
        _tidy(ax)
    # one column lies on the same axis as the panels below it, two do not
    first.tick_params(labelbottom=columns > 1 or not names)
    figure.align_ylabels()
    rest = f"   (unused or at rest: {', '.join(still)})" if still else ""
    figure.supxlabel(f"time (s){rest}", fontsize=10)
    figure.suptitle(title, fontsize=11)
    return figure


def overview(title: str, drawing: str, simulated: Response) -> Figure:
    """Return a model on one page: its drawing, and what it does with its typical data."""
    lines = drawing.count("\n") + 1
    shown = [name for name in ("vt", "efd") if name in simulated.signals]
    text_height, height = 0.5 + 0.165 * lines, 2.2 * len(shown)
    figure = Figure(figsize=(WIDTH, text_height + height), layout="constrained")
    ratios = [text_height, *[2.2] * len(shown)]
    panels = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)[:, 0]
    panels[0].axis("off")
    panels[0].text(
        0.0, 1.0, drawing, family="monospace", fontsize=8.5, va="top", transform=panels[0].transAxes
    )
    for axes, name in zip(panels[1:], shown, strict=True):
        axes.sharex(panels[-1])
        axes.tick_params(labelbottom=axes is panels[-1])
        axes.plot(simulated.time, simulated.signals[name], color=SIMULATED, linewidth=1.4)
        axes.set_ylabel(LABELS[name])
        _tidy(axes)
    panels[-1].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=12)
    return figure


def _tidy(axes: Axes) -> None:
    axes.grid(visible=True, color="#e2e5e9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.01)
    low, high = axes.get_ylim()
    if axes.get_yscale() == "linear" and high - low < 1e-6 * max(1.0, abs(high)):
        # a flat signal fills its axis with rounding errors unless it is given some room
        axes.set_ylim(low - 0.05 * max(abs(low), 0.1), high + 0.05 * max(abs(high), 0.1))
    if not np.isfinite((low, high)).all():
        axes.set_ylim(0.0, 1.0)
