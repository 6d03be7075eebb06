"""What would move what a fit found: typical values, windows of a record, averages of a recorder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

from exfit.results.verdict import REJECTED, Cause
from exfit.util.text import digits, listed, rounded_value

WindowKind = Literal["step", "first half", "second half"]

DEVIATION = 0.2  # of a typical value: as far as units of one kind lie apart
MOST_NAMED = 3  # parameters, and values, of a sentence
STRONG = 10.0  # of chi-square: two hypotheses that differ by more are told apart


class TypicalValue(NamedTuple):
    """A typical value that the responses depend on, and what it moves.

    ``shifts`` is by how much each fitted parameter would move, in its own unit, if the value were
    larger by DEVIATION: to first order. ``matters_to`` names those of the unit that would move by
    more than half the width of their interval (twice the standard error, where there is none),
    with that shift in shares of the half width, the largest first.
    """

    value: float
    shifts: Mapping[str, float]
    matters_to: Mapping[str, float]


def moved_parameters(typical: TypicalValue, fitted: Mapping[str, float]) -> str:
    """Word the shifts that a typical value would cause where they matter, in percent if not of 0.

    A shift of the first order that exceeds the value itself says no more than that it is large.
    """
    moves = []
    for name in typical.matters_to:
        shift, value = abs(typical.shifts[name]), abs(fitted[name])
        share = f"{digits(100.0 * shift / value)} %" if 0.0 < value >= shift else "more than 100 %"
        moves.append(f"{name} by {share if value else digits(shift)}")
    return first_of(moves)


def by_weight(values: Mapping[str, TypicalValue]) -> dict[str, TypicalValue]:
    """Return the typical values that matter, the one that exceeds an interval the most first."""
    mattering = {name: value for name, value in values.items() if value.matters_to}
    order = sorted(mattering, key=lambda name: -max(mattering[name].matters_to.values()))
    return {name: mattering[name] for name in order}


def first_of(names: Sequence[str]) -> str:
    """Return the first few names as "A, B and 3 more"."""
    others = len(names) - MOST_NAMED
    if others <= 1:  # one more is as short as its name
        return listed(names)
    return listed([*names[:MOST_NAMED], f"{others} more"])


class WindowEstimate(NamedTuple):
    """A parameter as one window of a record gives it, from ``start`` to ``end`` (s).

    The window is that of a step, from the rest before it to the next one; or the half of it that
    is compared, each half with as much information about the parameter.
    """

    record: str
    kind: WindowKind
    start: float
    end: float
    value: float
    std_error: float


@dataclass(frozen=True)
class WindowSpread:
    """A parameter over several windows.

    ``p_value`` is the probability that noise alone spreads the windows of the steps, or the halves,
    so far (Cochran's Q); ``interval`` is the one of the fit to all, ``hull`` holds it, the 95 %
    intervals by the steps one by one, and the values by their halves.
    """

    DERIVED: ClassVar = {"moves": "moves", "sentence": "sentence"}

    name: str
    unit: str
    windows: tuple[WindowEstimate, ...]
    p_value: float
    interval: tuple[float, float] | None
    hull: tuple[float, float]

    @property
    def moves(self) -> bool:
        """Whether the parameter moves by more than noise from window to window."""
        return self.p_value < REJECTED

    @property
    def sentence(self) -> str:
        """What the windows say of the parameter."""
        steps = [window for window in self.windows if window.kind == "step"]
        values = ", ".join(rounded_value(window.value, window.std_error) for window in steps)
        least, most = (pick(self.windows, key=lambda w: w.value) for pick in (min, max))
        ends = " ... ".join(rounded_value(end.value, end.std_error) for end in (least, most))
        each = f"{self.name} is {values} {self.unit} from each of the {len(steps)} steps"
        spread = f"{ends} {self.unit} over {len(self.windows)} windows"
        if not self.moves:
            return f"{each}, {spread}: the spread is that of the noise"
        return (
            f"{each}, {spread}: the spread exceeds that of the noise (p {self.p_value:.1g}), as "
            "with hysteresis of the iron; an interval, where given, includes all of them"
        )


class RecorderAverages(NamedTuple):
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
            return f"the record shows averages {over}, not samples (chi-square {chi_square})"
        return f"whether the recorder averages {over} is unknown and matters"

    @property
    def cause(self) -> Cause:
        """What averages would change, and what to do."""
        window = f"{self.window:.3g}"
        names = self.beyond[:MOST_NAMED] or [*self.values][:MOST_NAMED]
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
