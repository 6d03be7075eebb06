"""What a batch announces while it runs: the terminal shows it, a test collects it."""

from typing import Protocol

from exfit.features.fleet.summary import CaseSummary


class BatchObserver(Protocol):
    """Sees a batch go on; all calls come from one thread, in the order of the events.

    Of each case of the run ``kept`` or ``finished`` is called once, unless the run is interrupted.
    Cases are named by their paths as the index has them.
    """

    def begun(self, cases: int, workers: int) -> None:
        """So many cases are to be done by so many workers; 0: by those of a cluster."""

    def kept(self, case: str) -> None:
        """A case is done already, or failed: by an earlier run, or as another of equal content."""

    def started(self, case: str) -> None:
        """A worker begins the fit of a case."""

    def finished(self, summary: CaseSummary) -> None:
        """A case has come to its end, whatever it is: done, failed, refused, no record ..."""


class Unobserved:
    """An observer that looks away."""

    def begun(self, cases: int, workers: int) -> None:
        """Ignore how much there is to do."""

    def kept(self, case: str) -> None:
        """Ignore a case that is done already."""

    def started(self, case: str) -> None:
        """Ignore the begin of a fit."""

    def finished(self, summary: CaseSummary) -> None:
        """Ignore the end of a case."""
