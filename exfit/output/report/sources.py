"""What a report is made from: a fit read back, its samples, and the case that it was of."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.load import load_case
from exfit.case.schema import SINGLE
from exfit.errors import ExfitError
from exfit.fitting.build import build_experiment
from exfit.fitting.search import fitted
from exfit.fitting.setup import ExperimentSetup
from exfit.records.reading import file_hash
from exfit.results.io import Saved
from exfit.results.model import Overlay
from exfit.workflows import inputs

Array = NDArray[np.float64]

SHOWN = 12  # digits of a hash that tell files apart


@dataclass(frozen=True, eq=False)
class Samples:
    """What a table of samples holds: ``time`` (M,) in s, and an overlay of each signal."""

    time: Array
    overlays: Mapping[str, Overlay]


@dataclass(frozen=True, eq=False)
class Sources:
    """A fit read back, its case, and the tests of the case with their records."""

    saved: Saved
    case: Case
    trials: tuple[ExperimentSetup, ...]
    validations: tuple[ExperimentSetup, ...]

    @property
    def folder(self) -> Path:
        """The folder that the fit left."""
        return self.saved.path.parent

    def samples(self, name: str) -> Samples | None:
        """Return the samples of a comparison; None where their table is not in the folder."""
        path = self.folder / ("response.csv" if name == SINGLE else f"{name}.csv")
        return read_samples(path) if path.is_file() else None


def sources(saved: Saved, case: Path | None = None) -> Sources:
    """Return what a report of a fit is made from.

    The case is looked for where the result says, from the working folder and from beside the
    result, unless ``case`` names it. Raises ExfitError where it is not found, or where the case or
    a record is another than the one that was fitted.
    """
    path = _found(saved) if case is None else case
    _refuse_changed(saved, path, file_hash(path), "inputs", "case")
    loaded = load_case(path)
    trials, _ = fitted(loaded)
    given = loaded.values()
    validations = tuple(build_experiment(loaded, one, given) for one in loaded.validations)
    files = {"case": path, "model": loaded.folder / str(loaded.model)}
    for label, trial in zip(_labels(loaded), (*trials, *validations), strict=True):
        files[label] = trial.record.source
    for label, found in inputs(loaded, *trials, *validations).items():
        _refuse_changed(saved, files[label], found, "inputs", label)
    return Sources(saved, loaded, trials, validations)


def read_samples(path: Path) -> Samples:
    """Return the samples of a table that a fit left; raises ExfitError where it holds others."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            header = next(csv.reader(file), [])
            columns = np.loadtxt(file, delimiter=",", ndmin=2).T
    except (OSError, ValueError) as error:
        raise ExfitError(f"{path}: not the samples of a fit: {error}") from None
    if not header or header[0] != "t" or len(header) != len(columns):
        raise ExfitError(f"{path}: not the samples of a fit: its columns are others")
    named = dict(zip(header, columns, strict=True))
    signals = [name.removesuffix("_measured") for name in header if name.endswith("_measured")]
    overlays = {
        one: Overlay(named[f"{one}_measured"], named[f"{one}_simulated"], named.get(f"{one}_start"))
        for one in signals
        if f"{one}_simulated" in named
    }
    return Samples(columns[0], overlays)


def _labels(case: Case) -> Sequence[str]:
    """Return what a result calls the records of a case."""
    fitted = ["record"] if not case.records else [f"records.{one.name}" for one in case.records]
    return [*fitted, *(f"validate.{one.name}" for one in case.validations)]


def _found(saved: Saved) -> Path:
    """Return where the case of a result is: the file that was fitted before another of its name."""
    told = Path(str(saved.at("case")))
    beside = saved.path.parent
    places = [told, beside / told, beside / told.name]
    there = [place for place in places if place.is_file()]
    if not there:
        raise ExfitError(f"{saved.path}: its case {told} is not there; give --case FILE")
    wanted = saved.at("inputs", "case")
    return next((place for place in there if file_hash(place) == wanted), there[0])


def _refuse_changed(saved: Saved, path: Path, found: str, *place: str) -> None:
    """Raise ExfitError where a file is not the one that was fitted."""
    wanted = str(saved.at(*place))
    if found != wanted:
        raise ExfitError(
            f"{path}: not the file that {saved.path} is the fit of: its SHA-256 begins with "
            f"{found[:SHOWN]}, that of the {place[-1]} was {wanted[:SHOWN]}; fit again"
        )
