"""Files of JSON that exfit wrote, read as if anyone may have changed them since."""

import json
import re
from pathlib import Path
from typing import Any, NoReturn

from exfit.errors import ExfitError
from exfit.util.files import read_limited, utf8

LARGEST_FILE = 128_000_000  # bytes; a result of a hundred long records has about as many
MOST_PARTS = 2_000_000  # texts, lists and mappings; a result has some thousand
LONGEST_INTEGER = 400  # digits; a longer one takes long to read, and no double is as large
HALF_CHARACTER = re.compile(r"\\u[dD][89a-fA-F]")


def read_json(path: Path) -> dict[str, Any]:
    """Return the mapping that a file of JSON holds.

    Raises ExfitError, with the place where there is one, for a file that cannot be read, is too
    large, is no JSON in UTF-8, has a key twice in a mapping, or whose top is no mapping.
    """
    text = utf8(read_limited(path, LARGEST_FILE), path)
    if sum(map(text.count, '"[{')) > MOST_PARTS:
        raise ExfitError(f"{path}: more than {MOST_PARTS:,} texts, lists and mappings")
    try:
        content = json.loads(
            text,
            object_pairs_hook=_mapping,
            parse_constant=_refuse_constant,
            parse_int=_integer,
        )
        if HALF_CHARACTER.search(text):
            json.dumps(content, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ExfitError(f"{path}: not JSON: a text with half a character (\\ud8..)") from None
    except RecursionError:
        raise ExfitError(f"{path}: not JSON: nested too deep") from None
    except ValueError as error:
        raise ExfitError(f"{path}: not JSON: {error}") from None
    if not isinstance(content, dict):
        raise ExfitError(f"{path}: not a mapping (key: value) at the top")
    return content


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        keys = [key for key, _ in pairs]
        duplicate = next(key for k, key in enumerate(keys) if key in keys[:k])
        raise ValueError(f"duplicate key {duplicate!r}")
    return mapping


def _integer(text: str) -> int | str:
    """Return a whole number; one that no double holds as its text, which is refused in place."""
    return int(text) if len(text) <= LONGEST_INTEGER else text


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number of JSON")
