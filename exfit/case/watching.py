"""Which files of a case change, for --watch."""

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

    others = _changed_and_still(before)
    if others:
        return others
    # a file itself is lost where an editor puts another in its place; of a folder that does not
    # exist it is the nearest above it that does
    folders = (
        next(parent for parent in path.absolute().parents if parent.is_dir()) for path in before
    )
    announced = watch(
        *dict.fromkeys(folders),
        watch_filter=None,
        step=STILL,
        rust_timeout=LOOK,
        yield_on_timeout=True,
        recursive=False,
    )
    return next(filter(None, (_changed_and_still(before) for _ in announced)), ())


def _changed_and_still(before: Stamps) -> tuple[Path, ...]:
    """Return the files that are others than before, once they change no more; else none."""
    from time import sleep

    others = {path: _stamp(path) for path, stamp in before.items() if _stamp(path) != stamp}
    if others:
        sleep(STILL / 1000.0)
    still = all(_stamp(path) == stamp for path, stamp in others.items())
    return tuple(others) if still else ()


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
