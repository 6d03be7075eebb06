"""The catalogue of exciters and stabilisers, by the names of IEEE 421.5 and PSS/E."""

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType

from exfit.errors import ModelError
from exfit.models import exciters, stabilisers
from exfit.models.sheet import Model, model


class Catalogue(Mapping[str, Model]):
    """Models by name: a file each in a package, named after the model, loaded when first asked for.

    Their order is that of the alphabet.
    """

    def __init__(self, package: ModuleType) -> None:
        self.package = package.__name__
        self.names = tuple(sorted(file.name.upper() for file in iter_modules(package.__path__)))

    def __getitem__(self, name: str) -> Model:
        if name not in self.names:
            raise KeyError(name)
        return _loaded(self.package, name)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@cache
def _loaded(package: str, name: str) -> Model:
    return model(name, vars(import_module(f"{package}.{name.lower()}")))


MODELS = Catalogue(exciters)
STABILISERS = Catalogue(stabilisers)

MACHINE_NAMES = ("GENROU", "GENROE", "GENSAL", "GENSAE", "ONE_AXIS")  # known without their files


def find(name: str, folder: Path) -> Model:
    """Return the model of a catalogue name, an alias, or a .py file relative to ``folder``.

    Raises ModelError where there is none.
    """
    if name.endswith(".py"):
        return from_file(folder / name)
    wanted = name.upper()
    if wanted in MODELS:
        return MODELS[wanted]
    # an alias mostly ends with the name, as ESAC1A does: the fewest files are loaded
    for listed in sorted(MODELS, key=lambda listed: not wanted.endswith(listed)):
        if wanted in MODELS[listed].aliases:
            return MODELS[listed]
    import difflib

    names = [listed for entry in MODELS.values() for listed in (entry.name, *entry.aliases)]
    near = difflib.get_close_matches(wanted, names, n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise ModelError(f"{name} is not in the catalogue ({', '.join(names)}){hint}")


def from_file(path: Path) -> Model:
    """Return the model of a user's own file, named after it.

    Raises ModelError where the file cannot be read, fails as Python, or defines no model.
    """
    if not path.is_file():
        raise ModelError(f"{path}: no such file")
    module = ModuleType(f"exfit_user_{path.stem}")
    try:
        # compiled here, not imported: a module cache beside it would outlive a quick edit
        exec(compile(path.read_bytes(), path.absolute(), "exec"), vars(module))
    except (Exception, SystemExit) as fault:
        raise ModelError(f"{path}: {type(fault).__name__}: {fault}") from fault
    return model(path.stem.upper(), vars(module))
