"""How long the causes of a misfit may be looked for, and how far that is."""

import time
from collections.abc import Callable
from math import inf

from exfit.estimate import Progress

LEAST_TIME = 30.0  # s
TIMES_SEARCH = 3.0  # times what the search took


class OutOfTime(Exception):
    """The time for causes is over."""


def time_for_causes(given: float | None, search: float) -> float:
    """Return the time (s) for causes: as it is given, or by what the ``search`` took (s)."""
    return max(LEAST_TIME, TIMES_SEARCH * search) if given is None else given


class Pace:
    """Watches the search for causes: announces its trials, and ends it when its time is over.

    The time (s) is that of ``clock``, processor time by default, from now on. ``untried`` are the
    causes that were not tried, or not to the end; ``interrupted`` whether an interruption left
    them.
    """

    def __init__(
        self,
        seconds: float = inf,
        watch: Callable[[Progress], object] = lambda _: None,
        clock: Callable[[], float] = time.process_time,
    ) -> None:
        self.seconds, self.watch, self.clock = seconds, watch, clock
        self.untried: tuple[str, ...] = ()
        self.interrupted = False
        self._until = clock() + seconds
        self._done, self._total, self._lowest, self._tried = 0, 0, inf, False

    def counts(self, done: int, total: int, cost: float) -> None:
        """Count how many causes are done; ``cost`` is that without any."""
        self._lowest = min(self._lowest, cost)
        self._done, self._total = done, total

    def goes_on(self, cost: float = inf) -> None:
        """Announce the cost of a trial; raises OutOfTime where its time is over."""
        if self.clock() > self._until:
            raise OutOfTime
        self._lowest = min(self._lowest, cost)
        self._announce(self._done if self._tried else 0)
        self._tried = True

    def ended(self) -> None:
        """Announce that all are done, where one needed a trial."""
        if self._tried:
            self._announce(self._total)

    def _announce(self, done: int) -> None:
        self.watch(Progress("causes", done, self._total, self._lowest))

    def stopped(self, untried: tuple[str, ...], interrupted: bool) -> None:
        """Keep what an interruption, or the end of the time, has left untried."""
        self.untried, self.interrupted = untried, interrupted

    @property
    def sentence(self) -> str:
        """What was not tried and why, "" where all was."""
        if not self.untried:
            return ""
        why = "interrupted" if self.interrupted else f"beyond estimate.causes, {self.seconds:.3g} s"
        return f"not tried as causes ({why}): {', '.join(self.untried)}"
