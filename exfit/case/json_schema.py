"""The JSON Schema of the case file, for editors and for messages about unknown keys."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from exfit.case.schema import CaseDocument
from exfit.registry import parts

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
            return _without(inner, "default") if inner.get("default", 0) is None else inner

    bases = (*(section.load() for section in parts("SECTIONS").values()), CaseDocument)
    whole = create_model("CaseDocument", __base__=bases, __doc__=CaseDocument.__doc__)
    schema = whole.model_json_schema(by_alias=True, schema_generator=NoNulls)
    return {"$schema": DIALECT, **schema, "title": "exfit case"}


def _without(mapping: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in mapping.items() if name != key}
