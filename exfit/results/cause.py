"""A cause of a fit that is not good, and its remedy."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

NOTHING: Mapping[str, str] = MappingProxyType({})


class Remedy(NamedTuple):
    """What to do about a cause: in words, and as changes of the case.

    ``changes`` are texts of YAML by their places in its file, "" for what is left out; ``word`` is
    what a command calls them. ``freed`` names given values, if all they do is to free these.
    """

    words: str
    word: str = ""
    changes: Mapping[str, str] = NOTHING
    freed: tuple[str, ...] = ()


class Cause(NamedTuple):
    """Why a fit may be as it is, and what to do about it: as a `Remedy` has it.

    ``values`` are those of the fitted parameters with it, none where no fit tried it.
    """

    cause: str
    remedy: str
    word: str = ""
    changes: Mapping[str, str] = NOTHING
    freed: tuple[str, ...] = ()
    values: Mapping[str, float] = MappingProxyType({})

    @property
    def sentence(self) -> str:
        """The cause and its remedy in one sentence."""
        return f"{self.cause}: {self.remedy}"
