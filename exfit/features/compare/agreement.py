"""Responses beside each other, whatever programs they are from, and their differences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.features import Features, features
from exfit.dsp.recorded_features import RecordedResponse, recorded_features
from exfit.errors import ExfitError, RecordError
from exfit.features.compare.clock_alignment import compared_clocks, shifted
from exfit.features.compare.curves import (
    RECORD,
    USUAL_COLUMNS,
    ColumnChoice,
    Curve,
    read_curve,
    refuse_unknown,
)
from exfit.features.compare.differences import Difference, differences
from exfit.results.comparisons import judged_of
from exfit.results.io import load_result
from exfit.results.model import FitResult
from exfit.signals import COMPARED
from exfit.util.file_names import WHOLE_FIT
from exfit.util.typed import plain

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Agreement:
    """Responses A, B, C ..., and a record where one is given, with their differences.

    The differences are those of the others from A, and those of all from the record.
    ``features`` are those of the judged signal after the step at ``step_at`` (s), by the name of
    the curve; there are none where no step is known. ``results`` are those of the curves that are
    fits.
    """

    curves: tuple[Curve, ...]
    differences: tuple[Difference, ...]
    step_at: float | None
    judged: str
    features: Mapping[str, Features]
    results: Mapping[str, FitResult]
    notes: tuple[str, ...]

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
        }


def compare(
    sources: Sequence[Path],
    record: Path | None = None,
    choice: ColumnChoice = USUAL_COLUMNS,
    shifts: Mapping[str, float] | None = None,
    align: bool = False,
    step_at: float | None = None,
) -> Agreement:
    """Compare responses, with each other and with a record.

    Each is the folder or the result.json of a run, or a file of any kind that records have. The
    signals that the first shares with others are compared over the time that all cover, on the
    finest of their clocks; between the samples of a coarser one lies a cubic (Akima 1970). A record
    is never interpolated: what is simulated is read at its instants.

    Args:
        sources: where the responses are, named A, B, C ...; one alone only beside a record.
        record: where the measured curve is.
        choice: the columns of signals and time, in the files that have them.
        shifts: s, added to the time of a curve, by its name.
        align: whether the clocks are moved so that the steps that are detected are together: at
            that of the record, or of A.
        step_at: s, the instant of the step on the clock of the record, or of A; by default it is
            detected.

    Raises RecordError where a file cannot be used, they have no signal or time in common, or a step
    is not detected that is to be aligned.
    """
    paths = dict(zip(_names(len(sources)), sources, strict=True))
    as_read = _read(paths if record is None else {**paths, RECORD: record}, choice)
    curves = shifted(as_read, shifts or {})
    shared = _shared_signals(curves)
    judged = judged_of(shared)
    clocks = compared_clocks(curves, judged)
    if align:
        clocks.refuse_undetected(curves)
        curves = shifted(curves, clocks.apart)
    results, unread = _results(paths)
    at = clocks.step_at if step_at is None else step_at
    of_curves = {} if at is None else dict(_features_of(curves, judged, at))
    return Agreement(
        tuple(curves),
        tuple(differences(curves, shared)),
        at,
        judged,
        of_curves,
        results,
        (*_notes(curves), *clocks.notes(curves, judged, align), *_removed(of_curves), *unread),
    )


def _read(paths: Mapping[str, Path], choice: ColumnChoice) -> list[Curve]:
    """Return curves by their names; raises RecordError for columns that none of them has."""
    curves = [read_curve(name, path, choice) for name, path in paths.items()]
    refuse_unknown(choice, curves)
    return curves


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
            raise RecordError(
                f"{first.path} and {curve.path}: no signal in common: {first.name} has "
                f"{_listed(first)}, {curve.name} has {_listed(curve)}; "
                "name columns with --columns vt=COLUMN"
            )
    return shared


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


def _listed(curve: Curve) -> str:
    return ", ".join(curve.signals) or f"none of {', '.join(COMPARED)}"


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


def _removed(of_curves: Mapping[str, Features]) -> Iterator[str]:
    for name, of_curve in of_curves.items():
        if of_curve.removed:
            yield f"{name}: its features are read without {of_curve.removed}"


def _notes(curves: Sequence[Curve]) -> Iterator[str]:
    for curve in curves:
        if curve.repeated:
            yield f"{curve.path}: {curve.repeated} instants repeat: the last row of each is used"
