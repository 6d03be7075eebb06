"""What a fit comes to: one of five verdicts, and what may be wrong where it is not good."""

from dataclasses import dataclass
from typing import Final, Literal

VerdictWords = Literal[
    "good", "matches, not all determined", "misses the record", "no match", "not converged"
]

GOOD: Final = "good"
MATCHES: Final = "matches, not all determined"
MISSES: Final = "misses the record"
NO_MATCH: Final = "no match"
NOT_CONVERGED: Final = "not converged"


@dataclass(frozen=True)
class Cause:
    """Why a fit may be as it is, and what to do about it."""

    cause: str
    remedy: str

    @property
    def sentence(self) -> str:
        """The cause and its remedy in one sentence."""
        return f"{self.cause}: {self.remedy}"


@dataclass(frozen=True)
class Verdict:
    """What a fit comes to, with the ``reason`` for it and the likeliest causes, the first first."""

    verdict: VerdictWords
    reason: str = ""
    causes: tuple[Cause, ...] = ()

    @property
    def matches(self) -> bool:
        """Whether the response matches the records as far as their noise lets a reader see."""
        return self.verdict in (GOOD, MATCHES)

    @property
    def sentence(self) -> str:
        """The verdict with its reason, in one line."""
        return f"{self.verdict}: {self.reason}" if self.reason else self.verdict
