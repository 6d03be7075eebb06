"""A fit read back: its result.json, whose parts are checked when they are asked for."""

import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from exfit.errors import ExfitError
from exfit.util.text import show_value

Data = Mapping[str, Any]

WHOLE_FIT = "result.json"


class Saved:
    """The content of a result.json."""

    def __init__(self, path: Path, content: Data) -> None:
        self.path, self.content = path, content

    def at(self, *place: str | int) -> Any:
        """Return what stands at a place; raises ExfitError where nothing does."""
        found: Any = self.content
        for depth, key in enumerate(place):
            try:
                found = found[key]
            except (LookupError, TypeError):
                missing = _dotted(place[: depth + 1])
                raise ExfitError(f"{self.path}: {missing}: missing; fit again") from None
        return found

    def number(self, *place: str | int) -> float:
        """Return the number at a place; raises ExfitError where there is none."""
        return self._number(_dotted(place), self.at(*place))

    def number_or_none(self, *place: str | int) -> float | None:
        """Return the number at a place, None for null; raises ExfitError where it is neither."""
        value = self.at(*place)
        return None if value is None else self._number(_dotted(place), value)

    def texts(self, *place: str | int) -> tuple[str, ...]:
        """Return the list of texts at a place; raises ExfitError where there is none."""
        found = self.at(*place)
        if not isinstance(found, list):
            raise ExfitError(f"{self.path}: {_dotted(place)}: {show_value(found)} is not a list")
        return tuple(str(one) for one in found)

    def text(self, key: str) -> str | None:
        """Return a text, None where there is none."""
        found = self.content.get(key)
        return found if isinstance(found, str) else None

    def mapping(self, key: str) -> Data:
        """Return a mapping, an empty one where there is none."""
        found = self.content.get(key)
        return found if isinstance(found, dict) else {}

    def entries(self, key: str) -> list[Any]:
        """Return a list, an empty one where there is none."""
        found = self.content.get(key)
        return found if isinstance(found, list) else []

    def fitted(self) -> dict[str, float]:
        """Return the fitted values under the names of the fit."""
        found = self.mapping("parameters")
        return {
            name: self._number(f"parameters.{name}.value", one.get("value"))
            for name, one in found.items()
            if isinstance(one, dict)
        }

    def values(self, key: str, prefix: str) -> dict[str, float]:
        """Return the values of a part: those that stayed, and over them those that were fitted."""
        kept = {
            name: self._number(f"{key}.{name}", value) for name, value in self.mapping(key).items()
        }
        return {**kept, **self.fitted_of(prefix)}

    def fitted_of(self, prefix: str) -> dict[str, float]:
        """Return the fitted values of a part; its prefix is empty for the exciter."""
        return {
            name.removeprefix(prefix): value
            for name, value in self.fitted().items()
            if name.startswith(prefix) and "." not in name.removeprefix(prefix)
        }

    def _number(self, place: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise ExfitError(f"{self.path}: {place}: {show_value(value)} is not a number")
        return float(value)


def read_saved(path: Path) -> Saved:
    """Return a fit, given its result.json or the folder that holds it.

    Raises ExfitError where the file cannot be read or is no result of a fit.
    """
    source = path / WHOLE_FIT if path.is_dir() else path
    try:
        content = json.loads(source.read_bytes())
    except OSError as error:
        raise ExfitError(f"{source}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise ExfitError(f"{source}: not JSON: {error}") from None
    if not isinstance(content, dict) or not {"model", "parameters", "fixed"} <= content.keys():
        raise ExfitError(f"{source}: not the result of a fit: model, parameters or fixed missing")
    return Saved(source, content)


def _dotted(place: tuple[str | int, ...]) -> str:
    return ".".join(map(str, place))
