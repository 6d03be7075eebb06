"""A batch in the terminal: a line for each case that ends, and what all came to."""

from rich.console import Console

from exfit.fleet.folder import Fleet
from exfit.fleet.summary import CaseSummary


class BatchProgress:
    """Shows cases as they end, a line for each."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self._done = self._cases = 0

    def begun(self, cases: int, workers: int) -> None:
        """Show how much there is to do."""
        self._cases = cases
        self._print(f"{cases} cases, {f'{workers} workers' if workers else 'a cluster'}")

    def kept(self, case: str) -> None:
        """Count a case that is done already."""
        self._done += 1

    def started(self, case: str) -> None:
        """Say nothing of a case that begins."""

    def finished(self, summary: CaseSummary) -> None:
        """Show a case that has ended."""
        self._done += 1
        what = summary.verdict or f"{summary.status}: {summary.reason.splitlines()[0]}"
        self._print(f"{self._done:>5} of {self._cases}  {summary.case}  {what}")

    def _print(self, text: str) -> None:
        self.console.print(text, soft_wrap=True, markup=False)


def batch(console: Console, fleet: Fleet) -> None:
    """Show how many cases of a folder there are of each status."""
    counts = ", ".join(f"{count} {status}" for status, count in fleet.counts.items())
    line = f"{len(fleet.cases)} cases in {fleet.folder}: {counts}"
    console.print(line, soft_wrap=True, markup=False)
