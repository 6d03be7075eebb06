"""COMTRADE records (IEEE Std C37.111-1991, -1999, -2013; IEC 60255-24)."""

from pathlib import Path
from typing import TYPE_CHECKING

from exfit.records.formats.cells import stated
from exfit.records.formats.columns import Columns
from exfit.records.formats.comtrade.channels import analog_of, status_of, time_of
from exfit.records.formats.comtrade.configuration import config_of
from exfit.records.formats.comtrade.data import ComtradeSamples, samples_of
from exfit.records.formats.comtrade.files import ComtradeFiles, files_of
from exfit.records.formats.table import Array, RecordTable
from exfit.records.units import unit_in

if TYPE_CHECKING:
    from comtrade import Cfg

TIME = "time"


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
    parts = files_of(path, memory)
    config = config_of(parts)
    return _table(parts, config, samples_of(parts, config))


def _table(parts: ComtradeFiles, config: "Cfg", samples: ComtradeSamples) -> Columns:
    time = time_of(parts, config, samples)
    held = len(parts.data) + samples.analog.nbytes
    analog, status = config.analog_channels, config.status_channels

    def fetch(at: int) -> Array:
        if at == 0:
            return time
        if at <= len(analog):
            return analog_of(config, analog[at - 1], samples.analog[:, at - 1])
        return status_of(parts, config, samples, at - 1 - len(analog))

    ids = [channel.name or f"A{at + 1}" for at, channel in enumerate(analog)]
    ids += [channel.name or f"D{at + 1}" for at, channel in enumerate(status)]
    units = {name: unit_in(name) for name in ids}
    units |= {name: channel.uu for name, channel in zip(ids, analog, strict=False) if channel.uu}
    return Columns(
        path=parts.path,
        sha256=parts.sha256,
        names=(TIME, *ids),
        units=stated(units) | {TIME: "s"},
        fetch=fetch,
        where=parts.sample,
        refuse_larger=lambda columns: parts.limit.check_columns([len(time)] * len(columns), held),
        time_columns=(TIME,),
    )
