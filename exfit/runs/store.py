"""The store of runs: the result of each is a file, under a key of all that goes into it.

A run whose key is there is not run again. Batches name a folder after the key, programmes one after
the test, and the key stands in its file.
"""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from exfit import __version__
from exfit.errors import ExfitError
from exfit.util.files import on_disk, read_json, regular_size
from exfit.util.text import to_json
from exfit.util.typed import plain
from exfit.util.typed_reading import read

Content = TypeVar("Content")


def key_of(files: Sequence[str | None], **inputs: Any) -> str:
    """SHA-256 of all that goes into a run: its files by their hashes, inputs, exfit's version."""
    content = {"exfit": __version__, "files": files, **inputs}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def digest_of(file: Path) -> str | None:
    """SHA-256 of the bytes of a file; None where it is missing or cannot be read."""
    try:
        regular_size(file)
        with on_disk(file).open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except OSError:
        return None


def text_of(content: object, **labels: Any) -> str:
    """Write a data class as the text of a file of the store, behind labels such as its version."""
    return to_json({**labels, **plain(content, whole=True)})


def read_kept(
    file: Path, kind: type[Content], under: str | None = None, **labels: Any
) -> Content | None:
    """Read what a file of the store holds; None unless it has this form and these labels.

    ``under`` is its key there, None where it has the labels beside its own. Anyone may have changed
    the file since: what is not ours is as if it was not there.
    """
    try:
        data = read_json(file)
        if any(data.get(label) != value for label, value in labels.items()):
            return None
        content: Content = read(kind, data if under is None else data[under])
    except (ExfitError, LookupError, RecursionError):
        return None
    return content
