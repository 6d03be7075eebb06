"""The catalogue of exciters and stabilisers, by the names of IEEE 421.5 and PSS/E."""

import difflib
from pathlib import Path
from types import ModuleType

from exfit.errors import ModelError
from exfit.models import (
    ac1a,
    ac2a,
    ac3a,
    ac4a,
    ac5a,
    ac6a,
    ac7b,
    ac8b,
    dc1a,
    dc2a,
    dc3a,
    dc4b,
    esac8b,
    exac1,
    exac2,
    exac4,
    exdc2,
    exst1,
    first_order,
    ieeet1,
    ieeex1,
    pss1a,
    pss2b,
    scrx,
    sexs,
    st1a,
    st2a,
    st3a,
    st4b,
    st5b,
    st6b,
    st7b,
    stab1,
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
        ("AC2A", ac2a),
        ("AC3A", ac3a),
        ("AC4A", ac4a),
        ("AC5A", ac5a),
        ("AC6A", ac6a),
        ("AC7B", ac7b),
        ("AC8B", ac8b),
        ("ST1A", st1a),
        ("ST2A", st2a),
        ("ST3A", st3a),
        ("ST4B", st4b),
        ("ST5B", st5b),
        ("ST6B", st6b),
        ("ST7B", st7b),
        ("IEEET1", ieeet1),
        ("IEEEX1", ieeex1),
        ("EXDC2", exdc2),
        ("EXAC1", exac1),
        ("EXAC2", exac2),
        ("EXAC4", exac4),
        ("ESAC8B", esac8b),
        ("EXST1", exst1),
        ("SEXS", sexs),
        ("SCRX", scrx),
        ("FIRST_ORDER", first_order),
    )
}

STABILISERS: dict[str, Model] = {
    name: model(name, vars(module))
    for name, module in (
        ("PSS1A", pss1a),
        ("PSS2B", pss2b),
        ("STAB1", stab1),
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
