"""What a command announces to a program that runs it: a JSON object a line on standard error."""

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, Self

from exfit.estimate import Progress
from exfit.results.model import Iteration
from exfit.runs.runner import Planned
from exfit.util.typed import plain


class Judged(Planned, Protocol):
    """A run that has ended: a fit, a test of a programme."""

    @property
    def verdict(self) -> str:
        """The verdict on it, or what speaks against one that matches."""

    @property
    def holds(self) -> bool:
        """Whether it matches and is accepted."""


class Events:
    """Writes each event as it comes; docs/commands.md describes what they hold.

    It is called with a run and an iteration of it, or how far it is; None as it begins. ``folder``
    is where the command leaves its files.
    """

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._begun: set[str] = set()
        self._verdicts: list[str] = []
        self.folder: Path | None = None

    def start(self, command: str, inputs: Sequence[str], strategies: Sequence[str]) -> None:
        """Write what is run."""
        self.write("start", command=command, inputs=inputs, strategies=strategies)

    def write(self, event: str, **content: Any) -> None:
        """Write an event with the seconds since the start; numbers that are not finite are null."""
        line = {"event": event, "elapsed": round(time.monotonic() - self._began, 3), **content}
        print(json.dumps(plain(line), allow_nan=False), file=sys.stderr, flush=True)

    @contextmanager
    def running(self) -> Iterator[Self]:
        """Write events: as what else shows progress, it is entered first."""
        yield self

    def __call__(self, run: Planned | str, progress: Iteration | Progress | None = None) -> None:
        """Write how far a run is, of a plan or by its name."""
        name = run if isinstance(run, str) else run.name
        if name not in self._begun:
            self._begun.add(name)
            self.write("begin", run=name)
        if isinstance(progress, Iteration):
            self.write("iteration", run=name, **plain(progress))
        elif progress is not None:
            self.stage(name, progress.stage, progress.done, progress.total, progress.best)

    def stage(
        self, run: str | None, stage: str, done: int, total: int, best_cost: float | None = None
    ) -> None:
        """Write how far a stage is, of a run or the command; ``best_cost``: the lowest so far."""
        self.write("stage", run=run, stage=stage, done=done, total=total, best_cost=best_cost)

    def finished(self, run: Judged) -> None:
        """Write that a run has ended."""
        self.done(run.name, run.verdict, run.holds)

    def done(self, run: str, verdict: str, holds: bool) -> None:
        """Write the verdict on a run, or why it has none, and whether it matches."""
        self._begun.discard(run)
        self._verdicts.append(verdict)
        self.write("done", run=run, verdict=verdict, holds=holds)

    def end(self, exit_code: int, error: str | None) -> None:
        """Write how the command ends; the verdict is that of its run, null where it has several."""
        verdict = self._verdicts[0] if len(self._verdicts) == 1 else None
        folder = self.folder
        self.write("end", exit_code=exit_code, verdict=verdict, folder=folder, error=error)
