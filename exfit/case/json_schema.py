"""The JSON Schema of the case file, for editors, and the faults of form in words, which need it."""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any

from exfit.case.schema import CaseDocument
from exfit.case.schema.values import FILE_NAME, PERCENT, REFUSED
from exfit.case.yaml import QUESTION, TO_BE_FILLED_IN, Fault
from exfit.registry import parts
from exfit.util.text import Place, near, show_value

DIALECT = "https://json-schema.org/draft/2020-12/schema"


@cache
def json_schema() -> Mapping[str, Any]:
    """Make the JSON Schema of the case file, with the sections that features add to it."""
    from pydantic import create_model
    from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

    class NoNulls(GenerateJsonSchema):
        """A key that may be missing may not be null."""

        def nullable_schema(self, schema: Any) -> JsonSchemaValue:
            return self.generate_inner(schema["schema"])

        def default_schema(self, schema: Any) -> JsonSchemaValue:
            inner = super().default_schema(schema)
            if inner.get("default", 0) is None:
                return {name: value for name, value in inner.items() if name != "default"}
            return inner

    bases = (*(section.load() for section in parts("SECTIONS").values()), CaseDocument)
    whole = create_model("CaseDocument", __base__=bases, __doc__=CaseDocument.__doc__)
    schema = whole.model_json_schema(by_alias=True, schema_generator=NoNulls)
    return {"$schema": DIALECT, **schema, "title": "exfit case"}


Data = Mapping[str, Any]

RENAMED: Mapping[Place, str] = {
    ("accept",): "is now a row of criteria: {limits: [{quantity: rms, limit: 1.5e-4}]}",
    ("report",): "its criteria are now those of the case: {limits: [{quantity: rms, percent: 5}]}",
}
KIND_OF_TEST = "_kind_of_test"  # the function by which the schema distinguishes tests
NOT_A_MAPPING = "is not a mapping (key: value)"
IN_PLACE_OF: Mapping[str, str] = {
    "ChannelSection": " or, as text, a column",
    "CriteriaSection": "; of a file: {file: its name}",
}
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
    REFUSED: lambda _, limits: str(limits["text"]),
    "string_type": lambda value, _: f"{value} is not text; put it in quotes",
    "string_too_short": lambda _, __: "is empty",
    "string_too_long": lambda value, limits: (
        f"{value} is longer than {limits['max_length']} characters"
    ),
    "string_pattern_mismatch": lambda value, limits: (
        f"{value} {PATTERNS.get(limits['pattern'], 'has another form')}"
    ),
    "model_attributes_type": lambda value, _: f"{value} {NOT_A_MAPPING}",
    "model_type": lambda value, limits: (
        f"{value} {NOT_A_MAPPING}{IN_PLACE_OF.get(limits['class_name'], '')}"
    ),
    "dict_type": lambda value, _: f"{value} {NOT_A_MAPPING}",
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
    """Put pydantic's details of errors in words: place, value and limit.

    ``schema`` is the JSON Schema of the whole file.
    """
    return [
        _fault(detail, schema)
        for detail in details
        # a list that is too short only for its faulty entries has these reported
        if detail["type"] != "too_short" or len(detail["input"]) < detail["ctx"]["min_length"]
    ]


def _fault(detail: Data, schema: Data) -> Fault:
    kind, limits = detail["type"], detail.get("ctx", {})
    place = _place_in_file(detail["loc"])
    value = show_value(detail["input"])
    if kind == "extra_forbidden":  # the last is a key of the file, whatever it looks like
        section, key = _place_in_file(detail["loc"][:-1]), str(detail["loc"][-1])
        known = [
            name for part in _at(schema, schema, section) for name in part.get("properties", ())
        ]
        text = "not allowed with this type"
        if key not in known:
            unknown = f"unknown key; {near(key, list(dict.fromkeys(known)))}"
            text = RENAMED.get((*section, key), unknown)
        return Fault((*section, key), text)
    if kind == "missing":
        words = [word for part in _at(schema, schema, place) for word in part.get("enum", ())]
        return Fault(place, "is missing" + (f": {' or '.join(words)}?" if words else ""))
    if kind == "union_tag_not_found":
        return Fault((*place, "type"), "is missing")
    if kind == "union_tag_invalid":
        key = "kind" if KIND_OF_TEST in limits["discriminator"] else "type"
        return _wrong_choice((*place, key), str(limits["tag"]), limits["expected_tags"])
    if kind == "literal_error":
        return _wrong_choice(place, detail["input"], limits["expected"])
    in_words = WORDS.get(kind)
    return Fault(place, in_words(value, limits) if in_words else f"{value}: {detail['msg']}")


def _wrong_choice(place: Place, value: Any, expected: str) -> Fault:
    """Make the fault of a value outside a list of words, given as ``'a', 'b' or 'c'``."""
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
