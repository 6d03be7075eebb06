"""Records: signals measured on one clock, read from a CSV file with one row of column names."""

import csv
import hashlib
import io
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError

Array = NDArray[np.float64]

FEWEST_SAMPLES = 2
COLUMNS_SHOWN = 30
CELL_SHOWN = 40
NONE: frozenset[str] = frozenset()


class ChannelLike(Protocol):
    """Where a signal stands in a file and how it becomes per unit."""

    @property
    def column(self) -> str:
        """Name of the column."""

    @property
    def scale(self) -> float:
        """Factor on the column's numbers."""

    @property
    def offset(self) -> float:
        """What is added after scaling."""


@dataclass(frozen=True, eq=False)
class Record:
    """Signals in per unit, each (M,) like ``time`` in s, which increases; arrays are read-only.

    A sample that is missing is nan, in a signal and only where ``read_record`` was told so.
    """

    time: Array
    signals: Mapping[str, Array]
    source: Path
    sha256: str


@dataclass(frozen=True)
class _Table:
    """A CSV file as text: its column names, and the rows below them from ``first_line`` on."""

    path: Path
    names: tuple[str, ...]
    body: str
    first_line: int
    sha256: str

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield line number and cells of each row, one by one: slow, to say where a fault is."""
        reader = csv.reader(io.StringIO(self.body, newline=""))
        try:
            for row in reader:
                if row:
                    yield self.first_line + reader.line_num - 1, row
        except csv.Error as error:
            line = self.first_line + reader.line_num - 1
            raise RecordError(f"{self.path}:{line}: cannot be read: {error}") from None

    def refuse(self, row: int, what: str) -> NoReturn:
        """Raise a RecordError for a row, counted from 0."""
        line = next(line for at, (line, _) in enumerate(self.rows()) if at == row)
        raise RecordError(f"{self.path}:{line}: {what}")


def read_record(
    path: Path,
    time_column: str,
    channels: Mapping[str, ChannelLike],
    window: tuple[float, float] | None = None,
    missing: bool = False,
) -> Record:
    """Return the record of a CSV file: each signal is ``column * scale + offset``.

    Args:
        path: comma separated, UTF-8, one row of column names.
        time_column: name of the column with the time in s.
        channels: signal name -> column, scale and offset.
        window: first and last instant kept, both included; what lies outside it may hold gaps.
        missing: whether a sample may be missing from a signal: an empty cell or nan becomes nan.

    Raises:
        RecordError: a file that cannot be read, a column that is missing, a cell that is no finite
            number, time that does not increase, fewer than two samples, or a signal without any.
    """
    table = _read_table(path)
    names = [time_column, *(channel.column for channel in channels.values())]
    columns = _columns(table, names, frozenset(names[1:]) - {time_column} if missing else NONE)
    time = columns[time_column]
    _check_time(table, time_column, time)
    kept = _kept(path, time, window)
    signals = {
        name: _signal(table, channel, columns[channel.column], kept, missing)
        for name, channel in channels.items()
    }
    return Record(_frozen(time[kept]), MappingProxyType(signals), path, table.sha256)


def read_columns(path: Path, names: Iterable[str]) -> dict[str, Array]:
    """Return columns of a CSV file by name, as they stand; raises RecordError like read_record."""
    return {name: _frozen(column) for name, column in _columns(_read_table(path), names).items()}


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file's bytes; raises RecordError where it cannot be read."""
    return hashlib.sha256(_read_bytes(path)).hexdigest()


def _read_table(path: Path) -> _Table:
    data = _read_bytes(path)
    text = _decode(path, data)
    if not text.strip():
        raise RecordError(f"{path}: the file is empty: a row of column names belongs there")
    stream = io.StringIO(text, newline="")
    header = csv.reader(stream)
    try:
        names = tuple(name.strip() for name in next(header))
    except csv.Error as error:
        raise RecordError(f"{path}:1: column names that cannot be read: {error}") from None
    if not any(names):
        raise RecordError(f"{path}:1: the first line is empty: column names belong there")
    body = stream.read().rstrip("\n")
    if not body.strip():
        raise RecordError(f"{path}: no samples below the column names")
    return _Table(path, names, body, header.line_num + 1, hashlib.sha256(data).hexdigest())


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:  # a name with a null character
        raise RecordError(f"{path}: cannot be read: {error}") from None


