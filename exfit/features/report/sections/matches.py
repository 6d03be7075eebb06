"""Records beside their simulations: figures of the match, overlays, step features."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.decimation import envelope, kept_rows
from exfit.features.report.layout import BINS, HALF, LEVEL, LOW, MILLI, TALL, TIME
from exfit.results.comparisons import REFERENCE, Comparison, LeftOut
from exfit.results.tables import clock_digits
from exfit.results.validation_result import Reported
from exfit.show.blocks import Chart, Panel, Series
from exfit.signals import label_of
from exfit.util.text import show

Array = NDArray[np.float64]

FEWEST_BINS = 50  # a step can still be seen
PER_BIN = 8  # points of an overlay: the least and the greatest of its four lines
MOST_POINTS = 40_000  # drawn in all overlays: 400 KB
MOST_SENT = 16_000  # samples for the interactive overlays: 600 KB
DIGITS = 7  # of a sample: beyond what a recorder resolves


@dataclass(frozen=True)
class OverlayChart:
    """The overlay of one signal of a comparison."""

    comparison: Comparison
    signal: str
    chart: Chart


@dataclass(frozen=True)
class MatchView:
    """A record beside its simulation; without charts where the result holds no samples.

    ``played`` shows what of a record drove the simulation above what came of it.
    """

    comparison: Comparison
    overlays: tuple[OverlayChart, ...]
    played: Chart | None = None


def fitted_matches(result: Reported) -> tuple[MatchView, ...]:
    """Return the records that were fitted, beside their simulations."""
    return _matches(result)[: len(result.comparisons)]


def validation_matches(result: Reported) -> tuple[MatchView, ...]:
    """Return the records that were not fitted, beside their simulations."""
    return _matches(result)[len(result.comparisons) :]


def _matches(result: Reported) -> tuple[MatchView, ...]:
    comparisons = (*result.comparisons, *result.validation)
    count = sum(len(comparison.overlays) for comparison in comparisons)
    bins = max(FEWEST_BINS, min(BINS, MOST_POINTS // (PER_BIN * max(count, 1))))
    return tuple(
        MatchView(
            comparison,
            tuple(
                OverlayChart(
                    comparison, signal, overlay(f"overlay-{k}-{signal}", comparison, signal, bins)
                )
                for signal in comparison.overlays
            ),
            played(f"played-{k}", comparison, bins) if comparison.overlays else None,
        )
        for k, comparison in enumerate(comparisons)
    )


def played(key: str, comparison: Comparison, bins: int = BINS) -> Chart | None:
    """Return the driving signals of a record above those that are compared; None without any."""
    if comparison.played is None:
        return None
    time, driving = comparison.time, comparison.played.driving
    panels = [
        Panel(
            f"{signal.label}, played in",
            (Series("", *envelope(time, signal.samples, bins), "other thin"),),
            HALF,
        )
        for signal in driving.values()
    ]
    for name, samples in comparison.overlays.items():
        measured = Series("recorded", *envelope(time, samples.measured, bins), "measured", True)
        simulated = Series("simulated", *envelope(time, samples.simulated, bins), "simulated")
        left_out = comparison.played.left_out.get(name)
        gaps = () if left_out is None else _gaps(time, left_out)
        panels.append(Panel(label_of(name), (measured, simulated, *gaps), HALF))
    signals = ", ".join(comparison.overlays)
    return Chart(
        key=key,
        title=f"{comparison.name}: {comparison.record} played into the unit",
        text=f"Recorded {', '.join(driving)} played in; recorded and simulated {signals} from "
        f"{show(time[0])} to {show(time[-1])} s.",
        x_title=TIME,
        panels=tuple(panels),
        x_range=(float(time[0]), float(time[-1])),
    )


def _gaps(time: Array, left_out: LeftOut) -> tuple[Series, ...]:
    """Draw the few samples of a signal that are not compared."""
    return (
        Series("", time, left_out.measured, "measured faint", dots=True),
        Series("simulated, not compared", time, left_out.simulated, "simulated faint"),
    )


def overlay(key: str, comparison: Comparison, signal: str, bins: int = BINS) -> Chart:
    """Return a signal measured and simulated, with the difference below."""
    time, samples = comparison.time, comparison.overlays[signal]
    match = comparison.channels[signal]
    fit = "simulated" if samples.start is None else "fitted"
    lines = [Series("measured", *envelope(time, samples.measured, bins), "measured", dots=True)]
    if samples.start is not None:
        lines.append(Series("start values", *envelope(time, samples.start, bins), "start"))
    if samples.reference is not None:
        lines.append(Series(REFERENCE, *envelope(time, samples.reference, bins), "reference thin"))
    lines.append(Series(fit, *envelope(time, samples.simulated, bins), "simulated"))
    error = Series("", *envelope(time, MILLI * samples.error, bins), "simulated thin")
    return Chart(
        key=key,
        title=f"{comparison.name}: {label_of(signal)}, {comparison.record}",
        text=f"Measured and {fit} {signal} from {show(time[0])} to {show(time[-1])} s, the "
        f"difference below: rmse {match.rmse:.3g} pu, at most {match.max_error:.3g} pu.",
        x_title=TIME,
        panels=(
            Panel(label_of(signal), tuple(lines), TALL),
            Panel("simulated - measured (1e-3 pu)", (error,), LOW, rules=(LEVEL,)),
        ),
        x_range=(float(time[0]), float(time[-1])),
        live=True,
    )


def live_data(overlays: Sequence[OverlayChart]) -> Iterator[dict[str, Any]]:
    """Yield the samples of the overlays for the script, thinned where they are many.

    A gap is None.
    """
    most = MOST_SENT // max(len(overlays), 1)
    for overlay_chart in overlays:
        time, samples = (
            overlay_chart.comparison.time,
            overlay_chart.comparison.overlays[overlay_chart.signal],
        )
        rows = kept_rows([samples.measured, samples.error], max(1, most // 4))
        signals = {"measured": samples.measured, "simulated": samples.simulated}
        if samples.start is not None:
            signals["start"] = samples.start
        if samples.reference is not None:
            signals["reference"] = samples.reference
        yield {
            "key": overlay_chart.chart.key,
            "group": overlay_chart.comparison.name,
            "time": _numbers(time[rows], clock_digits(time, DIGITS)),
            **{name: _numbers(line[rows], DIGITS) for name, line in signals.items()},
        }


def _numbers(samples: Array, digits: int) -> list[float | None]:
    return [float(f"{x:.{digits}g}") if np.isfinite(x) else None for x in samples.tolist()]
