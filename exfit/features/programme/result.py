"""The result of a programme: what tests at rest and fits show, and the values that they gave."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, nan
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np

from exfit.inference.confidence import Interval
from exfit.results.description import UnitDescription
from exfit.results.model import FitResult, FittedParameter
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH, Verdict
from exfit.util.arrays import Array
from exfit.util.text import ERRORS_IN_INTERVAL, error_of_interval, listed, rounded_value
from exfit.util.typed import IN_FILE, KEY, plain

SaturationForm = Literal["quadratic", "exponential", "exponential-se"]
WithValues = TypeVar("WithValues", "FittedCurve", "SaturationResult")

LARGEST_SHARE = 0.02  # of the rms of a signal: what instruments and model may leave
LARGEST_NOISES = 3.0  # times its noise: a misfit that still counts as a match


@dataclass(frozen=True)
class MeasuredValue:
    """A value that a test at rest gives.

    std_error  in its own unit, by linear theory; None where nothing determines it
    interval   95 %; a side without a limit is None
    why        what limits what is known of it, "" where nothing needs to be said
    """

    value: float
    std_error: float | None
    interval: Interval
    why: str = ""

    @property
    def determined(self) -> bool:
        """Whether the points limit the value on both sides."""
        return None not in self.interval

    def rounded(self, number: float | None) -> str:
        """Return the value, or an end of its interval, as tables print it."""
        return rounded_value(number, self.std_error)

    def times(self, factor: float) -> "MeasuredValue":
        """Return the value in another unit, which is 1 / ``factor`` of its own; factor > 0."""
        low, high = (None if end is None else factor * end for end in self.interval)
        error = None if self.std_error is None else factor * self.std_error
        return MeasuredValue(factor * self.value, error, (low, high), self.why)


@dataclass(frozen=True, eq=False)
class FittedCurve:
    """The curve that fits the points in one form: ifd / base = vt + vt S(vt) + offset.

    ifd_base   field current that gives 1 pu on the air-gap line, in the unit of the points
    S10, S12   saturation at 1.0 and 1.2 pu: excess of the field current over the air-gap line
    offset     field current by which the points lie off a line through zero, pu: the mean of
               the branches
    hysteresis  field current of the rising less that of the falling branch, pu; None with one
    rms        of the residuals, pu of ifd_base
    refuted    whether another form fits so much better that this one is rejected
    extrapolated  the levels of S10 and S12 that lie beyond the highest point, pu
    vt, ifd    the mean curve (K,), pu; low and high its 95 % band
    """

    form: SaturationForm
    ifd_base: MeasuredValue
    S10: MeasuredValue
    S12: MeasuredValue
    offset: MeasuredValue
    hysteresis: MeasuredValue | None
    rms: float
    refuted: bool
    extrapolated: tuple[float, ...]
    vt: Array = field(metadata=IN_FILE)
    ifd: Array = field(metadata=IN_FILE)
    low: Array = field(metadata=IN_FILE)
    high: Array = field(metadata=IN_FILE)


@dataclass(frozen=True, eq=False)
class SaturationResult:
    """An open-circuit saturation test.

    form         the form that is used
    curves       the curve in each form, the best match first
    vt, ifd      the points (M,) in the order in which they were taken: pu, and ``unit``
    direction    (M,) 1 for a point reached with rising voltage, -1 with falling voltage
    left_out     points without field current, by their positions from 0: not part of the fit
    residual     terminal voltage without field current, pu; None without such a point
    exciter      whether the field current is that of a brushless exciter
    efd_base     field voltage that gives 1 pu on the air-gap line, hot, in ``efd_unit``
    resistance   of the hot field winding, efd_unit / unit
    notes        what limits these numbers, in sentences
    """

    form: SaturationForm
    curves: tuple[FittedCurve, ...]
    unit: str
    exciter: bool
    left_out: tuple[int, ...]
    residual: float | None
    efd_base: MeasuredValue | None
    resistance: MeasuredValue | None
    efd_unit: str
    notes: tuple[str, ...]
    vt: Array = field(metadata=IN_FILE)
    ifd: Array = field(metadata=IN_FILE)
    direction: Array = field(metadata=IN_FILE)

    @property
    def curve(self) -> FittedCurve:
        """The curve in the form that is used."""
        return next(curve for curve in self.curves if curve.form == self.form)

    @property
    def residuals(self) -> Array:
        """The points' field current less that of their branch (M,), pu; nan where left out."""
        curve = self.curve
        loop = 0.0 if curve.hysteresis is None else 0.5 * curve.hysteresis.value * self.direction
        errors = self.ifd / curve.ifd_base.value - np.interp(self.vt, curve.vt, curve.ifd) - loop
        errors[list(self.left_out)] = np.nan
        return np.asarray(errors)

    @property
    def highest(self) -> float:
        """The highest voltage of the points, pu."""
        return float(self.vt.max())

    @property
    def machine_values(self) -> Mapping[str, MeasuredValue]:
        """S10 and S12 for the machine's section; nothing of a brushless unit."""
        return {} if self.exciter else {"S10": self.curve.S10, "S12": self.curve.S12}

    @property
    def channel_bases(self) -> Mapping[str, tuple[MeasuredValue, str]]:
        """The bases, each with its unit, of channels of later records that give none.

        They are those of ifd and, where it is known, of efd; none of a brushless unit.
        """
        if self.exciter:
            return {}
        bases = {"ifd": (self.curve.ifd_base, self.unit)}
        return bases if self.efd_base is None else {**bases, "efd": (self.efd_base, self.efd_unit)}

    @property
    def verdict(self) -> Verdict:
        """The verdict: good only if the form is that of the points, and all is measured.

        A form that another one rejects matches as long as its residuals are within the limit: the
        intervals include the values of the other.
        """
        curve, best = self.curve, self.curves[0]
        ifd = np.delete(self.ifd, self.left_out) / curve.ifd_base.value
        limit = LARGEST_SHARE * float(np.sqrt(np.mean(ifd**2)))
        if curve.rms > limit:
            off = f"{curve.rms:.2g} pu rms off a curve of form {curve.form}"
            return Verdict(NO_MATCH, f"the points lie {off}, beyond {limit:.2g} pu")
        doubts = []
        values = {"the base of ifd": curve.ifd_base, "S10": curve.S10, "S12": curve.S12}
        names = [name for name, value in values.items() if not value.determined]
        if names:
            doubts.append(f"the points do not limit {listed(names)} on both sides")
        if curve.refuted:
            doubts.append(
                f"form {curve.form} leaves {curve.rms:.2g} pu rms, {best.form} {best.rms:.2g}: "
                "the intervals include the values of both"
            )
        if curve.extrapolated:
            levels = listed([f"S({level:.1f})" for level in curve.extrapolated])
            verb = "is" if len(curve.extrapolated) == 1 else "are"
            doubts.append(f"{levels} {verb} extrapolated from {self.highest:.3g} pu")
        if doubts:
            return Verdict(MATCHES, "; ".join(doubts))
        return Verdict(GOOD, "the points determine the air-gap line and the saturation")

    @property
    def consistent(self) -> bool:
        """Whether its parts fit together, as one that is read from a file may not."""
        return (
            self.form in [curve.form for curve in self.curves]
            and _alike(self.vt, self.ifd, self.direction)
            and all(0 <= point < len(self.vt) for point in self.left_out)
            and all(
                _alike(curve.vt, curve.ifd, curve.low, curve.high) and curve.ifd_base.value > 0.0
                for curve in self.curves
            )
        )

    def as_judged(self) -> "SaturationResult":
        """Return the test without intervals where the points do not match the curve."""
        why = self.verdict.no_interval
        if not why:
            return self
        curves = tuple(_without_intervals(curve, why) for curve in self.curves)
        return replace(_without_intervals(self, why), curves=curves)


