"""The channels of a COMTRADE record: the time, analog channels in their units, status channels."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.comtrade.data import BITS, MISSING_STAMP, ComtradeSamples
from exfit.records.formats.comtrade.files import ComtradeFiles
from exfit.records.formats.table import Array, column_error

if TYPE_CHECKING:
    from comtrade import AnalogChannel, Cfg

MISSING = {  # what a missing sample reads as
    "ASCII": 99999.0,
    "BINARY": -(2.0**15),
    "BINARY32": -(2.0**31),
    "FLOAT32": float(np.finfo(np.float32).min),
}
MISSING_1991 = -1.0  # 0xFFFF
NANOSECONDS = 1e-9


def time_of(parts: ComtradeFiles, config: "Cfg", samples: ComtradeSamples) -> Array:
    """Return the time (M,) in s since the first sample."""
    if config.timestamp_critical or any(rate == 0.0 for rate, _ in config.sample_rates):
        return _stamped(parts, config, samples.stamp)
    time = np.empty(len(samples.number))
    first, before = 0, 0.0
    rates, ends = zip(*config.sample_rates, strict=True)
    for rate, last in zip(rates, (*ends[:-1], len(time)), strict=True):
        count = np.arange(last - first) + (first > 0)
        time[first:last] = before + count / rate
        first, before = last, float(time[last - 1])
    return time


def _stamped(parts: ComtradeFiles, config: "Cfg", stamp: NDArray[Any]) -> Array:
    """Return the time in s since the first sample, by the time stamps of the samples."""
    lost = np.flatnonzero((stamp == MISSING_STAMP) | ~np.isfinite(stamp))
    if lost.size:
        raise RecordError(
            f"{parts.sample(int(lost[0]))}: no time stamp, and {parts.cfg.name} gives no rate"
        )
    if config.time_base == NANOSECONDS and config.rev_year in ("", "1991", "1999"):
        raise RecordError(
            f"{parts.cfg}: its dates have ns, but the revision {config.rev_year or '1991'} counts "
            "time stamps in µs: the two contradict each other"
        )
    ticks = stamp.astype(np.float64)
    return np.asarray((ticks - ticks[0]) * (config.time_base * config.timemult), np.float64)


def analog_of(config: "Cfg", channel: "AnalogChannel", raw: NDArray[Any]) -> Array:
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


def status_of(parts: ComtradeFiles, config: "Cfg", samples: ComtradeSamples, at: int) -> Array:
    """Return a status channel (M,) as 0 and 1."""
    if config.ft.upper() != "ASCII":
        return np.asarray(samples.status[:, at // BITS] >> at % BITS & 1, np.float64)
    values = np.asarray(samples.status[:, at], np.float64)
    wrong = np.flatnonzero(~np.isin(values, (0.0, 1.0)) & ~np.isnan(values))
    if wrong.size:
        name, row = config.status_channels[at].name, int(wrong[0])
        raise column_error(parts.sample(row), name, f"{values[row]:g} is not 0 or 1")
    return values
