"""Responses beside each other, whatever programs they are from: their clocks, their differences."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from os import PathLike
from pathlib import Path
from string import ascii_uppercase
from typing import Any, NamedTuple

import numpy as np

from exfit.dsp.features import Features, features
from exfit.dsp.recorded_features import RecordedResponse, recorded_features
from exfit.dsp.step_detection import DetectedStep, first_step
from exfit.errors import ExfitError, RecordError
from exfit.features.compare.curves import (
    RECORD,
    ColumnChoice,
    Curve,
    Difference,
    differences,
    read_curve,
    refuse_unknown,
)
from exfit.features.compare.revalidation import Revalidation, revalidation
from exfit.results.comparisons import judged_of
from exfit.results.io import load_result
from exfit.results.model import FitResult
from exfit.signals import COMPARED
from exfit.util.arrays import Array
from exfit.util.file_names import WHOLE_FIT
from exfit.util.text import magnitude_fault
from exfit.util.typed import plain

STEPS_APART = 0.05  # s: steps found closer than this may differ by the shape of the rise alone
MATCHED = 1e-5  # s: how closely the time between two steps is matched


@dataclass(frozen=True, eq=False)
class Agreement:
    """Responses A, B, C ..., and a record where one is given, with their differences.

    The differences are those of the others from A, and those of all from the record.
    ``features`` are those of the judged signal after the step at ``step_at`` (s), by the name of
    the curve; there are none where no step is known. ``results`` are those of the curves that are
    fits, ``revalidation`` what two fits alone differ by.
    """

    curves: tuple[Curve, ...]
    differences: tuple[Difference, ...]
    step_at: float | None
    judged: str
    features: Mapping[str, Features]
    results: Mapping[str, FitResult]
    notes: tuple[str, ...]
    revalidation: Revalidation | None = None

    @property
    def time(self) -> Array:
        """The clock (M,) of the responses, s: the finest, over the time that all cover."""
        return self.between[0].time if self.between else self.curves[0].time

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that are compared."""
        return tuple(dict.fromkeys(difference.signal for difference in self.differences))

    @property
    def between(self) -> tuple[Difference, ...]:
        """The differences of the responses from the first, without those from the record."""
        return tuple(entry for entry in self.differences if entry.first != RECORD)

    @property
    def from_reference(self) -> tuple[Difference, ...]:
        """The differences from the record, or from the first response where there is no record."""
        return tuple(entry for entry in self.differences if entry.first == RECORD) or self.between

    def as_json(self) -> dict[str, Any]:
        """Return the figures, without the samples."""
        return {
            "curves": {
                entry.name: {
                    "file": str(entry.path),
                    "sha256": entry.sha256,
                    "samples": len(entry.time),
                    "shift": entry.shift,
                }
                for entry in self.curves
            },
            "differences": [entry.as_json() for entry in self.differences],
            "step_at": self.step_at,
            "features": {
                "signal": self.judged,
                **{name: asdict(entry) for name, entry in self.features.items()},
            },
            "results": {
                name: {
                    "model": result.model,
                    "strategy": result.strategy,
                    "f": result.cost,
                    "parameters": plain(result.parameters),
                }
                for name, result in self.results.items()
            },
            "notes": list(self.notes),
            "revalidation": plain(self.revalidation),
        }


