"""The generated parts of the documentation: the keys of the case file, and a page for each model.

    python docs/generate.py

writes the tables of keys into case_file.md and the pages of case_file/, a page for each section,
and the pages into models/. Sphinx calls `setup`: it writes the pages of the models, and warns where
a table of keys is out of date. What stands outside the marks of a page is written by hand.
"""

import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import yaml

import exfit
from exfit.features.drawings.diagram import block_diagram
from exfit.features.drawings.letters import diagram_and_remarks

DOCS = Path(__file__).parent
CONFIGS = DOCS.parent / "configs"
CASES = CONFIGS / "models"
CASE_FILE = DOCS / "case_file.md"
SECTIONS = DOCS / "case_file"  # the pages of the sections
LONGEST = 12  # lines of an example
MODEL_PAGES = DOCS / "models"
BEGIN, END = "<!-- keys -->", "<!-- /keys -->"

# what a value of a JSON type is called in the tables
TYPES = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
}
WIDTH, HEIGHT = 7.2, 2.2  # of a figure and of each of its panels, inches
LABELS = {name: f"{name} (pu)" for name in ("vt", "efd", "ifd", "p", "q", "it")}

Schema = Mapping[str, Any]

MACHINE_CASE = """\
model: SEXS
plant: {{type: open-circuit, machine: {name}}}
test: {{vt0: 1.0, duration: 10.0, vref: [{{at: 1.0, step: 0.05}}]}}
"""
STABILISER_CASE = """\
model: ST1A
plant: {{type: infinite-bus, machine: GENROU, network: {{f0: 60, X: 0.5, P: 0.8, E: 1.0}}}}
{stabiliser}
test: {{vt0: 1.0, duration: 10.0, vref: [{{at: 1.0, step: 0.02}}]}}
"""
GOVERNOR_CASE = """\
model: ST1A
plant: {{type: infinite-bus, machine: GENROU, network: {{f0: 60, X: 0.3, P: 0.7, Q: 0.1}}}}
{governor}
test: {{vt0: 1.0, duration: 40.0, angle: [{{at: 1.0, step: 24.5, unit: rad, ramp: 39.0}}]}}
"""
LIMITER_CASE = """\
model: {exciter}
plant: {{type: infinite-bus, machine: GENROU, network: {{f0: 60, X: 0.3, P: 0.7, Q: 0.1}}}}
{limiter}
test: {{vt0: 1.0, duration: 20.0, vref: [{{at: 1.0, step: {step}}}]}}
"""
# by limiter: an exciter, data by which it acts, a step of the reference, the signal that is drawn
LIMITER_EXAMPLES: Mapping[str, tuple[str, str, float, str]] = {
    "OEL2C": ("ST1A", "ITFPU: 1.9, ILIM: 1.9, IINST: 4.0, KPOEL: 20.0, K2: 20.0", 0.1, "ifd"),
    "OEL3C": ("AC8C", "ITFPU: 1.9, VOELMAX1: 0.1", 0.1, "ifd"),
    "OEL5C": (
        "AC8C",
        "KSCALE1: 0.52, IFDLIM: 0.3, VOELMAX1: 0.5, KPOEL: 0.3, KIOEL: 1.0",
        0.1,
        "ifd",
    ),
    "SCL1C": ("AC8C", "ISCLLIM: 0.73, KIOEX: 0.5", 0.1, "it"),
    "SCL2C": (
        "ST1A",
        "ITFPU: 0.75, ILIM: 0.75, K2: 100.0, KPOEL: 6.0, KIOEL: 3.0, TAOEL: 0.5",
        0.1,
        "it",
    ),
    "UEL1": ("ST1A", "KUR: 1.6, KUL: 7.0", -0.15, "q"),
    "UEL2C": ("AC8C", "", -0.15, "q"),
}


# ---- keys of the case file


@dataclass(frozen=True)
class Part:
    """A mapping of the case file: its keys, and the places at which a file may have it."""

    schema: Schema
    places: list[str] = field(default_factory=list)

    @property
    def heading(self) -> str:
        """The first of its places, with its type or kind where others may stand there."""
        return self.places[0]

    @property
    def page(self) -> str:
        """The section of the case file in which it is described."""
        return re.match(r"\w+", self.heading)[0]


