"""A cause of a fit that is not good."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Cause(NamedTuple):
    """Why a fit may be as it is, and what to do about it.

    ``values`` are those of the fitted parameters with it, none where no fit tried it.
    """

    cause: str
    remedy: str
    values: Mapping[str, float] = MappingProxyType({})

    @property
    def sentence(self) -> str:
        """The cause and its remedy in one sentence."""
        return f"{self.cause}: {self.remedy}"
