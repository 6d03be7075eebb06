"""The generated parts of the documentation: the keys of the case file, and a page for each model.

    python docs/generate.py

writes the key tables into case_file.md and the pages into models/. Sphinx calls `setup`: it writes
the pages of the models, and warns where the key tables are out of date.
"""

import re
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import exfit
from exfit.features.drawings.diagram import block_diagram
from exfit.features.drawings.letters import diagram_and_remarks

DOCS = Path(__file__).parent
CASES = DOCS.parent / "configs" / "models"
CASE_FILE = DOCS / "case_file.md"
MODEL_PAGES = DOCS / "models"
BEGIN, END = "<!-- keys -->", "<!-- /keys -->"

# what a value of a JSON type is called in the tables
TYPES = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
}
WIDTH, HEIGHT, DPI = 7.2, 2.2, 110  # of a figure and of each of its panels, inches
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


def key_tables() -> str:
    """Return a table for each section of the case file, as Markdown."""
    from exfit.case.json_schema import json_schema

    schema = json_schema()
    sections = {"": schema, **schema["$defs"]}
    headings = _headings(sections)
    return "\n\n".join(_section(name, headings, sections) for name in headings)


def _headings(sections: Mapping[str, Schema]) -> dict[str, str]:
    """Return the heading of each section: the shortest places at which a case file has it."""
    places: dict[str, list[str]] = {}
    reached = [("", "top level")]
    for name, place in reached:
        if place.count(".") > places.get(name, [place])[0].count("."):
            continue
        places.setdefault(name, []).append(place)
        for key, value in sections[name]["properties"].items():
            inner = _inner(value, sections)
            above = "" if name == "" else f"{place.partition(' (')[0]}."
            for other in inner:
                kind = f" ({_kind(sections[other])})" if len(inner) > 1 else ""
                if f"{above}{key}{kind}" not in places.get(other, ()):
                    reached.append((other, f"{above}{key}{kind}"))
    return {name: ", ".join(dict.fromkeys(all_places)) for name, all_places in places.items()}


def _inner(value: Any, sections: Mapping[str, Schema]) -> list[str]:
    """Return the names of the sections that the value of a key may be, or that it holds."""
    if isinstance(value, list):
        return [name for part in value for name in _inner(part, sections)]
    if not isinstance(value, Mapping):
        return []
    if "$ref" in value:
        name = str(value["$ref"]).rpartition("/")[2]
        part = sections[name]
        return [name] if "properties" in part else _inner(part, sections)
    parts = ("anyOf", "oneOf", "items", "prefixItems", "additionalProperties")
    return list(dict.fromkeys(name for key in parts for name in _inner(value.get(key), sections)))


def _kind(section: Schema) -> str:
    """Return what distinguishes a section from others: its type or kind, or its first key."""
    words = (section["properties"].get(key, {}).get("const") for key in ("type", "kind"))
    return str(next(filter(None, words), section["required"][0]))


def _section(name: str, headings: Mapping[str, str], sections: Mapping[str, Schema]) -> str:
    section = sections[name]
    required = section.get("required", [])
    rows = [
        (
            f"`{key}`" + (" (required)" if key in required else ""),
            _value(value, headings, sections),
            _cell(value.get("description") or _about(value, sections)) + _default(value),
        )
        for key, value in sorted(
            section["properties"].items(), key=lambda pair: pair[0] not in required
        )
    ]
    table = _table(("key", "value", "meaning"), rows)
    return f"### {headings[name]}\n\n{_cell(section['description'])}\n\n{table}"


def _about(value: Schema, sections: Mapping[str, Schema]) -> str:
    """Return the description of the section that a value is."""
    return " ".join(sections[name]["description"] for name in _inner(value, sections))


def _value(value: Schema, headings: Mapping[str, str], sections: Mapping[str, Schema]) -> str:
    """Return what the value of a key may be, with links to the sections."""
    inner = _inner(value, sections)

    def words(part: Schema) -> str:
        if "$ref" in part:
            name = str(part["$ref"]).rpartition("/")[2]
            if name not in headings:
                return words(sections[name])
            kind = _kind(sections[name]) if len(inner) > 1 else "mapping"
            return f"[{kind}](#{_anchor(headings[name])})"
        if "const" in part:
            return f"`{part['const']}`"
        if "enum" in part:
            return ", ".join(f"`{word}`" for word in part["enum"])
        choices = part.get("anyOf") or part.get("oneOf")
        if choices:
            return " or ".join(dict.fromkeys(words(choice) for choice in choices))
        if part.get("type") == "array":
            items = part.get("items") or part["prefixItems"][0]
            return f"list of {words(items)}"
        if part.get("type") == "object":
            return f"name: {words(part['additionalProperties'])}"
        return TYPES[part["type"]]

    return words(value)


