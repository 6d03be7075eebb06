"""The sections of a case that an inspected record suggests: record and test, with what to check."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from types import MappingProxyType

import yaml

from exfit.case.draft.bases import Base
from exfit.case.open_values import FILL_IN
from exfit.case.templates import commented, in_comment, quoted
from exfit.records.channel_inspection import SPIKE_LIMIT, InspectedChannel, InspectedPhases
from exfit.records.channel_recognition import connection_of
from exfit.records.field_base import FIELD, ScaleRange, is_on_load, scale_to_find
from exfit.records.inspection import Inspection
from exfit.records.rejection import POWERS, BreakerOpening
from exfit.records.steps import RecordedStep, bounds_of_instant
from exfit.records.units import unit_of
from exfit.signals import COMPARED, OF_EVENT, RECORDED, SIGNALS
from exfit.util.text import yaml_number

NO_BASES: Mapping[str, Base] = MappingProxyType({})
DIGITS = 4
WIDTH = 80  # columns of a comment
BASE_ON_LOAD = "; check its base: on load the level does not show whether it is the air-gap line"
SPEED = "speed"  # which no plant with the breaker open has
COLUMNS_LISTED = 6  # among which the voltage may be


def record_section(
    inspection: Inspection,
    file: str,
    only: tuple[str, ...] = COMPARED,
    bases: Mapping[str, Base] = NO_BASES,
    window: tuple[float, float] | None = None,
) -> list[str]:
    """Return the lines of a ``record:`` section; signals that are not in ``only`` as comments.

    A channel in engineering units without one of the ``bases`` has a base that is to be filled in:
    no number, so that a case with it is refused.
    """
    lines = ["record:", f"  file: {plain_text(file)}", f"  time: {clock_text(inspection)}"]
    lines += ["  channels:", *channel_lines(inspection, only, bases)]
    return [*lines, *window_lines(window), *gap_lines(inspection), *reading_lines(inspection)]


def channel_lines(
    inspection: Inspection, only: tuple[str, ...], bases: Mapping[str, Base]
) -> list[str]:
    """Return the entries of all channels, those that are not compared as comments."""
    channels = [
        channel
        for signal in RECORDED
        if (channel := inspection.channel_of(signal)) and (signal not in OF_EVENT or signal in only)
    ]
    return [
        *_voltage_lines(inspection, bases.get("vt")),
        *_channel_lines(channels, only, inspection, bases),
    ]


def window_lines(window: tuple[float, float] | None) -> list[str]:
    """Return the line of a window (s), if there is one."""
    return (
        []
        if window is None
        else [f"  window: [{number_text(window[0])}, {number_text(window[1])}]"]
    )


def gap_lines(inspection: Inspection) -> list[str]:
    """Return the line that a record with missing samples needs."""
    signals = (inspection.channel_of(signal) for signal in RECORDED)
    if not any(channel.missing for channel in signals if channel is not None):
        return []
    return ["  gaps: skip            # samples without a number are left out"]


def reading_lines(inspection: Inspection) -> list[str]:
    """Return the lines that the file of a record needs to be read again: its sheet, its memory."""
    sheet, memory = inspection.sheet, inspection.memory
    return [
        *([] if sheet is None else [f"  sheet: {plain_text(sheet)}"]),
        *([] if memory is None else [f"  memory: {number_text(memory)}"]),
    ]


def _voltage_lines(inspection: Inspection, base: Base | None) -> Iterator[str]:
    """Yield the entry of vt where no channel is vt by itself: three phases, or an open question."""
    if inspection.channel_of("vt") is not None:
        return
    for group in inspection.phases[:1]:
        yield from (f"    # {in_comment(line)}" for line in _about_phases(inspection, group))
        yield f"    vt: {_phases(inspection, group, base)}"
    if not inspection.phases:
        columns = ", ".join(plain_text(c.name) for c in inspection.channels[:COLUMNS_LISTED])
        more = ", ..." if len(inspection.channels) > COLUMNS_LISTED else ""
        yield "    # the terminal voltage: which column is it?"
        yield f"    # {columns}{more}"
        yield f"    vt: {{column: {FILL_IN}}}"


def _channel_lines(
    channels: Sequence[InspectedChannel],
    only: tuple[str, ...],
    inspection: Inspection,
    bases: Mapping[str, Base],
) -> Iterator[str]:
    """Yield the entry of each channel, with what to check above it.

    A recorded reference drives the simulation: it is not compared.
    """
    loaded = is_on_load(inspection.channels)
    for channel in channels:
        drives = channel is inspection.reference
        compared = channel.signal in only and (channel.signal != SPEED or loaded)
        mark = "" if drives or compared else "# "
        base = bases.get(str(channel.signal))
        scale = None if base is not None else scale_to_find(channel, inspection.channels)
        about = in_comment(_about(channel, scale, loaded))
        yield from wrap(about, WIDTH, initial_indent="    # ", subsequent_indent="    #   ")
        yield f"    {mark}{channel.signal}: {_channel(channel, drives, base, scale)}"


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


def bump_section(inspection: Inspection) -> list[str]:
    """Return the lines of a ``test:`` section: a breaker that opens, the recorded reference, steps.

    The instants of steps are found by the fit; their sizes are to be filled in: vt changes by less,
    and the gain of a regulator is what makes the difference.
    """
    if inspection.opening is not None:
        return _rejection_sections(inspection, inspection.opening)
    return steps_section(inspection, inspection.steps, (None,) * len(inspection.steps))


def _rejection_sections(inspection: Inspection, opening: BreakerOpening) -> list[str]:
    """Return the lines of the sections ``plant:`` and ``test:`` of a load rejection."""
    levels = dict.fromkeys(POWERS, FILL_IN)
    for signal, level in opening.levels.items():
        channel = inspection.channel_of(signal)
        if signal in POWERS and channel is not None and channel.unit in (None, "pu"):
            levels[signal] = number_text(level)
    powers = ", ".join(f"{signal.upper()}: {level}" for signal, level in levels.items())
    return [
        "plant:",
        commented("  type: machine-on-load", "or infinite-bus, with the exciter in service"),
        commented(f"  network: {{{powers}}}", "pu of the machine, until the breaker opens"),
        "test:",
        commented(
            "  breaker: {opens: {start: auto}}", f"{opening.at:.4f} +- {opening.error:.1g} s"
        ),
    ]


def steps_section(
    inspection: Inspection,
    steps: Sequence[RecordedStep],
    sizes: Sequence[float | None],
    level: Sequence[str] = (),
) -> list[str]:
    """Return the lines of a ``test:`` section as ``bump_section``, of some steps of known sizes.

    The size (pu) of a step is None where it is to be filled in; ``level`` is the line of vt0.
    """
    lines = ["test:", *level]
    if inspection.reference is not None:
        text = f"{inspection.reference.name}, from its level at rest on"
        return [*lines, commented("  vref: recorded", text)]
    if not steps:
        at = "the record shows no step: when, s, and by how much, pu?"
        return [*lines, f"  # {at}", f"  vref: [{{at: {FILL_IN}, step: {FILL_IN}}}]"]
    lines.append("  vref:")
    for step, size in zip(steps, sizes, strict=True):
        lines += _step(inspection, step, size)
    return lines


def _step(inspection: Inspection, step: RecordedStep, given: float | None) -> Iterator[str]:
    reference = inspection.channel_of("vref")
    if reference is not None and reference.name in step.seen_in:
        own = min((change.at for change in reference.steps), key=lambda at: abs(at - step.at))
        size = step.sizes.get(reference.name, 0.0)
        yield f"    - at: {number_text(own)}"
        if reference.seems_per_unit:
            yield f"      step: {number_text(size)}"
        else:
            yield commented(f"      step: {FILL_IN}", f"pu; {reference.name} {size:+.4g}")
        return
    if step.from_start:
        text = "the record moves from its first sample: made then, or before?"
        yield commented(f"    - at: {number_text(step.at)}", text)
    else:
        bounds = bounds_of_instant(step.at, inspection.time)
        yield commented(f"    - at: {_range(step.at, *bounds)}", f"+- {step.error:.1g} s")
    share = inspection.change_of_voltage(step)
    change = "" if share is None else f"; vt changed by {number_text(share)}"
    keyed_in = FILL_IN if given is None else yaml_number(given)
    yield commented(f"      step: {keyed_in}", f"pu, as it was keyed in{change}")


def _phases(inspection: Inspection, group: InspectedPhases, base: Base | None) -> str:
    columns = ", ".join(plain_text(name) for name in group.columns)
    kind = f"kind: {group.kind}, connection: {connection_of(group.columns)}"
    unit, value = _unit_and_base(_first_phase(inspection, group), base)
    return f"{{phases: [{columns}], {kind}, unit: {unit}, base: {value}}}"


def _unit_and_base(channel: InspectedChannel, base: Base | None) -> tuple[str, str]:
    """Return the unit and the base of a channel that needs both, as far as they are known."""
    known = channel.unit if channel.unit and unit_of(channel.unit) else None
    if base is None:
        return plain_text(known) if known else FILL_IN, FILL_IN
    unit = known or base.unit
    return plain_text(unit) if unit else FILL_IN, yaml_number(base.in_unit(known, channel.name))


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


def _about(channel: InspectedChannel, scale: ScaleRange | None, loaded: bool) -> str:
    """Return what to check of a channel."""
    by, _, _ = channel.why.partition(";")
    why = f"{'' if channel.sure else 'a guess: '}{channel.signal} by {by}"
    if scale is not None:
        return f"{why}; {channel.level:.4g} at rest: another base, which is found"
    if channel.system_base:
        return f"{why}; {channel.level:.5g} at rest"
    percent = channel.unit == "%"
    if percent or channel.seems_per_unit:
        unit = "%" if percent else "pu" if channel.unit else "taken for pu"
        doubt = loaded and channel.signal in FIELD
        return f"{why}; {unit}, {channel.level:.5g} at rest" + (BASE_ON_LOAD if doubt else "")
    base = SIGNALS[str(channel.signal)].base
    return f"{why}; {channel.level:.5g} {channel.unit or '?'} at rest; base: {base}"


def channel_entry(channel: InspectedChannel, base: Base | None) -> str:
    """Return the entry of a channel that is compared, as a case has it."""
    return _channel(channel, drives=False, base=base, scale=None)


def _channel(
    channel: InspectedChannel, drives: bool, base: Base | None, scale: ScaleRange | None
) -> str:
    entries = {"column": plain_text(channel.name), **_scaling(channel, base, scale)}
    if channel.spikes and not drives:
        entries["outliers"] = f"{SPIKE_LIMIT:g}"
    if len(entries) == 1:
        return entries["column"]
    return "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"


def _scaling(
    channel: InspectedChannel, base: Base | None, scale: ScaleRange | None
) -> dict[str, str]:
    """Return what makes the numbers of a channel per unit."""
    percent = channel.unit == "%"
    if base is not None and (channel.seems_per_unit or percent):
        value = yaml_number(base.in_unit(channel.unit or "pu", channel.name))
        return {"unit": plain_text("%" if percent else "pu"), "base": value}
    if scale is not None:
        return {"scale": _range(scale.start, scale.low, scale.high)}
    if channel.system_base:
        return {"unit": "pu", "base": FILL_IN}
    if percent:
        return {"scale": "0.01"}
    if channel.seems_per_unit:
        return {}
    return dict(zip(("unit", "base"), _unit_and_base(channel, base), strict=True))


def clock_text(inspection: Inspection) -> str:
    """Return the columns of the time as a case has them."""
    names = [plain_text(name) for name in inspection.clock.columns]
    if inspection.clock.unit is not None:
        return f"{{column: {names[0]}, unit: {inspection.clock.unit}}}"
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _range(start: float, low: float, high: float) -> str:
    return f"{{start: {number_text(start)}, min: {number_text(low)}, max: {number_text(high)}}}"


def number_text(value: float) -> str:
    """Return a number in a few digits, of an instant no fewer than 0.1 ms."""
    rounded = float(f"{value:.{DIGITS}g}")
    return yaml_number(round(value, DIGITS) if abs(value) >= 1.0 else rounded)


def plain_text(name: str) -> str:
    """Return a text as YAML has it, in quotes where it would be read as something else."""
    plain = re.fullmatch(r"[A-Za-zäöüÄÖÜß./][\w./ -]*", name) and name == name.strip()
    if plain and yaml.safe_load(name) == name:
        return name
    return quoted(name)


def relative(file: Path, folder: Path) -> str:
    """Return the path of a record as a case in a folder names it."""
    import os

    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()
