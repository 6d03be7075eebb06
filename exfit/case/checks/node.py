"""A place in the content of a case: read with care, as any value there may have the wrong form.

The checks of a case read the content itself, not its sections: a section with one bad value does
not exist, and would hide the faults of the others.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from exfit.case.yaml import Fault
from exfit.util.text import Place


@dataclass(frozen=True)
class ContentNode:
    """A place of the content and its value; None where there is none.

    A form that the value does not have is None, or empty.
    """

    place: Place
    value: Any

    def at(self, *keys: str | int) -> "ContentNode":
        """Return the place under the keys and indices, one within the other."""
        value = self.value
        for key in keys:
            if isinstance(value, list):
                value = value[key] if isinstance(key, int) and key < len(value) else None
            else:
                value = value.get(key) if isinstance(value, dict) else None
        return ContentNode((*self.place, *keys), value)

    def __contains__(self, key: str) -> bool:
        """Whether the value is a mapping that has the key."""
        return key in self.content

    @property
    def content(self) -> Mapping[str, Any]:
        """The value as a mapping."""
        return self.value if isinstance(self.value, dict) else {}

    @property
    def is_section(self) -> bool:
        """Whether the value is a mapping."""
        return isinstance(self.value, dict)

    @property
    def sections(self) -> Iterator[tuple[str, "ContentNode"]]:
        """The entries of the value, a mapping, by key."""
        return ((key, self.at(key)) for key in self.content)

    @property
    def entries(self) -> list["ContentNode"]:
        """The entries of the value, a list."""
        count = len(self.value) if isinstance(self.value, list) else 0
        return [self.at(index) for index in range(count)]

    @property
    def number(self) -> float | None:
        """The value as a finite number."""
        number = isinstance(self.value, int | float) and not isinstance(self.value, bool)
        return float(self.value) if number and isfinite(self.value) else None

    @property
    def start(self) -> float | None:
        """The value as a number, or the one from which a fit starts that finds it."""
        return self.at("start").number if self.is_section else self.number

    @property
    def text(self) -> str | None:
        """The value as a text."""
        return self.value if isinstance(self.value, str) else None

    @property
    def pair(self) -> tuple[float, float] | None:
        """The value as a list of two numbers."""
        numbers = [entry.number for entry in self.entries]
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
            return None
        return numbers[0], numbers[1]

    @property
    def numbers(self) -> dict[str, float]:
        """The entries of the mapping that are numbers."""
        each = {key: node.number for key, node in self.sections}
        return {key: number for key, number in each.items() if number is not None}

    def fault(self, text: str) -> Fault:
        """Return a fault of this place."""
        return Fault(self.place, text)