def compare(
    sources: Sequence[str | PathLike[str]],
    record: str | PathLike[str] | None = None,
    columns: Mapping[str, Sequence[str]] | None = None,
    time: Sequence[str] = (),
    shifts: Mapping[str, float] | None = None,
    align: bool = False,
    step_at: float | None = None,
) -> Agreement:
    """Compare responses, with each other and with a record.

    Each is the folder or the result.json of a run, or a file of any kind that records have. The
    signals that the first shares with others are compared over the time that all cover, on the
    finest of their clocks; a coarser one is interpolated by cubics (Akima 1970), a record never:
    the simulation is read at its samples.

    Args:
        sources: where the responses are, named A, B, C ...; one alone needs a record.
        record: where the measured curve is.
        columns: possible columns of each signal: a file is read by the one that it has.
        time: possible columns of the time; by default the usual names are looked for.
        shifts: s, added to the time of a curve, by its name.
        align: whether the clocks are shifted so that the detected steps coincide with that of the
            record, or of A.
        step_at: s, the time of the step on the clock of the record, or of A; by default it is
            detected.

    Raises RecordError where a file cannot be used, they have no signal or time in common, or a step
    is not detected that is to be aligned.

    Example:
        >>> agreement = exfit.compare(["runs/a-fit", "pss_e.csv"], shifts={"B": 0.5})
        >>> agreement.differences[0].rms
    """
    if len(sources) == 1 and record is None:
        raise RecordError(f"{sources[0]}: one curve alone can be compared only with a record")
    choice = ColumnChoice(columns or {}, time)
    paths = dict(zip(_names(len(sources)), map(Path, sources), strict=True))
    named = paths if record is None else {**paths, RECORD: Path(record)}
    as_read = [read_curve(name, path, choice) for name, path in named.items()]
    refuse_unknown(choice, as_read)
    curves = shifted(as_read, shifts or {})
    shared = _shared_signals(curves)
    judged = judged_of(shared)
    clocks = compared_clocks(curves, judged, align)
    if align:
        _refuse_without_step(curves, clocks)
        curves = shifted(curves, clocks.apart)
    results, unread = _results(paths)
    at = _given_or_first(step_at, [clocks.steps.get(RECORD), *clocks.steps.values()])
    of_curves = {} if at is None else dict(_features_of(curves, judged, at))
    removed = [
        f"{name}: its features are read without {of_curve.removed}"
        for name, of_curve in of_curves.items()
        if of_curve.removed
    ]
    return Agreement(
        tuple(curves),
        tuple(differences(curves, shared)),
        at,
        judged,
        of_curves,
        results,
        (*_repetitions(curves), *clocks.notes, *removed, *unread),
        revalidation(*results.values()) if len(results) == len(sources) == 2 else None,
    )


def _repetitions(curves: Iterable[Curve]) -> Iterator[str]:
    for curve in curves:
        if curve.repeated:
            yield f"{curve.path}: {curve.repeated} repeated times: the last row of each is used"


def _refuse_without_step(curves: Iterable[Curve], clocks: "ComparedClocks") -> None:
    """Raise RecordError for a curve that cannot be aligned."""
    for curve in curves:
        if clocks.steps.get(curve.name) is None:
            raise RecordError(
                f"--align: {curve.name}, {curve.path}: no step is detected in it; "
                "--shift B=SECONDS shifts the time of one"
            )


def _names(count: int) -> list[str]:
    """Return A, B ... Z, AA, AB ... for so many curves."""
    names: list[str] = []
    length = 1
    while len(names) < count:
        names += map("".join, product(ascii_uppercase, repeat=length))
        length += 1
    return names[:count]


def _shared_signals(curves: Sequence[Curve]) -> list[str]:
    """Return the signals that the first shares with others, or alone with the record.

    Raises RecordError where one of the others has none of them.
    """
    first, *others = curves
    shared = [name for name in first.signals if any(name in curve.signals for curve in others)]
    for curve in others:
        if not any(name in curve.signals for name in shared or first.signals):
            ours, theirs = (
                ", ".join(each.signals) or f"none of {', '.join(COMPARED)}"
                for each in (first, curve)
            )
            raise RecordError(
                f"{first.path} and {curve.path}: no signal in common: {first.name} has {ours}, "
                f"{curve.name} has {theirs}; name columns with --columns vt=COLUMN"
            )
    return shared


