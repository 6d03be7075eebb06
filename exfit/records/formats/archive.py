"""ZIP archives, as workbooks are: unpacked within a limit of memory, whatever they declare."""

import io
import zipfile
from collections.abc import Mapping

from exfit.records.formats.memory import MemoryLimit

WHILE_UNPACKED = 3  # times an entry's bytes: itself, packed anew, and as its reader holds it
MOST_ENTRIES = 10_000
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


class ArchiveError(Exception):
    """An archive that cannot be used."""


def unpacked(data: bytes, limit: MemoryLimit) -> dict[str, bytes]:
    """Return the entries of an archive by name.

    Raises TooLargeError where they need too much memory, and ArchiveError or errors of zipfile and
    zlib for what is damaged.
    """
    entries: dict[str, bytes] = {}
    held = len(data)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if len(archive.filelist) > MOST_ENTRIES:
            raise ArchiveError(f"{len(archive.filelist)} entries; at most {MOST_ENTRIES} are read")
        for entry in archive.filelist:
            name, size = entry.filename, entry.file_size
            if name in entries:
                raise ArchiveError(f"it has two entries {name!r}")
            if entry.compress_type not in METHODS:
                raise ArchiveError(f"its entry {name!r} is compressed by another method")
            held += WHILE_UNPACKED * size
            limit.check(held, f"its entry {name!r} of {size} bytes, unpacked")
            with archive.open(entry) as file:
                entries[name] = file.read(size)  # one that is longer has another checksum
    return entries


def packed(entries: Mapping[str, bytes]) -> io.BytesIO:
    """Return an archive of entries, not compressed."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in entries.items():
            archive.writestr(zipfile.ZipInfo(name), data)
    stream.seek(0)
    return stream
