"""Where exfit keeps what it can make again: a folder that nobody but the user can write to."""

import os
import stat
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

from exfit.util.files import write_whole

CACHE = "EXFIT_CACHE"  # the variable of the environment that names the folder
OF_OTHERS = stat.S_IWGRP | stat.S_IWOTH
FOLDER_MODE, FILE_MODE = 0o700, 0o600


def private_cache() -> Path | None:
    """Return the folder where compiled code is kept: EXFIT_CACHE, or the user's cache folder.

    None where others could write to it: what lies there may be theirs. That is reported once.
    """
    folder = _chosen()
    return folder if _is_usable(folder) else None


def read_private(path: Path) -> bytes | None:
    """Return the content of a file; None where there is none, or others could have written it."""
    try:
        with path.open("rb") as file:
            return file.read() if _why_not_private(os.fstat(file.fileno())) is None else None
    except OSError:
        return None


def keep_private(path: Path, data: bytes) -> None:
    """Keep a file that nobody else may write to; where that is not possible, keep nothing."""
    if path.parent.is_symlink() and path.parent != _chosen():
        return  # it leads out of the cache, which may itself be a link
    with suppress(OSError):
        path.parent.mkdir(mode=FOLDER_MODE, parents=True, exist_ok=True)
        write_whole(path, data)
        if sys.platform != "win32":
            path.chmod(FILE_MODE)


def _chosen() -> Path:
    if chosen := os.environ.get(CACHE):
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("exfit", appauthor=False)


@cache
def _is_usable(folder: Path) -> bool:
    """Check that a folder, made where it is missing, is the user's own; report why not."""
    try:
        folder.mkdir(mode=FOLDER_MODE, parents=True, exist_ok=True)
        why = _why_not_private(folder.stat())
    except OSError:
        return True  # it cannot be made: nothing is found there, and nothing kept
    if why is not None:
        from logging import getLogger

        getLogger("exfit").warning("Warning: %s: not used for compiled code: %s", folder, why)
    return why is None


def _why_not_private(status: os.stat_result) -> str | None:
    """Give the reason why a file or folder may be of others; None where it is the user's own.

    On Windows the access rights of the folder decide, which those of the user's profile are.
    """
    if sys.platform == "win32":
        return None
    if status.st_uid != os.geteuid():
        return f"it belongs to another user (number {status.st_uid})"
    if status.st_mode & OF_OTHERS:
        return f"others can write to it (mode {stat.S_IMODE(status.st_mode):o}): chmod go-w"
    return None