class KeyTables:
    """The tables of keys of the case file, as Markdown, for the page of each section."""

    def __init__(self, schema: Schema) -> None:
        self.schema = schema
        self.examples = examples()
        self.parts = {name: Part(part) for name, part in schema["$defs"].items()}
        # a parameter that is fitted stands in many sections: it has its place under `parameters`
        reached = sorted(self._below(schema, ""), key=lambda found: found[1] != "parameters")
        order: dict[str, Part] = {}
        for name, place, kind in reached:
            part = order.setdefault(name, self.parts[name])
            if not part.places and any(place in other.places for other in order.values()):
                part.places.append(f"{place}{kind}")
            elif place not in part.places and (
                not part.places or place.count(".") == part.heading.count(".")
            ):
                part.places.append(place)
                reached += self._below(part.schema, place)
        self.order = list(order.values())

    def _below(self, section: Schema, above: str) -> Iterator[tuple[str, str, str]]:
        """Yield the names of the parts in a section, their places, and the kind of the section."""
        place, bracket, kind = above.partition(" (")
        for key, value in section["properties"].items():
            inner = self._inner(value)
            for name in inner:
                own = f" ({self._kind(name)})" if len(inner) > 1 else ""
                yield name, f"{place}.{key}{own}".lstrip("."), f"{bracket}{kind}"

    def _inner(self, value: Any) -> list[str]:
        """Return the names of the parts that the value of a key may be, or that it holds."""
        if isinstance(value, list):
            return [name for part in value for name in self._inner(part)]
        if not isinstance(value, Mapping):
            return []
        if "$ref" in value:
            name = str(value["$ref"]).rpartition("/")[2]
            part = self.parts[name].schema
            return [name] if "properties" in part else self._inner(part)
        keys = ("anyOf", "oneOf", "items", "prefixItems", "additionalProperties")
        return list(dict.fromkeys(name for key in keys for name in self._inner(value.get(key))))

    def _kind(self, name: str) -> str:
        """Return what distinguishes a part from others: its type or kind, or its first key."""
        part = self.parts[name].schema
        words = (part["properties"].get(key, {}).get("const") for key in ("type", "kind"))
        return str(next(filter(None, words), part["required"][0]))

    @cached_property
    def pages(self) -> dict[Path, str]:
        """The tables of each page: of the top level, then of each section."""
        top = {CASE_FILE: self._table(self.schema, "case_file")}
        sections: dict[str, list[Part]] = {}
        for part in self.order:
            sections.setdefault(part.page, []).append(part)
        for key in self.schema["properties"]:
            parts = sorted(sections.get(key, ()), key=lambda part: part.heading.count("."))
            if parts:
                top[SECTIONS / f"{key}.md"] = "\n\n".join(map(self._section, parts))
        return top

    def _section(self, part: Part) -> str:
        """Return a part of a page: a heading, what it is, an example, and its table."""
        first, *others = part.places
        lines = [] if first == part.page else [f"## {first}"]
        lines.append(_cell(part.schema["description"]))
        if others:
            lines.append(
                f"The same keys stand under {', '.join(f'`{place}`' for place in others)}."
            )
        if first in self.examples:
            path, text = self.examples[first]
            lines.append(f"From `{path}`:\n\n```yaml\n{text}\n```")
        return "\n\n".join([*lines, self._table(part.schema, part.page)])

    def _table(self, section: Schema, page: str) -> str:
        required = section.get("required", [])
        rows = [
            (
                f"`{key}`",
                self._value(value, page),
                "required" if key in required else _default(value),
                _cell(value.get("description") or self._about(value)),
            )
            for key, value in sorted(
                section["properties"].items(), key=lambda pair: pair[0] not in required
            )
            if not value.get("deprecated")
        ]
        return _table(("key", "value", "default", "meaning"), rows)

    def _about(self, value: Schema) -> str:
        """Return the description of the part that a value is."""
        return " ".join(self.parts[name].schema["description"] for name in self._inner(value))

    def _value(self, value: Schema, page: str) -> str:
        """Return what the value of a key may be: its type and limits, with links to the parts."""
        inner = self._inner(value)

        def words(part: Schema) -> str:
            if "$ref" in part:
                name = str(part["$ref"]).rpartition("/")[2]
                if not self.parts[name].places:
                    return words(self.parts[name].schema)
                kind = self._kind(name) if len(inner) > 1 else "mapping"
                return f"[{kind}]({self._link(self.parts[name], page)})"
            if "const" in part:
                return f"`{part['const']}`"
            if "enum" in part:
                return ", ".join(f"`{word}`" for word in part["enum"])
            choices = part.get("anyOf") or part.get("oneOf")
            if choices:
                return " or ".join(dict.fromkeys(words(choice) for choice in choices))
            if part.get("type") == "array":
                items = part.get("items") or part["prefixItems"][0]
                least, most = part.get("minItems"), part.get("maxItems")
                count = f" {most}" if least == most and most is not None else ""
                return f"list of{count} {words(items)}"
            if part.get("type") == "object":
                return f"name: {words(part['additionalProperties'])}"
            return TYPES[part["type"]] + _limits(part)

        return words(value)

    def _link(self, part: Part, page: str) -> str:
        """Return the link from a page to a part."""
        folder = "case_file/" if page == "case_file" else ""
        file = "" if part.page == page else f"{folder}{part.page}.md"
        anchor = "" if part.heading == part.page else f"#{_anchor(part.heading)}"
        return f"{file}{anchor}" or f"#{_anchor(part.page)}"


