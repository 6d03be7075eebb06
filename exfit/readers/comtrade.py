"""COMTRADE records (IEEE Std C37.111-1991, -1999, -2013; IEC 60255-24)."""

import hashlib
import io
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.readers.columns import Columns, needed, read_bytes
from exfit.readers.table import Array, Table

if TYPE_CHECKING:
    from comtrade import AnalogChannel, Cfg

TIME = "time"
REVISIONS = ("", "1991", "1999", "2001", "2013")  # none stands for 1991 (-1999, 5.3.1)
ANALOG_CELLS = (10, 13)  # 1991, and since
STATUS_CELLS = (3, 5)
BITS = 16  # status channels per word
RAW = {"BINARY": "<i2", "BINARY32": "<i4", "FLOAT32": "<f4"}
MISSING_STAMP = 0xFFFFFFFF
MISSING = {  # what a missing sample reads as
    "ASCII": 99999.0,
    "BINARY": -(2.0**15),
    "BINARY32": -(2.0**31),
    "FLOAT32": float(np.finfo(np.float32).min),
}
MISSING_1991 = -1.0  # 0xFFFF
NANOSECONDS = 1e-9
SLOWEST = 1e-6  # Hz: less is no sampling rate
TEXT_SHOWN = 60
EMPTY = "an empty cell"

_COUNTS = re.compile(r"\s*(\d{1,6})\s*,\s*(\d{1,6})\s*[Aa]\s*,\s*(\d{1,6})\s*[Dd]\s*")
_SECTION = re.compile(
    rb"^--- *file type: *([a-z]+)(?: +([a-z0-9]+))?(?: *: *([0-9]{1,15}))? *---[ \t]*\r?\n",
    re.IGNORECASE | re.MULTILINE,
)
_NO_FRACTION = re.compile(r"(\d:\d\d:\d\d)(?=[ \t]*$)", re.MULTILINE)
_BLANK_CELL = re.compile(rb"(?<=,)[ \t]*(?=,|\r|\n|\Z)")


@dataclass(frozen=True)
class _Parts:
    """The two halves of a record, whether they are two files or one."""

    path: Path
    cfg: Path
    text: str
    first_line: int
    dat: Path
    data: bytes
    sha256: str

    def line(self, at: int) -> str:
        """Return the place of a line of the configuration, counted from 0."""
        return f"{self.cfg}:{self.first_line + at}"


@dataclass(frozen=True)
class _Samples:
    """The data part as it stands: each (M,), (M, analog) or (M, words or channels)."""

    number: NDArray[Any]
    stamp: NDArray[Any]
    analog: NDArray[Any]
    status: NDArray[Any]


def read_comtrade(path: Path) -> Table:
    """Return the table of a COMTRADE record: the time, the analog and the status channels.

    The columns are called by the channels' identifiers, after ``time`` in s, 0 at the first
    sample; the instant of the trigger, which the .cfg gives too, is no part of the table. The time
    follows the sampling rates, each the distance of a sample from the one before it, and the time
    stamps only where the .cfg gives no rate, as the standard has it. Analog channels are
    a * x + b in the unit of the .cfg, primary or secondary as it says (PS), without the skew
    between channels; status channels are 0 or 1; missing samples are nan.

    Args:
        path: the .cfg or the .dat file, the other one beside it; or a .cff file.

    Raises:
        RecordError: a file that is missing, damaged or truncated, or the package comtrade missing.
    """
    kind = path.suffix.lower()
    if kind not in (".cfg", ".dat", ".cff"):
        raise RecordError(f"{path}: a COMTRADE record is a .cfg with its .dat, or a .cff")
    parts = _of_one_file(path) if kind == ".cff" else _of_two_files(path)
    config = _config(parts)
    return _table(parts, config, _samples(parts, config))


def _table(parts: _Parts, config: "Cfg", samples: _Samples) -> Columns:
    time = _time(parts, config, samples)
    analog, status = config.analog_channels, config.status_channels

    def fetch(at: int) -> Array:
        if at == 0:
            return time
        if at <= len(analog):
            return _analog(config, analog[at - 1], samples.analog[:, at - 1])
        return _status(parts, config, samples, at - 1 - len(analog))

    ids = [channel.name or f"A{at + 1}" for at, channel in enumerate(analog)]
    ids += [channel.name or f"D{at + 1}" for at, channel in enumerate(status)]
    units = {name: channel.uu for name, channel in zip(ids, analog, strict=False) if channel.uu}
    return Columns(
        path=parts.path,
        sha256=parts.sha256,
        names=(TIME, *ids),
        units=units | {TIME: "s"},
        clock=(TIME,),
        fetch=fetch,
        where=lambda row: _place(parts, row),
    )


