"""Files that are read up to a size, and that appear whole or not at all; those of JSON, too.

A worker of a cluster lays the files of a case out in a folder of its own, which stands for the
root: it reads them there by the paths that the user gave, so that no result and no message names
another.
"""

import json
import os
import re
import stat
import sys
import time
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable, Mapping
from contextlib import suppress
from errno import EINVAL, EISDIR, ENOTDIR
from pathlib import Path
from typing import Any, NoReturn
from zlib import crc32

from exfit.errors import ExfitError, FileError
from exfit.util.interrupts import deferred_interrupts

ROOT = "EXFIT_LAID_OUT"  # the variable of the environment that names the folder; its real path
LARGEST_FILE = 128_000_000  # bytes; a result of a hundred long records has about as many
MOST_PARTS = 2_000_000  # texts, lists and mappings; a result has some thousand
LONGEST_INTEGER = 400  # digits; a longer one, which no double may hold, stays a text
HALF_CHARACTER = re.compile(r"\\u[dD][89a-fA-F]")
# of a file that is still to be renamed: computer, process, and which of its files
TEMPORARY = re.compile(r"\.exfit-([0-9a-f]{8})-([0-9]+)-[0-9a-f]{8}\.tmp")
# has links to what a program reads and writes
STREAMS = None if sys.platform == "win32" else Path("/dev")
ABANDONED = 86_400.0  # s: so old, a temporary file of any computer is of a run that was killed


def on_disk(path: Path) -> Path:
    """Find the place of a file that a case names: the path itself by default."""
    root = os.environ.get(ROOT)
    return below(Path(root), path) if root else path


def below(root: Path, path: Path) -> Path:
    """Return the place of a path below a root.

    A relative one begins in the current folder, as far as this lies below the root. A path above
    the root is one at the root, as everywhere. Drives become folders.
    """
    working = Path(os.sep, os.path.relpath(Path.cwd(), root))
    drive, rest = os.path.splitdrive(os.path.normpath(working / path))
    return root / re.sub(r"[^\w.-]+", "_", drive).strip("_") / rest.lstrip(os.sep)


def regular_size(path: Path) -> int:
    """Return the size of a file in bytes.

    Raises OSError for what is missing and for what is no file: a folder, or a pipe or device, which
    may never end.
    """
    status = on_disk(path).stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(EISDIR, os.strerror(EISDIR))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(EINVAL, "a pipe or a device, not a file")
    return status.st_size


def read_regular(path: Path) -> bytes:
    """Return the bytes of a file; raises OSError where it cannot be read or is none."""
    regular_size(path)
    return on_disk(path).read_bytes()


