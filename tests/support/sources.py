"""The sources of the package as syntax trees, each parsed once in a session."""

import ast
from functools import cache
from pathlib import Path

import exfit

ROOT = Path(exfit.__file__).parent


def module_name(path):
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}


@cache
def tree_of(name):
    """Return the syntax tree of a module."""
    return ast.parse(MODULES[name].read_text(encoding="utf-8"))


@cache
def nodes_of(name):
    """Return all nodes of the syntax tree of a module."""
    return (*ast.walk(tree_of(name)),)


def trees():
    """Yield the name and the syntax tree of each module."""
    return ((name, tree_of(name)) for name in MODULES)


def nodes(wanted):
    """Yield the path and each node of each module whose text is ``wanted``."""
    for name, path in MODULES.items():
        if wanted(path.read_text(encoding="utf-8")):
            yield from ((path, node) for node in nodes_of(name))
