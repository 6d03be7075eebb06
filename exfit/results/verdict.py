"""The verdict of a fit: one of five, and the likely causes where it is not good."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import Annotated, ClassVar, Final, Literal, NamedTuple

from exfit.results.cause import Cause

VerdictWords = Literal[
    "good", "matches, not all determined", "misses the record", "no match", "not converged"
]

GOOD: Final = "good"
MATCHES: Final = "matches, not all determined"
MISSES: Final = "misses the record"
NO_MATCH: Final = "no match"
NOT_CONVERGED: Final = "not converged"

WITHOUT_INTERVALS: Mapping[str, tuple[str, str]] = {
    MISSES: ("none: misses", "the response misses the record"),
    NO_MATCH: ("none: no match", "the response does not match the record"),
}  # verdicts beside which no value has an interval: what tables have in its place, and why
REJECTED = 0.01  # a probability below it
NEGLIGIBLE = 1e-3  # of the variance of the scatter: what inputs carry is not tested for
VISIBLE = 0.005  # of the range of a signal: the width of a line in its figure


@dataclass(frozen=True)
class ResidualTests:
    """What tests say of the residuals of a channel: whether they are noise, or can be seen.

    whiteness  probability that white noise is as correlated (Ljung & Box 1978)
    pattern    probability that white noise has sums as large after its steps
    excess     probability that the record's own scatter leaves residuals as large
    scatter    the record's own (pu), from sample to sample or at rest, where that is larger
    times      standard deviation of the residuals, over the scatter
    deviation  what stands out of the noise (pu) for a fiftieth of the record or longer
    share      deviation, over the range of the signal
    carried    share of the variance of the scatter that recorded inputs carry into the response

    A probability is None where there are too few samples, or no errors at all.
    """

    DERIVED: ClassVar = {"noise": "are_noise", "seen": "are_seen"}

    record: str
    signal: str
    whiteness: float | None
    pattern: float | None
    excess: Annotated[float, nan]
    scatter: Annotated[float, nan]
    times: Annotated[float, nan]
    deviation: Annotated[float, nan]
    share: Annotated[float, nan]
    carried: Annotated[float, nan] = 0.0

    @property
    def probabilities(self) -> tuple[float, ...]:
        """Those of all tests that were made."""
        return tuple(p for p in (self.whiteness, self.pattern, self.excess) if p is not None)

    @property
    def are_white(self) -> bool:
        """Whether neither test of whiteness rejects the residuals.

        Noise that recorded inputs carry is coloured: residuals that are no larger may be, too.
        """
        if self.carried > NEGLIGIBLE and not self.excess < REJECTED:
            return True
        return not any(p is not None and p < REJECTED for p in (self.whiteness, self.pattern))

    @property
    def are_noise(self) -> bool:
        """Whether no test says that the residuals are anything but the noise of the record."""
        return self.are_white and not self.excess < REJECTED

    @property
    def are_seen(self) -> bool:
        """Whether the residuals are a part of the step that a reader sees, and no noise."""
        return not self.are_white and self.excess < REJECTED and self.share > VISIBLE


class Verdict(NamedTuple):
    """The verdict of a fit with its ``reason`` and its causes, the likeliest first.

    ``residuals`` are the tests of each channel of each record, empty where none could be made.
    """

    verdict: VerdictWords
    reason: str = ""
    causes: tuple[Cause, ...] = ()
    residuals: tuple[ResidualTests, ...] = ()

    @property
    def matches(self) -> bool:
        """Whether the response matches the records as far as their noise lets a reader see."""
        return self.verdict in (GOOD, MATCHES)

    @property
    def explained(self) -> bool:
        """Whether nothing but noise is left of the residuals."""
        return all(test.are_noise for test in self.residuals)

    @property
    def refuted(self) -> tuple[ResidualTests, ...]:
        """The residuals that are no noise, by all tests at once.

        One of 100 fits of the true model is refuted, however many tests it has (Bonferroni).
        """
        count = sum(len(test.probabilities) for test in self.residuals)
        return tuple(
            test
            for test in self.residuals
            if not test.are_noise and count * min(test.probabilities) < REJECTED
        )

    @property
    def misfit(self) -> str:
        """Why no parameter has an interval, "" where the response matches or the search failed.

        An interval holds for errors by noise alone: beside a misfit it is meaningless.
        """
        return WITHOUT_INTERVALS.get(self.verdict, ("", ""))[1]

    @property
    def no_interval(self) -> str:
        """What is said of each parameter where there is a `misfit`, else ""."""
        return self.misfit and f"has no interval: {self.misfit}"

    @property
    def in_place_of_interval(self) -> str:
        """What a column of intervals has where there is a `misfit`, else ""."""
        return WITHOUT_INTERVALS.get(self.verdict, ("", ""))[0]

    @property
    def sentence(self) -> str:
        """The verdict with its reason, in one line."""
        return f"{self.verdict}: {self.reason}" if self.reason else self.verdict
