"""What a phasor measurement unit records: phasors, the angle of the voltage, flags of its frames.

Voltage, angle and power of its phasors are computed in per unit, as further columns of the file.
"""

from collections.abc import Iterable, Iterator, Mapping
from math import pi, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from exfit.errors import RecordError
from exfit.records.formats.cells import quoted
from exfit.records.formats.table import NONE, RecordTable, column_error, listed
from exfit.records.formats.text import TextTable
from exfit.records.units import alike, scale_between
from exfit.signals import OF_CURRENT_PHASOR, OF_PHASORS, OF_VOLTAGE_PHASOR, PHASOR_COLUMNS
from exfit.util.arrays import Array, Complex, Places, median_step

if TYPE_CHECKING:
    from exfit.dsp.three_phase import Connection


TURN = np.exp(2j * np.pi / 3.0)  # by which phase a leads phase b
TURNS = {"deg": 360.0, "rad": 2.0 * pi}  # of a turn in a unit
MOST_BETWEEN_SAMPLES = 0.25  # turns: an angle that moves farther may have been wrapped or not
LEAST_MOVE = 2e-3  # Hz, rms: with less neither shows the other
SMOOTHED_OVER = 0.2  # s
LIKE_FREQUENCY = (0.5, 2.0)  # times what the frequency moves by
ALIKE = 0.5  # correlation
# bits of the word STAT of a frame (IEEE Std C37.118.2-2011, table 7)
BITS: Mapping[int, str] = {
    0x8000: "data error", 0x4000: "data error or test mode", 0x2000: "not in synchronism with UTC",
    0x1000: "sorted by arrival, not by time",
}  # fmt: skip
WORD = 1 << 16  # a word is smaller
GOOD_WORDS = frozenset(("good", "ok", "valid", "g", "normal"))


class Phasor(NamedTuple):
    """The columns of a phasor: of its positive sequence, or of its three phases in their order.

    ``unit`` is that of the magnitudes, ``angle_unit`` deg or rad. A voltage is rms, from phase to
    ground or from phase to phase, by its ``connection``.
    """

    magnitudes: tuple[str, ...]
    angles: tuple[str, ...]
    unit: str
    angle_unit: str
    connection: "Connection | None" = None


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


class Status(NamedTuple):
    """The column of the flags, and its entries that are good; () for those of C37.118."""

    column: str
    accept: tuple[str, ...] = ()


class BadRow(NamedTuple):
    """A row that is no measurement, and its flag."""

    row: int
    flag: str
    why: str


class AngleError(ValueError):
    """A fault of the angles between a sample, counted from 0, and the one before."""

    def __init__(self, row: int, text: str) -> None:
        super().__init__(text)
        self.row = row


def numbers_with_phasors(
    table: RecordTable, phasors: Phasors, names: Iterable[str], gappy: frozenset[str] = NONE
) -> dict[str, Array]:
    """Return columns (M,) of a file, and those that are computed of its phasors, as phasors.vt.

    The voltage ``vt``, the power ``p`` and ``q`` and the current ``it`` are per unit, of the
    positive sequence; ``angle`` is that of the voltage in rad. A sample may be missing from the
    ``gappy`` ones. Raises RecordError as the table does, for a column in another unit than the
    phasors are said to be in, and for a magnitude that is negative.
    """
    names = [*names]
    signals = {name: name.removeprefix(PHASOR_COLUMNS) for name in names if name in phasors.names}
    columns = table.numbers([name for name in names if name not in signals], gappy)
    if not signals:
        return columns
    may_lack = bool(gappy.intersection(signals))
    voltage = _positive_sequence(table, phasors, phasors.voltage, may_lack)
    computed = {"vt": np.abs(voltage), "angle": np.angle(voltage)}
    if len(phasors.voltage.angles) == 1:  # as recorded, also where the voltage is lost
        own = table.numbers(
            phasors.voltage.angles, frozenset(phasors.voltage.angles if may_lack else ())
        )
        (angle,) = own.values()
        computed["angle"] = in_radians(angle, phasors.voltage.angle_unit)
    if phasors.current is not None and {*OF_CURRENT_PHASOR}.intersection(signals.values()):
        current = _positive_sequence(table, phasors, phasors.current, may_lack)
        power = voltage * np.conj(current)
        of_power = (power.real, power.imag, np.abs(current))
        computed |= dict(zip(OF_CURRENT_PHASOR, of_power, strict=True))
    return {
        name: np.asarray(computed[signals[name]]) if name in signals else columns[name]
        for name in names
    }


