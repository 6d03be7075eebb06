"""Every key of a case file stands in an example: in `configs` or on a page that a user reads."""

import re

import yaml
from places import CONFIGS

from exfit.case.json_schema import json_schema
from exfit.case.schema import CriteriaSection, Estimate, RecordFile

DOCS = CONFIGS.parent / "docs"
OF_SCHEMA = re.compile(r"<!-- keys -->.*?<!-- /keys -->", re.DOTALL)  # tables made of it
OF_A_PAGE = re.compile(r"```yaml\n(.*?)```", re.DOTALL)
EXAMPLES = "\n".join(
    [path.read_text("utf-8") for path in sorted(CONFIGS.rglob("*.yaml"))]
    + [OF_SCHEMA.sub("", path.read_text("utf-8")) for path in sorted(DOCS.rglob("*.md"))]
)


def keys(part, schema, known):
    """Yield the keys of a part of a JSON Schema and of all below it."""
    if "$ref" in part and part["$ref"] not in known:
        known.add(part["$ref"])
        yield from keys(schema["$defs"][part["$ref"].rpartition("/")[2]], schema, known)
    properties = part.get("properties", {})
    yield from (key for key, value in properties.items() if not value.get("deprecated"))
    inner = [*part.get("oneOf", ()), *part.get("anyOf", ()), *part.get("properties", {}).values()]
    inner += [
        part[key] for key in ("items", "additionalProperties") if isinstance(part.get(key), dict)
    ]
    for each in [*inner, *part.get("prefixItems", ())]:
        yield from keys(each, schema, known)


def test_every_key_of_the_schema_stands_in_an_example():
    shown = re.findall(r"(?m)(?:^|(?<=[\s{,`(]))([^\s{},`(:]+):(?=\s|$)", EXAMPLES)
    schema = json_schema()
    assert sorted({*keys(schema, schema, set())} - {*shown}) == []


SECTIONS = {"record": RecordFile, "estimate": Estimate, "criteria": CriteriaSection}


def test_every_example_of_a_page_is_yaml_and_its_sections_are_sound():
    for path in sorted(DOCS.rglob("*.md")):
        for text in OF_A_PAGE.findall(path.read_text("utf-8")):
            content = yaml.safe_load(text)
            assert content, path
            for key in SECTIONS.keys() & {*(content if isinstance(content, dict) else ())}:
                SECTIONS[key].model_validate(content[key])