def _place(parts: _Parts, row: int) -> str:
    return f"{parts.dat}: sample {row + 1}"


def _of_two_files(path: Path) -> _Parts:
    found = read_bytes(path)
    if path.suffix.lower() == ".cfg":
        cfg, dat, text = path, _beside(path, ".dat"), found
        data = read_bytes(dat)
    else:
        cfg, dat, data = _beside(path, ".cfg"), path, found
        text = read_bytes(cfg)
    sha256 = hashlib.sha256(text + data).hexdigest()
    return _Parts(path, cfg, _decoded(cfg, text), 1, dat, data, sha256)


def _beside(path: Path, suffix: str) -> Path:
    """Return the file of the same name with another suffix, in capitals or not."""
    wanted = (path.stem + suffix).lower()
    found = [one for one in sorted(path.parent.iterdir()) if one.name.lower() == wanted]
    found = [one for one in found if one.stem == path.stem] or found
    if not found:
        raise RecordError(f"{path}: {path.stem}{suffix} is not beside it")
    if len(found) > 1:
        names = " and ".join(one.name for one in found)
        raise RecordError(f"{path}: more than one file may belong to it: {names}")
    return found[0]


def _of_one_file(path: Path) -> _Parts:
    """Return the parts of a .cff file (IEEE Std C37.111-2013, clause 9)."""
    whole = read_bytes(path)
    sections = {}
    for found in _SECTION.finditer(whole):
        sections[found[1].upper().decode()] = found
        if found[1].upper() == b"DAT":  # what follows may be binary
            break
    for name in ("CFG", "DAT"):
        if name not in sections:
            raise RecordError(f"{path}: no line --- file type: {name} ---")
    cfg, dat = sections["CFG"], sections["DAT"]
    ends = [found.start() for found in sections.values() if found.start() > cfg.start()]
    if not ends:
        raise RecordError(f"{path}: the data stand before the configuration")
    data = whole[dat.end() :]
    if dat[3] is not None:
        data = _cut(path, data, int(dat[3]))
    text = _decoded(path, whole[cfg.end() : min(ends)])
    first_line = whole.count(b"\n", 0, cfg.end()) + 1
    return _Parts(path, path, text, first_line, path, data, hashlib.sha256(whole).hexdigest())


def _cut(path: Path, data: bytes, size: int) -> bytes:
    if len(data) < size:
        raise RecordError(f"{path}: {len(data)} of {size} bytes of data: it is cut off")
    return data[:size]


def _decoded(path: Path, text: bytes) -> str:
    """Return a configuration as text with line ends of one kind; latin-1 where it is not UTF-8."""
    if b"\0" in text:
        line = text.count(b"\n", 0, text.index(b"\0")) + 1
        raise RecordError(f"{path}:{line}: not text: byte 0x00")
    try:
        decoded = text.decode("utf-8-sig")
    except UnicodeDecodeError:
        decoded = text.decode("latin-1")
    return decoded.replace("\r\n", "\n").replace("\r", "\n").replace("\x1a", "")


def _config(parts: _Parts) -> "Cfg":
    """Return the configuration as the package reads it, where its lines are as they should be."""
    try:
        from comtrade import Cfg
    except ImportError:
        raise needed(parts.path, "comtrade", "comtrade") from None
    _check_lines(parts)
    text = _NO_FRACTION.sub(r"\1.0", parts.text)  # the package fails where seconds have none
    stream = io.StringIO(text)
    config = Cfg(ignore_warnings=True)
    try:
        config.read(stream)
    except Exception as error:  # a damaged line fails in the package in many ways
        at = text.count("\n", 0, max(stream.tell() - 1, 0))
        line = [*text.split("\n"), ""][at][:TEXT_SHOWN]
        raise RecordError(f"{parts.line(at)}: {line!r} cannot be read: {error}") from None
    _check_config(parts, config)
    return config