def _positive_sequence(
    table: RecordTable, phasors: Phasors, phasor: Phasor, may_lack: bool
) -> Complex:
    """Return the positive sequence (M,) of a phasor, per unit of the ratings."""
    units = dict.fromkeys(phasor.magnitudes, phasor.unit)
    units |= dict.fromkeys(phasor.angles, phasor.angle_unit)
    for column, unit in units.items():
        stated = table.units.get(column)
        if stated is not None and not alike(stated, unit):
            raise column_error(table.path, column, f"in {stated} as the file says, not in {unit}")
    columns = table.numbers(units, frozenset(units if may_lack else ()))
    phases = []
    for magnitude, angle in zip(phasor.magnitudes, phasor.angles, strict=True):
        samples = columns[magnitude]
        negative = np.flatnonzero(samples < 0.0)
        if negative.size:
            row = int(negative[0])
            what = f"{samples[row]:g} is no magnitude of a phasor, which cannot be negative"
            raise column_error(table.place(row), magnitude, what)
        phases.append(samples * np.exp(1j * in_radians(columns[angle], phasor.angle_unit)))
    whole = sum(phase * TURN**k for k, phase in enumerate(phases)) / len(phases)
    base, kv, mva = 1.0, phasors.kv, phasors.mva  # of 1 pu in the unit of the magnitudes
    if not alike(phasor.unit, "pu"):
        assert kv is not None
        if phasor is phasors.voltage:
            base = kv * (scale_between("kV", phasor.unit) or 1.0)
            base = base / sqrt(3.0) if phasor.connection == "phase-to-ground" else base
        else:
            assert mva is not None
            base = mva / (sqrt(3.0) * kv) * (scale_between("kA", phasor.unit) or 1.0)
    return np.asarray(whole / base)


# ---- the angle


def in_radians(angle: Array, unit: str) -> Array:
    """Return angles (M,) in rad, given in deg or rad."""
    return np.asarray(angle * (2.0 * pi / TURNS[unit]))


def unwrapped(angle: Array) -> Array:
    """Return angles (M,) in rad without jumps by whole turns; nan stays where it is.

    Raises AngleError where an angle moves by more than a quarter of a turn from one sample to the
    next: it is not known then by how many turns.
    """
    present = np.flatnonzero(np.isfinite(angle))
    smooth = np.array(angle, np.float64)
    turns = np.diff(smooth[present]) / (2.0 * pi)
    moves = turns - np.round(turns)
    far = np.flatnonzero(np.abs(moves) > MOST_BETWEEN_SAMPLES)
    if far.size:
        row = int(present[far[0] + 1])
        raise AngleError(
            row,
            f"the angle moves by {abs(360.0 * moves[far[0]]):.0f} degrees (to whole turns) from "
            f"one sample to the next ({far.size} times in the record); beyond "
            f"{360.0 * MOST_BETWEEN_SAMPLES:.0f} its turns cannot be counted",
        )
    if present.size:
        steps = 2.0 * pi * moves
        smooth[present] = smooth[present[0]] + np.concatenate([[0.0], np.cumsum(steps)])
    return smooth


def wraps(angle: Array, unit: str) -> int:
    """Count the jumps of angles (M,) by most of a turn of their unit."""
    jumps = np.abs(np.diff(angle[np.isfinite(angle)]))
    return int(np.count_nonzero(jumps > 0.75 * TURNS[unit]))


def unit_by_range(angle: Array) -> str | None:
    """Return the unit in which wrapped angles (M,) are: deg or rad, by the size of their jumps.

    None without jumps by a turn: an angle that is not wrapped may have any range in either.
    """
    if wraps(angle, "deg"):
        return "deg"
    largest = float(np.max(np.abs(angle), initial=0.0, where=np.isfinite(angle)))
    return "rad" if largest <= TURNS["rad"] and wraps(angle, "rad") else None


def angle_findings(time: Array, name: str, angle: Array, frequency: Array | None) -> Iterator[str]:
    """Find what is wrong with an angle (M,) in rad beside the recorded frequency (M,) in Hz."""
    try:
        smooth = unwrapped(angle)
    except AngleError as fault:
        yield f"{name}: at {time[fault.row]:.6g} s {fault}"
        return
    if frequency is None:
        return
    present = np.isfinite(smooth) & np.isfinite(frequency)
    t, f = time[present], _smoothed(time[present], frequency[present])
    rate = _smoothed(t, np.gradient(smooth[present], t) / (2.0 * pi))
    f, rate = f - np.mean(f), rate - np.mean(rate)
    sizes = [float(np.sqrt(np.mean(y * y))) for y in (rate, f)]
    if max(sizes) < LEAST_MOVE:
        return
    ratio = sizes[0] / max(sizes[1], 1e-12)
    alike = float(rate @ f) / max(len(f) * sizes[0] * sizes[1], 1e-300)
    low, high = LIKE_FREQUENCY
    if not low <= ratio <= high:
        yield (
            f"{name}: turns {ratio:.3g} times as fast as the recorded frequency moves, not {low:g} "
            f"... {high:g}: degrees taken for radians are 57.3 times as fast, mHz for Hz 1000 times"
        )
    elif alike < -ALIKE:
        yield (
            f"{name}: turns against the recorded frequency (correlation {alike:.2f}): scale: -1 on "
            "the channel angle turns it"
        )
    elif alike < ALIKE:
        yield (
            f"{name}: does not turn as the recorded frequency moves (correlation {alike:.2f}, not "
            f"above {ALIKE:g}): is it the angle of the same voltage, and not relative to another?"
        )


