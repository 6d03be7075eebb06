"""A breaker that opens: the stator then has no current, and its voltage follows the speed.

On load the equations neglect speed in the stator's voltages, as PSS/E does. From rest at rated
speed nothing is lost by that, as the source keeps the speed; and when the breaker opens the speed
is still 1, so that it starts to count without a jump: then vt = speed times flux, per unit. (After
a swing the speed may be off by a thousandth there, and vt jumps by as much.)
"""

from typing import NamedTuple

from exfit.engine.system import Signals
from exfit.engine.trace import Signal, where
from exfit.models.machines import Axes

BREAKER, SPEED = "breaker", "speed"  # inputs: 1 from the opening on; the recorded change of speed
HALF_OPEN = 0.5  # between closed, 0, and open, 1


class MachineBreaker(NamedTuple):
    """A machine with its breaker at one instant: ``open`` says whether it is.

    ``dw`` is its speed less 1, ``factor`` what the stator's voltages have of the speed.
    """

    open: Signal
    dw: Signal
    factor: Signal

    def until_open(self, closed: Signal) -> Signal:
        """Keep a value until the breaker that is ``closed`` opens, then zero."""
        return where(self.open, 0.0, closed)

    def once_open(self, slope: Signal) -> Signal:
        """Take zero until the breaker opens, then the value."""
        return where(self.open, slope, 0.0)

    def current(self, closed: Axes) -> Axes:
        """Return the current, which is that with the breaker ``closed`` until it opens."""
        return Axes(self.until_open(closed.d), self.until_open(closed.q))


def breaker_of(u: Signals, dw: Signal) -> MachineBreaker:
    """Return the state of a breaker; ``dw`` is the simulated speed less 1.

    A recorded speed, where there is one, is in place of the simulated one from the opening on.
    """
    opened = u[BREAKER] > HALF_OPEN
    deviation = where(opened, u[SPEED], dw) if SPEED in u else dw
    return MachineBreaker(opened, deviation, where(opened, 1.0 + deviation, 1.0))
