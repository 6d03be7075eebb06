"""What exfit makes of a nameless file beside its truth: right, asked, or wrong in silence."""

from pathlib import Path

import yaml
from drawn_recordings import BUMP, EVENT, PHASES, NamelessFile
from recorder_judge import ASKED, MISSED, RIGHT, SCALE, WRONG, Judged

from exfit.case.case_draft import CaseDraft
from exfit.case.suggestion import suggested_sections
from exfit.case.yaml import QUESTION
from exfit.records.formats import open_table
from exfit.records.inspection import Inspection, inspect

NEEDED = ("vt", "efd", "ifd", "vref", *PHASES)  # of a bump test; others may be left out of it
ON_LOAD = ("p", "q")
DRIVING = ("frequency", "angle")
INSTANT = 0.05  # s, beside the stated error


def judged(file: NamelessFile, path: Path) -> Judged:
    """Return what is suggested of a file as it stands at a path, beside its truth."""
    inspection = inspect(open_table(path))
    kind = inspection.kind
    asked = QUESTION in kind.why
    text = f"taken for a {kind.name}: {kind.why}"
    parts = [(RIGHT if kind.name == file.kind else ASKED if asked else WRONG, text)]
    sections = suggested_sections(inspection, path.name)
    suggested = yaml.safe_load("\n".join(CaseDraft(sections).lines()))
    entries = suggested.get("record", {}).get("channels", {})
    for column in file.columns:
        parts.append(_column(file, column, inspection, entries))
    if file.kind == BUMP and kind.name == BUMP and inspection.steps:
        parts.append(_step(file, inspection))
    return Judged(file.name, tuple(parts))


def _needed(file: NamelessFile, of: str) -> bool:
    """Whether a case of the file's kind uses a signal."""
    if file.kind == EVENT:
        first = next(c.of for c in file.columns if c.of in DRIVING)
        return of in ("vt", "p", "q", "ifd", first)
    return of in NEEDED or (of in ON_LOAD and file.loaded)


def _column(file, column, inspection: Inspection, entries) -> tuple[str, str]:
    channel = next(c for c in inspection.channels if c.name == column.header)
    what = f"{column.header!r} is {column.of} [{column.unit or '-'}]"
    if column.of in PHASES:
        grouped = any(column.header in group.columns for group in inspection.phases)
        return (RIGHT if grouped else ASKED if channel.question else MISSED), what
    if inspection.pmu is not None and column.header in inspection.pmu.columns:
        return (RIGHT if column.of in (*DRIVING, "vt") else WRONG), f"{what}, not of a phasor"
    taken = channel.signal
    if taken is None:
        if column.of not in NEEDED + ON_LOAD + DRIVING or not _needed(file, column.of):
            return RIGHT, ""
        return (ASKED if channel.question else MISSED), what
    if taken != column.of:
        return (ASKED if channel.question else WRONG), f"{what}, not {taken}"
    entry = entries.get(taken)
    if entry is None:
        return RIGHT, ""
    entry = {"column": entry} if isinstance(entry, str) else entry
    if QUESTION in (entry.get("base"), entry.get("unit")):
        known = entry.get("unit") in (QUESTION, column.unit or QUESTION)
        return (RIGHT, "") if known else (WRONG, f"{what}: unit {entry}")  # the rating is asked
    if taken in DRIVING:
        unit = {180.0: "deg"}.get(round(column.base * 3.14159265), "rad")
        if taken == "frequency":
            unit = "Hz" if column.base > 1.0 else "pu"
        return (RIGHT, "") if entry.get("unit") == unit else (WRONG, f"{what}: {entry}")
    scale, base = entry.get("scale", 1.0), entry.get("base", 1.0)
    if isinstance(scale, dict):
        fits = scale["min"] / base <= 1.0 / column.base <= scale["max"] / base
    else:
        fits = abs(scale / base - 1.0 / column.base) <= SCALE / column.base
    if fits:
        return RIGHT, ""
    return (ASKED if channel.question else WRONG), f"{what}: 1 pu is {column.base:g}: {entry}"


def _step(file: NamelessFile, inspection: Inspection) -> tuple[str, str]:
    step = inspection.steps[0]
    text = f"step of {file.size:g} at {file.at:g} s: {len(inspection.steps)}, {step.at:.3f}"
    text += f" +- {step.error:.2g}"
    if len(inspection.steps) != 1 or abs(step.at - file.at) > max(2.0 * step.error, INSTANT):
        return WRONG, text
    return RIGHT, ""
