"""Words and numbers as messages and files have them."""

import json
from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any


def to_json(content: Mapping[str, Any], ascii_only: bool = False) -> str:
    """Return JSON that every reader takes: numbers that are not finite become null."""
    return json.dumps(_finite(content), indent=2, ensure_ascii=ascii_only) + "\n"


def _finite(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    if isinstance(content, float) and not isfinite(content):
        return None
    return content


def yaml_number(value: float) -> str:
    """Return a number that gives the same float back to every reader of YAML."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    # YAML 1.1 takes 1e-05 for text, 1.0e-05 for a number
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{e}{exponent}"


SHOWN = 60  # characters of a wrong value


def near(word: str, known: Iterable[str]) -> str:
    """Return a hint at the known word that is meant, or at all of them."""
    import difflib

    folded = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(word.casefold(), folded, n=1)
    return f"did you mean {folded[close[0]]}?" if close else f"known: {', '.join(folded.values())}"


def show(value: float) -> str:
    """Return a number in as few digits as tell it."""
    return f"{value:.12g}"


def show_value(value: Any) -> str:
    """Return a value as a message shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return show(value)
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "a mapping"
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