def _given_or_first(at: float | None, steps: Iterable[DetectedStep | None]) -> float | None:
    """Return the time of the step that is given, else of the first found; it is a number."""
    if at is None:
        return next((step.at for step in steps if step is not None), None)
    fault = magnitude_fault(at)
    if fault is not None:
        raise RecordError(f"step: {fault}")
    return at


def _results(paths: Mapping[str, Path]) -> tuple[dict[str, FitResult], list[str]]:
    """Return the results of the curves that are fits, and why others cannot be read."""
    results, unread = {}, []
    for name, path in paths.items():
        if (path.is_dir() and (path / WHOLE_FIT).is_file()) or path.name == WHOLE_FIT:
            try:
                results[name] = load_result(path)
            except ExfitError as fault:
                unread.append(f"{name}: its parameters are not shown: {fault}")
    return results, unread


def _features_of(curves: Sequence[Curve], signal: str, at: float) -> Iterator[tuple[str, Features]]:
    """Yield the features of each curve, until the first of them ends; of a record without noise."""
    until = min(float(curve.time[-1]) for curve in curves)
    responses = [
        curve
        for curve in curves
        if not curve.measured and np.isfinite(curve.signals.get(signal, np.nan)).all()
    ]
    for curve in curves:
        if signal in curve.signals:
            kept = np.isfinite(curve.signals[signal])
            time, samples = curve.time[kept], curve.signals[signal][kept]
            if curve.measured and responses:
                guide = np.interp(time, responses[0].time, responses[0].signals[signal])
                recorded = RecordedResponse(time, samples, guide, at, until)
                of_curve = recorded_features(recorded)
            else:
                of_curve = features(time, samples, at, until)
            if of_curve is not None:
                yield curve.name, of_curve


class ComparedClocks(NamedTuple):
    """The steps that curves show, by their names, and what puts clocks that differ together.

    ``apart`` (s) is that of the curves whose steps are farther from that of the record, or of the
    first curve, than the shape of a rise may move them; ``notes`` name these.
    """

    steps: Mapping[str, DetectedStep | None]
    apart: Mapping[str, float]
    notes: Sequence[str]


def compared_clocks(curves: Sequence[Curve], signal: str, aligned: bool) -> ComparedClocks:
    """Compare clocks by the steps of a signal, and by where the responses then match best."""
    steps = {
        curve.name: first_step(curve.time, curve.signals[signal])
        for curve in curves
        if signal in curve.signals
    }
    name = RECORD if steps.get(RECORD) is not None else curves[0].name
    reference = next(curve for curve in curves if curve.name == name)
    whose = "the record" if reference.measured else name
    at = steps.get(name)
    apart, notes = {}, []
    for curve in curves:
        step = steps.get(curve.name)
        if step is None or at is None:
            continue
        within = step.error + at.error
        if abs(at.at - step.at) <= max(STEPS_APART, within):
            continue
        by = apart[curve.name] = _matched(reference, curve, signal, at.at - step.at, within)
        times = f"the step of {curve.name} is at {step.at:.3f} s, that of {whose} at {at.at:.3f} s"
        if aligned:
            notes.append(
                f"{times}: {curve.name} is shifted by {by:.4f} s, as it matches best within "
                f"{within:.1g} s of that"
            )
        else:
            f = _from_reference(reference, curve.shifted(by), signal).f
            notes.append(
                f"{times}: --align makes them coincide (f = {f:.2e}); for this one alone "
                f"--shift {curve.name}={curve.shift + by:.4f}"
            )
    return ComparedClocks(steps, apart, notes)


def shifted(curves: Sequence[Curve], shifts: Mapping[str, float]) -> list[Curve]:
    """Return curves with seconds added to their times; raises RecordError for a wrong name."""
    names = [curve.name for curve in curves]
    for name in shifts:
        if name not in names:
            raise RecordError(f"--shift {name}: no curve has this name; known: {', '.join(names)}")
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
    pair = [curve, reference] if reference.measured else [reference, curve]
    (difference,) = differences(pair, [signal])
    return difference