def _anchor(heading: str) -> str:
    """Return the anchor of a heading, as Markdown on the web makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _default(value: Schema) -> str:
    default = value.get("default")
    return "" if default is None or default in ({}, []) else f" Default: `{_yaml(default)}`."


def _yaml(value: Any) -> str:
    """Return a value as a case file has it, on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_yaml(inner)}" for key, inner in value.items()) + "}"
    return f"{value:g}" if isinstance(value, float) else str(value)


# ---- pages of the models


def model_pages(folder: Path = MODEL_PAGES) -> list[Path]:
    """Write a page and a figure for each model; return the pages."""
    from exfit.models import GOVERNORS, LIMITERS, MODELS, STABILISERS
    from exfit.models.machines import MACHINES

    pages = []
    for model in MODELS.values():
        case = CASES / f"{model.name.lower()}.yaml"
        responses = {"": exfit.simulate(exfit.load_case(case)).response}
        _draw(responses, ("vt", "efd"), folder / f"{model.name}.png")
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
    )
    for models, kind, case_text, event in added:
        for model in models.values():
            with_it, without = (
                case_text.format(**{kind: line})
                for line in (f"{kind}: {{model: {model.name}}}", "")
            )
            responses = {f"with {kind}": _response(with_it), "without": _response(without)}
            _draw(responses, ("p",), folder / f"{model.name}.png")
            caption = f"{on_load}{event} All data are typical."
            pages.append(_model_page(model, caption, folder))
    pages += [_limiter_page(model, folder) for model in LIMITERS.values()]
    for machine in MACHINES.values():
        responses = {"": _response(MACHINE_CASE.format(name=machine.name))}
        _draw(responses, ("vt", "efd"), folder / f"{machine.name}.png")
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
    _draw(responses, (signal,), folder / f"{model.name}.png")
    data = f", with {given}" if given else ""
    caption = (
        f"A GENROU machine with {exciter} on load after a step of {100.0 * step:g} % of the "
        f"reference. All data are typical{data}."
    )
    return _model_page(model, caption, folder)


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
        f"## Response\n\n![response of {model.name}]({model.name}.png)\n\n{caption}",
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
        f"![response of {machine.name}]({machine.name}.png)",
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
    from matplotlib.figure import Figure

    names = [name for name in signals if all(name in it.signals for it in responses.values())]
    figure = Figure(figsize=(WIDTH, HEIGHT * len(names)), layout="constrained", dpi=DPI)
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        for label, response in responses.items():
            axes.plot(response.time, response.signals[name], label=label)
        axes.set_ylabel(LABELS[name])
        axes.grid(alpha=0.3)
        if len(responses) > 1:
            axes.legend(frameon=False)
    panels[-1].set_xlabel("time (s)")
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


def with_key_tables(page: str) -> str:
    """Return a page with the key tables between their marks."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{key_tables()}\n\n{END}{after}"


# ---- Sphinx


def with_contents(_app: Any, name: str, source: list[str]) -> None:
    """Add to an index its table of contents: its groups of links, or the pages of its folder."""
    if name == "index":
        groups = re.findall(r"^## (.+)\n\n((?:\* .+\n)+)", source[0], re.MULTILINE)
        for group, links in groups:
            pages = "\n".join(re.findall(r"\]\((.+?)\.(?:md|ipynb)\)", links))
            source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {group}\n\n{pages}\n```\n"
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
    """Write the pages of the models; warn where the key tables are not those of the schema."""
    from sphinx.util import logging

    model_pages()
    page = CASE_FILE.read_text(encoding="utf-8")
    if with_key_tables(page) != page:
        logging.getLogger(__name__).warning("case_file.md: run python docs/generate.py")


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("builder-inited", prepare)
    app.connect("source-read", with_contents)
    app.connect("autodoc-process-docstring", with_literal_tables)
    app.connect("autodoc-process-signature", without_fields)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    model_pages()
    CASE_FILE.write_text(with_key_tables(CASE_FILE.read_text(encoding="utf-8")), encoding="utf-8")
