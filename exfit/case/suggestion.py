"""The sections of a case that an inspected record suggests: record and test, with what to check."""

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import yaml

from exfit.case.templates import commented
from exfit.records.channel_inspection import SPIKE_LIMIT, InspectedChannel
from exfit.records.channel_recognition import connection_of
from exfit.records.inspection import InspectedPhases, Inspection
from exfit.records.steps import INSTANT_WITHIN, RecordedStep
from exfit.records.units import quantity_of
from exfit.signals import COMPARED, RECORDED, SIGNALS
from exfit.util.text import yaml_number

FILL_IN = '"?"'  # no number: a case that holds it is refused by place
DIGITS = 4
COLUMNS_LISTED = 6  # among which the voltage may be


def record_section(
    inspection: Inspection, file: str, only: tuple[str, ...] = COMPARED
) -> list[str]:
    """Return the lines of a ``record:`` section; signals that are not in ``only`` as comments.

    A channel in engineering units has a base that is to be filled in: no number, so that a case
    with it is refused.
    """
    channels = [channel for signal in RECORDED if (channel := inspection.channel_of(signal))]
    lines = ["record:", f"  file: {_text(file)}", f"  time: {_clock(inspection)}", "  channels:"]
    lines += _voltage_lines(inspection)
    lines += _channel_lines(channels, only, inspection.reference)
    if any(channel.missing for channel in channels):
        lines.append("  gaps: skip            # samples without a number are left out")
    return lines


def _voltage_lines(inspection: Inspection) -> Iterator[str]:
    """Yield the entry of vt where no channel is vt by itself: three phases, or an open question."""
    if inspection.channel_of("vt") is not None:
        return
    for group in inspection.phases[:1]:
        yield from (f"    # {line}" for line in _about_phases(inspection, group))
        yield f"    vt: {_phases(inspection, group)}"
    if not inspection.phases:
        columns = ", ".join(channel.name for channel in inspection.channels[:COLUMNS_LISTED])
        more = ", ..." if len(inspection.channels) > COLUMNS_LISTED else ""
        yield "    # the terminal voltage: which column is it?"
        yield f"    # {columns}{more}"
        yield f"    vt: {{column: {FILL_IN}}}"


def _channel_lines(
    channels: Sequence[InspectedChannel], only: tuple[str, ...], reference: InspectedChannel | None
) -> Iterator[str]:
    """Yield the entry of each channel, with what to check above it.

    A recorded ``reference`` drives the simulation: it is not compared.
    """
    for channel in channels:
        drives = channel is reference
        mark = "" if drives or channel.signal in only else "# "
        yield f"    # {_about(channel)}"
        yield f"    {mark}{channel.signal}: {_channel(channel, drives)}"


def weights_section(inspection: Inspection) -> list[str]:
    """Return the lines of an ``estimate:`` section; none where a single channel is compared.

    The noise of each channel from sample to sample is no weight: what a model does not match, as
    the ripple of a bridge, is more.
    """
    signals = {"vt", *(signal for signal in COMPARED if inspection.channel_of(signal))}
    if len(signals) < 2:
        return []
    text = "each channel by how well the model matches it"
    return ["estimate:", commented("  weights: balanced", text)]


def bump_section(inspection: Inspection, vt0: bool = False) -> list[str]:
    """Return the lines of a ``test:`` section: the recorded reference, or steps.

    The instants of steps are found by the fit; their sizes are to be filled in: vt changes by less,
    and the gain of a regulator is what makes the difference. ``vt0`` says whether to give the level
    before.
    """
    lines = ["test:"]
    if vt0:
        level = inspection.channel_of("vt")
        lines.append(commented(f"  vt0: {_number(level.level if level else 1.0)}", "at rest"))
    if inspection.reference is not None:
        text = f"{inspection.reference.name}, from its level at rest on"
        return [*lines, commented("  vref: recorded", text)]
    if not inspection.steps:
        at = "the record shows no step: when, s, and by how much, pu?"
        return [*lines, f"  # {at}", f"  vref: [{{at: {FILL_IN}, step: {FILL_IN}}}]"]
    lines.append("  vref:")
    for step in inspection.steps:
        lines += _step(inspection, step)
    return lines


