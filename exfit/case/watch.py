"""The files of a case, watched until one of them changes."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from exfit.case.peek import files_of

STILL = 200  # ms without a change: an editor or a copy may write a file in several steps
LOOK = 1000  # ms between two looks where nothing is announced, as on a network drive

Stamp = tuple[int, int] | None
Stamps = Mapping[Path, Stamp]


def stamps_of(case: Path, beside: Iterable[Path] = ()) -> Stamps:
    """Note time of change and length of each file of a case, and beside it.

    None where there is none.
    """
    return {path: _stamp(path) for path in (*files_of(case), *beside)}


def changed(before: Stamps) -> tuple[Path, ...]:
    """Wait for changed files, until they change no more; return these."""
    from watchfiles import watch

    others = _others(before)
    if others and _stands_still(others):
        return others
    announced = watch(
        *_folders(before),
        watch_filter=None,
        step=STILL,
        rust_timeout=LOOK,
        yield_on_timeout=True,
        recursive=False,
    )
    for _ in announced:
        others = _others(before)
        if others and _stands_still(others):
            return others
    return ()


def _others(before: Stamps) -> tuple[Path, ...]:
    return tuple(path for path, stamp in before.items() if _stamp(path) != stamp)


def _stands_still(paths: Iterable[Path]) -> bool:
    from time import sleep

    first = [_stamp(path) for path in paths]
    sleep(STILL / 1000.0)
    return first == [_stamp(path) for path in paths]


def _folders(before: Stamps) -> tuple[Path, ...]:
    """Return the folders of files: a file itself is lost where an editor puts another in its place.

    Of one that does not exist it is the nearest above it that does.
    """
    folders = (
        next(parent for parent in path.absolute().parents if parent.is_dir()) for path in before
    )
    return tuple(dict.fromkeys(folders))


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
