"""A batch in the terminal: its progress while it runs, then the outcomes of its cases."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from textwrap import shorten

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar as Bar
from rich.table import Table as Grid
from rich.text import Text

from exfit.features.fleet.batch import BatchObserver
from exfit.features.fleet.folder import CaseSummary, Fleet
from exfit.output.blocks import Block, Mark, Note, Table, columns, row
from exfit.output.events import Events
from exfit.output.terminal import STYLES, paragraph, show, written
from exfit.results.verdict import GOOD, MATCHES

FIRST_LINE, BETWEEN_LINES = 10.0, 60.0  # s: when a file or pipe gets its lines
REFRESHES = 2.0  # a second
FEWEST_DONE = 3  # cases, before the time left is estimated
MOST_RUNNING = 4  # cases that are named
MOST_ATTENTION = 20  # cases below the counts
LONGEST_REASON = 160  # characters of it: the whole is in the table
BETWEEN = 2  # characters between a bar and the words beside it
SHORTEST_BAR = 10  # characters
MINUTE, HOUR = 60.0, 3600.0
LONG_WAIT = 100.0  # s: from here on in minutes
HARMLESS = (GOOD, MATCHES, "no record")
MARKS: dict[str, Mark] = {GOOD: "ok", MATCHES: "doubt", "no record": "faint", "not run": "faint"}


class BatchProgress(BatchObserver):
    """Shows how far a batch is: a few lines that change, or plain lines in a file or pipe."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self.console, self._clock = console, clock
        self._cases = self._workers = self._kept = 0
        self._began = self._next_line = clock()
        self._running: dict[str, float] = {}
        self._durations: list[float] = []
        self._outcomes = Counter[str]()
        self._live: Live | None = None

    @contextmanager
    def running(self) -> Iterator["BatchProgress"]:
        """Show it for as long as the batch runs."""
        if not self.console.is_terminal:
            yield self
            return
        live = Live(
            get_renderable=self.picture,
            console=self.console,
            refresh_per_second=REFRESHES,
            transient=True,
        )
        with live as self._live:
            yield self

    def begun(self, cases: int, workers: int) -> None:
        """Show how much there is to do."""
        self._cases, self._workers = cases, workers
        self._began = self._clock()
        self._next_line = self._began + FIRST_LINE
        by = _plural(workers, "worker") if workers else "a cluster"
        self.console.print(f"{_plural(cases, 'case')}, {by}", soft_wrap=True, markup=False)

    def kept(self, case: str) -> None:
        """Count a case that is done already."""
        self._running.pop(case, None)
        self._kept += 1
        self._line()

    def started(self, case: str) -> None:
        """Show that a case begins."""
        self._running[case] = self._clock()

    def finished(self, summary: CaseSummary) -> None:
        """Count a case that has ended."""
        began = self._running.pop(summary.case, None)
        if began is not None:
            self._durations.append(self._clock() - began)
        self._outcomes[summary.outcome] += 1
        self._line()

    @property
    def done(self) -> int:
        """How many cases have ended, those of earlier runs among them."""
        return self._kept + self._outcomes.total()

    @property
    def seconds_left(self) -> float | None:
        """The time until all are done, None while too little is known of it.

        What is left is taken to need the mean time of a case, and no less than the longest of those
        that run: a mean of all holds however mixed the cases are, a rate of the last ones does not.
        """
        if len(self._durations) < FEWEST_DONE:
            return None
        mean = sum(self._durations) / len(self._durations)
        waiting = self._cases - self.done - len(self._running)
        now = self._clock()
        rest = [max(mean - (now - began), 0.0) for began in self._running.values()]
        at_a_time = self._workers or max(sum(self._durations) / max(now - self._began, 1e-9), 1.0)
        return max((waiting * mean + sum(rest)) / at_a_time, *rest, 0.0)

    def picture(self) -> Grid:
        """Return the lines that a terminal shows: how far it is, what is done, what runs."""
        width, now = self.console.width - 1, self._clock()
        head, pace = f"{self.done} of {self._cases} cases", self._pace()
        room = width - len(head) - len(pace) - 2 * BETWEEN
        line = Grid.grid(padding=(0, BETWEEN, 0, 0))
        if room >= SHORTEST_BAR:
            line.add_row(head, Bar(max(self._cases, 1), self.done, width=room), pace)
        else:
            line.add_row(", ".join(filter(None, (head, pace))))
        longest = sorted(self._running.items(), key=lambda item: item[1])
        text = ", ".join(
            f"{case.rsplit('/', 1)[-1].removesuffix('.yaml')} ({_duration(now - began)})"
            for case, began in longest[:MOST_RUNNING]
        )
        more = len(longest) - MOST_RUNNING
        text += f" and {more} more" if more > 0 else ""
        running = Text(f"now {text}" if text else "", "dim")
        running.truncate(max(width, 1), overflow="ellipsis")
        grid = Grid.grid()
        for each in (line, self._counts(), running):
            grid.add_row(each)
        return grid

    def _line(self) -> None:
        """Print a line of a file or pipe where it is time for one."""
        if self._live is not None or self._clock() < self._next_line:
            return
        self._next_line = self._clock() + BETWEEN_LINES
        parts = (f"{self.done} of {self._cases} cases", self._pace(), self._counts().plain)
        self.console.print(", ".join(filter(None, parts)), soft_wrap=True, markup=False)

    def _pace(self) -> str:
        elapsed, left = self._clock() - self._began, self.seconds_left
        if left is None or elapsed <= 0.0:
            return ""
        rate = len(self._durations) / elapsed * MINUTE
        return f"{rate:.3g}/min, {_duration(left)} left"

    def _counts(self) -> Text:
        kept = {"done before": self._kept} if self._kept else {}
        parts = [*kept.items(), *self._outcomes.most_common()]
        words = (Text(f"{word} {count}", STYLES[MARKS.get(word, "")]) for word, count in parts)
        return Text(", ").join(words)


