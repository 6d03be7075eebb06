"""Which parameter matters first: by how much a small change of each moves what is recorded."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np

from exfit.inference.linear import Linearisation
from exfit.inference.noise import Noise

PERCENT = 0.01
OF_INTERVAL = "is 0: 1 % of its interval"


class ParameterEffect(NamedTuple):
    """Effect of 1 % of a parameter on the records.

    ``rms`` is the root mean square of the change of each channel over its samples, per unit;
    ``of_noise`` is that of all samples together, each in standard deviations of its noise: below
    about 1 / sqrt(samples) no record shows the change. ``percent_of`` says of what the 1 % is: of
    the value or, where that is 0, of the interval between the bounds.
    """

    parameter: str
    rms: Mapping[str, float]
    of_noise: Annotated[float, np.nan]
    percent_of: Literal["value", "interval"] = "value"

    @property
    def label(self) -> str:
        """The parameter, with what the 1 % is of where that is not its value."""
        return self.parameter if self.percent_of == "value" else f"{self.parameter} ({OF_INTERVAL})"


def effects(lin: Linearisation, noise: Sequence[Noise]) -> tuple[ParameterEffect, ...]:
    """Return the effect of each parameter, the strongest first.

    What counts as 100 % is `Linearisation.ranked_size`. Samples that are left out do
    not count, and filters are applied. What belongs to a record is no parameter. Where the noise of
    a channel is not known its effects are compared per unit.
    """
    each = [*_effects(lin, noise)]
    known = all(np.isfinite(effect.of_noise) for effect in each)
    return tuple(
        sorted(each, key=lambda e: -e.of_noise if known else -sum(r**2 for r in e.rms.values()))
    )


def _effects(lin: Linearisation, noise: Sequence[Noise]) -> Iterator[ParameterEffect]:
    samples = [each.samples for each in noise]
    for k, (name, size) in enumerate(zip(lin.names, lin.ranked_size, strict=True)):
        if lin.nuisances[k]:
            continue
        squares = [
            float(np.sum((PERCENT * size * lin.jacobian[channel.rows, k]) ** 2))
            for channel in lin.channels
        ]
        triples = zip(lin.channels, squares, samples, strict=True)
        rms = {
            channel.label: (square / count) ** 0.5 / channel.weight
            for channel, square, count in triples
        }
        with np.errstate(divide="ignore", invalid="ignore"):
            in_noise = np.divide(squares, [each.std**2 for each in noise])
        of_noise = float(np.sqrt(np.sum(in_noise) / sum(samples)))
        yield ParameterEffect(
            name,
            rms,
            of_noise if np.isfinite(of_noise) else np.nan,
            "value" if lin.values[k] != 0.0 else "interval",
        )
