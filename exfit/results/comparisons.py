"""A simulated response beside a record: samples, match, and the signals that drove it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np

from exfit.dsp.features import Features
from exfit.simulation.limit_hits import LimiterAction
from exfit.util.arrays import Array
from exfit.util.text import rounded
from exfit.util.typed import IN_FILE, KEY
from exfit.util.vocabulary import QUANTITIES, QuantityName

POWERS = ("p", "q")  # what a unit gives to the grid
Outcome = Literal["met", "not met", "open", "not judged"]  # of a criterion
REFERENCE = "vref, from where vt rests"  # how figures call the reference beside vt


@dataclass(frozen=True, eq=False)
class Overlay:
    """Measured and simulated samples (M,) of one signal, per unit; ``start`` after a fit.

    What is left out of the comparison is nan. Beside vt, ``reference`` is how vref moved from where
    vt rests, if not by steps alone.
    """

    measured: Array
    simulated: Array
    start: Array | None = None
    reference: Array | None = None

    @property
    def error(self) -> Array:
        """Simulated minus measured."""
        return self.simulated - self.measured

    @property
    def rmse(self) -> float:
        """Root mean square of the error, per unit."""
        return float(np.sqrt(np.nanmean(self.error**2)))

    @property
    def max_error(self) -> float:
        """Largest magnitude of the error, per unit."""
        return float(np.nanmax(np.abs(self.error)))

    @property
    def fit_percent(self) -> float:
        """100 (1 - |error| / |measured - its mean|), norms of the whole signal: 100 is perfect."""
        kept = np.isfinite(self.error)
        measured, error = self.measured[kept], self.error[kept]
        spread = float(np.linalg.norm(measured - np.mean(measured)))
        return 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread else float("nan")


class Match(NamedTuple):
    """How well a signal matches its record: errors per unit, and the fit percentage."""

    rmse: Annotated[float, nan]
    max_error: Annotated[float, nan]
    fit_percent: Annotated[float, nan]

    @property
    def describes(self) -> bool:
        """Whether the response matches better than a constant would."""
        return self.fit_percent > 0.0


def match_of(overlay: Overlay) -> Match:
    """Compute the figures of the match of an overlay's samples."""
    return Match(overlay.rmse, overlay.max_error, overlay.fit_percent)


def judged_of(signals: Iterable[str]) -> str:
    """Return the signal that a match is judged by: vt, or the first where there is no vt."""
    names = tuple(signals)
    return "vt" if "vt" in names else names[0]


class IterationResponses(NamedTuple):
    """A signal, measured and after some iterations of a fit, per unit, at ``time`` (M,) in s.

    ``numbers`` (K,) are those of the iterations, in rising order; 0 is the start. ``measured`` is
    (M,), ``samples`` (K, M). What is left out of the comparison is nan.
    """

    signal: str
    numbers: tuple[int, ...]
    time: Array
    measured: Array
    samples: Array


class StepFeatures(NamedTuple):
    """Features of vt after the first step, None where the record does not have it."""

    measured: Features | None
    simulated: Features | None

    def cells(self, key: str) -> tuple[str, str, str]:
        """Write a feature measured, half of its 95 % interval, and simulated, for a table.

        The simulated one has the digits that the error of the measured one allows.
        """
        measured, simulated = self.measured, self.simulated
        half = None if measured is None else measured.errors.get(key)
        return (
            "-" if measured is None else rounded(getattr(measured, key), half),
            "-" if half is None else f"{half:.2g}",
            "-" if simulated is None else rounded(getattr(simulated, key), half),
        )


class ValidatedStep(NamedTuple):
    """A step of a record for validation: its time (s) and size (pu).

    ``found`` says which of instant and size were detected in the record, not given. The error
    ``rmse`` (pu) is that at the times that are judged. If they were detected, it is least,
    ``best_rmse``, with the step at ``best_at``, within the uncertainty of the time.
    """

    signal: str
    at: float
    size: float
    found: tuple[str, ...]
    rmse: float | None = None
    best_at: float | None = None
    best_rmse: float | None = None

    @property
    def text(self) -> str:
        """The step in words."""
        found = " and ".join(self.found).replace("instant", "time")
        source = f"{found} found in the record" if found else "given"
        step = f"{self.signal} {self.size:+.4g} pu at {self.at:.4g} s, {source}"
        if self.rmse is None:
            return step
        judged = f"{step}: rmse {self.rmse:.3e} pu"
        if self.best_at is None or self.best_rmse is None:
            return judged
        return f"{judged}, and {self.best_rmse:.3e} pu fitted, at {self.best_at:.4g} s, not judged"