def _step(inspection: Inspection, step: RecordedStep) -> Iterator[str]:
    reference = inspection.channel_of("vref")
    if reference is not None and reference.name in step.seen_in:
        own = min((change.at for change in reference.steps), key=lambda at: abs(at - step.at))
        size = step.sizes.get(reference.name, 0.0)
        yield f"    - at: {_number(own)}"
        if reference.seems_per_unit:
            yield f"      step: {_number(size)}"
        else:
            yield commented(f"      step: {FILL_IN}", f"pu; {reference.name} {size:+.4g}")
        return
    if step.from_start:
        text = "the record moves from its first sample: made then, or before?"
        yield commented(f"    - at: {_number(step.at)}", text)
    else:
        low = max(step.at - INSTANT_WITHIN, float(inspection.time[0]))
        high = min(step.at + INSTANT_WITHIN, float(inspection.time[-1]))
        yield commented(f"    - at: {_range(step.at, low, high)}", f"+- {step.error:.1g} s")
    yield commented(
        f"      step: {FILL_IN}", f"pu, as it was keyed in{_change_of_vt(inspection, step)}"
    )


def _change_of_vt(inspection: Inspection, step: RecordedStep) -> str:
    """Return by how much vt changed for good, where that is known."""
    voltage = inspection.channel_of("vt")
    if voltage is not None and voltage.name in step.sizes:
        size = step.sizes[voltage.name]
        return (
            f"; vt changed by {_number(size if voltage.seems_per_unit else size / voltage.level)}"
        )
    for group in inspection.phases:
        if group.name in step.sizes:
            return f"; vt changed by {_number(step.sizes[group.name] / group.level)}"
    return ""


def _phases(inspection: Inspection, group: InspectedPhases) -> str:
    columns = ", ".join(_text(name) for name in group.columns)
    unit = _first_phase(inspection, group).unit
    kind = f"kind: {group.kind}, connection: {connection_of(group.columns)}"
    return f"{{phases: [{columns}], {kind}, unit: {unit or FILL_IN}, base: {FILL_IN}}}"


def _first_phase(inspection: Inspection, group: InspectedPhases) -> InspectedChannel:
    return next(channel for channel in inspection.channels if channel.name == group.columns[0])


def _about_phases(inspection: Inspection, group: InspectedPhases) -> Iterator[str]:
    first = _first_phase(inspection, group)
    unit = first.unit or "the unit of the columns"
    yield f"three phases by their names; base: rated voltage, line to line, in {unit};"
    yield "check connection, a factor of sqrt(3): phase-to-ground or phase-to-phase"
    if group.kind == "rms":
        yield f"{first.name} rests at {first.level:.5g}"
    else:
        yield f"waveforms of {first.frequency:.4g} Hz, crest {max(first.high, -first.low):.5g}"


def _about(channel: InspectedChannel) -> str:
    """Return what to check of a channel."""
    why = f"{channel.signal} by {channel.why}"
    if channel.seems_per_unit:
        return f"{why}; {'pu' if channel.unit else 'taken for pu'}, {channel.level:.5g} at rest"
    if channel.unit == "%":
        return f"{why}; {channel.level:.5g} % at rest"
    base = SIGNALS[str(channel.signal)].base
    return f"{why}; {channel.level:.5g} {channel.unit or '?'} at rest; base: {base}"


def _channel(channel: InspectedChannel, drives: bool) -> str:
    entries = {"column": _text(channel.name)}
    if channel.unit == "%":
        entries["scale"] = "0.01"
    elif not channel.seems_per_unit and quantity_of(channel.unit):
        entries |= {"unit": str(channel.unit), "base": FILL_IN}
    elif not channel.seems_per_unit:
        entries |= {"unit": FILL_IN, "base": FILL_IN}
    if channel.spikes and not drives:
        entries["outliers"] = f"{SPIKE_LIMIT:g}"
    if len(entries) == 1:
        return entries["column"]
    return "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"


def _clock(inspection: Inspection) -> str:
    names = [_text(name) for name in inspection.clock.columns]
    if inspection.clock.unit is not None:
        return f"{{column: {names[0]}, unit: {inspection.clock.unit}}}"
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _range(start: float, low: float, high: float) -> str:
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
