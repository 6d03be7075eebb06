"""The result of an open-circuit saturation test: the curve's numbers, each with its interval."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from exfit.inference.confidence import Interval
from exfit.inference.wording import listed
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH, Verdict
from exfit.util.text import rounded_value
from exfit.util.typed import IN_FILE

Array = NDArray[np.float64]
SaturationForm = Literal["quadratic", "exponential", "exponential-se"]

LARGEST_SHARE = 0.02  # of the rms of the field current: what instruments and form may leave


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

    def without_interval(self, why: str) -> "MeasuredValue":
        """Return the value without its interval, for a reason."""
        return replace(self, interval=(None, None), why=why)

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
    offset     field current by which the points lie beside a line through zero, pu: the mean of
               the branches
    hysteresis  field current of the rising less that of the falling branch, pu; None with one
    rms        of the residuals, pu of ifd_base
    refuted    whether another form fits so much better that this one is none of the curve's
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

    def without_intervals(self, why: str) -> "FittedCurve":
        """Return the curve without the intervals of its numbers, for a reason."""
        loop = self.hysteresis
        return replace(
            self,
            ifd_base=self.ifd_base.without_interval(why),
            S10=self.S10.without_interval(why),
            S12=self.S12.without_interval(why),
            offset=self.offset.without_interval(why),
            hysteresis=loop and loop.without_interval(why),
        )


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

    def as_judged(self) -> "SaturationResult":
        """Return the test without intervals where the points do not match the curve."""
        why = self.verdict.no_interval
        if not why:
            return self

        efd_base, resistance = self.efd_base, self.resistance
        return replace(
            self,
            curves=tuple(curve.without_intervals(why) for curve in self.curves),
            efd_base=efd_base and efd_base.without_interval(why),
            resistance=resistance and resistance.without_interval(why),
        )

    @property
    def highest(self) -> float:
        """The highest voltage of the points, pu."""
        return float(self.vt.max())

    @property
    def limit(self) -> float:
        """The largest rms of the residuals that counts as a match, pu."""
        ifd = np.delete(self.ifd, self.left_out) / self.curve.ifd_base.value
        return LARGEST_SHARE * float(np.sqrt(np.mean(ifd**2)))

    @property
    def verdict(self) -> Verdict:
        """The verdict: good only if the form is that of the points, and all is measured.

        A form that another one refutes matches as long as its residuals are within the limit: the
        intervals hold the values of the other.
        """
        curve = self.curve
        if curve.rms > self.limit:
            beside = f"{curve.rms:.2g} pu rms beside a curve of form {curve.form}"
            return Verdict(NO_MATCH, f"the points lie {beside}, beyond {self.limit:.2g} pu")
        doubts = "; ".join(self._doubts())
        if doubts:
            return Verdict(MATCHES, doubts)
        return Verdict(GOOD, "the points determine the air-gap line and the saturation")

    def _doubts(self) -> Iterator[str]:
        """Yield the doubts that keep a test that matches from being good."""
        curve, best = self.curve, self.curves[0]
        values = {"the base of ifd": curve.ifd_base, "S10": curve.S10, "S12": curve.S12}
        names = [name for name, value in values.items() if not value.determined]
        if names:
            yield f"the points do not limit {listed(names)} on both sides"
        if curve.refuted:
            yield (
                f"form {curve.form} leaves {curve.rms:.2g} pu rms, {best.form} {best.rms:.2g}: "
                "the intervals hold the values of both"
            )
        if curve.extrapolated:
            levels = listed([f"S({level:.1f})" for level in curve.extrapolated])
            verb = "is" if len(curve.extrapolated) == 1 else "are"
            yield f"{levels} {verb} extrapolated from {self.highest:.3g} pu"
