"""A fitted exciter as another model: its parameters, and how far the responses differ."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

from exfit.util.arrays import Array
from exfit.util.typed import IN_FILE, plain
from exfit.util.vocabulary import NOT_STATED, TYPICAL

POOR = 5.0  # % of the step: an error beyond it changes what a study shows
EXACT = 1e-4  # % of the step: what differs by less differs by rounding and sub-steps
WITHOUT_EFFECT = "without effect"  # origin of what the source does not have
UNDETERMINED = 0.5  # relative change of a parameter that stays unnoticed


@dataclass(frozen=True)
class TranslatedParameter:
    """A parameter of the target: its value, and where that comes from.

    ``origin`` is copied, computed, fitted, without effect or typical; ``of`` are the parameters of
    the source that it is from, with what each is there: fitted, nameplate, typical ...;
    ``value_source`` is the one word of `util.sources` for it, or its origin. Of a fitted one
    ``unnoticed`` is by what share of its value it can change, the others following, until the
    responses change by a thousandth of the step (rms); it is no confidence interval.
    """

    DERIVED: ClassVar = {"provenance": "provenance", "undetermined": "undetermined"}

    value: float
    unit: str
    meaning: str
    origin: str
    source: str
    of: Mapping[str, str] = field(default_factory=dict)
    unnoticed: float | None = None
    value_source: str = NOT_STATED

    @property
    def provenance(self) -> str:
        """Where the value is from, in words."""
        if self.origin in (TYPICAL, WITHOUT_EFFECT):
            return f"{self.origin}: {self.source} has no such parameter"
        return f"translated from {self.source}: {self.origin_in_words}"

    @property
    def origin_in_words(self) -> str:
        """How the value was made, and of what."""
        names = ", ".join(f"{name} ({state})" for name, state in self.of.items())
        if self.origin == "fitted":
            return "fitted to its responses"
        if not names:
            return self.origin
        return f"computed from {names}" if self.origin == "computed" else names

    @property
    def undetermined(self) -> bool:
        """Whether the steps hardly show it."""
        return self.unnoticed is not None and self.unnoticed > UNDETERMINED


class SignalError(NamedTuple):
    """How far a signal is from that of the source, in pu and in percent of the step or range."""

    rmse: float
    largest: float
    rmse_percent: float
    largest_percent: float


@dataclass(frozen=True, eq=False)
class StepComparison:
    """The responses of source and target to a step of the reference (pu).

    Errors of vt are in percent of the step, those of efd in percent of the range that efd has
    there. ``fitted`` is whether the parameters were adjusted to it; limits are those that each
    model met. ``source`` and ``target`` are the signals (M,) pu by name.
    """

    plant: str
    step: float
    fitted: bool
    errors: Mapping[str, SignalError]
    source_limits: tuple[str, ...]
    target_limits: tuple[str, ...]
    source: Mapping[str, Array] = field(metadata=IN_FILE)
    target: Mapping[str, Array] = field(metadata=IN_FILE)

    @property
    def label(self) -> str:
        """Its size and plant."""
        return f"{100.0 * self.step:+g} % {self.plant}"

    @property
    def percent(self) -> float:
        """The largest error of vt, in percent of the step."""
        return self.errors["vt"].largest_percent


class LoopFigures(NamedTuple):
    """The voltage loop near rest: Hz, dB and degrees; the oscillation that is damped least."""

    bandwidth: float | None
    peak: float
    gain_margin: float | None
    phase_margin: float | None
    damping: float | None
    frequency: float | None


class LoopComparison(NamedTuple):
    """The voltage loop of both models in a plant."""

    plant: str
    source: LoopFigures
    target: LoopFigures


@dataclass(frozen=True, eq=False)
class Translation:
    """A fitted exciter as another model, and what is lost by that.

    ``source`` and ``target`` are the names of the models, ``name`` that of the case that was
    fitted. ``searched`` is whether parameters had to be fitted; ``lost`` are the values of the
    source's parameters that the target does not have. ``time`` (M,) in s is that of all responses.
    """

    DERIVED: ClassVar = {key: key for key in ("verdict", "exact", "exact_within_limits", "poor")}

    name: str
    source: str
    target: str
    parameters: Mapping[str, TranslatedParameter]
    steps: tuple[StepComparison, ...]
    loops: tuple[LoopComparison, ...]
    lost: Mapping[str, float]
    searched: bool
    notes: tuple[str, ...]
    seconds: float
    time: Array = field(metadata=IN_FILE)

    @property
    def values(self) -> dict[str, float]:
        """The values of the target by symbol."""
        return {name: parameter.value for name, parameter in self.parameters.items()}

    @property
    def worst(self) -> StepComparison:
        """The step with the largest error of vt."""
        return max(self.steps, key=lambda step: step.percent)

    @property
    def exact(self) -> bool:
        """Whether vt is the same in all steps."""
        return self.worst.percent <= EXACT

    @property
    def exact_within_limits(self) -> bool:
        """Whether vt is the same in all steps in which neither model meets a limit."""
        within = [s.percent for s in self.steps if not (s.source_limits or s.target_limits)]
        return bool(within) and max(within) <= EXACT

    @property
    def poor(self) -> bool:
        """Whether a response is not that of the source."""
        return not self.worst.percent <= POOR

    @property
    def verdict(self) -> str:
        """How well the responses agree, in a sentence."""
        if self.exact:
            return f"exact: {self.target} responds like {self.source} in all steps"
        worst = self.worst
        met = [
            f"{model} is at {', '.join(limits)}"
            for model, limits in (
                (self.source, worst.source_limits),
                (self.target, worst.target_limits),
            )
            if limits
        ]
        by = f"{worst.percent:.2g} % of the step, at {worst.label}"
        limits = f" ({'; '.join(met)})" if met else ""
        differs = f"{self.target} differs from {self.source} by up to {by}{limits}"
        if self.poor:
            return f"poor, beyond {POOR:g} %: {differs}"
        if self.exact_within_limits:
            return f"exact where no limit is met; else {differs}"
        return f"similar: {differs}"

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data, without the samples."""
        figures: dict[str, Any] = plain(self)
        return figures