def _decode(path: Path, data: bytes) -> str:
    """Return the text with line ends of one kind."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise RecordError(
            f"{path}:{line}: not UTF-8 text: byte 0x{data[error.start]:02x}"
        ) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RecordError(f"{path}:{line}: not text: byte 0x00")
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def _columns(table: _Table, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
    """Return the columns by name; cells of the ``gappy`` ones may be empty."""
    places = {name: _place(table, name) for name in names}
    if _uneven(table):
        _find_fault(table, places, gappy)
    data = _load(table, places, gappy)
    return {name: data[:, at] for at, name in enumerate(places)}


def _load(
    table: _Table,
    places: Mapping[str, int],
    gappy: frozenset[str],
    cell_by_cell: frozenset[str] = NONE,
) -> Array:
    """Return the columns as NumPy's C reader reads them; where it stumbles, say where and why.

    Where only empty cells of the ``gappy`` columns stopped it, these are read cell by cell: slow.
    """
    try:
        return np.loadtxt(
            io.StringIO(table.body),
            delimiter=",",
            quotechar='"',
            comments=None,
            usecols=tuple(places.values()),
            ndmin=2,
            converters={places[name]: _number_or_nan for name in cell_by_cell},
        )
    except ValueError as error:
        _find_fault(table, places, gappy)
        if cell_by_cell != gappy:
            return _load(table, places, gappy, gappy)
        raise RecordError(f"{table.path}: {error}") from None


def _number_or_nan(cell: str) -> float:
    return float(cell) if cell.strip() else np.nan


def _place(table: _Table, name: str) -> int:
    """Return the position of a column."""
    found = [at for at, known in enumerate(table.names) if known == name]
    if not found:
        known = ", ".join(repr(name) for name in table.names[:COLUMNS_SHOWN])
        more = f" and {len(table.names) - COLUMNS_SHOWN} more"
        shown = known + (more if len(table.names) > COLUMNS_SHOWN else "")
        single = "; columns are separated by commas" if len(table.names) == 1 else ""
        raise RecordError(f"{table.path}: no column {name!r}; the columns are {shown}{single}")
    if len(found) > 1:
        places = " and ".join(str(at + 1) for at in found)
        raise RecordError(f"{table.path}: {name!r} names more than one column: {places}")
    return found[0]


def _uneven(table: _Table) -> bool:
    """Tell whether any row may have more or fewer cells than there are column names."""
    characters = np.frombuffer(table.body.encode() + b"\n", np.uint8)
    commas = np.flatnonzero(characters == ord(","))
    ends = np.flatnonzero(characters == ord("\n"))
    per_line = np.diff(np.searchsorted(commas, ends), prepend=0)
    return bool(np.any(per_line != len(table.names) - 1))


def _find_fault(table: _Table, places: Mapping[str, int], gappy: frozenset[str]) -> None:
    """Raise a RecordError for the first row that is ragged or holds text in a number, if any."""
    for line, row in table.rows():
        if len(row) != len(table.names):
            raise RecordError(
                f"{table.path}:{line}: cells in this row: {len(row)}, columns: {len(table.names)}"
            )
        for name, place in places.items():
            cell = row[place].strip()
            if not _is_number(row[place]) and (cell or name not in gappy):
                what = f"{cell[:CELL_SHOWN]!r} is not a number" if cell else "an empty cell"
                raise RecordError(f"{table.path}:{line}: column {name!r}: {what}")


def _is_number(cell: str) -> bool:
    """Tell whether a cell is a number to NumPy too: ASCII, and no 1_000."""
    try:
        float(cell)
    except ValueError:
        return False
    return cell.isascii() and "_" not in cell


def _check_time(table: _Table, column: str, time: Array) -> None:
    """Raise a RecordError where time is not finite or does not increase."""
    lost = np.flatnonzero(~np.isfinite(time))
    if lost.size:
        table.refuse(lost[0], f"column {column!r}: {time[lost[0]]} is not a finite number")
    back = np.flatnonzero(time[1:] <= time[:-1])
    if back.size:
        before, now = time[back[0]], time[back[0] + 1]
        kind = "repeats" if now == before else "goes back behind"
        table.refuse(
            back[0] + 1, f"column {column!r}: time {now} s {kind} the {before} s before it"
        )


def _kept(path: Path, time: Array, window: tuple[float, float] | None) -> NDArray[np.intp]:
    """Return the positions of the samples in the window."""
    start, end = window or (time[0], time[-1])
    kept = np.flatnonzero((time >= start) & (time <= end))
    if kept.size < FEWEST_SAMPLES:
        place = f" in the window {start:g} ... {end:g} s" if window else ""
        raise RecordError(
            f"{path}: {kept.size} of {time.size} samples ({time[0]:g} ... {time[-1]:g} s)"
            f"{place}; at least {FEWEST_SAMPLES} are needed"
        )
    return kept


def _signal(
    table: _Table, channel: ChannelLike, column: Array, kept: NDArray[np.intp], missing: bool
) -> Array:
    """Return a channel in per unit; raises RecordError where it is not finite, nor missing."""
    with np.errstate(over="ignore", invalid="ignore"):
        signal = column[kept] * channel.scale + channel.offset
    gaps = np.isnan(column[kept]) & missing
    if gaps.all():
        raise RecordError(f"{table.path}: column {channel.column!r}: every sample is missing")
    lost = np.flatnonzero(~np.isfinite(signal) & ~gaps)
    if lost.size:
        row = int(kept[lost[0]])
        scaled = "" if not np.isfinite(column[row]) else f" * {channel.scale:g}"
        table.refuse(
            row, f"column {channel.column!r}: {column[row]}{scaled} is not a finite number"
        )
    return _frozen(signal)


def _frozen(values: Array) -> Array:
    values = np.ascontiguousarray(values)
    values.flags.writeable = False
    return values
