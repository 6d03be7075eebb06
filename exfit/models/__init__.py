"""The catalogue of exciter models, by the names that IEEE 421.5 and PSS/E give them."""

import difflib
from pathlib import Path
from types import ModuleType

from exfit.errors import ModelError
from exfit.models import (
    ac1a,
    ac8b,
    dc1a,
    dc2a,
    dc3a,
    dc4b,
    exdc2,
    first_order,
    ieeet1,
    ieeex1,
)
from exfit.models.sheet import Model, model

MODELS: dict[str, Model] = {
    name: model(name, vars(module))
    for name, module in (
        ("DC1A", dc1a),
        ("DC2A", dc2a),
        ("DC3A", dc3a),
        ("DC4B", dc4b),
        ("AC1A", ac1a),
        ("AC8B", ac8b),
        ("IEEET1", ieeet1),
        ("IEEEX1", ieeex1),
        ("EXDC2", exdc2),
        ("FIRST_ORDER", first_order),
    )
}


def find(name: str, folder: Path) -> Model:
    """Return the model of a catalogue name, an alias, or a .py file relative to ``folder``.

    Raises ModelError where there is none.
    """
    if name.endswith(".py"):
        return from_file(folder / name)
    for found in MODELS.values():
        if name.upper() in (found.name, *found.aliases):
            return found
    names = [known for found in MODELS.values() for known in (found.name, *found.aliases)]
    near = difflib.get_close_matches(name.upper(), names, n=1)
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