def refuse_bytes(path: Path) -> None:
    """Raise ExfitError for a name that no text of a case, a result or a report can hold."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        try:
            why = _what_lacks(os.fsencode(path).decode())
        except UnicodeDecodeError:
            why = "the name of the file is not UTF-8 text; rename it"
        raise ExfitError(f"{path}: {why}") from None


def why_unreadable(fault: OSError | ValueError) -> str:
    """Give the reason why a file cannot be read."""
    if isinstance(fault, UnicodeEncodeError):
        return _what_lacks(fault.object)
    # a ValueError is that of a name with a null character
    return str(fault.strerror if isinstance(fault, OSError) else fault)


def _what_lacks(name: str) -> str:
    letters = ascii("".join(dict.fromkeys(letter for letter in name if not letter.isascii())))
    return (
        f"the encoding of the locale, {sys.getfilesystemencoding()}, lacks {letters} of the name "
        "of the file; set PYTHONUTF8=1, or a locale of UTF-8, as LC_ALL=C.UTF-8"
    )


def read_limited(path: Path, most: int) -> bytes:
    """Return the bytes of a file; raises ExfitError for more than ``most``, or one not readable.

    What is no file, as a folder, a pipe or a device, is refused before it is opened.
    """
    try:
        regular_size(path)
        with on_disk(path).open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as fault:
        raise ExfitError(f"{path}: cannot be read: {why_unreadable(fault)}") from None
    if len(data) > most:
        raise ExfitError(f"{path}: larger than {most / 1e6:g} MB, the limit of such a file")
    return data


def utf8(data: bytes, path: Path) -> str:
    """Return the text that the bytes of a file are; raises ExfitError where they are not UTF-8."""
    wide = b"\0\0" in (data[:4:2], data[1:4:2])  # UTF-16 without its mark
    try:
        if not wide:
            return data.decode("utf-8-sig")
        start = data.index(0)
    except UnicodeDecodeError as error:
        start = error.start
        wide = data.startswith((BOM_UTF16_LE, BOM_UTF16_BE))
    line = data.count(b"\n", 0, start) + 1
    what = f"byte 0x{data[start]:02x}{'; it is UTF-16' if wide else ''}"
    raise ExfitError(f"{path}:{line}: not UTF-8 text: {what}: save it as UTF-8")


def read_json(path: Path) -> dict[str, Any]:
    """Return the mapping that a file of JSON holds.

    Raises ExfitError, with the place where there is one, for a file that cannot be read, is too
    large, is no JSON in UTF-8, has a key twice in a mapping, or whose top is no mapping.
    """
    text = utf8(read_limited(path, LARGEST_FILE), path)
    if sum(map(text.count, '"[{')) > MOST_PARTS:
        raise ExfitError(f"{path}: more than {MOST_PARTS:,} texts, lists and mappings")
    try:
        content = json.loads(
            text,
            object_pairs_hook=_mapping,
            parse_constant=_refuse_constant,
            parse_int=lambda text: int(text) if len(text) <= LONGEST_INTEGER else text,
        )
        if HALF_CHARACTER.search(text):
            json.dumps(content, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ExfitError(f"{path}: not JSON: a text with half a character (\\ud8..)") from None
    except RecursionError:
        raise ExfitError(f"{path}: not JSON: nested too deep") from None
    except ValueError as error:
        raise ExfitError(f"{path}: not JSON: {error}") from None
    if not isinstance(content, dict):
        raise ExfitError(f"{path}: not a mapping (key: value) at the top")
    return content


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        keys = [key for key, _ in pairs]
        duplicate = next(key for k, key in enumerate(keys) if key in keys[:k])
        raise ValueError(f"duplicate key {duplicate!r}")
    return mapping


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number of JSON")


def within(folder: Path, name: str) -> Path:
    """Place a file or folder below the folder that a command writes to, which may be a link.

    Raises ExfitError where a link leads out of it.
    """
    path = folder / name
    target = os.path.realpath(path)  # of a circle of links, which Path.resolve refuses, too
    if not Path(target).is_relative_to(os.path.realpath(folder)):
        raise ExfitError(f"{path}: not written: a link leads out of {folder}, to {target}")
    return path


def write_whole(path: Path, data: bytes) -> None:
    """Write a file beside its place and rename it, its folder made where it is missing.

    Raises OSError where the place cannot be written; nothing is left beside it then, nor by an
    interruption. What killed runs have left there is removed.
    """
    with deferred_interrupts():
        _make_folder(path.parent)
        remove_abandoned(path.parent)
        _write_and_rename(path, data)


def write(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all; raises ExfitError where the place cannot be written.

    Where a link leads to a file of its folder, that is replaced, not the link; one that leads out
    of it is refused. A device or a pipe is written to.
    """
    data = content.encode() if isinstance(content, str) else content
    if path.parent != STREAMS:
        within(path.parent, path.name)
    try:
        kind = path.stat().st_mode if path.exists() else stat.S_IFREG
        if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):  # as /dev/stdout
            path.write_bytes(data)
        else:
            write_whole(Path(os.path.realpath(path)) if path.is_symlink() else path, data)
    except OSError as fault:
        raise ExfitError(_message(path, fault)) from fault


def prepare(folder: Path) -> None:
    """Make a folder, and remove what killed runs have left in it.

    Raises ExfitError where it cannot be made or written.
    """
    try:
        _make_folder(folder)
        remove_abandoned(folder)
        beside = _temporary(folder)
        with deferred_interrupts():
            try:
                _write_new(beside, b"")
            finally:
                with suppress(OSError):
                    beside.unlink()
    except OSError as fault:
        raise ExfitError(_message(folder, fault)) from fault


def write_each(folder: Path, contents: Mapping[str, str]) -> None:
    """Write small files of a folder, each whole or not at all, in little time for many.

    Raises ExfitError where one cannot be written. What killed runs have left there is removed.
    """
    prepare(folder)
    for name, content in contents.items():
        write_quickly(folder / name, content)


