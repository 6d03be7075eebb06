"""Records: signals per unit, measured on one clock."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from exfit.errors import RecordError
from exfit.records.clock import check_increasing, check_steps, why_unusable
from exfit.util.arrays import Array
from exfit.util.text import LARGEST

FEWEST_SAMPLES = 2


@dataclass(frozen=True, eq=False)
class Record:
    """Signals in per unit, each (M,) like ``time`` in s, which increases; arrays are read-only.

    A missing sample is nan; only signals may have any, and only where the caller allowed it. A
    signal of waveforms is ``averaged`` over a window (s) about each instant, by signal. ``notes``
    say what was left out when it was read.
    """

    time: Array
    signals: Mapping[str, Array]
    source: Path
    sha256: str
    averaged: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return the source, the signals and the time that they cover, in one line."""
        span = f"{len(self.time)} samples, {self.time[0]:g} ... {self.time[-1]:g} s"
        return f"<Record {self.source.name}: {', '.join(self.signals)}; {span}>"

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        signals: Mapping[str, ArrayLike],
        source: str | Path = "arrays",
        missing: bool = False,
    ) -> Self:
        """Return the record of signals in arrays, of which it keeps copies.

        Args:
            time: (M,), s, increasing.
            signals: signal name -> samples (M,), per unit.
            source: what messages and results name in place of a file.
            missing: whether a sample may be missing from a signal: nan.

        Raises:
            RecordError: fewer than two samples, no signal or one without any sample, arrays that
                are not one-dimensional, real and equally long, a value that is no finite number,
                or time that does not increase.
        """
        source = Path(source)
        if not signals:
            raise RecordError(f"{source}: no signals")
        if "time" in signals:
            raise RecordError(f"{source}: a signal cannot be named time")
        instants = _real_array(source, "time", time)
        samples = {name: _real_array(source, name, signal) for name, signal in signals.items()}
        if len(instants) < FEWEST_SAMPLES:
            raise RecordError(
                f"{source}: {len(instants)} samples; at least {FEWEST_SAMPLES} are needed"
            )
        for name, values in {"time": instants, **samples}.items():
            if len(values) != len(instants):
                count = f"{len(values)} samples, but time has {len(instants)}"
                raise RecordError(f"{source}: {name}: {count}")
            gaps = np.isnan(values) & (missing and name in samples)
            if gaps.all():
                raise RecordError(f"{source}: {name}: every sample is missing")
            lost = np.flatnonzero(~(np.abs(values) <= LARGEST) & ~gaps)
            if lost.size:
                number = values[lost[0]]
                what = f"{name}: {number} {why_unusable(number)}"
                raise RecordError(f"{source}: sample {lost[0]}: {what}")
        check_increasing(instants, "time", lambda row: f"{source}: sample {row}")
        check_steps(instants, "time", lambda row: f"{source}: sample {row}")
        digest = hashlib.sha256(instants.astype("<f8").tobytes())
        for name in sorted(samples):
            digest.update(b"\0" + name.encode() + b"\0" + samples[name].astype("<f8").tobytes())
        return cls(instants, MappingProxyType(samples), source, digest.hexdigest())


def read_only(values: Array) -> Array:
    """Return an array that lies in one piece and cannot be changed any more."""
    values = np.ascontiguousarray(values)
    values.flags.writeable = False
    return values


def _real_array(source: Path, name: str, values: ArrayLike) -> Array:
    """Return a read-only copy (M,) of real numbers; raises RecordError for anything else."""
    given = np.asarray(values)
    if given.ndim != 1:
        raise RecordError(f"{source}: {name}: {given.ndim} dimensions instead of 1")
    if not np.can_cast(given.dtype, np.float64, "same_kind"):
        raise RecordError(f"{source}: {name}: {given.dtype} instead of real numbers")
    return read_only(np.array(given, np.float64))
