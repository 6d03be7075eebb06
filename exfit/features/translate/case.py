"""A case with another exciter in place of its own: the same tests and records, other parameters."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from exfit.case.draft.free_parameters import BOUNDS, bounds_of, free_of
from exfit.case.draft.suggestion import relative
from exfit.case.templates import commented, source_lines
from exfit.case.yaml import read_yaml
from exfit.models.sheet import Model, Parameter
from exfit.util.sources import FITTED
from exfit.util.text import yaml_number

TEST: Mapping[str, Any] = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}], "duration": 10.0}
EXCITER = ("model", "parameters")  # the sections that change


def translated_case(
    text: str,
    case: Path,
    folder: Path,
    model: tuple[str, Model],
    values: Mapping[str, float],
    provenance: Mapping[str, str],
    sources: Mapping[str, str],
    plant: Mapping[str, Any],
    heading: str,
) -> str:
    """Return the text of a case of another model, to be written into ``folder``.

    ``model`` is behind the name that the case gives it, ``text`` that of the fitted ``case``. Where
    there is no such text, the case is one of ``plant``, without a record. What the fit found for
    the machine is where its parameters start. ``provenance`` says in words where each of the
    ``values`` comes from, ``sources`` in the words of a case.
    """
    name, sheet = model
    content = read_yaml(text, case)[0].value if text else {"plant": plant, "test": TEST}
    sections = {key: value for key, value in content.items() if key not in EXCITER}
    sections = _moved(sections, case.parent, folder)
    sections["plant"] = _with_values(sections.get("plant", {}), plant.get("parameters", {}))
    dumped = yaml.safe_dump(
        sections, sort_keys=False, default_flow_style=None, allow_unicode=True, width=100
    )
    lines = [f"# {line}" for line in heading.splitlines()]
    lines += [f"model: {name}", *dumped.splitlines()]
    lines += ["parameters:", *_parameters(sheet, values, provenance)]
    lines += source_lines(sources, "  ")
    return "\n".join(lines) + "\n"


def _moved(content: Any, before: Path, now: Path) -> Any:
    """Return content whose files are named from another folder."""
    if isinstance(content, Mapping):
        return {
            key: relative((before / value).absolute(), now.absolute())
            if key == "file" and isinstance(value, str)
            else _moved(value, before, now)
            for key, value in content.items()
        }
    return (
        [_moved(entry, before, now) for entry in content] if isinstance(content, list) else content
    )


def _with_values(plant: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Return a plant section with fitted values, and numbers for what followed the exciter."""
    given = {
        symbol: values.get(symbol, value) if isinstance(value, str) else value
        for symbol, value in plant.get("parameters", {}).items()
    }
    free = {
        symbol: {**section, "start": values.get(symbol, section.get("start"))}
        for symbol, section in plant.get("free", {}).items()
    }
    sources = {**plant.get("sources", {}), **dict.fromkeys(free, FITTED)}
    return {
        **plant,
        **({"parameters": given} if given else {}),
        **({"free": free} if free else {}),
        **({"sources": sources} if sources else {}),
    }


def _parameters(
    model: Model, values: Mapping[str, float], provenance: Mapping[str, str]
) -> Iterator[str]:
    free = free_of(model, values)
    yield "  fixed:"
    for row in model.sheet:
        if row not in free:
            line = f"    {row.symbol}: {yaml_number(values[row.symbol])}"
            yield commented(line, f"{row.unit}, {provenance[row.symbol]}")
    if free:
        yield "  free:"
    for row in free:
        yield f"    # {row.unit}, {row.meaning}; {provenance[row.symbol]}"
        yield f"    {row.symbol}: {{{_section(row, values[row.symbol])}}}"


def _section(row: Parameter, value: float) -> str:
    """Return a start within the bounds of a fit, also where it is not physical."""
    low, high = bounds_of(row, value)
    if not row.low <= value <= row.high:
        low, high = sorted(share * value for share in BOUNDS)
    bounds = float(f"{min(low, value):.6g}"), float(f"{max(high, value):.6g}")
    start, low_text, high_text = (yaml_number(number) for number in (value, *bounds))
    scale = "" if value > 0.0 else ", scale: linear"
    return f"start: {start}, min: {low_text}, max: {high_text}{scale}"
