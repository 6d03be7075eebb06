"""COMTRADE records (IEEE Std C37.111-1991, -1999, -2013; IEC 60255-24).

A record is a configuration (.cfg), which is checked and then read by the package comtrade, and its
data (.dat), text or binary, in two files or in one (.cff).
"""

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
from exfit.records.formats.cells import is_number, stated, why_not
from exfit.records.formats.columns import Columns, missing_package
from exfit.records.formats.table import (
    MemoryLimit,
    RecordTable,
    column_error,
    memory_limit,
    read_bytes,
)
from exfit.records.units import unit_in
from exfit.util.arrays import Array
from exfit.util.files import siblings

if TYPE_CHECKING:
    from comtrade import Cfg

TIME = "time"
REVISIONS = ("", "1991", "1999", "2001", "2013")  # without one it is 1991 (-1999, 5.3.1)
# of recorders: 1997 of a draft, 2000 as IEC 60255-24:2001 has it for an example, 0 of none
BY_CELLS = ("0", "1997", "2000")
ANALOG_CELLS = (10, 13)  # 1991, and since
STATUS_CELLS = (3, 4, 5)  # 1991, without the normal state, which is not used, and since
SLOWEST_RATE = 1e-6  # Hz: less is no sampling rate
TEXT_SHOWN = 60
CHANNEL_BYTES = 4000  # of a channel's description, while it is read
BITS = 16  # status channels per word
RAW = {"BINARY": "<i2", "BINARY32": "<i4", "FLOAT32": "<f4"}
MISSING = {  # kind of data -> what a missing sample reads as
    "ASCII": 99999.0,
    "BINARY": -(2.0**15),
    "BINARY32": -(2.0**31),
    "FLOAT32": float(np.finfo(np.float32).min),
}
MISSING_1991 = -1.0  # 0xFFFF
MISSING_STAMP = 0xFFFFFFFF
NANOSECONDS = 1e-9

_SECTION = re.compile(
    rb"^--- *file type: *([a-z]+)(?: +([a-z0-9]+))?(?: *: *([0-9]{1,15}))? *---[ \t]*\r?\n",
    re.IGNORECASE | re.MULTILINE,
)
_COUNTS = re.compile(r"\s*(\d{1,6})\s*,\s*(\d{1,6})\s*[Aa]\s*,\s*(\d{1,6})\s*[Dd]\s*")
_NO_FRACTION = re.compile(r"(\d:\d\d:\d\d)(?=[ \t]*$)", re.MULTILINE)
_BLANK_CELL = re.compile(rb"(?<=,)[ \t]*(?=,|\r|\n|\Z)")


@dataclass(frozen=True)
class _Files:
    """The two halves of a record, whether they are two files or one; ``text`` is the first."""

    path: Path
    cfg: Path
    text: str
    first_line: int
    dat: Path
    data: bytes
    sha256: str
    limit: MemoryLimit

    def fault(self, at: int, what: str) -> RecordError:
        """Return the error of a line of the configuration, counted from 0."""
        return RecordError(f"{self.cfg}:{self.first_line + at}: {what}")


@dataclass(frozen=True)
class _Samples:
    """The data part, unconverted: each (M,), (M, analog) or (M, words or channels)."""

    number: NDArray[Any]
    stamp: NDArray[Any]
    analog: NDArray[Any]
    status: NDArray[Any]