def examples() -> dict[str, tuple[str, str]]:
    """Return for each place an example: the case that has most of its keys in few lines."""
    best: dict[str, tuple[int, str, str]] = {}
    for path in sorted(CONFIGS.rglob("*.yaml")):
        for key, text in _top_level(path.read_text(encoding="utf-8")):
            content = yaml.safe_load(text)[key]
            for value, lines in _entries(key, content, text):
                kind = next((value[word] for word in ("type", "kind") if word in value), "")
                kind = "bump" if key == "tests" and not kind else kind
                place = f"{key} ({kind})" if kind else key
                keys = str(value).count(":")
                if lines.count("\n") < LONGEST and keys > best.get(place, (0,))[0]:
                    best[place] = (keys, path.relative_to(DOCS.parent).as_posix(), lines)
    return {place: example for place, (_, *example) in best.items()}


def _top_level(text: str) -> Iterator[tuple[str, str]]:
    """Yield the sections of a case with their lines."""
    for match in re.finditer(r"^(\w+):.*\n(?:[ ].*\n)*", text, re.MULTILINE):
        yield match[1], match[0].rstrip()


def _entries(key: str, content: Any, text: str) -> Iterator[tuple[Mapping[str, Any], str]]:
    """Yield the mappings of a section with their lines: the section itself, or its entries."""
    if isinstance(content, Mapping):
        yield content, text
    elif isinstance(content, list):
        head, *entries = re.split(r"^(?=  - )", text, flags=re.MULTILINE)
        for value, lines in zip(content, entries, strict=False):
            yield value, f"{head}{lines.rstrip()}"


def _anchor(heading: str) -> str:
    """Return the anchor of a heading, as Markdown on the web makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _limits(part: Schema) -> str:
    """Return the limits of a number or the greatest length of a text."""
    signs = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}
    limits = [f"{sign} {part[key]:,}" for key, sign in signs.items() if key in part]
    if "maxLength" in part:
        limits.append(f"of at most {part['maxLength']} characters")
    return f" {', '.join(limits)}" if limits else ""


def _default(value: Schema) -> str:
    default = value.get("default")
    return "" if default is None or default in ({}, []) else f"`{_yaml(default)}`"


def _yaml(value: Any) -> str:
    """Return a value as a case file has it, on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_yaml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def key_pages() -> dict[Path, str]:
    """Return the pages with keys of the case file: what is written by hand, and the tables."""
    from exfit.case.json_schema import json_schema

    return {path: _with_tables(path, text) for path, text in KeyTables(json_schema()).pages.items()}


def _with_tables(path: Path, tables: str) -> str:
    """Return a page with the tables between their marks; a new page has a title and no more."""
    page = f"# {path.stem}\n\n{BEGIN}{END}\n"
    if path.exists():
        page = path.read_text(encoding="utf-8")
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{tables}\n\n{END}{after}"


# ---- pages of the models


