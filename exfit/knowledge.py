"""What the records of a fit tell of its parameters, and what they leave open."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.inference import (
    Channel,
    Confidence,
    Identifiability,
    Linearisation,
    Prior,
    confidence,
    identifiability,
    rises,
)
from exfit.inference.wording import listed
from exfit.residuals import Residuals

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Confidence and identifiability at the solution, with the linearisation that they are of.

    ``bent`` names the parameters over whose intervals the response is not linear.
    """

    linear: Linearisation
    confidence: Confidence
    identifiability: Identifiability
    bent: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the figures, without the samples."""
        return {
            "confidence": self.confidence.as_json(),
            "identifiability": self.identifiability.as_json(),
            "not_linear": list(self.bent),
        }

    @property
    def rises(self) -> dict[str, float]:
        """By how much the cost rises from its minimum to the ends of each profile's interval."""
        return rises(self.linear, self.confidence)

    @property
    def open(self) -> tuple[str, ...]:
        """What is not determined, and what could be done about it, in words."""
        without = {
            name: one for name, one in self.confidence.parameters.items() if one.why is not None
        }
        vague = [name for name, one in without.items() if one.std_error is not None]
        if len(vague) < 2:
            vague = []  # its own reason says more
        reasons = [f"{name} {one.why}" for name, one in without.items() if name not in vague]
        if vague:
            reasons.append(f"{listed(vague)} are not determined by the record: see `exfit profile`")
        return (*reasons, *self.identifiability.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What a reader must know of it, in words."""
        names = ", ".join(self.bent)
        told = f"the response is not linear over the intervals of {names}: see `exfit profile`"
        return (*self.confidence.sentences, *([told] if names else []), *self.open)


def knowledge(residuals: Residuals, theta: Array, of_record: tuple[str, ...]) -> Knowledge:
    """Return what the records tell at the scaled parameters theta (N,).

    ``of_record`` names what belongs to a record and is no parameter of the unit. Raises
    SimulationError where a derivative is not finite.
    """
    linear = linearisation(residuals, theta, of_record)
    known = confidence(linear)
    return Knowledge(linear, known, identifiability(linear, known))


def linearisation(
    residuals: Residuals, theta: Array, of_record: tuple[str, ...], errors: Array | None = None
) -> Linearisation:
    """Return the errors and their exact derivatives at theta, in the parameters' own units.

    Raises SimulationError where a derivative is not finite.
    """
    values = residuals.values(theta)
    found, slopes = residuals.errors(theta)
    if not np.isfinite(slopes).all():
        at = ", ".join(f"{one.name} = {values[one.name]:g}" for one in residuals.free)
        raise SimulationError(f"the derivatives are not finite at {at}")
    errors = found if errors is None else errors
    influence, curvature = residuals.influence(errors)
    own = np.array([one.slope(float(x)) for one, x in zip(residuals.free, theta, strict=True)])
    free = residuals.free
    return Linearisation(
        names=tuple(one.name for one in free),
        units=tuple("" for _ in free),
        values=np.array([values[one.name] for one in free]),
        logarithmic=np.array([one.logarithmic for one in free]),
        width=np.array([one.high - one.low for one in free]),
        held=tuple(one.bound(values[one.name]) for one in free),
        errors=errors,
        jacobian=slopes / own,
        influence=influence,
        curvature=curvature,
        channels=tuple(_channels(residuals)),
        priors=tuple(
            Prior(k, known.mean, known.std, residuals.noise)
            for k, known in residuals.priors.items()
        ),
        nuisances=tuple(one.name in of_record for one in free),
    )


def _channels(residuals: Residuals) -> list[Channel]:
    """Return where the errors of each channel stand among those of all."""
    found, first, several = [], 0, len(residuals.experiments) > 1
    for one in residuals.experiments:
        for channel, size in zip(one.channels, one.sizes, strict=True):
            label = f"{one.name} {channel.signal}" if several else channel.signal
            noise = None if channel.noise is None else channel.noise * channel.weight
            rows = slice(first, first + size)
            found.append(Channel(label, rows, noise, channel.weight))
            first += size
    return found
