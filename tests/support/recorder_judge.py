"""What is suggested of a made-up recorder's file beside its truth: right, asked, missed, wrong."""

from dataclasses import dataclass
from pathlib import Path

import yaml
from recorder_files import SIGNALS, Column, RecorderFile

from exfit.case.case_draft import CaseDraft
from exfit.case.suggestion import bump_section, record_section
from exfit.case.yaml import QUESTION
from exfit.records.formats import open_table
from exfit.records.inspection import inspect

RIGHT, ASKED, MISSED, WRONG = "right", "asked", "missed", "wrong"
ORDER = (RIGHT, ASKED, MISSED, WRONG)
SCALE = 0.02  # of a base: more is another one
INSTANT = 0.05  # s: farther off, a step is another one
LINE = 0.02  # of the frequency of a ripple
TO_FILL_IN = QUESTION


@dataclass(frozen=True)
class Judged:
    """What became of a file, the worst of its parts, and why; ``questions`` is how many it asks."""

    name: str
    parts: tuple[tuple[str, str], ...]

    @property
    def outcome(self) -> str:
        """The worst of what became of its parts."""
        return max((outcome for outcome, _ in self.parts), key=ORDER.index)

    @property
    def reasons(self) -> tuple[str, ...]:
        """What was not right, in words."""
        return tuple(f"{outcome}: {text}" for outcome, text in self.parts if outcome != RIGHT)


def judged(file: RecorderFile, path: Path) -> Judged:
    """Return what is suggested of a file as it stands at a path, beside its truth."""
    inspection = inspect(open_table(path))
    sections = {**record_section(inspection, path.name), **bump_section(inspection)}
    lines = CaseDraft(sections).lines()
    suggested = yaml.safe_load("\n".join(lines))
    texts = [*inspection.findings, *_comments(lines)]
    channels = suggested["record"]["channels"]
    entries = {
        signal: {"column": entry} if isinstance(entry, str) else entry
        for signal, entry in channels.items()
    }
    parts = [_column(column, entries, texts) for column in file.columns if not _phase(column)]
    parts.append(_voltage(file, entries))
    parts.append(_test(file, suggested["test"]["vref"], entries, inspection))
    parts += [_ripple(column, texts) for column in file.rippled]
    return Judged(file.name, tuple(parts))


def _comments(lines: list[str]) -> list[str]:
    """Return the comments of a case, each with the line that it stands above."""
    texts, comment = [], ""
    for line in lines:
        if line.strip().startswith("#"):
            comment += line.strip(" #") + " "
        else:
            texts.append(comment + line)
            comment = ""
    return texts


def _phase(column: Column) -> bool:
    return column.of.startswith("phase")


def _asks(texts: list[str], column: Column, *words: str) -> bool:
    """Return whether a text about a column holds one of the words."""
    return any(column.header in text and any(word in text for word in words) for text in texts)


def _column(column: Column, entries: dict, texts: list[str]) -> tuple[str, str]:
    """Return what became of a column, with a reason."""
    used = [signal for signal, entry in entries.items() if column.header in _columns(entry)]
    if column.of == "speed" and not used:
        return RIGHT, ""  # no plant with the breaker open has it
    if column.of not in SIGNALS:
        if not used:
            return RIGHT, ""
        outcome = ASKED if _asks(texts, column, "?") else WRONG
        return outcome, f"{column.header!r} is no signal, but taken for {used}"
    if not used:
        outcome = ASKED if _asks(texts, column, "?") else MISSED
        return outcome, f"{column.header!r} is {column.of}"
    if used != [column.of]:
        alternatives = _asks(texts, column, f"{column.of} or", f"or {column.of}")
        return (ASKED if alternatives else WRONG), f"{column.header!r} is {column.of}, not {used}"
    entry = entries[column.of]
    if TO_FILL_IN in (entry.get("base"), entry.get("unit")):
        if column.sign > 0.0 or _asks(texts, column, "inverted"):
            return ASKED, f"{column.header!r}: base {entry}"
        return WRONG, f"{column.header!r} is inverted"
    if _scaled_rightly(column, entry):
        return RIGHT, ""
    words = ("inverted",) if column.sign < 0.0 else ("base", "scale", "its unit")
    outcome = ASKED if _asks(texts, column, *words) else WRONG
    return outcome, f"{column.header!r}: 1 pu is {column.sign * column.base:g}: {entry}"


def _columns(entry: dict) -> list[str]:
    return [entry.get("column"), *entry.get("phases", ())]


def _scaled_rightly(column: Column, entry: dict) -> bool:
    wanted = 1.0 / (column.sign * column.base)
    scale, base = entry.get("scale", 1.0), entry.get("base", 1.0)
    if isinstance(scale, dict):
        return bool(scale["min"] / base <= wanted <= scale["max"] / base)
    return abs(scale / base - wanted) <= SCALE * abs(wanted)


def _voltage(file: RecorderFile, entries: dict) -> tuple[str, str]:
    """Return whether the terminal voltage is taken from its columns, or is asked for."""
    of = [column.header for column in file.columns if column.of == "vt" or _phase(column)]
    given = [name for name in _columns(entries["vt"]) if name]
    if given == [TO_FILL_IN]:
        return ASKED, "which column is vt?"
    return (RIGHT, "") if {*given} <= {*of} else (WRONG, f"vt is {of}, not {given}")


def _test(file: RecorderFile, vref, entries: dict, inspection) -> tuple[str, str]:
    """Return whether the steps suggested are those that were made."""
    truth = f"one step, {file.size:g} pu at {file.at:g} s"
    if vref == "recorded":
        own = [column.header for column in file.columns if column.of == "vref"]
        return (RIGHT, "") if entries["vref"]["column"] in own else (WRONG, "not the reference")
    if len(vref) != 1:
        return WRONG, f"{truth}: {len(vref)} are suggested"
    at, size = vref[0]["at"], vref[0]["step"]
    if at == TO_FILL_IN:
        return ASKED, truth
    start = at["start"] if isinstance(at, dict) else at
    if abs(start - file.at) > INSTANT:
        return WRONG, f"{truth}: at {at}"
    if size == TO_FILL_IN:
        return ASKED, "size of the step"
    right = abs(float(size) - file.size) <= SCALE * abs(file.size)
    return (RIGHT, "") if right else (WRONG, f"{truth}: size {size}")


def _ripple(column: Column, texts: list[str]) -> tuple[str, str]:
    named = _asks(texts, column, "ripple", " Hz")
    return (RIGHT, "") if named else (MISSED, f"ripple of {column.header!r}")
