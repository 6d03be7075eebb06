"""What the records determine: sensitivities and correlations."""

from dataclasses import dataclass

import numpy as np

from exfit.dsp.decimation import envelope
from exfit.fitting.uncertainty import Sensitivity
from exfit.inference import Correlation
from exfit.output.report.charts import Chart, Panel, Series
from exfit.output.report.layout import BINS, LEVEL, MILLI, TALL, TIME, line_style
from exfit.results.model import FitResult

PERCENT = 1e-2


@dataclass(frozen=True)
class IdentifiabilityView:
    """What the records determine; ``unresolved`` says whether they leave something so."""

    unresolved: bool
    sensitivity: tuple[Chart, ...]
    correlation: Correlation


def identifiability(result: FitResult) -> IdentifiabilityView | None:
    """Return what the records determine; None where that is not known."""
    known = result.knowledge
    if known is None:
        return None
    charts = (sensitivity(f"moved-{k}", one) for k, one in enumerate(known.sensitivity))
    return IdentifiabilityView(bool(known.sentences), tuple(charts), known.confidence.correlation)


def sensitivity(key: str, one: Sensitivity) -> Chart:
    """Return by how much 1 % more of each parameter moves a signal over time."""
    moved = {name: PERCENT * samples for name, samples in one.moved.items()}
    lines = tuple(
        Series(name, *envelope(one.time, MILLI * samples, BINS // 2), line_style(k))
        for k, (name, samples) in enumerate(moved.items())
    )
    most = [(float(np.max(np.abs(samples))), name) for name, samples in moved.items()]
    largest = ", ".join(f"{name} {MILLI * size:.2g}" for size, name in sorted(most, reverse=True))
    return Chart(
        key=key,
        title=f"What 1 % more of each parameter does to {one.label}",
        text=f"Largest change of {one.label} in 1e-3 pu for 1 % more of each parameter: {largest}.",
        x_title=TIME,
        panels=(Panel(f"change of {one.label} (1e-3 pu)", lines, TALL, rules=(LEVEL,)),),
        x_range=(float(one.time[0]), float(one.time[-1])),
    )
