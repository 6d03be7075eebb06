"""What a test must keep in the plant, checked on the response that is simulated."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np

from exfit.errors import CaseError
from exfit.simulation.simulator import Run
from exfit.util.text import near

Extremes = Mapping[str, tuple[float, float]]

ROUNDING = 1e-9  # pu: a limit that is met exactly is kept


@dataclass(frozen=True)
class Limits:
    """How far a test may go, per unit.

    ``vt`` and ``vref`` may deviate so far from the start, the reference by default as far as vt;
    ``efd`` and ``efd_min`` are the largest and the least field voltage, besides the model's own.
    Raises CaseError for a limit that leaves no room.
    """

    vt: float = 0.05
    vref: float = inf
    efd: float = inf
    efd_min: float = -inf

    def __post_init__(self) -> None:
        for name in ("vt", "vref"):
            if not getattr(self, name) > 0.0:
                raise CaseError([f"limit {name}: {getattr(self, name):g}: must be above 0"])
        if not self.efd_min < self.efd:
            raise CaseError([f"limit efd_min: {self.efd_min:g}: must be below {self.efd:g}"])

    @staticmethod
    def of(values: Mapping[str, float]) -> "Limits":
        """Return the limits of some names; raises CaseError for a name that is none."""
        names = ("vt", "vref", "efd", "efd_min")
        unknown = [name for name in values if name not in names]
        if unknown:
            raise CaseError(f"limit {name}: not a limit; {near(name, names)}" for name in unknown)
        return Limits(**values)

    @property
    def given(self) -> dict[str, float]:
        """The limits that there are, by name."""
        limits = {"vt": self.vt, "vref": self.of_vref, "efd": self.efd, "efd_min": self.efd_min}
        return {name: limit for name, limit in limits.items() if abs(limit) < inf}

    @property
    def of_vref(self) -> float:
        """How far the reference may deviate from the start, pu."""
        return self.vt if self.vref == inf else self.vref

    def keep(self, run: Run) -> bool:
        """Tell whether a simulated test is within the limits at every point of its grid."""
        extremes = extremes_of(run)
        return bool(np.isfinite([*extremes.values()]).all()) and self.allow(
            extremes, float(run.outputs["vt"][0])
        )

    def allow(self, extremes: Extremes, vt0: float) -> bool:
        """Tell whether signals that stay between extremes, from a voltage, are within limits."""
        (vt_low, vt_high), (efd_low, efd_high) = extremes["vt"], extremes["efd"]
        deviation = max(vt_high - vt0, vt0 - vt_low)
        within_efd = self.efd_min - ROUNDING <= efd_low and efd_high <= self.efd + ROUNDING
        return deviation <= self.vt + ROUNDING and within_efd


def extremes_of(run: Run) -> Extremes:
    """Return the least and the largest value of each signal that has a limit, pu."""
    return {
        "vt": (float(run.outputs["vt"].min()), float(run.outputs["vt"].max())),
        "efd": (float(run.outputs["efd"].min()), float(run.outputs["efd"].max())),
    }