def write_quickly(path: Path, content: str) -> None:
    """Write one of many small files of a folder that is there, whole or not at all.

    What killed runs have left is not looked for. Raises ExfitError where it cannot be written.
    """
    try:
        with deferred_interrupts():
            _write_and_rename(path, content.encode())
    except OSError as fault:
        raise ExfitError(_message(path, fault)) from fault


def write_together(folder: Path, contents: Mapping[str, str], obsolete: Iterable[str] = ()) -> None:
    """Write files of a folder as one: first all beside their places, then each to its place.

    Others that are ``obsolete`` disappear in between; the former version of the last of
    ``contents`` remains until all else is in place. An interruption waits for the end.

    Raises ExfitError where the folder cannot be written: then all is as it was. A single file that
    cannot be replaced (a folder of its name, open in a program on Windows) is named by an
    ExfitError too, but hinders no other: the numbers of a long run are not lost for it.
    """
    beside: dict[Path, Path] = {}
    faults: list[str] = []
    with deferred_interrupts():
        try:
            _make_folder(folder)
            remove_abandoned(folder)
            for name, content in contents.items():
                within(folder, str(Path(name).parent)).mkdir(parents=True, exist_ok=True)
                beside[folder / name] = _temporary(folder)
                _write_new(beside[folder / name], content.encode())
            for temporary in beside.values():
                with temporary.open("rb+") as file:
                    # a rename that outlives a power failure has all of the file then
                    os.fsync(file.fileno())
            for path in (folder / name for name in {*obsolete} - {*contents}):
                try:
                    if path.is_file():
                        path.unlink()
                except OSError as fault:
                    why = f"of a former run, cannot be removed: {fault.strerror}"
                    faults.append(f"{path}: {why}")
            for path, temporary in beside.items():
                try:
                    temporary.replace(path)
                except OSError as fault:
                    faults.append(_message(path, fault))
        except OSError as fault:
            raise ExfitError(_message(folder, fault)) from fault
        finally:
            for temporary in beside.values():
                with suppress(OSError):
                    temporary.unlink(missing_ok=True)
    if faults:
        raise FileError(faults)


def remove_abandoned(folder: Path) -> None:
    """Remove the temporary files that killed runs have left in a folder.

    Those of a process that still runs stay, and those of another computer, whose processes cannot
    be seen from here, until they are a day old.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            name = TEMPORARY.fullmatch(entry.name)
            if name is None:
                continue
            with suppress(OSError):
                here = name[1] == _computer()
                old = time.time() - entry.stat().st_mtime > ABANDONED
                if old or (here and not _runs(int(name[2]))):
                    Path(entry).unlink()


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as fault:
        raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(folder)) from fault


def _temporary(folder: Path) -> Path:
    """Return the name of a new file: neither a process nor a thread has it twice."""
    return folder / f".exfit-{_computer()}-{os.getpid()}-{os.urandom(4).hex()}.tmp"


def _computer() -> str:
    from platform import node

    return f"{crc32(node().encode()):08x}"


def _runs(process: int) -> bool:
    """Check whether a process of this computer may still run; always true on Windows."""
    if os.name == "nt":
        return True  # os.kill would send it Ctrl-C there
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


def _write_and_rename(path: Path, data: bytes) -> None:
    beside = _temporary(path.parent)
    try:
        _write_new(beside, data)
        beside.replace(path)
    except OSError:
        with suppress(OSError):
            beside.unlink()
        raise


def _write_new(path: Path, data: bytes) -> None:
    with path.open("xb") as file:
        file.write(data)


def _message(path: Path, fault: OSError) -> str:
    return f"{path}: cannot be written: {fault.strerror}"


def siblings(path: Path, suffix: str) -> list[Path]:
    """Return the files beside one that are called like it but for the suffix, in capitals or not.

    Those whose name is the same to the letter count before others.
    """
    folder = on_disk(path.parent)
    if not folder.is_dir():
        return []
    wanted = (path.stem + suffix).lower()
    names = sorted(file.name for file in folder.iterdir())
    alike = [path.with_name(name) for name in names if name.lower() == wanted]
    return [file for file in alike if file.stem == path.stem] or alike
