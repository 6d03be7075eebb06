"""The sections of a case that an inspected record suggests: record and test, with what to check."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import yaml

from exfit.case.templates import commented
from exfit.records.channel_inspection import AT_REST_PU, InspectedChannel
from exfit.records.channel_recognition import connection_of
from exfit.records.inspection import InspectedPhases, Inspection
from exfit.records.steps import RecordedStep
from exfit.records.units import quantity_of
from exfit.signals import COMPARED, RECORDED, SIGNALS
from exfit.util.text import yaml_number

FILL_IN = '"?"'  # no number: a case that holds it is refused by place
AROUND = 0.25  # s: how far the instant of a step may be from where the record shows it
LARGEST_PU = 30.0  # what a signal in per unit stays below: ceilings are lower
DIGITS = 4
OUTLIERS = "6"  # times the noise, as `exfit inspect` counts spikes
NAMED = 6  # columns among which the voltage may be


def record_section(found: Inspection, file: str, only: tuple[str, ...] = COMPARED) -> list[str]:
    """Return the lines of a ``record:`` section; signals that are not in ``only`` as comments.

    A channel in engineering units has a base that is to be filled in: no number, so that a case
    with it is refused.
    """
    lines = ["record:", f"  file: {_text(file)}", f"  time: {_clock(found)}", "  channels:"]
    channels = [one for signal in RECORDED if (one := found.channel_of(signal))]
    noisy = bool(channels) and all(in_per_unit(one) and one.noise > 0.0 for one in channels)
    for group in _voltage(found, channels):
        lines += [f"    # {line}" for line in _about_phases(found, group)]
        lines.append(f"    vt: {_phases(found, group)}")
    for one in channels:
        mark = "" if one.signal in only else "# "
        lines.append(f"    # {_about(one)}")
        lines.append(f"    {mark}{one.signal}: {_channel(one, noisy)}")
    if not found.phases and found.channel_of("vt") is None:
        names = ", ".join(one.name for one in found.channels[:NAMED])
        names += ", ..." if len(found.channels) > NAMED else ""
        lines += ["    # the terminal voltage: which column is it?", f"    # {names}"]
        lines.append(f"    vt: {{column: {FILL_IN}}}")
    if any(one.missing for one in channels):
        lines.append("  gaps: skip            # samples without a number are left out")
    return lines


def bump_section(found: Inspection, vt0: bool = False) -> list[str]:
    """Return the lines of a ``test:`` section: steps whose instants the fit finds.

    Their sizes are to be filled in, unless the reference was recorded: vt changes by less, and the
    gain of a regulator is what makes the difference. ``vt0`` says whether to give the level before.
    """
    lines = ["test:"]
    if vt0:
        level = found.channel_of("vt")
        lines.append(commented(f"  vt0: {_number(level.level if level else 1.0)}", "at rest"))
    if not found.steps:
        at = "the record shows no step: when, s, and by how much, pu?"
        return [*lines, f"  # {at}", f"  vref: [{{at: {FILL_IN}, step: {FILL_IN}}}]"]
    lines.append("  vref:")
    for step in found.steps:
        lines += _step(found, step)
    return lines


def in_per_unit(one: InspectedChannel) -> bool:
    """Tell whether a channel seems to be in per unit: it says so, or nothing, and looks so."""
    if one.unit is not None:
        return one.unit == "pu"
    if one.signal in ("vt", "vref"):
        return one.level <= AT_REST_PU[1]
    return max(abs(one.low), abs(one.high)) <= LARGEST_PU


def _step(found: Inspection, step: RecordedStep) -> Iterator[str]:
    reference = found.channel_of("vref")
    if reference is not None and reference.name in step.seen_in:
        own = min((one.at for one in reference.steps), key=lambda at: abs(at - step.at))
        size = step.sizes.get(reference.name, 0.0)
        yield f"    - at: {_number(own)}"
        if in_per_unit(reference):
            yield f"      step: {_number(size)}"
        else:
            yield commented(f"      step: {FILL_IN}", f"pu; {reference.name} {size:+.4g}")
        return
    if step.from_start:
        text = "the record moves from its first sample: made then, or before?"
        yield commented(f"    - at: {_number(step.at)}", text)
    else:
        low = max(step.at - AROUND, float(found.time[0]))
        high = min(step.at + AROUND, float(found.time[-1]))
        yield commented(f"    - at: {_found(step.at, low, high)}", f"+- {step.error:.1g} s")
    shown = _shown(found, step)
    yield commented(f"      step: {FILL_IN}", f"pu, as it was keyed in{shown}")


def _shown(found: Inspection, step: RecordedStep) -> str:
    """Return by how much vt changed for good, where that is known."""
    voltage = found.channel_of("vt")
    if voltage is not None and voltage.name in step.sizes:
        size = step.sizes[voltage.name]
        return f"; vt changed by {_number(size if in_per_unit(voltage) else size / voltage.level)}"
    for group in found.phases:
        if group.name in step.sizes:
            return f"; vt changed by {_number(step.sizes[group.name] / group.level)}"
    return ""


def _voltage(found: Inspection, channels: list[InspectedChannel]) -> tuple[InspectedPhases, ...]:
    """Return the phases that vt is made of, where no channel is vt by itself."""
    return () if any(one.signal == "vt" for one in channels) else found.phases[:1]


def _phases(found: Inspection, group: InspectedPhases) -> str:
    columns = ", ".join(_text(name) for name in group.columns)
    unit = next(one.unit for one in found.channels if one.name == group.columns[0])
    known = f"kind: {group.kind}, connection: {connection_of(group.columns)}"
    return f"{{phases: [{columns}], {known}, unit: {unit or FILL_IN}, base: {FILL_IN}}}"


def _about_phases(found: Inspection, group: InspectedPhases) -> Iterator[str]:
    first = next(one for one in found.channels if one.name == group.columns[0])
    unit = first.unit or "the unit of the columns"
    yield f"three phases by their names; base: rated voltage, line to line, in {unit};"
    yield "check connection, a factor of sqrt(3): phase-to-ground or phase-to-phase"
    if group.kind == "rms":
        yield f"{first.name} rests at {first.level:.5g}"
    else:
        yield f"waveforms of {first.frequency:.4g} Hz, crest {max(first.high, -first.low):.5g}"


def _about(one: InspectedChannel) -> str:
    """Return what to check of a channel."""
    why = f"{one.signal} by {one.why}"
    if in_per_unit(one):
        return f"{why}; {'pu' if one.unit else 'taken for pu'}, {one.level:.5g} at rest"
    if one.unit == "%":
        return f"{why}; {one.level:.5g} % at rest"
    base = SIGNALS[str(one.signal)].base
    return f"{why}; {one.level:.5g} {one.unit or '?'} at rest; base: {base}"


def _channel(one: InspectedChannel, noisy: bool) -> str:
    entries = {"column": _text(one.name)}
    if one.unit == "%":
        entries["scale"] = "0.01"
    elif not in_per_unit(one) and quantity_of(one.unit):
        entries |= {"unit": str(one.unit), "base": FILL_IN}
    elif not in_per_unit(one):
        entries |= {"unit": FILL_IN, "base": FILL_IN}
    if noisy:
        entries["noise"] = yaml_number(float(f"{one.noise:.2g}"))
    if one.spikes:
        entries["outliers"] = OUTLIERS
    if len(entries) == 1:
        return entries["column"]
    return "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"


def _clock(found: Inspection) -> str:
    names = [_text(name) for name in found.clock.columns]
    if found.clock.unit is not None:
        return f"{{column: {names[0]}, unit: {found.clock.unit}}}"
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _found(start: float, low: float, high: float) -> str:
    return f"{{start: {_number(start)}, min: {_number(low)}, max: {_number(high)}}}"


def _number(value: float) -> str:
    """Return a number in a few digits, of an instant no fewer than 0.1 ms."""
    rounded = float(f"{value:.{DIGITS}g}")
    return yaml_number(round(value, DIGITS) if abs(value) >= 1.0 else rounded)


def _text(name: str) -> str:
    """Return a text as YAML has it, in quotes where it would be read as something else."""
    plain = re.fullmatch(r"[A-Za-zäöüÄÖÜß./][\w./ -]*", name) and name == name.strip()
    if plain and yaml.safe_load(name) == name:
        return name
    return json.dumps(name, ensure_ascii=False)


def relative(file: Path, folder: Path) -> str:
    """Return the path of a record as a case in a folder names it."""
    import os

    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()