def _without_intervals(result: WithValues, why: str) -> WithValues:
    values: dict[str, Any] = {
        name: replace(value, interval=(None, None), why=why)
        for name, value in vars(result).items()
        if isinstance(value, MeasuredValue)
    }
    return replace(result, **values)


def _alike(*rows: Array) -> bool:
    """Check that all are samples (M,) of the same points, of which there are some."""
    return rows[0].ndim == 1 and rows[0].size > 0 and len({row.shape for row in rows}) == 1


@dataclass(frozen=True, eq=False)
class FieldReading:
    """The readings of ifd or efd at the points, and the same by the model, (M,) per unit.

    ``base`` is what 1 pu is in ``unit``: as given, or as fitted, then ``base_fitted``. ``noise`` is
    the standard deviation that was given for the readings (pu); ``scatter`` that of the residuals,
    less what was fitted (pu), None without a fit; ``limit`` the largest rms that counts as a match.
    """

    DERIVED: ClassVar = {"rms": "rms", "worst": "worst"}

    signal: str
    unit: str
    base: float
    measured: Array
    simulated: Array
    noise: float | None
    scatter: Annotated[float, nan] | None
    limit: float
    base_fitted: bool = False

    @property
    def residuals(self) -> Array:
        """Simulated less measured (M,), pu."""
        return np.asarray(self.simulated - self.measured)

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, pu."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def worst(self) -> int:
        """The point with the largest residual, counted from 0."""
        return int(np.argmax(np.abs(self.residuals)))

    @property
    def matches(self) -> bool:
        """Whether the residuals are within their limit."""
        return self.rms <= self.limit


