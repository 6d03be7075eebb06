"""The configuration of a COMTRADE record, its .cfg: checked, then read by the package comtrade."""

import io
import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from exfit.errors import RecordError
from exfit.records.formats.columns import missing_package
from exfit.records.formats.comtrade.files import ComtradeFiles

if TYPE_CHECKING:
    from comtrade import Cfg

REVISIONS = ("", "1991", "1999", "2001", "2013")  # without one it is 1991 (-1999, 5.3.1)
# of recorders: 1997 of a draft, 2000 as IEC 60255-24:2001 has it for an example, 0 of none
BY_CELLS = ("0", "1997", "2000")
KINDS = ("ASCII", "BINARY", "BINARY32", "FLOAT32")
ANALOG_CELLS = (10, 13)  # 1991, and since
STATUS_CELLS = (3, 4, 5)  # 1991, without the normal state, which is not used, and since
SLOWEST_RATE = 1e-6  # Hz: less is no sampling rate
TEXT_SHOWN = 60
CHANNEL_BYTES = 4000  # of a channel's description, while it is read

_COUNTS = re.compile(r"\s*(\d{1,6})\s*,\s*(\d{1,6})\s*[Aa]\s*,\s*(\d{1,6})\s*[Dd]\s*")
_NO_FRACTION = re.compile(r"(\d:\d\d:\d\d)(?=[ \t]*$)", re.MULTILINE)


def config_of(parts: ComtradeFiles) -> "Cfg":
    """Return the configuration as the package reads it, where its lines are as they should be.

    Raises RecordError for a line that cannot be, or the package comtrade missing.
    """
    try:
        from comtrade import Cfg
    except ImportError:
        raise missing_package(parts.path, "comtrade", "comtrade") from None
    _check_lines(parts)
    text = _with_known_revision(parts.text)
    text = _NO_FRACTION.sub(r"\1.0", text)  # the package fails where seconds have none
    stream = io.StringIO(text)
    config = Cfg(ignore_warnings=True)
    try:
        config.read(stream)
    except Exception as error:  # damaged lines make the package fail in many ways
        at = text.count("\n", 0, max(stream.tell() - 1, 0))
        line = [*text.split("\n"), ""][at][:TEXT_SHOWN]
        raise RecordError(f"{parts.line(at)}: {line!r} cannot be read: {error}") from None
    _check_config(parts, config)
    return config


def _check_lines(parts: ComtradeFiles) -> None:
    """Raise RecordError where a line has too many or too few cells, which the package fills."""
    lines = parts.text.rstrip().split("\n")
    _check_station(parts, lines[0])
    analog, status = _channel_counts(parts, lines)
    total = analog + status
    held = len(parts.data) + len(parts.text)
    parts.limit.check(held + CHANNEL_BYTES * total, f"{total} channels")
    if len(lines) < total + 2:
        raise RecordError(
            f"{parts.line(len(lines) - 1)}: the file ends here: {total} channels, but "
            f"{len(lines) - 2} lines"
        )
    kinds = [("analog", ANALOG_CELLS)] * analog + [("status", STATUS_CELLS)] * status
    for at, (kind, allowed) in enumerate(kinds, 2):
        count = lines[at].count(",") + 1
        if count not in allowed:
            raise RecordError(
                f"{parts.line(at)}: {count} cells for a channel ({kind}), not "
                f"{' or '.join(map(str, allowed))}"
            )


def _check_station(parts: ComtradeFiles, line: str) -> None:
    """Raise RecordError where the first line is not station, device and a known revision."""
    if not line.strip():
        raise RecordError(f"{parts.line(0)}: station, device and revision are missing")
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) not in (2, 3):
        raise RecordError(
            f"{parts.line(0)}: {len(cells)} cells in place of station, device, revision"
        )
    if len(cells) == 3 and cells[2] not in (*REVISIONS, *BY_CELLS):
        supported = ", ".join(REVISIONS[1:])
        raise RecordError(f"{parts.line(0)}: revision {cells[2]!r} is not one of {supported}")


def _with_known_revision(text: str) -> str:
    """Return a configuration with the revision that its first channel has the cells of."""
    station, counts, channel, *rest = text.split("\n")
    *first, revision = station.split(",")
    if len(first) < 2 or revision.strip() not in BY_CELLS:
        return text
    old = channel.count(",") + 1 in (ANALOG_CELLS[0], STATUS_CELLS[0])
    station = ",".join([*first, "1991" if old else "1999"])
    return "\n".join([station, counts, channel, *rest])


def _channel_counts(parts: ComtradeFiles, lines: Sequence[str]) -> tuple[int, int]:
    """Return the numbers of analog and status channels in the second line."""
    counts = _COUNTS.fullmatch(lines[1]) if len(lines) > 1 else None
    if counts is None:
        raise RecordError(f"{parts.line(1)}: the numbers of channels are missing, as in 6,4A,2D")
    total, analog, status = map(int, counts.groups())
    if total != analog + status or total == 0:
        raise RecordError(
            f"{parts.line(1)}: {total} channels, but {analog} analog and {status} status channels"
        )
    return analog, status


def _check_config(parts: ComtradeFiles, config: "Cfg") -> None:
    """Raise RecordError where a number of the configuration cannot be."""
    for at, channel in enumerate(config.analog_channels):
        if not (math.isfinite(channel.a) and math.isfinite(channel.b)):
            raise RecordError(
                f"{parts.line(at + 2)}: channel {channel.name!r}: a = {channel.a}, b = {channel.b}"
            )
    _check_rates(parts, config)
    multiplier = config.timemult
    if not (math.isfinite(multiplier) and multiplier > 0.0):
        raise RecordError(f"{parts.cfg}: a time multiplier of {multiplier}")
    if config.ft.upper() not in KINDS:
        raise RecordError(
            f"{parts.cfg}: data of the kind {config.ft!r}, not one of {', '.join(KINDS)}"
        )


def _check_rates(parts: ComtradeFiles, config: "Cfg") -> None:
    """Raise RecordError where a sampling rate, or the sample at which it ends, cannot be."""
    first = config.analog_count + config.status_count + 4
    if not config.sample_rates:
        raise RecordError(f"{parts.line(first - 1)}: {config.nrates} sampling rates")
    before = 0
    for at, (rate, last) in enumerate(config.sample_rates):
        if rate != 0.0 and not SLOWEST_RATE < rate < math.inf:
            raise RecordError(f"{parts.line(first + at)}: a sampling rate of {rate} Hz")
        if last <= before:
            raise RecordError(
                f"{parts.line(first + at)}: the rate ends at sample {last}, not after {before}"
            )
        before = last