def _smoothed(time: Array, samples: Array) -> Array:
    """Return a signal (M,) averaged over a short time about each instant."""
    width = max(round(SMOOTHED_OVER / median_step(time)), 1)
    padded = np.pad(samples, (width // 2, width - 1 - width // 2), mode="edge")
    return np.convolve(padded, np.ones(width) / width, "valid")


def smooth_angle(table: RecordTable, column: str, angle: Array, rows: Places) -> Array:
    """Return the angle (M,) in rad at rows (M,) of a file without jumps by whole turns.

    Raises RecordError with the place where its turns cannot be counted.
    """
    try:
        return unwrapped(angle)
    except AngleError as fault:
        place = table.place(int(rows[fault.row]))
        remedy = "give a faster record, or leave out invalid samples (record.window, status)"
        raise RecordError(f"{place}: column {column!r}: {fault}: {remedy}") from None


# ---- the flags


def leave_out_bad(
    table: RecordTable, status: Status, columns: dict[str, Array], rows: Places, missing: bool
) -> None:
    """Put nan into those of the given rows that their flags call bad.

    Raises RecordError where no sample may be missing.
    """
    considered = {*rows.tolist()}
    bad = [row for row in bad_rows(table, status) if row.row in considered]
    if bad and not missing:
        first = bad[0]
        raise column_error(
            table.place(first.row),
            status.column,
            f"status {quoted(first.flag)}: {first.why} ({len(bad)} rows are not valid); "
            "gaps: skip leaves them out, record.window begins or ends beside them",
        )
    for name in columns if bad else ():
        columns[name] = np.array(columns[name])
        columns[name][[row.row for row in bad]] = np.nan


def bad_rows(table: RecordTable, status: Status) -> tuple[BadRow, ...]:
    """Return the rows of a file that its flags call bad.

    Numbers, also hexadecimal as 0x2000, are the word STAT of C37.118: bad are those with a data
    error, without synchronism or sorted by arrival. Of other words those are good that say so.
    Raises RecordError for a column that is not there, and for flags 0 and 1, which may mean either,
    without ``accept``.
    """
    flags = _flags(table, status.column)
    kinds = {flag: _plain(flag) for flag in {*flags}}
    if status.accept:
        good = {_plain(entry) for entry in status.accept}
        refused = f"accepted: {listed(status.accept)}"
        why = {flag: "" if kinds[flag] in good else refused for flag in kinds}
    elif {*kinds.values()} in ({0, 1}, {1}):
        what = "contains 0 and 1: give the one that means valid under record.status.accept"
        raise column_error(table.path, status.column, what)
    else:
        why = {flag: _fault(kind) for flag, kind in kinds.items()}
    return tuple(BadRow(row, flag, why[flag]) for row, flag in enumerate(flags) if why[flag])


def _flags(table: RecordTable, column: str) -> list[str]:
    try:
        return [f"{flag:.0f}" for flag in table.numbers([column])[column]]
    except RecordError:
        if column not in table.names or not isinstance(table, TextTable):
            raise
    at = table.names.index(column)
    return [cells[at] for _, cells in table.rows() if at < len(cells)]


def _plain(flag: str) -> int | str:
    """Return the number that a flag is, in decimal or hexadecimal digits, or its word."""
    text = flag.strip().casefold()
    try:
        if text.startswith("0x"):
            return int(text, 16)
        if text.endswith("h"):
            return int(text[:-1], 16)
        return int(float(text))
    except (ValueError, OverflowError):
        return text


def _fault(flag: int | str) -> str:
    """Describe the fault of a row by its flag, "" where there is none."""
    if isinstance(flag, str):
        return "" if flag in GOOD_WORDS else "not one of good, ok, valid"
    if not 0 <= flag < WORD:
        return f"no word of 16 bits: 0 ... {WORD - 1}"
    return " and ".join(text for bit, text in BITS.items() if flag & bit)