@dataclass(frozen=True, eq=False)
class PowerLevel:
    """The V-curve of one power: the ``points`` that belong to it, and the model's curve (K,).

    ``p`` is the mean of these points; the curve runs over ``q``, at voltages ``vt`` that follow a
    line through those of the points, with stator current ``it`` and field current ``ifd``, pu.
    """

    p: float
    points: tuple[int, ...]
    q: Array
    vt: Array
    it: Array
    ifd: Array


@dataclass(frozen=True, eq=False)
class VCurve:
    """Points of V-curves (M,) per unit on the machine's base, beside the machine's model.

    ``given`` are the machine's data before anything was fitted, ``machine_data`` those after;
    ``parameters`` what was fitted: machine data by symbol, ``ifd.base`` and ``efd.base`` in the
    unit of the column. ``undetermined`` says what the points leave open, ``notes`` what else is
    remarkable.
    """

    DERIVED: ClassVar = {"it": "it", "determined": "determined"}

    machine: str
    p: Array
    q: Array
    vt: Array
    readings: Mapping[str, FieldReading]
    given: Mapping[str, float]
    machine_data: Mapping[str, float]
    parameters: Mapping[str, FittedParameter]
    verdict: Verdict
    undetermined: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    levels: tuple[PowerLevel, ...] = field(default=(), metadata=IN_FILE)

    @property
    def it(self) -> Array:
        """The stator current at each point (M,), pu."""
        return np.asarray(np.hypot(self.p, self.q) / self.vt)

    @property
    def determined(self) -> tuple[str, ...]:
        """The machine data that were fitted and that the points limit on both sides."""
        return tuple(
            name
            for name, parameter in self.parameters.items()
            if parameter.determined and not parameter.of_record
        )

    @property
    def consistent(self) -> bool:
        """Whether its parts fit together, as one that is read from a file may not."""
        fields = [
            samples
            for reading in self.readings.values()
            for samples in (reading.measured, reading.simulated)
        ]
        return _alike(self.p, self.q, self.vt, *fields) and all(
            _alike(level.q, level.vt, level.it, level.ifd)
            and all(0 <= point < len(self.p) for point in level.points)
            for level in self.levels
        )


@dataclass(frozen=True, eq=False)
class GovernorCurve:
    """The gate over p at rest, or gate or p over a speed that wanders, beside a governor's model.

    ``over`` names x (M,); ``parameters`` are what was fitted: data of the governor by symbol, and
    of a record ``level`` and ``lag``. ``undetermined`` and ``notes`` as of `VCurve`.
    """

    governor: str
    over: str
    x: Array
    reading: FieldReading
    parameters: Mapping[str, FittedParameter]
    verdict: Verdict
    undetermined: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def consistent(self) -> bool:
        """Whether its parts fit together, as one that is read from a file may not."""
        return _alike(self.x, self.reading.measured, self.reading.simulated)


StepResult = SaturationResult | VCurve | GovernorCurve | FitResult


@dataclass(frozen=True)
class EnteredValue:
    """A value that a test gave, and whether it entered the later tests.

    ``name`` is that of a parameter (machine.S10), or of the base of a signal (ifd.base) in
    ``unit``; ``interval`` holds it with 95 % confidence. ``given`` is what the file of the
    programme has in its place, None where it has nothing, and ``given_source`` where that comes
    from; ``excluded`` says whether that lies outside the interval. The value was fitted between
    ``min`` and ``max``.
    """

    name: str
    value: float
    interval: tuple[float, float]
    source: str
    test: str
    unit: str = ""
    given: float | None = None
    given_source: str = ""
    entered: bool = True
    excluded: bool = False
    min: Annotated[float, -inf] = -inf
    max: Annotated[float, inf] = inf

    def rounded(self, number: float) -> str:
        """Return the value, or an end of its interval, as tables print it: within the bounds."""
        return rounded_value(number, error_of_interval(*self.interval), self.min, self.max)

    @property
    def std_error(self) -> float:
        """The standard error that later tests allow for: by the wider side of the interval."""
        low, high = self.interval
        return 2.0 * max(self.value - low, high - self.value) / ERRORS_IN_INTERVAL

    @property
    def warning(self) -> str:
        """The contradiction of the file to the value, in a sentence; "" without one."""
        if not self.excluded or self.given is None:
            return ""
        low, high = map(self.rounded, self.interval)
        measured = f"{low} ... {high} {self.unit}".rstrip()
        used = f"the value of {'the test' if self.entered else 'the file'} is used"
        return (
            f"{self.name}: {self.given:g} in the file ({self.given_source}) lies outside "
            f"{measured}, which the test {self.test} gave; {used}"
        )


