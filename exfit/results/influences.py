"""What would move what a fit found: given values, windows of a record, averages of a recorder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

from exfit.inference.confidence import closed
from exfit.results.cause import Cause
from exfit.results.verdict import REJECTED
from exfit.util.text import digits, listed, rounded_value
from exfit.util.vocabulary import UNSTATED

if TYPE_CHECKING:
    from exfit.fitting.uncertainty import GivenError
    from exfit.results.model import FittedParameter

WindowKind = Literal["step", "first half", "second half"]

WIDENED = 1.4  # times: most of the variance is that of given values
WEIGHTY = 0.1  # of the variance by given values
MOST_NAMED = 3  # parameters, and values, of a sentence
STRONG = 10.0  # of chi-square: two hypotheses that differ by more are told apart


def resting_on(
    parameters: "Mapping[str, FittedParameter]",
    given: "Mapping[str, GivenError]",
    sources: Mapping[str, str],
) -> dict[str, tuple[str, ...]]:
    """Name the given values without a source in this unit that intervals rest on.

    For each parameter whose interval they widen most of all, those that do so most first.
    """
    resting = {}
    for name, parameter in parameters.items():
        shares = {value: error.shifts.get(name, 0.0) ** 2 for value, error in given.items()}
        if not (closed(parameter.interval) and closed(parameter.noise_interval)):
            continue
        (low, high), (inner, outer) = parameter.interval, parameter.noise_interval
        if high - low < WIDENED * (outer - inner):
            continue
        weighty = [n for n in shares if shares[n] > WEIGHTY * sum(shares.values())]
        unstated = [n for n in weighty if sources.get(n) in UNSTATED]
        if unstated:
            resting[name] = tuple(sorted(unstated, key=lambda value: -shares[value]))
    return resting


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
    that these take out of their interval; ``changes`` are those of the case.
    """

    window: float
    chi_square: float
    given: Mapping[str, float]
    values: Mapping[str, float]
    beyond: tuple[str, ...]
    changes: Mapping[str, str]

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
            "ask for its setting; averaged: 0 on its channels if it does not average",
            "averaged",
            self.changes,
        )
