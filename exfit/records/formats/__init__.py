"""Recorders' files, each kind read by a module of its own, all to the same table."""

from pathlib import Path

from exfit.errors import RecordError
from exfit.records.formats.table import RecordTable
from exfit.util.files import siblings

__all__ = ["PLAY_IN", "RecordTable", "open_table"]

COMTRADE = (".cfg", ".cff")
BESIDE_CFG = (".dat", ".hdr")  # text files too may be called so
PLAY_IN = ".plb"
WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")
IN_CHILD = {**dict.fromkeys(WORKBOOKS, "excel"), ".mat": "matlab", ".parquet": "parquet"}


def open_table(path: Path, sheet: str | None = None, memory: float | None = None) -> RecordTable:
    """Open a file of any kind that is known, by its suffix; ``sheet`` of a workbook.

    ``memory`` (GB) is what reading may take; None: 1 GB, or four times the file's size up to 4 GB.
    Raises RecordError for a file that cannot be read or needs more, and for a sheet of a file
    without sheets.
    """
    suffix = path.suffix.lower()
    if sheet is not None and suffix not in WORKBOOKS:
        raise RecordError(f"{path}: a sheet, {sheet!r}, is given, but only workbooks have sheets")
    if suffix in IN_CHILD:
        from exfit.records.formats.child import read_table

        return read_table(IN_CHILD[suffix], path, sheet, memory)
    if suffix in COMTRADE or (suffix in BESIDE_CFG and siblings(path, ".cfg")):
        from exfit.records.formats.comtrade import read_comtrade

        return read_comtrade(path, memory)
    if suffix == PLAY_IN:
        from exfit.records.formats.play_in import read_play_in

        return read_play_in(path, memory)
    from exfit.records.formats.text import read_text_table

    return read_text_table(path, memory)