@dataclass(frozen=True)
class ProgrammeStep:
    """A test that is run by itself, or all bump tests, which are fitted together.

    ``name`` is that of its folder, ``tests`` are the names of its tests.
    """

    name: str
    kind: str
    tests: tuple[str, ...]


@dataclass(frozen=True)
class KeptTest(ProgrammeStep):
    """A test as programme.json names it; ``key`` is a hash of all that goes into its result."""

    key: str


@dataclass(frozen=True, eq=False)
class FinishedTest(KeptTest):
    """A test that has been run; its result is ``kept`` of an earlier run with the same key."""

    result: StepResult = field(metadata=IN_FILE)
    kept: bool = field(default=False, metadata=IN_FILE)

    @property
    def verdict(self) -> str:
        """The verdict, in the words of that of a fit."""
        result = self.result
        return outcome_of(result) if isinstance(result, FitResult) else result.verdict.verdict

    @property
    def reason(self) -> str:
        """The verdict in a sentence."""
        result = self.result
        return explanation_of(result) if isinstance(result, FitResult) else result.verdict.reason

    @property
    def interrupted(self) -> bool:
        """Whether its result is the best point of a fit that was interrupted."""
        return isinstance(self.result, FitResult) and self.result.interrupted

    @property
    def holds(self) -> bool:
        """Whether its results can be used: an exit code of 0 by itself."""
        result = self.result
        return result.holds if isinstance(result, FitResult) else result.verdict.matches


@dataclass(frozen=True, eq=False)
class KeptSummary:
    """The content of programme.json but its version: a programme without the results of its tests.

    ``failed`` holds the error of each test that could not be run, by its name; ``not_run`` names
    those that an interruption left out. ``unit`` has the models with what the tests gave.
    """

    path: Path = field(metadata={KEY: "programme"})
    about: Mapping[str, float | str]
    tests: tuple[KeptTest, ...]
    values: tuple[EnteredValue, ...] = ()
    failed: Mapping[str, str] = field(default_factory=dict)
    not_run: tuple[str, ...] = ()
    interrupted: bool = False
    unit: UnitDescription = field(default_factory=UnitDescription)


@dataclass(frozen=True, eq=False)
class ProgrammeResult(KeptSummary):
    """A programme that has been run: its tests in the order of the run, and the values they gave.

    ``failed`` holds the error of each test that could not be run, by its name; ``not_run`` names
    those that an interruption left out. ``unit`` has the models with what the tests gave.
    """

    tests: tuple[FinishedTest, ...]

    @property
    def name(self) -> str:
        """The name of the programme."""
        return self.path.stem

    @property
    def results(self) -> dict[str, StepResult]:
        """The results by the names of the tests; that of all bump tests is named fit."""
        return {test.name: test.result for test in self.tests}

    @property
    def fit(self) -> FitResult | None:
        """The fit of the bump tests; None where there is none."""
        result = self.results.get("fit")
        return result if isinstance(result, FitResult) else None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Contradictions to the file of the programme, in sentences."""
        return tuple(filter(None, (value.warning for value in self.values)))

    @property
    def holds(self) -> bool:
        """Whether every test has been run, and its result can be used."""
        done = not (self.failed or self.not_run or self.interrupted)
        return done and all(test.holds for test in self.tests)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of all tests as plain data, as ``exfit run --json`` prints them."""
        content: dict[str, Any] = plain(self)
        del content["unit"]
        content["tests"] = [
            {
                "name": test.name,
                "kind": test.kind,
                "tests": list(test.tests),
                "verdict": test.verdict,
                "reason": test.reason,
                "holds": test.holds,
                "kept": test.kept,
                "result": plain(test.result),
            }
            for test in self.tests
        ]
        return {**content, "warnings": list(self.warnings)}
