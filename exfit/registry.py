"""The features: each a folder of `exfit.features`, whose ``__init__`` says which plugs it fills.

A plug is a table from names to texts ``module:name`` within the folder, so that nothing of a
feature is imported before it is used:

    COMMANDS  commands of the shell: (group, short help, "command:rank")
    PUBLIC    names of `exfit` itself
    CHECKS    what `exfit check` does with a file that has this key, given its path; False: unsound
    SECTIONS  keys of a case file that other commands read: a class of fields, and why not a case
    SUGGESTIONS  sections of a case that an inspected file suggests, none where it is another kind
    PLANTS    kinds of plant, by the names that a case gives them
    INPUT_NOISE  of the signals that drive a simulation: to weigh errors by it, its bias, its size
    CAUSES_BEFORE_FIT  causes of a misfit that a record shows before a fit, (case, recording)
    PROGRAMS  what simulates a case in place of exfit, by the kind of its plant: given the case, a
              context that provides an `exfit.fitting.program.Program`
    FAULTS    what contradicts itself in a case, by the kind of its plant: given its content and
              its parts
    PICTURES  what draws models: "overview" writes a page of some of them to a folder
    CAUSES_AT_REST, CAUSES_OF_EVENTS  what looks for a cause of the misfit of a grid event, by what
              it looks at; of a match only the former

The core asks for plugs here and names no feature.
"""

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, NamedTuple

PLACE = "exfit.features"


class LazyPart(NamedTuple):
    """Something of a feature, imported when it is loaded: ``path`` is "package.module:name"."""

    path: str

    def load(self) -> Any:
        """Import the module and return what has the name there."""
        module, _, name = self.path.partition(":")
        return getattr(import_module(module), name)


class LazyCommand(NamedTuple):
    """A command of the shell, known without being imported: its group and its short help."""

    group: str
    help: str
    part: LazyPart


@cache
def features() -> Mapping[str, ModuleType]:
    """List the features by name: packages that name their plugs and import nothing."""
    spec = find_spec(PLACE)
    places = None if spec is None else spec.submodule_search_locations
    names = sorted(each.name for each in iter_modules(places) if each.ispkg) if places else []
    return {name: import_module(f"{PLACE}.{name}") for name in names}


@cache
def parts(plug: str) -> Mapping[str, LazyPart]:
    """Collect what all features fill a plug with, by name."""
    found: dict[str, LazyPart] = {}
    for feature, module in features().items():
        for name, path in getattr(module, plug, {}).items():
            if name in found:
                raise ValueError(
                    f"{plug}: {name}: of two features, {feature} and {found[name].path}"
                )
            found[name] = LazyPart(f"{PLACE}.{feature}.{path}")
    return found


@cache
def commands() -> Mapping[str, LazyCommand]:
    """Collect the commands of all features by name."""
    return {
        name: LazyCommand(group, text, LazyPart(f"{PLACE}.{feature}.{path}"))
        for feature, module in features().items()
        for name, (group, text, path) in getattr(module, "COMMANDS", {}).items()
    }
