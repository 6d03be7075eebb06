"""A parameter over windows of its records: whether it is the same in each of them."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from exfit.results.verdict import REJECTED
from exfit.util.text import rounded_value

WindowKind = Literal["step", "first half", "second half"]


@dataclass(frozen=True)
class WindowEstimate:
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
        each = f"{self.name} is {values} {self.unit} by the {len(steps)} steps one by one"
        spread = f"{ends} {self.unit} over {len(self.windows)} windows"
        if not self.moves:
            return f"{each}, {spread}: no more than noise spreads them"
        return (
            f"{each}, {spread}: more than noise spreads them (p {self.p_value:.1g}), as the "
            "hysteresis of the iron does; an interval that is given holds all of them"
        )
