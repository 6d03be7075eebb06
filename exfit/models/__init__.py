"""The catalogue of exciters and what acts on them, by the names of IEEE 421.5 and PSS/E."""

from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from pkgutil import iter_modules

from exfit.errors import ModelError
from exfit.models.sheet import Model, model


class Catalogue(Mapping[str, Model]):
    """Models by name, in the order of the alphabet, each loaded on first use.

    A file of the package is named after its model, or after a family whose models it holds.
    """

    def __init__(self, package: str) -> None:
        self.package = f"{__name__}.{package}"

    @cached_property
    def files(self) -> dict[str, str]:
        """The file of each model; the package is loaded on first use, too."""
        package = import_module(self.package)
        families = vars(package).get("FAMILIES", {})
        names = {
            name: file.name
            for file in iter_modules(package.__path__)
            for name in families.get(file.name, file.name.upper()).split()
        }
        return dict(sorted(names.items()))

    def __getitem__(self, name: str) -> Model:
        return _loaded(name, f"{self.package}.{self.files[name]}")

    def __contains__(self, name: object) -> bool:
        return name in self.files

    def __iter__(self) -> Iterator[str]:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)


@cache
def _loaded(name: str, file: str) -> Model:
    names = vars(import_module(file))
    return names[name] if name in names else model(name, names)


MODELS = Catalogue("exciters")
STABILISERS = Catalogue("stabilisers")
GOVERNORS = Catalogue("governors")
LOAD_CONTROLLERS = Catalogue("load_controllers")
LIMITERS = Catalogue("limiters")


# known without their files
MACHINE_NAMES = ("GENROU", "GENROE", "GENSAL", "GENSAE", "GENTPJ", "GENQEC", "GENQEJ", "ONE_AXIS")


def find(name: str, folder: Path, sha256: str = "") -> Model:
    """Return the model of a catalogue name, an alias, or a .py file relative to ``folder``.

    A file is run only if it has the hash ``sha256``, where one is given.

    Raises ModelError where there is none.
    """
    if name.endswith(".py"):
        return from_file(folder / name, sha256)
    wanted = name.upper()
    if wanted in MODELS:
        return MODELS[wanted]
    # an alias mostly ends with the name, as ESAC1A does: the fewest files are loaded
    for listed in sorted(MODELS, key=lambda listed: not wanted.endswith(listed)):
        if wanted in MODELS[listed].aliases:
            return MODELS[listed]
    from difflib import get_close_matches

    names = [listed for entry in MODELS.values() for listed in (entry.name, *entry.aliases)]
    close = get_close_matches(wanted, names, n=len(names))
    # of those as near, what begins as it does
    close.sort(key=lambda other: (-_letters_shared(wanted, other), other))
    hint = f"; did you mean {' or '.join(close[:2])}?" if close else ""
    raise ModelError(f"{name} is not in the catalogue, which exfit models lists{hint}")


def _letters_shared(name: str, other: str) -> int:
    """Return with how many equal letters two names begin."""
    pairs = zip(name, other, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def from_file(path: Path, sha256: str = "") -> Model:
    """Return the model of a user's own file, named after it; a ``sha256`` given must be its own.

    Raises ModelError where the file cannot be read, has another hash, fails as Python, or defines
    no model.
    """
    from exfit.models.user_code import run_user_code

    return model(path.stem.upper(), run_user_code(path, sha256))
