"""What a fit would find if the recorder averaged, where neither the case nor the record says."""

from collections.abc import Mapping
from dataclasses import dataclass

from exfit.inference.wording import digits
from exfit.results.verdict import Cause

STRONG = 10.0  # of chi-square: two hypotheses that differ by more are told apart
MOST_VALUES = 3  # of a sentence


@dataclass(frozen=True)
class RecorderAverages:
    """Averages over a ``window`` (s), which the record does not exclude.

    ``chi_square`` is by how much better they match than samples of single instants; ``given`` are
    the fitted values without them, ``values`` with them; ``beyond`` are the parameters of the unit
    that these take out of their interval.
    """

    window: float
    chi_square: float
    given: Mapping[str, float]
    values: Mapping[str, float]
    beyond: tuple[str, ...]

    @property
    def shown(self) -> bool:
        """Whether the record shows that the recorder averages."""
        return self.chi_square > STRONG

    @property
    def matters(self) -> bool:
        """Whether a reader must know of them."""
        return self.shown or bool(self.beyond)

    @property
    def likelihood(self) -> float:
        """How likely averages are, by the record."""
        return 0.5 * self.chi_square

    @property
    def reason(self) -> str:
        """What is in doubt."""
        over = f"over {1e3 * self.window:.3g} ms"
        if self.shown:
            chi_square = digits(self.chi_square)
            return f"the record shows averages {over}, no single instants (chi-square {chi_square})"
        return f"whether the recorder averages, {over}, is not known and matters"

    @property
    def cause(self) -> Cause:
        """What averages would change, and what to do."""
        window = f"{self.window:.3g}"
        names = self.beyond[:MOST_VALUES] or [*self.values][:MOST_VALUES]
        moved = ", ".join(
            f"{name} {self.values[name]:.3g} ({self.given[name]:.3g})" for name in names
        )
        words = (
            f"the recorder averages over some {1e3 * self.window:.3g} ms, or a transducer lags"
            if self.shown
            else f"the recorder may average over {1e3 * self.window:.3g} ms"
        )
        return Cause(
            f"{words}: {moved} then",
            f"give averaged: {window} on its channels, with delay: {0.5 * self.window:.3g} if it "
            "averages over the time before a sample; or averaged: 0 if it does not average",
        )
