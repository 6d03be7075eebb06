"""The one place where a file of Python that a case names is run: with the rights of its user."""

from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from exfit.errors import ExfitError, ModelError
from exfit.util.files import read_limited
from exfit.util.gate import refuse_untrusted
from exfit.util.trust import Code

LARGEST_FILE = 4_000_000  # bytes
HASH_DIGITS = 12  # digits of a hash that distinguish files


def run_user_code(path: Path, sha256: str = "") -> dict[str, Any]:
    """Run a file of Python and return the names that it defines.

    A file whose hash ``sha256`` is given is run once in a process: its models are then the same
    ones, which share their machine code. Without a hash it is run each time.

    Raises ModelError where the file cannot be read or fails, and, before anything of it is run,
    where its hash is another one, or the user has not trusted it.
    """
    try:
        code = read_limited(path, LARGEST_FILE)
    except ExfitError as fault:
        raise ModelError(str(fault)) from fault
    named = Code.of_file(path, code)
    own = named.sha256
    if sha256 and own != sha256:
        raise ModelError(
            f"{path}: not run: the file has changed since the fit: its SHA-256 begins with "
            f"{own[:HASH_DIGITS]}, that of the fitted model was {sha256[:HASH_DIGITS]}; fit again"
        )
    try:
        refuse_untrusted(named)
    except ExfitError as fault:
        raise ModelError(str(fault)) from fault
    return _run_once(path, code) if sha256 else _run(path, code)


def _run(path: Path, code: bytes) -> dict[str, Any]:
    module = ModuleType(f"exfit_user_{path.stem}")
    try:
        # compiled here, not imported: a module cache beside it would outlive a quick edit
        exec(compile(code, path.absolute(), "exec"), vars(module))
    except (Exception, SystemExit) as fault:
        raise ModelError(f"{path}: {type(fault).__name__}: {fault}") from fault
    return vars(module)


_run_once = cache(_run)
