"""What the records determine: sensitivities and correlations."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exfit.dsp.decimation import envelope
from exfit.features.report.layout import BINS, LEVEL, MILLI, TALL, TIME, line_style
from exfit.fitting.uncertainty import Sensitivity
from exfit.inference.confidence import Correlation
from exfit.inference.identifiability import ParameterEffect
from exfit.results.influences import by_weight
from exfit.results.model import FitResult
from exfit.show.blocks import Chart, Panel, Series

PERCENT = 1e-2


@dataclass(frozen=True)
class IdentifiabilityView:
    """What the records determine; ``unresolved`` says whether they leave something so.

    ``typical``: whether typical values would move that if they were wrong.
    """

    unresolved: bool
    typical: bool
    effects: tuple[ParameterEffect, ...]
    sensitivity: tuple[Chart, ...]
    correlation: Correlation


def identifiability(result: FitResult) -> IdentifiabilityView | None:
    """Collect sensitivities and correlations of a fit; None where they are not known."""
    uncertainty = result.knowledge
    if uncertainty is None:
        return None
    labels = {effect.parameter: effect.label for effect in uncertainty.effects}
    charts = (
        sensitivity(f"moved-{k}", channel, labels)
        for k, channel in enumerate(uncertainty.sensitivity)
    )
    return IdentifiabilityView(
        bool(uncertainty.sentences),
        bool(by_weight(result.typical_values)),
        uncertainty.effects,
        tuple(charts),
        uncertainty.confidence.correlation,
    )


def sensitivity(key: str, channel: Sensitivity, labels: Mapping[str, str]) -> Chart:
    """Draw the change of a signal over time for 1 % more of each parameter."""
    moved = {labels.get(name, name): PERCENT * each for name, each in channel.moved.items()}
    lines = tuple(
        Series(name, *envelope(channel.time, MILLI * samples, BINS // 2), line_style(k))
        for k, (name, samples) in enumerate(moved.items())
    )
    most = [(float(np.max(np.abs(samples))), name) for name, samples in moved.items()]
    largest = ", ".join(f"{name} {MILLI * size:.2g}" for size, name in sorted(most, reverse=True))
    return Chart(
        key=key,
        title=f"What 1 % more of each parameter does to {channel.label}",
        text=f"Largest change of {channel.label} in 1e-3 pu for 1 % more of each parameter: "
        f"{largest}.",
        x_title=TIME,
        panels=(Panel(f"change of {channel.label} (1e-3 pu)", lines, TALL, rules=(LEVEL,)),),
        x_range=(float(channel.time[0]), float(channel.time[-1])),
    )
