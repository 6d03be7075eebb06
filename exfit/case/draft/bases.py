"""The bases of channels: what 1 pu is, as an engineer gives it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from exfit.errors import ExfitError
from exfit.records.units import alike, scale_between, unit_of, usual
from exfit.signals import RECORDED
from exfit.util.text import near

BASE = re.compile(r"(?P<value>[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)\s*(?P<unit>\D.*)?")


@dataclass(frozen=True)
class Base:
    """What 1 pu of a signal is, in a unit; without one it is that of the channel."""

    value: float
    unit: str | None

    def in_unit(self, unit: str | None, channel: str) -> float:
        """Return the value in the unit of a channel; raises ExfitError where that is another."""
        if unit is None or self.unit is None or alike(unit, self.unit):
            return self.value
        scale = scale_between(self.unit, unit)
        if scale is None:
            raise ExfitError(f"base {self.value:g} {self.unit}: {channel} is in {unit}")
        return float(f"{self.value * scale:.12g}")


def base_of(text: str, place: str) -> Base:
    """Return the base that a text is, as 15.75kV; raises ExfitError, which begins with a place."""
    parts = BASE.fullmatch(text.strip())
    unit = parts["unit"].strip() if parts is not None and parts["unit"] else None
    if parts is None or float(parts["value"]) <= 0.0 or (unit and unit_of(unit) is None):
        raise ExfitError(f"{place}: {text!r} is not a positive number with a unit, as 15.75kV")
    return Base(float(parts["value"]), None if unit is None else usual(unit))


def bases_of(texts: tuple[str, ...]) -> dict[str, Base]:
    """Return bases by signal from texts as vt=15.75kV; raises ExfitError."""
    bases = {}
    for text in texts:
        signal, equals, value = text.partition("=")
        if not equals or signal not in RECORDED:
            hint = near(signal, RECORDED) if equals else "give it as vt=15.75kV"
            raise ExfitError(f"--base {text}: not a signal and its base; {hint}")
        bases[signal] = base_of(value, f"--base {text}")
    return bases


def rated_bases(bases: Mapping[str, Base], kv: float | None, mva: float | None) -> dict[str, Base]:
    """Return bases with those that the ratings of a unit give to signals without one."""
    rated = {} if kv is None else {"vt": Base(kv, "kV")}
    if mva is not None:
        rated |= {"p": Base(mva, "MW"), "q": Base(mva, "Mvar")}
    return {**rated, **bases}