def _check_lines(parts: _Parts) -> None:
    """Raise RecordError where a line has too many or too few cells, which the package fills."""
    lines = parts.text.rstrip().split("\n")
    if not lines[0].strip():
        raise RecordError(f"{parts.line(0)}: station, device and revision are missing")
    cells = [cell.strip() for cell in lines[0].split(",")]
    if len(cells) not in (2, 3):
        raise RecordError(f"{parts.line(0)}: {len(cells)} cells: station, device, revision")
    if len(cells) == 3 and cells[2] not in REVISIONS:
        known = ", ".join(REVISIONS[1:])
        raise RecordError(f"{parts.line(0)}: revision {cells[2]!r} is none of {known}")
    counts = _COUNTS.fullmatch(lines[1]) if len(lines) > 1 else None
    if counts is None:
        raise RecordError(f"{parts.line(1)}: the numbers of channels are missing, as in 6,4A,2D")
    total, analog, status = map(int, counts.groups())
    if total != analog + status or total == 0:
        raise RecordError(
            f"{parts.line(1)}: {total} channels, but {analog} analog and {status} status channels"
        )
    if len(lines) < total + 2:
        raise RecordError(
            f"{parts.line(len(lines) - 1)}: it ends here: {total} channels, {len(lines) - 2} lines"
        )
    for at in range(2, total + 2):
        kind, allowed = ("analog", ANALOG_CELLS) if at < analog + 2 else ("status", STATUS_CELLS)
        count = lines[at].count(",") + 1
        if count not in allowed:
            raise RecordError(
                f"{parts.line(at)}: {count} cells of an {kind} channel, not "
                f"{' or '.join(map(str, allowed))}"
            )


def _check_config(parts: _Parts, config: "Cfg") -> None:
    """Raise RecordError where a number of the configuration cannot be."""
    for at, channel in enumerate(config.analog_channels):
        if not (math.isfinite(channel.a) and math.isfinite(channel.b)):
            raise RecordError(
                f"{parts.line(at + 2)}: channel {channel.name!r}: a = {channel.a}, b = {channel.b}"
            )
    first = config.analog_count + config.status_count + 4
    if not config.sample_rates:
        raise RecordError(f"{parts.line(first - 1)}: {config.nrates} sampling rates")
    before = 0
    for at, (rate, last) in enumerate(config.sample_rates):
        if rate != 0.0 and not SLOWEST < rate < math.inf:
            raise RecordError(f"{parts.line(first + at)}: a sampling rate of {rate} Hz")
        if last <= before:
            raise RecordError(
                f"{parts.line(first + at)}: the rate ends at sample {last}, not behind {before}"
            )
        before = last
    multiplier = config.timemult
    if not (math.isfinite(multiplier) and multiplier > 0.0):
        raise RecordError(f"{parts.cfg}: a time multiplier of {multiplier}")
    if config.ft.upper() not in MISSING:
        raise RecordError(
            f"{parts.cfg}: data of the kind {config.ft!r}, which is none of {', '.join(MISSING)}"
        )


def _samples(parts: _Parts, config: "Cfg") -> _Samples:
    read = _ascii if config.ft.upper() == "ASCII" else _binary
    samples = read(parts, config)
    rows, total = len(samples.number), config.sample_rates[-1][1]
    if rows != total:
        raise RecordError(f"{parts.dat}: {rows} samples, but {total} in {parts.cfg.name}")
    number = samples.number.astype(np.float64)
    jump = np.flatnonzero(number[1:] != number[:-1] + 1.0)
    if jump.size:
        at = int(jump[0]) + 1
        raise RecordError(
            f"{_place(parts, at)}: it is numbered {number[at]:.0f} and the one before "
            f"{number[at - 1]:.0f}"
        )
    return samples