def model_pages(folder: Path = MODEL_PAGES) -> list[Path]:
    """Write a page and a figure for each model; return the pages."""
    from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS
    from exfit.models.machines import MACHINES

    pages = []
    for model in MODELS.values():
        case = CASES / f"{model.name.lower()}.yaml"
        responses = {"": exfit.simulate(exfit.load_case(case)).response}
        _draw(responses, ("vt", "efd"), folder / f"{model.name}.svg")
        caption = f"The response of the case `configs/models/{case.name}`, which has typical data."
        pages.append(_model_page(model, caption, folder))
    on_load = "The active power of a GENROU machine with ST1A on load, "
    added = (
        (STABILISERS, "stabiliser", STABILISER_CASE, "after a step of 2 % of the reference."),
        (
            GOVERNORS,
            "governor",
            GOVERNOR_CASE,
            "when the grid's frequency rises by 0.1 Hz of 60 Hz at 1 s.",
        ),
        (
            LOAD_CONTROLLERS,
            "load controller",
            GOVERNOR_CASE.replace("{governor}", "governor: {{model: TGOV1{load controller}}}"),
            "with TGOV1 when the grid's frequency rises by 0.1 Hz of 60 Hz at 1 s.",
        ),
    )
    in_case = {"load controller": ", load_controller: {{model: {}}}"}
    for models, kind, case_text, event in added:
        for model in models.values():
            with_it, without = (
                case_text.format(**{kind: line})
                for line in (
                    in_case.get(kind, f"{kind}: {{{{model: {{}}}}}}").format(model.name),
                    "",
                )
            )
            responses = {f"with {kind}": _response(with_it), "without": _response(without)}
            _draw(responses, ("p",), folder / f"{model.name}.svg")
            caption = f"{on_load}{event} All data are typical."
            pages.append(_model_page(model, caption, folder))
    pages += [_limiter_page(model, folder) for model in LIMITERS.values()]
    for machine in MACHINES.values():
        responses = {"": _response(MACHINE_CASE.format(name=machine.name))}
        _draw(responses, ("vt", "efd"), folder / f"{machine.name}.svg")
        pages.append(_machine_page(machine, folder))
    return pages


def _limiter_page(model: Any, folder: Path) -> Path:
    """Write the page of a limiter and its figure: a step into its limit, with it and without."""
    exciter, given, step, signal = LIMITER_EXAMPLES[model.name]
    limiter = f"limiters: [{{model: {model.name}, parameters: {{{given}}}}}]"
    with_it, without = (
        LIMITER_CASE.format(exciter=exciter, limiter=line, step=step) for line in (limiter, "")
    )
    responses = {"with limiter": _response(with_it), "without": _response(without)}
    _draw(responses, (signal,), folder / f"{model.name}.svg")
    data = f", with {given}" if given else ""
    caption = (
        f"A GENROU machine with {exciter} on load after a step of {100.0 * step:g} % of the "
        f"reference. All data are typical{data}."
    )
    return _model_page(model, caption, folder)


