"""A case with the contents of all files that it names, for a worker that shares no disk."""

import hashlib
import os
import sys
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from exfit.errors import ExfitError
from exfit.features.fleet.folder import CaseOutcome, Failure
from exfit.features.fleet.task import CaseTask, run_case
from exfit.util.cache import CACHE
from exfit.util.files import ROOT, below, read_regular, why_unreadable

QUICKLY = 1  # the level of compression: the next ones gain little and take several times as long
PAYS = 0.9  # of the length: what compression leaves, or less


@dataclass(frozen=True)
class PackedFile:
    """The content of a file: its path, its SHA-256, its bytes, as zlib packs them where it pays."""

    path: str
    sha256: str
    content: bytes
    compressed: bool

    @classmethod
    def of(cls, path: str, content: bytes) -> "PackedFile":
        """Return the file of a path with its content."""
        sha256, packed = hashlib.sha256(content).hexdigest(), zlib.compress(content, QUICKLY)
        pays = len(packed) <= PAYS * len(content)
        return cls(path, sha256, packed if pays else content, pays)

    def unpacked(self) -> bytes:
        """Return the bytes of the file; raises ExfitError where they are not those of its hash."""
        try:
            content = zlib.decompress(self.content) if self.compressed else self.content
        except zlib.error as fault:
            raise ExfitError(f"{self.path}: damaged on its way to the worker: {fault}") from None
        if hashlib.sha256(content).hexdigest() != self.sha256:
            raise ExfitError(f"{self.path}: damaged on its way to the worker: another SHA-256")
        return content


@dataclass(frozen=True)
class Bundle:
    """A case, by its path as it was given in a folder, and its files with their contents.

    The paths of the files are absolute, without links and dots.
    """

    case: str
    folder: str
    files: tuple[PackedFile, ...]

    @property
    def size(self) -> int:
        """Number of bytes that travel."""
        return sum(len(file.content) for file in self.files)


def bundle_of(paths: Sequence[Path]) -> Bundle:
    """Return a case, the first of some paths, with the files that it names, the others.

    One that does not exist is left out: the worker reports it as missing. Raises ExfitError for a
    file that cannot be read, and where links make one path of two files.
    """
    files: dict[str, PackedFile] = {}
    for path in paths:
        place = os.path.normpath(path.absolute())
        try:
            file = PackedFile.of(place, read_regular(path))
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as fault:
            raise ExfitError(f"{path}: cannot be read: {why_unreadable(fault)}") from None
        if files.setdefault(place, file) != file:
            raise ExfitError(f"{path}: another file than {place}: a link is before the dots")
    return Bundle(str(paths[0]), str(Path.cwd()), tuple(files.values()))


@contextmanager
def laid_out(bundle: Bundle, within: Path | None = None) -> Iterator[Path]:
    """Lay the files out in a temporary folder; the process reads them by the user's paths inside.

    The temporary folder is ``within`` another, or where the system has such.

    Gives the path of the case as the user gave it. For the time it lasts the folder stands for the
    root of all paths that cases name, and the current folder is that of the user below it: no other
    thread of the process may read cases meanwhile. Raises ExfitError where the files cannot be
    written, or where one arrived damaged.
    """
    if within is not None:
        within.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix="exfit-", dir=within, ignore_cleanup_errors=True) as temporary:
        root = Path(temporary).resolve()
        working = _written(bundle, root)
        former_folder, former_root = Path.cwd(), os.environ.get(ROOT)
        try:
            os.environ[ROOT] = str(root)
            os.chdir(working)
            yield Path(bundle.case)
        finally:
            os.chdir(former_folder)
            if former_root is None:
                del os.environ[ROOT]
            else:
                os.environ[ROOT] = former_root


def _keep_places() -> None:
    """Make absolute what the process finds from its current folder, before it leaves that."""
    sys.path[:] = [str(Path(path).absolute()) for path in sys.path]
    cache = os.environ.get(CACHE)
    if cache:
        os.environ[CACHE] = str(Path(cache).absolute())


def _written(bundle: Bundle, root: Path) -> Path:
    """Write the files below a root; return the user's folder there."""
    working = below(root, Path(bundle.folder))
    contents = {below(root, Path(file.path)): file.unpacked() for file in bundle.files}
    try:
        working.mkdir(parents=True, exist_ok=True)
        for place, content in contents.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
    except OSError as fault:
        raise ExfitError(f"temporary folder of the worker: {fault.strerror}") from None
    return working


@dataclass(frozen=True, kw_only=True)
class BundledTask(CaseTask):
    """A case with its files, which are laid out ``temporary``, in a folder of the worker."""

    bundle: Bundle
    temporary: Path | None = None

    @classmethod
    def of(cls, task: CaseTask) -> "BundledTask":
        """Return a task with its files; raises ExfitError as `bundle_of`."""
        return cls(**vars(task), bundle=bundle_of(task.files))

    def run(self) -> CaseOutcome:
        """Fit the case; it reads no file but its own. To be run in a process of its own."""
        _keep_places()
        try:
            with laid_out(self.bundle, self.temporary):
                return run_case(self)
        except ExfitError as fault:
            return CaseOutcome(failure=Failure("failed", str(fault)))