def read_comtrade(path: Path, memory: float | None = None) -> RecordTable:
    """Return the table of a COMTRADE record: the time, the analog and the status channels.

    The columns are called by the channels' identifiers, after ``time`` in s, 0 at the first
    sample; the instant of the trigger, which the .cfg gives too, is no part of the table. The time
    follows the sampling rates, each the distance of a sample from the one before it, and the time
    stamps only where the .cfg gives no rate, as the standard defines it. Analog channels are
    a * x + b in the unit of the .cfg, primary or secondary as it says (PS), without the skew
    between channels; status channels are 0 or 1; missing samples are nan.

    Args:
        path: the .cfg or the .dat file, the other one beside it; or a .cff file.
        memory: what reading may take, GB.

    Raises:
        RecordError: a file that is missing, damaged or truncated or needs more memory, or the
            package comtrade missing.
    """
    files = _one_file(path, memory) if path.suffix.lower() == ".cff" else _two_files(path, memory)
    config = _configuration(files)
    samples = _samples(files, config)
    time = _time(files, config, samples)
    analog, status = config.analog_channels, config.status_channels
    ids = [channel.name or f"A{at + 1}" for at, channel in enumerate(analog)]
    ids += [channel.name or f"D{at + 1}" for at, channel in enumerate(status)]
    units = {name: unit_in(name) for name in ids}
    units |= {name: channel.uu for name, channel in zip(ids, analog, strict=False) if channel.uu}
    sample = f"{files.dat}: sample"

    def fetch(at: int) -> Array:
        if at == 0:
            return time
        if at <= len(analog):
            return _analog(config, at - 1, samples.analog)
        own = at - 1 - len(analog)
        if config.ft.upper() != "ASCII":
            return np.asarray(samples.status[:, own // BITS] >> own % BITS & 1, np.float64)
        values = np.asarray(samples.status[:, own], np.float64)
        wrong = np.flatnonzero(~np.isin(values, (0.0, 1.0)) & ~np.isnan(values))
        if wrong.size:
            row = int(wrong[0])
            what = f"{values[row]:g} is not 0 or 1"
            raise column_error(f"{sample} {row + 1}", status[own].name, what)
        return values

    return Columns(
        path=path,
        sha256=files.sha256,
        names=(TIME, *ids),
        units=stated(units) | {TIME: "s"},
        lengths=[len(time)] * (1 + len(ids)),
        fetch=fetch,
        sample=sample,
        time_columns=(TIME,),
        limit=files.limit,
        held=len(files.data) + samples.analog.nbytes,
    )


# ---- the files


def _two_files(path: Path, memory: float | None) -> _Files:
    """Return the parts of a record by its .cfg or its .dat; raises RecordError for another file."""
    kind = path.suffix.lower()
    if kind not in (".cfg", ".dat"):
        raise RecordError(f"{path}: a COMTRADE record is a .cfg with its .dat, or a .cff")
    memory_limit(path, memory)  # the file itself may be missing, or none
    cfg = path if kind == ".cfg" else _beside(path, ".cfg")
    dat = path if kind == ".dat" else _beside(path, ".dat")
    limit = memory_limit(cfg, memory, dat)
    text, data = read_bytes(cfg), read_bytes(dat)
    sha256 = hashlib.sha256(text + data).hexdigest()
    return _Files(path, cfg, _decoded(cfg, text), 1, dat, data, sha256, limit)


def _beside(path: Path, suffix: str) -> Path:
    """Return the file of the same name with another suffix, in capitals or not."""
    files = siblings(path, suffix)
    if not files:
        raise RecordError(f"{path}: {path.stem}{suffix} is missing beside it")
    if len(files) > 1:
        names = " and ".join(file.name for file in files)
        raise RecordError(f"{path}: more than one file may belong to it: {names}")
    return files[0]


def _one_file(path: Path, memory: float | None) -> _Files:
    """Return the parts of a .cff file (IEEE Std C37.111-2013, clause 9)."""
    limit = memory_limit(path, memory)
    whole = read_bytes(path)
    sections = {}
    for section in _SECTION.finditer(whole):
        sections[section[1].upper()] = section
        if section[1].upper() == b"DAT":  # what follows may be binary
            break
    for name in (b"CFG", b"DAT"):
        if name not in sections:
            raise RecordError(f"{path}: no line --- file type: {name.decode()} ---")
    cfg, dat = sections[b"CFG"], sections[b"DAT"]
    ends = [start for section in sections.values() if (start := section.start()) > cfg.start()]
    if not ends:
        raise RecordError(f"{path}: the data are before the configuration")
    data = whole[dat.end() :]
    if dat[3] is not None:
        size = int(dat[3])
        if len(data) < size:
            raise RecordError(f"{path}: {len(data)} of {size} bytes of data: it is cut off")
        data = data[:size]
    text = _decoded(path, whole[cfg.end() : min(ends)])
    first_line = whole.count(b"\n", 0, cfg.end()) + 1
    sha256 = hashlib.sha256(whole).hexdigest()
    return _Files(path, path, text, first_line, path, data, sha256, limit)


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


# ---- the configuration


def _configuration(files: _Files) -> "Cfg":
    """Return the configuration as the package reads it, where its lines are as they should be.

    Raises RecordError for a line that cannot be, or the package comtrade missing.
    """
    try:
        from comtrade import Cfg
    except ImportError:
        raise missing_package(files.path, "comtrade", "comtrade") from None
    _check_lines(files)
    text = files.text
    station, counts, channel, *rest = text.split("\n")
    *first, revision = station.split(",")
    if len(first) >= 2 and revision.strip() in BY_CELLS:
        old = channel.count(",") + 1 in (ANALOG_CELLS[0], STATUS_CELLS[0])
        known = ",".join([*first, "1991" if old else "1999"])
        text = "\n".join([known, counts, channel, *rest])
    text = _NO_FRACTION.sub(r"\1.0", text)  # the package fails where seconds have none
    stream = io.StringIO(text)
    config = Cfg(ignore_warnings=True)
    try:
        config.read(stream)
    except Exception as error:  # damaged lines make the package fail in many ways
        at = text.count("\n", 0, max(stream.tell() - 1, 0))
        line = [*text.split("\n"), ""][at][:TEXT_SHOWN]
        raise files.fault(at, f"{line!r} cannot be read: {error}") from None
    _check_numbers(files, config)
    return config


def _check_lines(files: _Files) -> None:
    """Raise RecordError where a line has too many or too few cells, which the package fills."""
    lines = files.text.rstrip().split("\n")
    if not lines[0].strip():
        raise files.fault(0, "station, device and revision are missing")
    cells = [cell.strip() for cell in lines[0].split(",")]
    if len(cells) not in (2, 3):
        raise files.fault(0, f"{len(cells)} cells instead of station, device, revision")
    if len(cells) == 3 and cells[2] not in (*REVISIONS, *BY_CELLS):
        supported = ", ".join(REVISIONS[1:])
        raise files.fault(0, f"revision {cells[2]!r} is not one of {supported}")
    counts = _COUNTS.fullmatch(lines[1]) if len(lines) > 1 else None
    if counts is None:
        raise files.fault(1, "the numbers of channels are missing, as in 6,4A,2D")
    total, analog, status = map(int, counts.groups())
    if total != analog + status or total == 0:
        raise files.fault(1, f"{total} channels, but {analog} analog and {status} status channels")
    held = len(files.data) + len(files.text)
    files.limit.check(held + CHANNEL_BYTES * total, f"{total} channels")
    if len(lines) < total + 2:
        raise files.fault(
            len(lines) - 1,
            f"the file ends here: {total} channels, but {len(lines) - 2} lines",
        )
    kinds = [("analog", ANALOG_CELLS)] * analog + [("status", STATUS_CELLS)] * status
    for at, (kind, allowed) in enumerate(kinds, 2):
        count = lines[at].count(",") + 1
        if count not in allowed:
            numbers = " or ".join(map(str, allowed))
            raise files.fault(at, f"{count} cells for a channel ({kind}), not {numbers}")


def _check_numbers(files: _Files, config: "Cfg") -> None:
    """Raise RecordError where a number of the configuration cannot be.

    So it is with factors, with sampling rates, and with the samples at which these end.
    """
    for at, channel in enumerate(config.analog_channels, 2):
        if not (math.isfinite(channel.a) and math.isfinite(channel.b)):
            raise files.fault(at, f"channel {channel.name!r}: a = {channel.a}, b = {channel.b}")
    first, before = config.analog_count + config.status_count + 4, 0
    if not config.sample_rates:
        raise files.fault(first - 1, f"{config.nrates} sampling rates")
    for at, (rate, last) in enumerate(config.sample_rates, first):
        if rate != 0.0 and not SLOWEST_RATE < rate < math.inf:
            raise files.fault(at, f"a sampling rate of {rate} Hz")
        if last <= before:
            raise files.fault(at, f"the rate ends at sample {last}, not after {before}")
        before = last
    multiplier = config.timemult
    if not (math.isfinite(multiplier) and multiplier > 0.0):
        raise RecordError(f"{files.cfg}: a time multiplier of {multiplier}")
    if config.ft.upper() not in MISSING:
        kinds = ", ".join(MISSING)
        raise RecordError(f"{files.cfg}: data of the kind {config.ft!r}, not one of {kinds}")


# ---- the data


def _samples(files: _Files, config: "Cfg") -> _Samples:
    """Return the samples; raises RecordError where they are not those of the configuration."""
    read = _ascii if config.ft.upper() == "ASCII" else _binary
    samples = read(files, config)
    rows, total = len(samples.number), config.sample_rates[-1][1]
    # some recorders count the last sample from 0; of one rate that is no matter
    counts_from_zero = len(config.sample_rates) == 1 and rows == total + 1
    if rows != total and not counts_from_zero:
        raise RecordError(f"{files.dat}: {rows} samples, but {total} in {files.cfg.name}")
    number = samples.number.astype(np.float64)
    jump = np.flatnonzero(number[1:] != number[:-1] + 1.0)
    if jump.size:
        at = int(jump[0]) + 1
        raise RecordError(
            f"{files.dat}: sample {at + 1}: its number is {number[at]:.10g}, that of the sample "
            f"before {number[at - 1]:.10g}"
        )
    return samples


def _binary(files: _Files, config: "Cfg") -> _Samples:
    layout = np.dtype(
        [
            ("number", "<u4"),
            ("stamp", "<u4"),
            ("analog", RAW[config.ft.upper()], (config.analog_count,)),
            ("status", "<u2", (-(-config.status_count // BITS),)),
        ]
    )
    rows, left = divmod(len(files.data), layout.itemsize)
    if left:
        raise RecordError(
            f"{files.dat}: {len(files.data)} bytes are {rows} samples of {layout.itemsize} bytes "
            f"and {left} bytes: it is cut off, or its channels are not those of {files.cfg.name}"
        )
    data = np.frombuffer(files.data, layout)
    return _Samples(data["number"], data["stamp"], data["analog"], data["status"])


def _ascii(files: _Files, config: "Cfg") -> _Samples:
    """Return the samples of data in text, blank cells as nan."""
    width = 2 + config.analog_count + config.status_count
    lines = files.data.count(b"\n") + 1
    files.limit.check_columns([lines] * width, len(files.data))
    data = files.data.replace(b"\x1a", b"")
    try:
        cells = _loaded(data, width)
    except ValueError:
        data = _BLANK_CELL.sub(b"nan", data)
        _find_fault(files, data, width)
        try:
            cells = _loaded(data, width)
        except ValueError as fault:  # lines that end with a sign that ends no line elsewhere
            raise RecordError(f"{files.dat}: damaged: {fault}") from None
    if cells.shape[1] != width:
        _find_fault(files, data, width)
    stamp = np.where(np.isnan(cells[:, 1]), MISSING_STAMP, cells[:, 1])
    analog, status = np.split(cells[:, 2:], [config.analog_count], axis=1)
    return _Samples(cells[:, 0], stamp, analog, status)


def _loaded(data: bytes, width: int) -> Array:
    if not data.strip():
        return np.empty((0, width))
    text = io.TextIOWrapper(io.BytesIO(data), encoding="latin-1")
    return np.loadtxt(text, delimiter=",", comments=None, ndmin=2)


def _find_fault(files: _Files, data: bytes, width: int) -> None:
    """Raise RecordError for the first line of the data with a wrong cell, if any."""
    for line, text in enumerate(data.decode("latin-1").splitlines(), 1):
        if not text.strip():
            continue
        cells = text.split(",")
        if len(cells) != width:
            what = f"{len(cells)} cells, but {files.cfg.name} has {width}"
            raise RecordError(f"{files.dat}:{line}: {what}")
        for cell in cells:
            if not is_number(cell, comma=False):
                raise RecordError(f"{files.dat}:{line}: {why_not(cell, comma=False)}")


# ---- the channels


def _time(files: _Files, config: "Cfg", samples: _Samples) -> Array:
    if config.timestamp_critical or any(rate == 0.0 for rate, _ in config.sample_rates):
        lost = np.flatnonzero((samples.stamp == MISSING_STAMP) | ~np.isfinite(samples.stamp))
        if lost.size:
            what = f"no time stamp, and {files.cfg.name} gives no rate"
            raise RecordError(f"{files.dat}: sample {lost[0] + 1}: {what}")
        if config.time_base == NANOSECONDS and config.rev_year in ("", "1991", "1999"):
            raise RecordError(
                f"{files.cfg}: its dates have ns, but the revision {config.rev_year or '1991'} "
                "counts time stamps in µs: the two contradict each other"
            )
        ticks = samples.stamp.astype(np.float64)
        return np.asarray((ticks - ticks[0]) * (config.time_base * config.timemult), np.float64)
    time = np.empty(len(samples.number))
    first, before = 0, 0.0
    rates, ends = zip(*config.sample_rates, strict=True)
    for rate, last in zip(rates, (*ends[:-1], len(time)), strict=True):
        count = np.arange(last - first) + (first > 0)
        time[first:last] = before + count / rate
        first, before = last, float(time[last - 1])
    return time


def _analog(config: "Cfg", at: int, raw: NDArray[Any]) -> Array:
    """Return an analog channel (M,) in its unit, nan where a sample is missing."""
    kind, channel = config.ft.upper(), config.analog_channels[at]
    mark: float | None = MISSING[kind]
    if config.rev_year in ("", "1991"):
        # 0xFFFF is also -1: missing only in a channel whose range does not hold that
        out_of_range = not channel.cmin <= MISSING_1991 <= channel.cmax
        mark = MISSING_1991 if kind == "BINARY" and out_of_range else None
    with np.errstate(over="ignore", invalid="ignore"):
        values = raw[:, at].astype(np.float64) * channel.a + channel.b
    if mark is not None:
        values[raw[:, at] == mark] = np.nan
    return np.asarray(values, np.float64)
