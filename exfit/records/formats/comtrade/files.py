"""The files of a COMTRADE record: a configuration and its data, in two files or in one."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from exfit.errors import RecordError
from exfit.records.formats.memory import MemoryLimit, memory_limit
from exfit.records.formats.table import read_bytes
from exfit.util.files import siblings

_SECTION = re.compile(
    rb"^--- *file type: *([a-z]+)(?: +([a-z0-9]+))?(?: *: *([0-9]{1,15}))? *---[ \t]*\r?\n",
    re.IGNORECASE | re.MULTILINE,
)


@dataclass(frozen=True)
class ComtradeFiles:
    """The two halves of a record, whether they are two files or one."""

    path: Path
    cfg: Path
    text: str
    first_line: int
    dat: Path
    data: bytes
    sha256: str
    limit: MemoryLimit

    def line(self, at: int) -> str:
        """Return the place of a line of the configuration, counted from 0."""
        return f"{self.cfg}:{self.first_line + at}"

    def sample(self, row: int) -> str:
        """Return the place of a sample, counted from 0."""
        return f"{self.dat}: sample {row + 1}"


def files_of(path: Path, memory: float | None = None) -> ComtradeFiles:
    """Return the parts of a record, by its .cfg, its .dat or its .cff file.

    ``memory`` (GB) is what reading may take. Raises RecordError for a file of another kind, and
    where one is missing, cut off or too large.
    """
    kind = path.suffix.lower()
    if kind not in (".cfg", ".dat", ".cff"):
        raise RecordError(f"{path}: a COMTRADE record is a .cfg with its .dat, or a .cff")
    return _one_file(path, memory) if kind == ".cff" else _two_files(path, memory)


def _two_files(path: Path, memory: float | None) -> ComtradeFiles:
    memory_limit(path, memory)  # the file itself may be missing, or none
    if path.suffix.lower() == ".cfg":
        cfg, dat = path, _beside(path, ".dat")
    else:
        cfg, dat = _beside(path, ".cfg"), path
    limit = memory_limit(cfg, memory, dat)
    text, data = read_bytes(cfg), read_bytes(dat)
    sha256 = hashlib.sha256(text + data).hexdigest()
    return ComtradeFiles(path, cfg, _decoded(cfg, text), 1, dat, data, sha256, limit)


def _beside(path: Path, suffix: str) -> Path:
    """Return the file of the same name with another suffix, in capitals or not."""
    files = siblings(path, suffix)
    if not files:
        raise RecordError(f"{path}: {path.stem}{suffix} is missing beside it")
    if len(files) > 1:
        names = " and ".join(file.name for file in files)
        raise RecordError(f"{path}: more than one file may belong to it: {names}")
    return files[0]


def _one_file(path: Path, memory: float | None) -> ComtradeFiles:
    """Return the parts of a .cff file (IEEE Std C37.111-2013, clause 9)."""
    limit = memory_limit(path, memory)
    whole = read_bytes(path)
    sections = {}
    for section in _SECTION.finditer(whole):
        sections[section[1].upper().decode()] = section
        if section[1].upper() == b"DAT":  # what follows may be binary
            break
    for name in ("CFG", "DAT"):
        if name not in sections:
            raise RecordError(f"{path}: no line --- file type: {name} ---")
    cfg, dat = sections["CFG"], sections["DAT"]
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
    return ComtradeFiles(
        path, path, text, first_line, path, data, hashlib.sha256(whole).hexdigest(), limit
    )


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
