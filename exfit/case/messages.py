"""Messages about the form of a case file: place, value and limit."""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from exfit.case.open_values import QUESTION, TO_BE_FILLED_IN
from exfit.case.yaml import Fault
from exfit.util.text import Place, near, show_value

Data = Mapping[str, Any]

FILE_NAME = r"^[A-Za-z0-9][A-Za-z0-9._%-]*$"  # of any system; a percent sign as in up-5%
KIND_OF_TEST = "_kind_of_test"  # the function by which the schema distinguishes tests
MAGNITUDE = "magnitude"  # the kind of fault of a number that is too large or too small
PERCENT = r"^[0-9]+(\.[0-9]+)? ?%$"


PATTERNS: Mapping[str, str] = {
    FILE_NAME: "must begin with a letter or digit and hold letters, digits, - _ . % only",
    PERCENT: "is neither a number nor a percentage such as 20 %",
}
# kind of fault -> what to say of the value, given the limits
WORDS: Mapping[str, Callable[[str, Data], str]] = {
    "float_type": lambda value, _: (
        TO_BE_FILLED_IN if value == repr(QUESTION) else f"{value} is not a number"
    ),
    "int_type": lambda value, _: f"{value} is not a whole number",
    "int_from_float": lambda value, _: f"{value} is not a whole number",
    "finite_number": lambda value, _: f"{value} is not a finite number",
    MAGNITUDE: lambda _, limits: str(limits["fault"]),
    "string_type": lambda value, _: f"{value} is not text; put it in quotes",
    "string_too_short": lambda _, __: "is empty",
    "string_too_long": lambda value, limits: (
        f"{value} is longer than {limits['max_length']} characters"
    ),
    "string_pattern_mismatch": lambda value, limits: (
        f"{value} {PATTERNS.get(limits['pattern'], 'has another form')}"
    ),
    "model_attributes_type": lambda value, _: f"{value} is not a mapping (key: value)",
    "model_type": lambda value, limits: (
        f"{value} is not a mapping (key: value)"
        + (" or, as text, a column" if limits["class_name"] == "ChannelSection" else "")
    ),
    "dict_type": lambda value, _: f"{value} is not a mapping (key: value)",
    "tuple_type": lambda value, _: f"{value} is not a list",
    "too_short": lambda _, limits: (
        f"{_entries(limits['actual_length'])}; at least {limits['min_length']} needed"
    ),
    "too_long": lambda _, limits: (
        f"{_entries(limits['actual_length'])}; at most {limits['max_length']} allowed"
    ),
    "greater_than": lambda value, limits: f"{value} is not above {limits['gt']:g}",
    "greater_than_equal": lambda value, limits: f"{value} is below {limits['ge']:g}",
    "less_than": lambda value, limits: f"{value} is not below {limits['lt']:g}",
    "less_than_equal": lambda value, limits: f"{value} is above {limits['le']}",
}


def form_faults(details: Iterable[Data], schema: Data) -> list[Fault]:
    """Return the faults that pydantic's error details describe, given the file's JSON Schema."""
    return [_fault(detail, schema) for detail in details if not _only_counts_good_ones(detail)]


def _only_counts_good_ones(detail: Data) -> bool:
    """Tell if a list is too short only for its faulty entries, which are reported anyway."""
    return detail["type"] == "too_short" and bool(
        len(detail["input"]) >= detail["ctx"]["min_length"]
    )


def _fault(detail: Data, schema: Data) -> Fault:
    kind, limits = detail["type"], detail.get("ctx", {})
    place = _place_in_file(detail["loc"])
    value = show_value(detail["input"])
    if kind == "extra_forbidden":  # the last is a key of the file, whatever it looks like
        section, key = _place_in_file(detail["loc"][:-1]), detail["loc"][-1]
        return Fault((*section, key), _unknown(str(key), _known_keys(schema, section)))
    if kind == "missing":
        return Fault(place, "is missing" + _offered(schema, place))
    if kind == "union_tag_not_found":
        return Fault((*place, "type"), "is missing")
    if kind == "union_tag_invalid":
        key = "kind" if KIND_OF_TEST in limits["discriminator"] else "type"
        return _wrong_choice((*place, key), str(limits["tag"]), limits["expected_tags"])
    if kind == "literal_error":
        return _wrong_choice(place, detail["input"], limits["expected"])
    words = WORDS.get(kind)
    return Fault(place, words(value, limits) if words else f"{value}: {detail['msg']}")


def _offered(schema: Data, place: Place) -> str:
    """Return the words that are allowed at a place, as the end of a sentence."""
    words = [word for part in _at(schema, schema, place) for word in part.get("enum", ())]
    return f": {' or '.join(words)}?" if words else ""


def _unknown(key: str, keys: list[str]) -> str:
    return "not allowed with this type" if key in keys else f"unknown key; {near(key, keys)}"


def _wrong_choice(place: Place, value: Any, expected: str) -> Fault:
    """Return the fault of a value outside a list of words, given as ``'a', 'b' or 'c'``."""
    words = re.sub(r"['\[\]]", "", expected).replace(" or ", ", ").split(", ")
    if isinstance(value, str):
        value = value.strip("[]")
    return Fault(place, f"{show_value(value)} is not possible; {near(str(value), words)}")


def _entries(count: int) -> str:
    return f"{count} {'entry' if count == 1 else 'entries'}"


def _place_in_file(location: Place) -> Place:
    """Return a place without what pydantic adds: the kind of plant, and marks in brackets."""
    place = [part for part in location if not str(part).startswith("[")]
    if "plant" in place[:-1]:
        del place[place.index("plant") + 1]
    return tuple(place)


def _known_keys(schema: Data, place: Place) -> list[str]:
    """Return the keys that a JSON Schema knows at a place."""
    keys: list[str] = []
    for part in _at(schema, schema, place):
        keys += [key for key in part.get("properties", ()) if key not in keys]
    return keys


def _at(schema: Data, part: Data, place: Place) -> list[Data]:
    """Return the parts of a JSON Schema that describe a place."""
    if "$ref" in part:
        return _at(schema, schema["$defs"][part["$ref"].rpartition("/")[2]], place)
    choices = [*part.get("oneOf", ()), *part.get("anyOf", ())]
    if choices:
        return [described for choice in choices for described in _at(schema, choice, place)]
    if not place:
        return [part]
    key, rest = place[0], place[1:]
    inner = part.get("properties", {}).get(key)
    if inner is None:
        inner = part.get("items" if isinstance(key, int) else "additionalProperties")
    return _at(schema, inner, rest) if isinstance(inner, dict) else []