@cache
def _response(case: str) -> Any:
    """Return the response of a case that is given as text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.yaml"
        path.write_text(case, encoding="utf-8")
        return exfit.simulate(exfit.load_case(path)).response


def _model_page(model: Any, caption: str, folder: Path) -> Path:
    title, source = _title_and_source(model.title)
    _, remarks = diagram_and_remarks(model.drawing)
    parts = [
        f"# {model.name}",
        f"{title[:1].upper()}{title[1:]}.",
        _diagram(model),
        *map(_escaped, remarks),
        *([f"{model.name} {_escaped(model.doubt)}."] if model.doubt else []),
        f"## Data sheet\n\n{_sheet(model.sheet)}",
        f"States: {', '.join(model.states)}.",
        f"## Response\n\n![response of {model.name}]({model.name}.svg)\n\n{caption}",
        f"## Sources\n\n{_sources(source, model)}",
    ]
    return _write(folder / f"{model.name}.md", parts)


def _machine_page(machine: Any, folder: Path) -> Path:
    title = f"{machine.title[:1].upper()}{machine.title[1:]}"
    q_axis = f" On load also {', '.join(machine.q_axis)} and those of the swing equation."
    parts = [
        f"# {machine.name}",
        f"Synchronous machine: {title[:1].lower()}{title[1:]}.",
        _diagram(machine),
        *map(_escaped, diagram_and_remarks(machine.drawing)[1]),
        f"## Data sheet\n\n{_sheet(machine.sheet)}",
        f"States: {', '.join(machine.d_axis)}.{q_axis if machine.q_axis else ''}",
        "## Response",
        f"![response of {machine.name}]({machine.name}.svg)",
        "On open circuit with SEXS, a step of 5 % of the reference. All data are typical.",
        f"## Sources\n\n{_sources('', machine)}",
    ]
    return _write(folder / f"{machine.name}.md", parts)


def _title_and_source(title: str) -> tuple[str, str]:
    """Return a title without its source in brackets, and the source."""
    match = re.fullmatch(r"(.*?) \(([^()]*(?:421\.5|PSS/E|IEEE)[^()]*)\)", title)
    return (match[1], match[2]) if match else (title, "")


def _diagram(model: Any) -> str:
    """Return the block diagram of a model: SVG in the page, in the colours that a reader chose."""
    diagram = block_diagram(model.drawing, model.name, model.title)
    region = f'<div class="diagram-region" tabindex="0">\n{diagram}\n</div>'
    return f"## Block diagram\n\n```{{raw}} html\n{region}\n```" if diagram else ""


def _sheet(rows: Iterable[Any]) -> str:
    return _table(
        ("symbol", "meaning", "typical", "unit", "range"),
        [(row.symbol, row.meaning, f"{row.typical:g}", row.unit, _range(row)) for row in rows],
    )


def _range(row: Any) -> str:
    return f"{row.low:g} ... {row.high:g}".replace(" ", "\u00a0")  # on one line


def _sources(source: str, model: Any) -> str:
    return "\n".join(
        [
            *([f"* {source}"] if source else []),
            *(
                f"* PSS/E record {record.name}: `{' '.join(record.cons)}`"
                + (f" ({record.doubt})" if record.doubt else "")
                for record in model.records
            ),
            "* [Verification](../verification.md) says what the model was compared with.",
        ]
    )


def _draw(responses: Mapping[str, Any], signals: Iterable[str], path: Path) -> None:
    """Draw some signals of responses, each under its label."""
    import matplotlib
    from matplotlib.figure import Figure

    names = [name for name in signals if all(name in it.signals for it in responses.values())]
    figure = Figure(figsize=(WIDTH, HEIGHT * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        for label, response in responses.items():
            axes.plot(response.time, response.signals[name], label=label)
        axes.set_ylabel(LABELS[name])
        axes.grid(alpha=0.3)
        if len(responses) > 1:
            axes.legend(frameon=False)
    panels[-1].set_xlabel("time (s)")
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure.savefig(path)


# ---- Markdown


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _escaped(text: str) -> str:
    """Return plain text with the characters escaped that Markdown would read."""
    return re.sub(r"([\\`*_\[\]<>|])", r"\\\1", text)


def _write(path: Path, parts: Iterable[str]) -> Path:
    path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return path


# ---- Sphinx


def with_contents(_app: Any, name: str, source: list[str]) -> None:
    """Add to an index its table of contents: its groups of links, or the pages of its folder."""
    if name == "index":
        groups = re.findall(r"^## (.+)\n\n((?:\* .+\n)+)", source[0], re.MULTILINE)
        for group, links in groups:
            pages = "\n".join(re.findall(r"\]\((.+?)\.(?:md|ipynb)\)", links))
            source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {group}\n\n{pages}\n```\n"
    elif name == "case_file":
        pages = "\n".join(f"case_file/{path.stem}" for path in key_pages() if path != CASE_FILE)
        source[0] += f"\n```{{toctree}}\n:hidden:\n\n{pages}\n```\n"
    elif name == "models/index":
        source[0] += "\n## All models\n\n```{toctree}\n:maxdepth: 1\n:glob:\n\n[A-Z]*\n```\n"


def with_literal_tables(_app: Any, *where: Any) -> None:
    """Set the aligned tables of a docstring as they are: its other paragraphs are plain text."""
    lines = where[-1]
    paragraphs = [text.split("\n") for text in "\n".join(lines).split("\n\n")]
    lines[:] = [line for paragraph in paragraphs for line in (*_set(paragraph), "")]


def _set(paragraph: list[str]) -> list[str]:
    example = any(">>>" in line for line in paragraph)
    if not example and any(re.search(r"\S {2,}\S", line) for line in paragraph):
        return ["::", "", *(f"    {line}" for line in paragraph)]
    return paragraph


def without_fields(_app: Any, what: str, *_: Any) -> tuple[str, None] | None:
    """Leave the fields out of the head of a class: its docstring has those that matter."""
    return ("", None) if what == "class" else None


def prepare(_app: Any) -> None:
    """Write the pages of the models; warn where the tables of keys are not those of the schema."""
    from sphinx.util import logging

    model_pages()
    for path, page in key_pages().items():
        if not path.exists() or path.read_text(encoding="utf-8") != page:
            logging.getLogger(__name__).warning(f"{path.name}: run python docs/generate.py")


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("builder-inited", prepare)
    app.connect("source-read", with_contents)
    app.connect("autodoc-process-docstring", with_literal_tables)
    app.connect("autodoc-process-signature", without_fields)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    model_pages()
    SECTIONS.mkdir(exist_ok=True)
    for key_page, text in key_pages().items():
        key_page.write_text(text, encoding="utf-8")