class Excursion(NamedTuple):
    """The largest departure of a signal from its rest, with its sign, and when it is reached."""

    value: float
    at: float

    def text(self, unit: str) -> str:
        """Return the departure in words; ``unit`` is that of the signal."""
        return f"{self.value:+.3g} {unit} at {self.at:.4g} s"


class PlayedErrors(NamedTuple):
    """How a simulated signal departs from its record, per unit, and when, in s.

    ``largest`` is the error of greatest magnitude, ``at_rest`` its mean before the event; the
    excursions are those of record and simulation, each from its own rest.
    """

    largest: Annotated[float, nan]
    largest_at: Annotated[float, nan]
    at_rest: Annotated[float, nan]
    measured: Excursion | None
    simulated: Excursion | None


class DrivingSignal(NamedTuple):
    """A recorded signal (M,) that drove the simulation; ``label`` is that of an axis.

    The samples are in its ``unit``.
    """

    label: str
    unit: str
    samples: Array
    excursion: Excursion | None


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Samples of a signal that are recorded and simulated but not compared (M,); nan elsewhere."""

    measured: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class PlayedRecord:
    """What of a record drove a simulation, and how what it gave departs from the rest of it.

    ``begins`` is the end of its state of rest, s; ``left_out`` has the signals of which masks leave
    something out.
    """

    begins: float
    driving: Mapping[str, DrivingSignal]
    errors: Mapping[str, PlayedErrors]
    left_out: Mapping[str, LeftOut] = field(default_factory=dict)


class Event(NamedTuple):
    """A disturbance as the recorder shows it, until the next one, s; it may be a step of vref."""

    at: float
    until: float
    of_vref: bool

    def until_within(self, seconds: float | None) -> float:
        """Return when what follows it ends: with the next one, or so many seconds after it."""
        return self.until if seconds is None else min(self.until, self.at + seconds)


@dataclass(frozen=True)
class JudgedCriterion:
    """A criterion on a signal of a record: the difference beside its limit, both in ``unit``.

    ``begin`` and ``end`` are s after the event; ``recorded`` is the quantity in the record, where
    it has one. ``why`` says why it is "open", for the noise of the record, or "not judged".
    """

    record: str
    quantity: QuantityName
    signal: str
    begin: float | None = None
    end: float | None = None
    recorded: float | None = None
    difference: float | None = None
    limit: float | None = None
    unit: str = ""
    outcome: Outcome = "met"
    why: str = ""

    @property
    def label(self) -> str:
        """The criterion in words, with the part of the record that it holds for."""
        label = f"{QUANTITIES[self.quantity].label}, {self.signal}"
        if self.begin is None and self.end is None:
            return label
        begin = "start" if self.begin is None else f"{self.begin:g}"
        return f"{label}, {begin} ... {'end' if self.end is None else f'{self.end:g} s'}"

    @property
    def sentence(self) -> str:
        """The difference in words, and its limit."""
        differs = "is not reached" if self.difference is None else f"{self.difference:+.2g}"
        limit = "" if self.limit is None else f", the limit is {self.limit:.2g} {self.unit}"
        return f"on {self.record} {self.label}: {differs}{limit}"


@dataclass(frozen=True, eq=False)
class Comparison:
    """A simulated response beside a record.

    ``record`` is the name of its file, ``cost`` that of the weighted residuals of all signals.
    ``channels`` says how well each signal matches, ``overlays`` holds its samples at ``time`` (M,)
    in s: of a result that is read back they are thinned, and without a response there are none.
    ``played`` says what of the record drove the simulation, where it did in place of a plant.
    ``criteria`` are those that it was judged by, ``reason`` says why it is not accepted.
    ``validation`` is whether the record was not fitted: then ``limit`` is the largest rmse (pu)
    that is accepted without criteria of the case, and ``of_record`` what was found about the record
    itself; ``steps`` are those of a record that was given by hand, ``notes`` what must be known of
    it. ``step`` is that of the simulation, s. ``limiters`` are those of excitation that acted.
    ``rmse``, ``max_error`` and ``fit_percent`` are those of vt, or of the first signal where there
    is no vt.
    """

    DERIVED: ClassVar = {
        "rmse": "rmse",
        "max_error": "max_error",
        "fit_percent": "fit_percent",
    }

    name: str
    record: str
    cost: Annotated[float, nan]
    accepted: bool
    channels: Mapping[str, Match]
    features: StepFeatures
    limit: float | None = None
    reason: str = ""
    criteria: tuple[JudgedCriterion, ...] = ()
    validation: bool = False
    steps: tuple[ValidatedStep, ...] = ()
    notes: tuple[str, ...] = ()
    of_record: Mapping[str, float] = field(default_factory=dict, metadata=IN_FILE)
    sha256: str = field(default="", metadata=IN_FILE)
    substeps: int = field(default=0, metadata=IN_FILE)
    step: float = field(default=0.0, metadata=IN_FILE)
    time: Array = field(default_factory=lambda: np.zeros(0), metadata=IN_FILE)
    event: Event | None = field(default=None, metadata=IN_FILE)
    overlays: Mapping[str, Overlay] = field(default_factory=dict, metadata=IN_FILE)
    iteration_responses: IterationResponses | None = field(default=None, metadata=IN_FILE)
    played: PlayedRecord | None = field(default=None, metadata=IN_FILE)
    limiters: tuple[LimiterAction, ...] = field(default=(), metadata=IN_FILE)

    @property
    def judged_by(self) -> str:
        """The name of the signal that the match is judged by."""
        return judged_of(self.channels)

    @property
    def judging(self) -> tuple[str, ...]:
        """The signals that a validation must match: of a grid event that was played in, P and Q."""
        powers = tuple(signal for signal in POWERS if signal in self.channels)
        return powers if self.is_event else (self.judged_by,)

    @property
    def is_event(self) -> bool:
        """Whether the record is a grid event that was played in, and P or Q is compared."""
        return self.played is not None and any(signal in self.channels for signal in POWERS)

    @property
    def judged(self) -> Match:
        """How well the signal matches that the match is judged by."""
        return self.channels[self.judged_by]

    @property
    def rmse(self) -> float:
        """Root mean square of its error, per unit."""
        return self.judged.rmse

    @property
    def max_error(self) -> float:
        """Largest magnitude of its error, per unit."""
        return self.judged.max_error

    @property
    def fit_percent(self) -> float:
        """Its fit percentage; not above zero where a constant would match as well."""
        return self.judged.fit_percent


@dataclass(frozen=True, eq=False)
class AsFound:
    """The model before the test and its responses; ``source`` is "" for the case's own start.

    ``bus``, ``machine_id`` and ``file``, whose path is relative to the case, are its place in a
    planner's base, None where the case does not say it.
    ``values`` are all of its parameters, named as in the system; ``comparisons`` those with the
    fitted records and then with the others, empty for the reason ``why``.
    """

    source: str
    model: str
    values: Mapping[str, float]
    comparisons: tuple[Comparison, ...] = field(default=(), metadata={KEY: "records"})
    why: str = ""
    bus: int | None = None
    machine_id: str | None = field(default=None, metadata={KEY: "id"})
    file: str | None = None

    @property
    def is_stated(self) -> bool:
        """Whether the case says what was in the planner's base."""
        return bool(self.source)


@dataclass(frozen=True, eq=False)
class PhaseEnd:
    """The end of a phase of the run from the start of the case, where the next one continues.

    ``iteration`` is its number in the history, ``values`` are those of the free parameters and of
    all others of the exciter there, ``comparisons`` the response to them beside each record.
    """

    phase: str
    next_phase: str
    iteration: int
    cost: Annotated[float, nan]
    values: Mapping[str, float]
    comparisons: tuple[Comparison, ...] = field(default=(), metadata={KEY: "records"})
