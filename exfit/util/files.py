"""Files that appear whole or not at all."""

import os
from contextlib import suppress
from pathlib import Path

from exfit.errors import ExfitError


def write_whole(path: Path, data: bytes) -> None:
    """Write a file beside its place and rename it, its folder made where it is missing.

    Raises OSError where the place cannot be written; nothing is left beside it then.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.write_bytes(data)
        beside.replace(path)
    except OSError:
        with suppress(OSError):
            beside.unlink()
        raise


def write(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all; raises ExfitError where the place cannot be written."""
    try:
        write_whole(path, content.encode() if isinstance(content, str) else content)
    except OSError as fault:
        raise ExfitError(f"{path}: cannot be written: {fault.strerror}") from fault


def siblings(path: Path, suffix: str) -> list[Path]:
    """Return the files beside one that are called like it but for the suffix, in capitals or not.

    Those whose name is the same to the letter count before others.
    """
    if not path.parent.is_dir():
        return []
    wanted = (path.stem + suffix).lower()
    found = [one for one in sorted(path.parent.iterdir()) if one.name.lower() == wanted]
    return [one for one in found if one.stem == path.stem] or found
