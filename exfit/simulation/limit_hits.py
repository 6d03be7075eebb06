"""Which limits a response has met, for how long, and which limiters acted."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from exfit.plants import LIMITER_KINDS

if TYPE_CHECKING:
    from exfit.simulation.simulator import Simulator

LIMITER_PREFIXES = tuple(f"{kind}." for kind in LIMITER_KINDS)  # of what belongs to a limiter


class LimitHit(NamedTuple):
    """A limit that a response has met.

    ``limit`` is the parameter that sets it, "0" for a state that cannot become negative;
    ``signal`` the state that was held or cut, "" where it was no state; ``value`` the limit when
    it was first met (pu, of the signal: VFEMAX limits VE where VFE reaches it); ``seconds`` how
    long in all, and which ``share`` of the test that is; ``first`` when (s).
    """

    limit: str
    signal: str
    value: float
    seconds: float
    first: float
    share: float


class LimiterAction(NamedTuple):
    """A limiter of excitation that acted, oel.OEL2C, and from when to when each time (s)."""

    name: str
    spans: tuple[tuple[float, float], ...]

    @property
    def sentence(self) -> str:
        """Word the time in which it acted."""
        first, last = self.spans[0][0], self.spans[-1][1]
        times = "" if len(self.spans) == 1 else f", {len(self.spans)} times"
        return f"{self.name} acts from {first:.4g} s to {last:.4g} s{times}"


def limiter_actions(
    simulator: "Simulator", values: Mapping[str, float]
) -> tuple[LimiterAction, ...]:
    """Return the limiters of excitation that act in the response to these values, and when.

    Raises SimulationError where the start is no rest.
    """
    if not any(name.startswith(LIMITER_PREFIXES) for name in simulator.system.outputs):
        return ()
    from exfit.simulation.limits import limiters_held  # only a unit with limiters needs them

    return tuple(LimiterAction(name, spans) for name, spans in limiters_held(simulator, values))