def _binary(parts: _Parts, config: "Cfg") -> _Samples:
    """Return the samples of binary data."""
    layout = np.dtype(
        [
            ("number", "<u4"),
            ("stamp", "<u4"),
            ("analog", RAW[config.ft.upper()], (config.analog_count,)),
            ("status", "<u2", (-(-config.status_count // BITS),)),
        ]
    )
    rows, left = divmod(len(parts.data), layout.itemsize)
    if left:
        raise RecordError(
            f"{parts.dat}: {len(parts.data)} bytes are {rows} samples of {layout.itemsize} bytes "
            f"and {left} bytes: it is cut off, or its channels are not those of {parts.cfg.name}"
        )
    data = np.frombuffer(parts.data, layout)
    return _Samples(data["number"], data["stamp"], data["analog"], data["status"])


def _ascii(parts: _Parts, config: "Cfg") -> _Samples:
    """Return the samples of data in text, blank cells as nan."""
    width = 2 + config.analog_count + config.status_count
    data = parts.data.replace(b"\x1a", b"")
    try:
        cells = _loaded(data, width)
    except ValueError:
        data = _BLANK_CELL.sub(b"nan", data)
        _find_fault(parts, data, width)
        cells = _loaded(data, width)
    if cells.shape[1] != width:
        _find_fault(parts, data, width)
    stamp = np.where(np.isnan(cells[:, 1]), MISSING_STAMP, cells[:, 1])
    analog = cells[:, 2 : 2 + config.analog_count]
    return _Samples(cells[:, 0], stamp, analog, cells[:, 2 + config.analog_count :])


def _loaded(data: bytes, width: int) -> Array:
    if not data.strip():
        return np.empty((0, width))
    text = io.TextIOWrapper(io.BytesIO(data), encoding="latin-1")
    return np.loadtxt(text, delimiter=",", comments=None, ndmin=2)


def _find_fault(parts: _Parts, data: bytes, width: int) -> None:
    """Raise RecordError for the first line of the data with a wrong cell, if any."""
    for at, line in enumerate(data.decode("latin-1").splitlines()):
        cells = line.split(",")
        if line.strip() and len(cells) != width:
            raise RecordError(
                f"{parts.dat}:{at + 1}: {len(cells)} cells, but {width} by {parts.cfg.name}"
            )
        for cell in cells if line.strip() else ():
            if not _is_number(cell):
                what = f"{cell.strip()[:TEXT_SHOWN]!r} is not a number"
                raise RecordError(f"{parts.dat}:{at + 1}: {what if cell.strip() else EMPTY}")


def _is_number(cell: str) -> bool:
    """Tell whether a cell is a number to NumPy too: ASCII, and no 1_000."""
    try:
        float(cell)
    except ValueError:
        return False
    return cell.isascii() and "_" not in cell


def _time(parts: _Parts, config: "Cfg", samples: _Samples) -> Array:
    """Return the time (M,) in s since the first sample."""
    if config.timestamp_critical or any(rate == 0.0 for rate, _ in config.sample_rates):
        return _stamped(parts, config, samples.stamp)
    time = np.empty(len(samples.number))
    first, before = 0, 0.0
    for rate, last in config.sample_rates:
        count = np.arange(last - first) + (first > 0)
        time[first:last] = before + count / rate
        first, before = last, float(time[last - 1])
    return time


def _stamped(parts: _Parts, config: "Cfg", stamp: NDArray[Any]) -> Array:
    """Return the time in s since the first sample, by the time stamps of the samples."""
    lost = np.flatnonzero((stamp == MISSING_STAMP) | ~np.isfinite(stamp))
    if lost.size:
        raise RecordError(
            f"{_place(parts, int(lost[0]))}: no time stamp, and {parts.cfg.name} gives no rate"
        )
    if config.time_base == NANOSECONDS and config.rev_year in ("", "1991", "1999"):
        raise RecordError(
            f"{parts.cfg}: its dates have ns, but the revision {config.rev_year or '1991'} counts "
            "time stamps in µs: which of them holds is not said"
        )
    ticks = stamp.astype(np.float64)
    return np.asarray((ticks - ticks[0]) * (config.time_base * config.timemult), np.float64)


def _analog(config: "Cfg", channel: "AnalogChannel", raw: NDArray[Any]) -> Array:
    """Return an analog channel (M,) in its unit, nan where a sample is missing."""
    kind = config.ft.upper()
    mark: float | None = MISSING[kind]
    if config.rev_year in ("", "1991"):
        # 0xFFFF is also -1: missing only in a channel whose range does not hold that
        out_of_range = not channel.cmin <= MISSING_1991 <= channel.cmax
        mark = MISSING_1991 if kind == "BINARY" and out_of_range else None
    with np.errstate(over="ignore", invalid="ignore"):
        values = raw.astype(np.float64) * channel.a + channel.b
    if mark is not None:
        values[raw == mark] = np.nan
    return np.asarray(values, np.float64)


def _status(parts: _Parts, config: "Cfg", samples: _Samples, at: int) -> Array:
    """Return a status channel (M,) as 0 and 1."""
    if config.ft.upper() != "ASCII":
        return np.asarray(samples.status[:, at // BITS] >> at % BITS & 1, np.float64)
    values = np.asarray(samples.status[:, at], np.float64)
    wrong = np.flatnonzero(~np.isin(values, (0.0, 1.0)) & ~np.isnan(values))
    if wrong.size:
        name, row = config.status_channels[at].name, int(wrong[0])
        raise RecordError(f"{_place(parts, row)}, column {name!r}: {values[row]:g} is not 0 or 1")
    return values
