"""The kinds of what a fit finds about a record, beside the parameters of the unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from exfit.plants import DRIVING_SCALE, VT0

NuisanceKind = Literal[
    "at",
    "shift",
    "step",
    "drift",
    "switching",
    "vt0",
    "delay",
    "scale",
    "offset",
    "driving",
    "frequency",
    "cosine",
    "sine",
]

NUISANCES: Mapping[NuisanceKind, tuple[str, str]] = {
    "at": ("s", "instant of a step"),
    "shift": ("s", "instant of a step"),
    "step": ("pu", "size of a step"),
    "switching": ("s", "instant of a switching in the grid"),
    "drift": ("Hz", "offset of the frequency"),
    "vt0": ("pu", "voltage before the first step"),
    "delay": ("s", "delay of the recorder"),
    "scale": ("", "factor of a channel"),
    "offset": ("pu", "offset of a channel"),
    "driving": ("", "factor of a channel that drives the machine"),
    "frequency": ("Hz", "frequency of a periodic disturbance"),
    "cosine": ("pu", "cosine of it, about the middle of the record"),
    "sine": ("pu", "sine of it, about the middle of the record"),
}  # unit and meaning of each kind


# those that are a parameter of the system
OF_SYSTEM: Mapping[NuisanceKind, str] = {"vt0": VT0, "driving": DRIVING_SCALE}


@dataclass(frozen=True)
class Nuisance:
    """Free parameter of a record, under ``name``: it is none of the unit.

    ``step`` is the index in the inputs of a step whose instant or size it is, ``signal`` the
    channel whose scale, offset or periodic disturbance it is. The instant of an only step is a
    ``shift`` of the whole response: the simulation stays as it is. ``factor`` is what a step is of
    a value that makes it; a ``switching`` is the instant of ``count`` steps from that one on.
    """

    name: str
    kind: NuisanceKind
    step: int = 0
    signal: str = ""
    factor: float = 1.0
    count: int = 1

    @property
    def unit(self) -> str:
        """Its unit."""
        return NUISANCES[self.kind][0]

    @property
    def meaning(self) -> str:
        """Meaning in words."""
        return NUISANCES[self.kind][1]

    def rescales(self, signal: str) -> bool:
        """Test whether it is the scale or the offset of the channel of a signal."""
        return self.signal == signal and self.kind in ("scale", "offset")
