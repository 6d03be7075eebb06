"""Phasors of a PMU: voltage, angle and power in per unit as further columns of its file."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.three_phase import Connection
from exfit.errors import RecordError
from exfit.records.angles import AngleError, in_radians, unwrapped
from exfit.records.formats.table import NONE, Array, RecordTable, column_error
from exfit.records.units import alike, scale_between
from exfit.signals import OF_CURRENT_PHASOR, OF_PHASORS, OF_VOLTAGE_PHASOR, PHASOR_COLUMNS

Complex = NDArray[np.complex128]

TURN = np.exp(2j * np.pi / 3.0)  # by which phase a leads phase b


class Phasor(NamedTuple):
    """The columns of a phasor: of its positive sequence, or of its three phases in their order.

    ``unit`` is that of the magnitudes, ``angle_unit`` deg or rad. A voltage is rms, from phase to
    ground or from phase to phase, by its ``connection``.
    """

    magnitudes: tuple[str, ...]
    angles: tuple[str, ...]
    unit: str
    angle_unit: str
    connection: Connection | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns."""
        return (*self.magnitudes, *self.angles)


class Phasors(NamedTuple):
    """The voltage and the current of a unit, and its ratings: kV from line to line, MVA."""

    voltage: Phasor
    current: Phasor | None = None
    kv: float | None = None
    mva: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The columns that are computed."""
        signals = OF_VOLTAGE_PHASOR if self.current is None else OF_PHASORS
        return tuple(PHASOR_COLUMNS + signal for signal in signals)


@dataclass(frozen=True, eq=False)
class PhasorTable:
    """A RecordTable with the columns that are computed of its phasors: ``phasors.vt`` and others.

    The voltage ``vt``, the power ``p`` and ``q`` and the current ``it`` are per unit, of the
    positive sequence; ``angle`` is that of the voltage in rad.
    """

    table: RecordTable
    phasors: Phasors

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    @property
    def sha256(self) -> str:
        """The hash of its bytes."""
        return self.table.sha256

    @property
    def names(self) -> tuple[str, ...]:
        """The columns of the file, and those that are computed."""
        return (*self.table.names, *self.phasors.names)

    @property
    def units(self) -> Mapping[str, str]:
        """The units that the file gives, by column; those that are computed need none."""
        return self.table.units

    @property
    def clock(self) -> tuple[str, ...]:
        """The column that holds the time, or two."""
        return self.table.clock

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns (M,), nan where a sample is missing in a ``gappy`` one.

        Raises RecordError as the file's own table does, for a column in another unit than the
        phasors are said to be in, and for a magnitude that is negative.
        """
        names = [*names]
        computed = [name for name in names if name in self.phasors.names]
        own = self.table.numbers([name for name in names if name not in computed], gappy)
        if not computed:
            return own
        derived = self._computed(computed, bool(gappy.intersection(computed)))
        return {name: own[name] if name in own else derived[name] for name in names}

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s."""
        return self.table.instants(columns, unit)

    def place(self, row: int) -> str:
        """Return the place of a sample, counted from 0."""
        return self.table.place(row)

    def _computed(self, names: Sequence[str], may_lack: bool) -> dict[str, Array]:
        """Return the columns that are computed; nan where a sample may be missing and is."""
        voltage = self._positive_sequence(self.phasors.voltage, may_lack)
        signals = {"vt": np.abs(voltage), "angle": np.angle(voltage)}
        if len(self.phasors.voltage.angles) == 1:  # as recorded, also where the voltage is lost
            (angle,), unit = self.phasors.voltage.angles, self.phasors.voltage.angle_unit
            gappy = frozenset([angle]) if may_lack else NONE
            signals["angle"] = in_radians(self.table.numbers([angle], gappy)[angle], unit)
        current = self.phasors.current
        if current is not None and any(
            name.removeprefix(PHASOR_COLUMNS) in OF_CURRENT_PHASOR for name in names
        ):
            amperes = self._positive_sequence(current, may_lack)
            power = voltage * np.conj(amperes)
            of_power = (power.real, power.imag, np.abs(amperes))
            signals |= dict(zip(OF_CURRENT_PHASOR, of_power, strict=True))
        return {name: np.asarray(signals[name.removeprefix(PHASOR_COLUMNS)]) for name in names}

    def _positive_sequence(self, phasor: Phasor, may_lack: bool) -> Complex:
        """Return the positive sequence (M,) of a phasor, per unit of the ratings."""
        for column in phasor.magnitudes:
            self._check_unit(column, phasor.unit)
        for column in phasor.angles:
            self._check_unit(column, phasor.angle_unit)
        gappy = frozenset(phasor.columns) if may_lack else NONE
        columns = self.table.numbers(dict.fromkeys(phasor.columns), gappy)
        phases = []
        for magnitude, angle in zip(phasor.magnitudes, phasor.angles, strict=True):
            self._check_magnitude(magnitude, columns[magnitude])
            phases.append(
                columns[magnitude] * np.exp(1j * in_radians(columns[angle], phasor.angle_unit))
            )
        whole = sum(phase * TURN**k for k, phase in enumerate(phases)) / len(phases)
        return np.asarray(whole / self._base(phasor))

    def _base(self, phasor: Phasor) -> float:
        """Size of 1 pu in the unit of a phasor's magnitudes."""
        kv, mva = self.phasors.kv, self.phasors.mva
        if alike(phasor.unit, "pu"):
            return 1.0
        if phasor is self.phasors.voltage:
            assert kv is not None
            line = kv * (scale_between("kV", phasor.unit) or 1.0)
            return line / sqrt(3.0) if phasor.connection == "phase-to-ground" else line
        assert kv is not None
        assert mva is not None
        return mva / (sqrt(3.0) * kv) * (scale_between("kA", phasor.unit) or 1.0)

    def _check_unit(self, column: str, unit: str) -> None:
        """Raise a RecordError where the file gives a column another unit."""
        stated = self.table.units.get(column)
        if stated is not None and not alike(stated, unit):
            raise column_error(self.path, column, f"in {stated} as the file says, not in {unit}")

    def _check_magnitude(self, name: str, samples: Array) -> None:
        """Raise a RecordError where a magnitude is negative."""
        negative = np.flatnonzero(samples < 0.0)
        if negative.size:
            row = int(negative[0])
            what = f"{samples[row]:g} is no magnitude of a phasor, which cannot be negative"
            raise column_error(self.place(row), name, what)


def smooth_angle(place: Callable[[int], str], label: str, angle: Array) -> Array:
    """Return angles (M,) in rad without jumps by whole turns; raises RecordError with the place."""
    try:
        return unwrapped(angle)
    except AngleError as fault:
        remedy = "give a faster record, or leave samples out that are none (record.window, status)"
        raise RecordError(f"{place(fault.row)}: {label}: {fault}: {remedy}") from None
