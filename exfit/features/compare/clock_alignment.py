"""The clocks of responses that are compared: by how much they differ, as their steps show."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from exfit.dsp.step_detection import DetectedStep, first_step
from exfit.errors import RecordError
from exfit.features.compare.curves import RECORD, Curve
from exfit.features.compare.differences import Difference, differences

STEPS_APART = 0.05  # s: steps found closer than this may differ by the shape of the rise alone
MATCHED = 1e-5  # s: how closely the time between two steps is matched


@dataclass(frozen=True)
class ComparedClocks:
    """The steps that the curves show, by their names, and what would put them together.

    ``reference`` is the curve with which the others are aligned. ``apart`` (s) is what puts those
    together with it whose steps are farther apart than the shape of a rise may move them: from the
    detected steps, and as the responses match best within ``within`` (s) of these.
    """

    steps: Mapping[str, DetectedStep | None]
    reference: str
    apart: Mapping[str, float]
    within: Mapping[str, float]

    @property
    def step_at(self) -> float | None:
        """When the step is: in the record, else in the first curve that shows it."""
        detected = (self.steps.get(RECORD), *self.steps.values())
        return next((step.at for step in detected if step is not None), None)

    def refuse_undetected(self, curves: Sequence[Curve]) -> None:
        """Raise RecordError where a step is not detected that is to be aligned."""
        for curve in curves:
            if self.steps.get(curve.name) is None:
                raise RecordError(
                    f"--align: {curve.name}, {curve.path}: no step is detected in it; "
                    "--shift B=SECONDS moves the time of one"
                )

    def notes(self, curves: Sequence[Curve], signal: str, aligned: bool) -> Iterator[str]:
        """Yield whose clock was moved, or differs and what f would be if it were moved."""
        whose = "the record" if self.reference == RECORD else self.reference
        at = self.steps.get(self.reference)
        for curve in curves:
            name, step = curve.name, self.steps.get(curve.name)
            if name not in self.apart or step is None or at is None:
                continue
            times = f"the step of {name} is at {step.at:.3f} s, that of {whose} at {at.at:.3f} s"
            if aligned:
                yield (
                    f"{times}: {name} is shifted by {self.apart[name]:.4f} s, as it matches best "
                    f"within {self.within[name]:.1g} s of that"
                )
            else:
                (reference,) = (each for each in curves if each.name == self.reference)
                f = _from_reference(reference, curve.shifted(self.apart[name]), signal).f
                yield (
                    f"{times}: --align puts the steps together (f = {f:.2e}), "
                    f"--shift {name}={curve.shift + self.apart[name]:.4f} this one"
                )


def compared_clocks(curves: Sequence[Curve], signal: str) -> ComparedClocks:
    """Return the clocks of curves as the steps of a signal show them."""
    steps = {
        curve.name: first_step(curve.time, curve.signals[signal])
        for curve in curves
        if signal in curve.signals
    }
    name = RECORD if steps.get(RECORD) is not None else curves[0].name
    reference = next(curve for curve in curves if curve.name == name)
    at = steps.get(name)
    apart, within = {}, {}
    for curve in curves:
        step = steps.get(curve.name)
        if step is None or at is None:
            continue
        uncertainty = step.error + at.error
        if abs(at.at - step.at) > max(STEPS_APART, uncertainty):
            apart[curve.name] = _matched(reference, curve, signal, at.at - step.at, uncertainty)
            within[curve.name] = uncertainty
    return ComparedClocks(steps, name, apart, within)


def shifted(curves: Sequence[Curve], shifts: Mapping[str, float]) -> list[Curve]:
    """Return curves with seconds added to their times; raises RecordError for a wrong name."""
    names = [curve.name for curve in curves]
    for name in shifts:
        if name not in names:
            raise RecordError(f"--shift {name}: no curve is called so; known: {', '.join(names)}")
    return [curve.shifted(shifts.get(curve.name, 0.0)) for curve in curves]


def _matched(reference: Curve, curve: Curve, signal: str, offset: float, within: float) -> float:
    """Return the offset (s) near a first one at which a curve differs least from the reference."""
    from scipy.optimize import minimize_scalar

    best = minimize_scalar(
        lambda by: _from_reference(reference, curve.shifted(by), signal).rmse,
        bounds=(offset - within, offset + within),
        method="bounded",
        options={"xatol": MATCHED},
    )
    return float(best.x)


def _from_reference(reference: Curve, curve: Curve, signal: str) -> Difference:
    """Subtract the reference from a curve."""
    pair = [curve, reference] if reference.measured else [reference, curve]
    (difference,) = differences(pair, [signal])
    return difference
