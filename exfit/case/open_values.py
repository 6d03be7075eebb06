"""What a case leaves to be filled in: a "?" in place of a value."""

from collections.abc import Iterator
from typing import Any

from exfit.util.text import Place

QUESTION = "?"  # no number, so that a case that holds it is refused
TO_BE_FILLED_IN = f"'{QUESTION}' is to be filled in"


def open_places(content: Any) -> list[Place]:
    """Return the places of the content of a case that are to be filled in.

    What an alias repeats counts where it stands first.
    """
    visited: set[int] = set()
    return [*_open_places(content, (), visited)]


def _open_places(content: Any, place: Place, visited: set[int]) -> Iterator[Place]:
    if content == QUESTION:
        yield place
    if not isinstance(content, dict | list) or id(content) in visited:
        return
    visited.add(id(content))
    entries = content.items() if isinstance(content, dict) else enumerate(content)
    for key, entry in entries:
        yield from _open_places(entry, (*place, key), visited)
