"""Code that a case names, which runs with the rights of the user: whether the user trusts it.

Each thing trusted is a file in the user's configuration folder, so that processes side by side
lose none of another's.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from exfit.errors import ExfitError
from exfit.util.cache import keep_private, read_private
from exfit.util.files import within

CONFIG = "EXFIT_CONFIG"  # the variable of the environment that names the folder


class Code(NamedTuple):
    """What may be run: in words, where it is (of a command: where it runs), and its hash.

    A folder, with all below it, is known by the hash of its path.
    """

    words: str
    place: Path
    sha256: str

    @property
    def folder(self) -> Path:
        """The folder that a file is in, or a command runs in."""
        place = self.place.absolute()
        return place if place.is_dir() else place.parent

    @classmethod
    def of_file(cls, path: Path, content: bytes) -> "Code":
        """A file of Python, or an FMU."""
        return cls(path.name, path, hashlib.sha256(content).hexdigest())

    @classmethod
    def of_command(cls, command: Sequence[str], folder: Path, scripts: Iterable[bytes]) -> "Code":
        """A command in its folder: another folder may hold another program of the name."""
        hashes = [hashlib.sha256(script).hexdigest() for script in scripts]
        key = json.dumps([os.path.realpath(folder), *command, hashes])
        words = f"the command {' '.join(command)}"
        return cls(words, folder, hashlib.sha256(key.encode()).hexdigest())

    @classmethod
    def of_folder(cls, folder: Path) -> "Code":
        """All code in a folder and below it, as it is and as it will be."""
        place = Path(os.path.realpath(folder))
        key = hashlib.sha256(os.fsencode(place)).hexdigest()
        return cls("all code in the folder and below", place, key)


def refuse_unknown(code: Code) -> None:
    """Raise ExfitError for code that the user has not trusted."""
    if not is_trusted(code):
        raise ExfitError(why_refused(code))


def why_refused(code: Code) -> str:
    """Say why code is not run, and what its user does next."""
    from shlex import quote

    return (
        f"{code.words}: not run: it has your rights, and you have not trusted it yet; read it, "
        f"then use --trust, or trust all below its folder: exfit trust {quote(str(code.folder))}"
    )


def is_trusted(code: Code) -> bool:
    """Look whether code is trusted by its hash, or lies below a trusted folder."""
    real = Path(os.path.realpath(code.place))
    folders = (Code.of_folder(above).sha256 for above in (real, *real.parents))
    return any(read_private(_file(key)) is not None for key in (code.sha256, *folders))


def trust(code: Code) -> None:
    """Remember code as trusted; raises ExfitError where that cannot be written."""
    content = {"words": code.words, "place": os.path.realpath(code.place), "sha256": code.sha256}
    file = _file(code.sha256)
    within(file.parents[1], file.parent.name)
    keep_private(file, json.dumps(content, indent=2).encode())
    if read_private(file) is None:
        raise ExfitError(f"{file}: cannot be written")


def all_trusted() -> list[Code]:
    """Return what is trusted, by its place."""
    found = []
    for file in sorted(_file("").parent.glob("*.json")):
        try:
            content = json.loads(read_private(file) or b"")
            code = Code(content["words"], Path(content["place"]), file.stem)
        except (ValueError, LookupError, TypeError):
            continue  # damaged, or others could have written it: not trusted, or not by that file
        found.append(code)
    return sorted(found, key=lambda code: code.place)


def withdraw(code: Code) -> None:
    """Trust code no more."""
    _file(code.sha256).unlink(missing_ok=True)


def _file(key: str) -> Path:
    chosen = os.environ.get(CONFIG)
    if not chosen:
        from platformdirs import user_config_path

        chosen = str(user_config_path("exfit", appauthor=False))
    return Path(chosen, "trusted", f"{key}.json")
