"""The data of a COMTRADE record, its .dat: text or binary, unconverted."""

import io
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import is_number, why_not
from exfit.records.formats.comtrade.files import ComtradeFiles
from exfit.records.formats.table import Array

if TYPE_CHECKING:
    from comtrade import Cfg

BITS = 16  # status channels per word
RAW = {"BINARY": "<i2", "BINARY32": "<i4", "FLOAT32": "<f4"}
MISSING_STAMP = 0xFFFFFFFF

_BLANK_CELL = re.compile(rb"(?<=,)[ \t]*(?=,|\r|\n|\Z)")


@dataclass(frozen=True)
class ComtradeSamples:
    """The data part, unconverted: each (M,), (M, analog) or (M, words or channels)."""

    number: NDArray[Any]
    stamp: NDArray[Any]
    analog: NDArray[Any]
    status: NDArray[Any]


def samples_of(parts: ComtradeFiles, config: "Cfg") -> ComtradeSamples:
    """Return the samples; raises RecordError where they are not those of the configuration."""
    read = _ascii if config.ft.upper() == "ASCII" else _binary
    samples = read(parts, config)
    rows, total = len(samples.number), config.sample_rates[-1][1]
    # some recorders count the last sample from 0; of one rate that is no matter
    counts_from_zero = len(config.sample_rates) == 1 and rows == total + 1
    if rows != total and not counts_from_zero:
        raise RecordError(f"{parts.dat}: {rows} samples, but {total} in {parts.cfg.name}")
    number = samples.number.astype(np.float64)
    jump = np.flatnonzero(number[1:] != number[:-1] + 1.0)
    if jump.size:
        at = int(jump[0]) + 1
        raise RecordError(
            f"{parts.sample(at)}: its number is {number[at]:.10g}, that of the sample "
            f"before {number[at - 1]:.10g}"
        )
    return samples


def _binary(parts: ComtradeFiles, config: "Cfg") -> ComtradeSamples:
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
    return ComtradeSamples(data["number"], data["stamp"], data["analog"], data["status"])


def _ascii(parts: ComtradeFiles, config: "Cfg") -> ComtradeSamples:
    """Return the samples of data in text, blank cells as nan."""
    width = 2 + config.analog_count + config.status_count
    lines = parts.data.count(b"\n") + 1
    parts.limit.check_columns([lines] * width, len(parts.data))
    data = parts.data.replace(b"\x1a", b"")
    try:
        cells = _loaded(data, width)
    except ValueError:
        data = _BLANK_CELL.sub(b"nan", data)
        _find_fault(parts, data, width)
        try:
            cells = _loaded(data, width)
        except ValueError as fault:  # lines that end with a sign that ends no line elsewhere
            raise RecordError(f"{parts.dat}: damaged: {fault}") from None
    if cells.shape[1] != width:
        _find_fault(parts, data, width)
    stamp = np.where(np.isnan(cells[:, 1]), MISSING_STAMP, cells[:, 1])
    analog = cells[:, 2 : 2 + config.analog_count]
    return ComtradeSamples(cells[:, 0], stamp, analog, cells[:, 2 + config.analog_count :])


def _loaded(data: bytes, width: int) -> Array:
    if not data.strip():
        return np.empty((0, width))
    text = io.TextIOWrapper(io.BytesIO(data), encoding="latin-1")
    return np.loadtxt(text, delimiter=",", comments=None, ndmin=2)


def _find_fault(parts: ComtradeFiles, data: bytes, width: int) -> None:
    """Raise RecordError for the first line of the data with a wrong cell, if any."""
    for at, line in enumerate(data.decode("latin-1").splitlines()):
        cells = line.split(",")
        if line.strip() and len(cells) != width:
            raise RecordError(
                f"{parts.dat}:{at + 1}: {len(cells)} cells, but {parts.cfg.name} has {width}"
            )
        for cell in cells if line.strip() else ():
            if not is_number(cell, comma=False):
                raise RecordError(f"{parts.dat}:{at + 1}: {why_not(cell, comma=False)}")
