"""A case with another exciter in place of its own: the same tests and records, other parameters."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exfit.case.draft.case_draft import CaseDraft, Noted, Section, with_sources
from exfit.case.draft.free_parameters import BOUNDS, bounds_of, free_of
from exfit.case.draft.suggestion import relative
from exfit.case.yaml import read_yaml
from exfit.models.sheet import Model, Parameter
from exfit.util.sources import FITTED

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
    case_draft = CaseDraft(
        {
            "model": name,
            **sections,
            "parameters": with_sources(_parameters(sheet, values, provenance), sources),
        },
        tuple(heading.splitlines()),
    )
    return case_draft.text


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
) -> Section:
    free = free_of(model, values)
    section: Section = {
        "fixed": {
            row.symbol: Noted(values[row.symbol], f"{row.unit}, {provenance[row.symbol]}")
            for row in model.sheet
            if row not in free
        }
    }
    if free:
        section["free"] = {
            row.symbol: Noted(
                _start(row, values[row.symbol]),
                above=f"{row.unit}, {row.meaning}; {provenance[row.symbol]}",
            )
            for row in free
        }
    return section


def _start(row: Parameter, value: float) -> Section:
    """Make a start within the bounds of a fit, also where it is not physical."""
    low, high = bounds_of(row, value)
    if not row.low <= value <= row.high:
        low, high = sorted(share * value for share in BOUNDS)
    bounds = {"min": float(f"{min(low, value):.6g}"), "max": float(f"{max(high, value):.6g}")}
    return {"start": value, **bounds, **({} if value > 0.0 else {"scale": "linear"})}