class BatchEvents(BatchObserver):
    """Announces the cases of a batch to a program."""

    def __init__(self, events: Events) -> None:
        self.events = events
        self._cases = self._done = 0

    def begun(self, cases: int, workers: int) -> None:
        """Announce how much there is to do."""
        self._cases = cases
        self._count(0)

    def kept(self, case: str) -> None:
        """Announce a case that is done already."""
        self.events.write("kept", run=case)
        self._count(1)

    def started(self, case: str) -> None:
        """Announce that a case begins."""
        self.events(case)

    def finished(self, summary: CaseSummary) -> None:
        """Announce how a case has ended."""
        self.events.done(summary.case, summary.outcome, summary.holds)
        self._count(1)

    def _count(self, more: int) -> None:
        self._done += more
        self.events.stage(None, "cases", self._done, self._cases)


def batch(console: Console, fleet: Fleet) -> None:
    """Show the outcomes of a batch, and which cases need attention."""
    console.print()
    show(console, _outcomes(fleet))
    console.print()
    if fleet.interrupted:
        paragraph(console, "interrupted: run the same command again to go on", "bold red")
    written(console, fleet.folder / "fleet.html")
    written(console, fleet.folder / "fleet.csv")


def _outcomes(fleet: Fleet) -> Iterator[Block]:
    counts = Counter(case.outcome for case in fleet.cases).most_common()
    rows = (row(outcome, str(count), mark=MARKS.get(outcome, "bad")) for outcome, count in counts)
    yield Table(columns("outcome", "cases", numbers=("cases",)), tuple(rows))
    attention = [case for case in fleet.cases if case.outcome not in HARMLESS]
    if attention:
        reasons = (
            row(case.name, case.outcome, shorten(case.reason, LONGEST_REASON, placeholder=" …"))
            for case in attention[:MOST_ATTENTION]
        )
        yield Table(columns("case", "outcome", "reason"), tuple(reasons))
    if len(attention) > MOST_ATTENTION:
        yield Note(f"… and {len(attention) - MOST_ATTENTION} more in fleet.csv", mark="faint")


def _duration(seconds: float) -> str:
    if seconds < LONG_WAIT:
        return f"{seconds:.0f} s"
    if seconds < 2 * HOUR:
        return f"{seconds / MINUTE:.0f} min"
    return f"{seconds / HOUR:.1f} h"


def _plural(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
