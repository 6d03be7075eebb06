"""A case file read and checked: every fault at once, each with its line."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exfit.case.case import Case
from exfit.case.checks.model import contradictions
from exfit.case.messages import form_faults
from exfit.case.parts import parts_of, ties_of
from exfit.case.yaml import Fault, Place, read_text, read_yaml
from exfit.errors import CaseError

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def load_case(path: Path) -> Case:
    """Return the case of a YAML file.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """Return the case of a YAML text, as if it stood in the file ``path``; raises CaseError."""
    top, faults = read_yaml(text, path)
    parts = parts_of(top.value, path.parent, faults)
    ties = ties_of(top.value, parts, faults)
    case = _checked(top.value, faults)
    taken = {fault.place for fault in faults}
    found = contradictions(top.value, parts, ties)
    faults += [fault for fault in found if fault.place not in taken]
    if faults or case is None:
        lines = [(fault.line or top.line_of(fault.place), fault) for fault in faults]
        raise CaseError(
            f"{path}:{line}: {dotted(fault.place)}: {fault.text}"
            for line, fault in sorted(lines, key=lambda found: found[0])
        )
    case._path, case._parts, case._ties = path, parts, ties
    return case


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of the case file."""
    from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

    class NoNulls(GenerateJsonSchema):
        """A key that may be missing may not be null."""

        def nullable_schema(self, schema: Any) -> JsonSchemaValue:
            return self.generate_inner(schema["schema"])

        def default_schema(self, schema: Any) -> JsonSchemaValue:
            found = super().default_schema(schema)
            return _without(found, "default") if found.get("default", 0) is None else found

    schema = Case.model_json_schema(by_alias=True, schema_generator=NoNulls)
    return {"$schema": DIALECT, **schema, "title": "exfit case"}


def dotted(place: Place) -> str:
    """Return a place as ``test.vref[0].at``."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)[1:]


def _without(mapping: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in mapping.items() if name != key}


def _checked(data: dict[str, Any], faults: list[Fault]) -> Case | None:
    """Return the case if its data has the right form; add a fault for each that has not."""
    try:
        return Case.model_validate(data)
    except ValidationError as error:
        known = {fault.place for fault in faults}
        found = form_faults(error.errors(include_url=False), json_schema())
        faults += [fault for fault in found if fault.place not in known]
        return None
