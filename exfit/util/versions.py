"""The versions that a result depends on."""

import sys
from importlib import import_module

from exfit import __version__

LIBRARIES = ("numpy", "llvmlite", "pydantic")


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    return {
        "exfit": __version__,
        "python": ".".join(map(str, sys.version_info[:3])),
        **{name: import_module(name).__version__ for name in LIBRARIES},
    }
