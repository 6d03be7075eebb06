"""The charts of a report, each with a text that says what it shows."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.decimation import envelope, kept_rows
from exfit.output.report.charts import SMALL, Chart, Panel, Rule, Series
from exfit.output.report.content import Fitted, Iteration, Match, Report, Signal
from exfit.output.report.simulated import Courses, Moved, Small
from exfit.results.tables import clock_digits
from exfit.signals import label_of
from exfit.util.strategies import PHASES
from exfit.util.text import show

if TYPE_CHECKING:
    from exfit.simulation.small_signal import Bode, Margins

Array = NDArray[np.float64]
Rules = tuple[Rule, ...]

MILLI = 1e3
TALL, HALF, LOW = 220.0, 150.0, 90.0  # of panels: of signals, of gain and phase, of errors
BINS = 600  # stretches of a line: about as many as a print or a screen shows
FEWEST_BINS = 50  # a step can still be seen
PER_BIN = 8  # points of an overlay: the least and the greatest of its four lines
MOST_POINTS = 40_000  # drawn in all overlays: 400 KB
MOST_SENT = 16_000  # samples for the interactive overlays: 600 KB
DIGITS = 7  # of a sample: beyond what a recorder resolves
COLOURS, DASHES = 7, 3  # of lines in the style sheet
TIME = "time (s)"
ZERO, HALF_TURN = Rule(0.0, style="level"), Rule(-180.0, style="level")


@dataclass(frozen=True)
class Overlaid:
    """The overlay of one signal of a match."""

    match: Match
    signal: Signal
    chart: Chart


@dataclass(frozen=True)
class Bodes:
    """The frequency responses of a small-signal view."""

    small: Small
    charts: tuple[Chart, ...]


@dataclass(frozen=True)
class Figures:
    """All charts of a report; what has nothing to show is missing from them."""

    overlays: tuple[Overlaid, ...]
    convergence: Chart | None
    trajectories: tuple[Chart, ...]
    iterations: tuple[Chart, ...]
    sensitivity: tuple[Chart, ...]
    bodes: tuple[Bodes, ...]


def figures(report: Report) -> Figures:
    """Return the charts of a report."""
    history = report.search.history
    return Figures(
        overlays=tuple(_overlays(report)),
        convergence=convergence(history) if history else None,
        trajectories=tuple(
            trajectory(f"path-{k}", one, history) for k, one in enumerate(report.fitted) if history
        ),
        iterations=tuple(
            iterations(f"steps-{k}", one)
            for k, one in enumerate(report.simulated.courses)
            if one.simulated
        ),
        sensitivity=tuple(
            sensitivity(f"moved-{k}", one) for k, one in enumerate(report.simulated.moved)
        ),
        bodes=tuple(
            Bodes(one, tuple(_bodes(f"bode-{k}", one)))
            for k, one in enumerate(report.simulated.small)
        ),
    )


def _overlays(report: Report) -> Iterator[Overlaid]:
    matches = (*report.fits, *report.validations)
    count = sum(len(one.samples.overlays) for one in matches if one.samples is not None)
    bins = max(FEWEST_BINS, min(BINS, MOST_POINTS // (PER_BIN * max(count, 1))))
    for k, one in enumerate(matches):
        for signal in one.signals:
            if one.samples is not None and signal.name in one.samples.overlays:
                chart = overlay(f"overlay-{k}-{signal.name}", one, signal, bins)
                yield Overlaid(one, signal, chart)


def overlay(key: str, match: Match, signal: Signal, bins: int = BINS) -> Chart:
    """Return a signal measured and simulated, with the difference below."""
    if match.samples is None:
        raise ValueError(f"{match.name}: no samples to draw")
    time, one = match.samples.time, match.samples.overlays[signal.name]
    fit = "simulated" if one.start is None else "fitted"
    lines = [Series("measured", *envelope(time, one.measured, bins), "measured", dots=True)]
    if one.start is not None:
        lines.append(Series("start values", *envelope(time, one.start, bins), "start"))
    lines.append(Series(fit, *envelope(time, one.simulated, bins), "simulated"))
    error = Series("", *envelope(time, MILLI * one.error, bins), "simulated thin")
    return Chart(
        key=key,
        title=f"{match.name}: {label_of(signal.name)}, {match.record}",
        text=f"Measured and {fit} {signal.name} from {show(time[0])} to {show(time[-1])} s, the "
        f"difference below: rmse {signal.rmse:.3g} pu, at most {signal.max_error:.3g} pu.",
        x_title=TIME,
        panels=(
            Panel(label_of(signal.name), tuple(lines), TALL),
            Panel("simulated - measured (1e-3 pu)", (error,), LOW, rules=(ZERO,)),
        ),
        x_range=(float(time[0]), float(time[-1])),
    )


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
        text=f"Over {last.number} iterations the cost goes from {_told(first.cost)} to "
        f"{_told(last.cost)} pu², the norm of its gradient from {_told(first.gradient_norm)} to "
        f"{_told(last.gradient_norm)}.",
        x_title="iteration",
        panels=panels,
        whole=True,
    )


def trajectory(key: str, one: Fitted, history: Sequence[Iteration]) -> Chart:
    """Return a parameter over the iterations, with those of its bounds that it comes near."""
    number = np.array([float(line.number) for line in history])
    values = np.array([line.values[one.name] for line in history])
    near = [bound for bound in (one.low, one.high) if values.min() <= bound <= values.max()]
    unit = f" ({one.unit})" if one.unit else ""
    lines = (Series("", number, values, "start thin"), Series("", number, values, "start", True))
    return Chart(
        key=key,
        title=one.name,
        text=f"{one.name} from {values[0]:.5g} to {values[-1]:.5g} {one.unit} "
        f"in {len(values) - 1} iterations.",
        x_title="iteration",
        panels=(Panel(one.name + unit, lines, LOW, rules=tuple(Rule(at) for at in near)),),
        width=SMALL,
        whole=True,
    )


def iterations(key: str, one: Courses) -> Chart:
    """Return the response after some of the iterations, fading in from the start to the fit."""
    numbers = list(one.simulated)
    lines = [Series("measured", *envelope(one.time, one.measured, BINS), "measured", dots=True)]
    for place, (number, samples) in enumerate(one.simulated.items()):
        name = {0: "start"}.get(number, f"iteration {number}")
        shade = round(9 * place / max(len(numbers) - 1, 1))
        lines.append(Series(name, *envelope(one.time, samples, BINS), f"fade fade{shade}"))
    return Chart(
        key=key,
        title=f"{one.name}: the response after each iteration",
        text=f"Measured {one.signal}, and simulated with the values after iterations "
        f"{', '.join(map(str, numbers))}; 0 is the start.",
        x_title=TIME,
        panels=(Panel(label_of(one.signal), tuple(lines), TALL),),
        x_range=(float(one.time[0]), float(one.time[-1])),
    )


def sensitivity(key: str, one: Moved) -> Chart:
    """Return by how much 1 % more of each parameter moves a signal over time."""
    lines = tuple(
        Series(name, *envelope(one.time, MILLI * one.by[:, k], BINS // 2), _line(k))
        for k, name in enumerate(one.names)
    )
    most = [(float(np.max(np.abs(one.by[:, k]))), name) for k, name in enumerate(one.names)]
    told = ", ".join(f"{name} {MILLI * size:.2g}" for size, name in sorted(most, reverse=True))
    return Chart(
        key=key,
        title=f"What 1 % more of each parameter does to {one.label}",
        text=f"Largest change of {one.label} in 1e-3 pu for 1 % more of each parameter: {told}.",
        x_title=TIME,
        panels=(Panel(f"change of {one.label} (1e-3 pu)", lines, TALL, rules=(ZERO,)),),
        x_range=(float(one.time[0]), float(one.time[-1])),
    )


def _bodes(key: str, small: Small) -> Iterator[Chart]:
    """Yield the Bode figures of the voltage loop, where there is one, and of the closed loop."""
    found, names = small.found, ", ".join(small.names)
    if found is None:
        return
    if found.open is not None:
        gain, phase = _margins(found.margins)
        told = [rule.label for rule in (*gain, *phase)]
        yield _bode(
            f"{key}-open",
            f"Open voltage loop, {names}",
            "Gain and phase of the open voltage loop over the frequency: "
            f"{' and '.join(told) or 'there is no crossover'}.",
            found.open,
            ((ZERO, *phase), (HALF_TURN, *gain)),
        )
    source, output = found.path
    width = "none" if found.bandwidth is None else f"{found.bandwidth:.3g} Hz"
    yield _bode(
        f"{key}-closed",
        f"Closed loop from {source} to {output}, {names}",
        f"Gain and phase from {source} to {output} over the frequency: peak {found.peak:.2f} dB, "
        f"bandwidth {width}.",
        found.closed,
        ((ZERO,), ()),
    )


def _margins(found: "Margins | None") -> tuple[Rules, Rules]:
    """Return where the gain margin and the phase margin are, nothing where there is none."""
    gain: Rules = ()
    phase: Rules = ()
    if found is not None and found.gain is not None and found.gain_at is not None:
        text = f"gain margin {found.gain:.1f} dB at {found.gain_at:.3g} Hz"
        gain = (Rule(found.gain_at, text, upright=True),)
    if found is not None and found.phase is not None and found.phase_at is not None:
        text = f"phase margin {found.phase:.1f}° at {found.phase_at:.3g} Hz"
        phase = (Rule(found.phase_at, text, upright=True),)
    return gain, phase


def _bode(key: str, title: str, text: str, found: "Bode", rules: tuple[Rules, Rules]) -> Chart:
    """Return gain and phase over the frequency, each with its rules."""
    gain = 20.0 * np.log10(np.abs(found.response))
    phase = np.degrees(np.unwrap(np.angle(found.response)))
    panels = tuple(
        Panel(name, (Series("", found.frequency, values, "p0"),), HALF, rules=marked)
        for name, values, marked in zip(
            ("gain (dB)", "phase (degrees)"), (gain, phase), rules, strict=True
        )
    )
    return Chart(key, title, text, "frequency (Hz)", panels, logarithmic=True)


def _by_phase(history: Sequence[Iteration], name: str) -> Iterator[Series]:
    """Yield a quantity of the history, the points of each phase of the search by themselves."""
    number = np.array([float(line.number) for line in history])
    found = [getattr(line, name) for line in history]
    values = np.array([np.nan if value is None else value for value in found], dtype=np.float64)
    yield Series("", number, values, "measured thin")
    for phase in dict.fromkeys(line.phase for line in history):
        rows = np.array([line.phase == phase for line in history])
        label = PHASES.get(phase, phase)
        yield Series(label, number[rows], values[rows], f"phase-{phase}", dots=True)


def _line(k: int) -> str:
    return f"p{k % COLOURS} dash{k // COLOURS % DASHES}"


def _told(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g}"


def data(overlays: Sequence[Overlaid]) -> list[dict[str, Any]]:
    """Return the samples of the overlays for the interactive twins, thinned where they are many.

    A gap is None.
    """
    share = MOST_SENT // max(len(overlays), 1)
    return [_sent(one, share) for one in overlays]


def _sent(one: Overlaid, most: int) -> dict[str, Any]:
    if one.match.samples is None:
        raise ValueError(f"{one.match.name}: no samples to send")
    time, overlaid = one.match.samples.time, one.match.samples.overlays[one.signal.name]
    rows = kept_rows([overlaid.measured, overlaid.error], max(1, most // 4))
    signals = {"measured": overlaid.measured, "simulated": overlaid.simulated}
    if overlaid.start is not None:
        signals["start"] = overlaid.start
    return {
        "key": one.chart.key,
        "group": one.match.name,
        "title": one.chart.title,
        "label": one.chart.panels[0].title,
        "time": _numbers(time[rows], clock_digits(time, DIGITS)),
        **{name: _numbers(samples[rows], DIGITS) for name, samples in signals.items()},
    }


def _numbers(samples: Array, digits: int) -> list[float | None]:
    return [float(f"{x:.{digits}g}") if np.isfinite(x) else None for x in samples.tolist()]
