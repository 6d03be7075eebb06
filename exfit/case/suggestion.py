"""The sections of a case that a recorder's file suggests, with what must be checked."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from exfit.case.case_draft import Noted, Remark, Section, in_braces
from exfit.case.yaml import QUESTION
from exfit.dsp.quality import SPIKE_LIMIT
from exfit.errors import ExfitError, RecordError
from exfit.plants.machine_on_load import MACHINE_ON_LOAD
from exfit.records.channel_inspection import InspectedChannel
from exfit.records.channel_names import connection_of
from exfit.records.contradictions import FIELD, ScaleRange, is_on_load, scale_to_find
from exfit.records.formats import open_table
from exfit.records.inspection import Inspection, inspect
from exfit.records.kinds import FOLLOWING, INJECTION, ISOLATED_LOAD, REJECTION
from exfit.records.rejection import POWERS, BreakerOpening
from exfit.records.steps import RecordedStep, bounds_of_instant
from exfit.records.units import alike, scale_between, unit_of, usual
from exfit.registry import parts
from exfit.signals import COMPARED, OF_EVENT, RECORDED, SIGNALS
from exfit.util.text import magnitude_fault, near

BASE = re.compile(r"(?P<value>[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)\s*(?P<unit>\D.*)?")

COLUMN = re.compile(r"(?P<column>.*?)\s*\[(?P<unit>[^]]+)\]")  # a column and its unit


@dataclass(frozen=True)
class Base:
    """What 1 pu of a signal is, in a unit; without one it is that of the channel."""

    value: float
    unit: str | None

    def in_unit(self, unit: str | None, channel: str) -> float:
        """Return the value in the unit of a channel; raises ExfitError where that is another."""
        if unit is None or self.unit is None or alike(unit, self.unit):
            return self.value
        scale = scale_between(self.unit, unit)
        if scale is None:
            raise ExfitError(f"base {self.value:g} {self.unit}: {channel} is in {unit}")
        return float(f"{self.value * scale:.12g}")


def base_of(text: str) -> Base:
    """Return the base that a text is, as 15.75kV; raises ExfitError."""
    parts = BASE.fullmatch(text.strip())
    unit = parts["unit"].strip() if parts is not None and parts["unit"] else None
    if parts is None or float(parts["value"]) <= 0.0 or (unit and unit_of(unit) is None):
        raise ExfitError(f"{text!r} is not a positive number with a unit, as 15.75kV")
    if fault := magnitude_fault(float(parts["value"])):
        raise ExfitError(fault)
    return Base(float(parts["value"]), None if unit is None else usual(unit))


def bases_of(texts: tuple[str, ...]) -> dict[str, Base]:
    """Return bases by signal from texts as vt=15.75kV; raises ExfitError."""
    bases = {}
    for text in texts:
        signal, equals, value = text.partition("=")
        if not equals or signal not in RECORDED:
            hint = near(signal, RECORDED) if equals else "give it as vt=15.75kV"
            raise ExfitError(f"--base {text}: not a signal and its base; {hint}")
        try:
            bases[signal] = base_of(value)
        except ExfitError as fault:
            raise ExfitError(f"--base {text}: {fault}") from None
    return bases


def rated_bases(bases: Mapping[str, Base], kv: float | None, mva: float | None) -> dict[str, Base]:
    """Return bases with those that the ratings of a unit give to signals without one."""
    rated = {} if kv is None else {"vt": Base(kv, "kV")}
    if mva is not None:
        rated |= {"p": Base(mva, "MW"), "q": Base(mva, "Mvar")}
    return {**rated, **bases}


@dataclass(frozen=True)
class RecordSettings:
    """Columns of the time of a record and their unit, its sheet, the column of its voltage.

    ``memory`` (GB) is what reading may take, ``channels`` are columns by signal, each with its
    unit in brackets where the file does not show it. What is empty or None is as the file shows it.
    """

    clock: tuple[str, ...] = ()
    unit: str | None = None
    sheet: str | None = None
    voltage: str | None = None
    memory: float | None = None
    channels: Mapping[str, str] = field(default_factory=dict)

    def inspect(self, file: Path) -> Inspection:
        """Inspect a recorder's file.

        Raises RecordError where it is none, and where it lacks a channel.
        """
        table = open_table(file, self.sheet, self.memory)
        inspection = inspect(table, self.clock or None, self.unit)
        inspection = replace(inspection, sheet=self.sheet, memory=self.memory)
        return inspection if not self.channels else self.with_channels(inspection)

    def with_channels(self, inspection: Inspection) -> Inspection:
        """Return an inspection in which given columns are the channels of signals."""
        channels = {channel.name: channel for channel in inspection.channels}
        named, faults = dict[str, InspectedChannel](), list[str]()
        for signal, text in self.channels.items():
            column, unit = text, None
            if text not in channels and (parts := COLUMN.fullmatch(text)):
                column, unit = parts["column"], usual(parts["unit"])
            if column not in channels or (unit is not None and unit_of(unit) is None):
                what = f"{text}: no column with a unit of {inspection.path}"
                faults.append(f"{signal}: {what}; {near(column, channels)}")
                continue
            own = replace(channels[column], signal=signal, sure=True, why="as given", question="")
            named[column] = own if unit is None else replace(own, unit=unit, unit_from="file")
        if faults:
            raise RecordError("\n".join(faults))
        others = (
            replace(channel, signal=None) if channel.signal in self.channels else channel
            for channel in inspection.channels
        )
        return replace(
            inspection, channels=tuple(named.get(channel.name, channel) for channel in others)
        )


NO_BASES: Mapping[str, Base] = MappingProxyType({})
DIGITS = 4
BASE_ON_LOAD = "; check its base: on load the level does not show whether it is the air-gap line"
SPEED = "speed"  # which no plant with the breaker open has
GATE = "gate"  # which needs a governor
OF_GOVERNOR_TEST = ("p", SPEED, GATE)
WITHOUT_GOVERNOR = tuple(signal for signal in COMPARED if signal != GATE)
COLUMNS_LISTED = 6  # among which the voltage may be


def record_section(
    inspection: Inspection, file: str, only: tuple[str, ...] = WITHOUT_GOVERNOR
) -> Section:
    """Suggest the ``record`` of a file; signals that are not in ``only`` are comments.

    A channel in engineering units has a base that is to be filled in.
    """
    channels = channels_section(inspection, only, NO_BASES)
    return {"record": record_of(inspection, file, channels)}


def record_of(
    inspection: Inspection,
    file: str,
    channels: Any,
    window: tuple[float, float] | None = None,
    extra: Section | None = None,
) -> Section:
    """Make the section of a record with some channels: what its file needs to be read again.

    ``extra`` are sections between the time and the channels.
    """
    clock = inspection.clock
    columns = clock.columns[0] if len(clock.columns) == 1 else list(clock.columns)
    signals = (inspection.channel_of(signal) for signal in RECORDED)
    missing = any(channel.missing for channel in signals if channel is not None)
    gaps = Noted("skip", "samples without a number are left out")
    return {
        "file": file,
        "time": columns if clock.unit is None else {"column": clock.columns[0], "unit": clock.unit},
        **(extra or {}),
        "channels": channels,
        **({} if window is None else {"window": [*map(rounded, window)]}),
        **({"gaps": gaps} if missing else {}),
        **({} if inspection.sheet is None else {"sheet": inspection.sheet}),
        **({} if inspection.memory is None else {"memory": rounded(inspection.memory)}),
    }


def suggested_sections(
    inspection: Inspection, file: str, bases: Mapping[str, Base] = NO_BASES
) -> Section:
    """Suggest the sections of a case for an inspected file: of a bump test, or of an event."""
    return suggested_event(inspection, file, bases) or {
        **record_section(inspection, file),
        **bump_section(inspection),
        **weights_section(inspection),
    }


def suggested_event(inspection: Inspection, file: str, bases: Mapping[str, Base]) -> Section:
    """Suggest the sections of a case for a record that is no bump test; {} for one that is."""
    if inspection.of_governor:
        return governor_sections(inspection, file, bases)
    suggestions = (part.load() for part in parts("SUGGESTIONS").values())
    sections = (suggest(inspection, file, bases) for suggest in suggestions)
    return next(filter(None, sections), {})


def governor_sections(inspection: Inspection, file: str, bases: Mapping[str, Base]) -> Section:
    """Suggest ``plant``, ``governor``, ``test`` and ``record`` of a test of a governor."""
    from exfit.plants.infinite_bus import INFINITE_BUS
    from exfit.plants.isolated import ISOLATED
    from exfit.plants.playback import GOVERNOR_PLAYBACK

    kind, f0 = inspection.kind.name, Noted(QUESTION, "Hz, rated frequency")
    level = _per_unit_level(inspection, "p")
    network: Section
    if kind in (ISOLATED_LOAD, REJECTION):
        load = Noted(level, "the load before, pu of the machine at 1 pu of voltage")
        network = {"f0": f0, "YP": load, "YQ": Noted(QUESTION, "as YP; Q is -YQ")}
        alone = "the unit feeds this load alone"
        plant = {"type": Noted(ISOLATED.name, alone), "network": network}
    elif kind == FOLLOWING:
        drives = "the recorded speed drives governor and turbine"
        plant = {"type": Noted(GOVERNOR_PLAYBACK.name, drives)}
    else:
        network = {"f0": f0, "R": 0.0, "X": Noted(QUESTION, "pu, reactance to the source")}
        network |= {"P": Noted(level, "pu of the machine, before"), "Q": Noted(QUESTION, "pu")}
        plant = {"type": Noted(INFINITE_BUS.name, "on load"), "network": network}
    driving = GOVERNOR_PLAYBACK.driving if kind == FOLLOWING else ()
    channels = channels_section(inspection, OF_GOVERNOR_TEST, bases, driving)
    if inspection.channel_of("vt") is None:
        channels.pop("vt", None)
    test = {} if kind == FOLLOWING else {"test": _governor_test(inspection, level)}
    model = Noted(QUESTION, "`exfit models` lists governors; R and its times are to be free")
    governor = {"governor": {"model": model}}
    return {"plant": plant, **governor, **test, "record": record_of(inspection, file, channels)}


def _governor_test(inspection: Inspection, level: float | str) -> Section:
    """Suggest the ``test`` of a governor: a load that changes, or steps of an input."""
    section: Section = {}
    if inspection.channel_of("vt") is None:
        section["vt0"] = Noted(QUESTION, "pu, the voltage before")
    opening, steps = inspection.opening, inspection.steps
    if opening is not None:
        at = Noted(rounded(opening.at), f"the breaker opens, +- {opening.error:.1g} s")
        return {**section, "network": [{"at": at, "YP": 0.0, "YQ": 0.0}]}
    if inspection.kind.name == ISOLATED_LOAD:
        power = inspection.channel_of("p")
        after = power.change_at(steps[0]) if power is not None else None
        load = QUESTION if after is None or isinstance(level, str) else rounded(level + after)
        at = Noted(rounded(steps[0].at), f"+- {steps[0].error:.1g} s")
        return {**section, "network": [{"at": at, "YP": Noted(load, "the load from then on")}]}
    signal = "fs" if inspection.kind.name == INJECTION else "pref"
    if inspection.channel_of(signal) is not None:
        return {**section, signal: Noted("recorded", "its change from its level at rest")}
    size = Noted(QUESTION, "as keyed in: docs/plants.md says what it is of each governor")
    made = [{"at": Noted(_range(each.at, *bounds_of_instant(each.at, inspection.time)),
                         f"+- {each.error:.1g} s"), "step": size} for each in steps]  # fmt: skip
    return {**section, signal: Noted(made, above="fs in place of pref: added to the speed, pu")}


def _per_unit_level(inspection: Inspection, signal: str) -> float | str:
    """Return the level at rest of a signal in per unit, "?" where its base is not known."""
    channel = inspection.channel_of(signal)
    known = channel is not None and channel.seems_per_unit
    return float(f"{channel.level:.4g}") if channel is not None and known else QUESTION


def channels_section(
    inspection: Inspection,
    only: tuple[str, ...],
    bases: Mapping[str, Base],
    driving: tuple[str, ...] = (),
) -> Section:
    """Suggest the entries of all channels, with what to check above each.

    What is not compared is a comment; a recorded reference drives the simulation, as those do that
    are ``driving``.
    """
    loaded = is_on_load(inspection.channels)
    section = _voltage(inspection, bases.get("vt"))
    for signal in RECORDED:
        channel = inspection.channel_of(signal)
        if channel is None or (signal in OF_EVENT and signal not in only):
            continue
        drives = channel is inspection.reference or signal in driving
        compared = signal in only and (signal != SPEED or loaded)
        base = bases.get(signal)
        scale = None if base is not None else scale_to_find(channel, inspection.channels)
        entry = channel_entry(channel, base, scale, drives)
        about = _about(channel, scale, loaded)
        if drives or compared:
            section[signal] = Noted(entry, above=about)
        else:
            section[Remark(f"{about}\n{signal}: {in_braces(entry)}")] = None
    return section


def _voltage(inspection: Inspection, base: Base | None) -> Section:
    """Suggest vt where no channel is vt by itself: three phases, or an open question."""
    if inspection.channel_of("vt") is not None:
        return {}
    for group in inspection.phases:
        first = next(each for each in inspection.channels if each.name == group.columns[0])
        unit, value = _unit_and_base(first, base)
        phases = {
            "phases": list(group.columns),
            "kind": group.kind,
            "connection": connection_of(group.columns),
            "unit": unit,
            "base": value,
        }
        level = (
            f"{first.name} rests at {first.level:.5g}"
            if group.kind == "rms"
            else f"waveforms of {first.frequency:.4g} Hz, crest {max(first.high, -first.low):.5g}"
        )
        about = (
            "three phases by their names; base: rated voltage, line to line, in "
            f"{first.unit or 'the unit of the columns'}; check connection, a factor of sqrt(3): "
            f"phase-to-ground or phase-to-phase; {level}"
        )
        return {"vt": Noted(phases, above=about)}
    columns = ", ".join(channel.name for channel in inspection.channels[:COLUMNS_LISTED])
    more = ", ..." if len(inspection.channels) > COLUMNS_LISTED else ""
    about = f"the terminal voltage: which column is it? {columns}{more}"
    return {"vt": Noted({"column": QUESTION}, above=about)}


def weights_section(inspection: Inspection) -> Section:
    """Suggest the ``estimate`` of a case; nothing where a single channel is compared.

    The noise of each channel from sample to sample is no weight: what a model does not match, as
    the ripple of a bridge, is more.
    """
    signals = {"vt", *(signal for signal in COMPARED if inspection.channel_of(signal))}
    if len(signals) < 2:
        return {}
    text = "each channel by how well the model matches it"
    return {"estimate": {"weights": Noted("balanced", text)}}


def bump_section(inspection: Inspection) -> Section:
    """Suggest the ``test``: a breaker that opens, the recorded reference, or steps.

    The instants of steps are found by the fit; their sizes are to be filled in: vt changes by less,
    and the gain of a regulator is what makes the difference.
    """
    if inspection.opening is not None:
        return _rejection_sections(inspection, inspection.opening)
    return {"test": steps_section(inspection, inspection.steps, (None,) * len(inspection.steps))}


def _rejection_sections(inspection: Inspection, opening: BreakerOpening) -> Section:
    levels: Section = {signal.upper(): QUESTION for signal in POWERS}
    for signal, level in opening.levels.items():
        channel = inspection.channel_of(signal)
        if signal in POWERS and channel is not None and channel.unit in (None, "pu"):
            levels[signal.upper()] = rounded(level)
    opens = {"opens": {"start": "auto"}}
    return {
        "plant": {
            "type": Noted(MACHINE_ON_LOAD.name, "or infinite-bus, with the exciter in service"),
            "network": Noted(levels, "pu of the machine, until the breaker opens"),
        },
        "test": {"breaker": Noted(opens, f"{opening.at:.4f} +- {opening.error:.1g} s")},
    }


def steps_section(
    inspection: Inspection, steps: Sequence[RecordedStep], sizes: Sequence[float | None]
) -> Section:
    """Suggest the reference of a test with some steps of known sizes.

    The size (pu) of a step is None where it is to be filled in.
    """
    if inspection.reference is not None:
        text = f"{inspection.reference.name}, from its level at rest on"
        return {"vref": Noted("recorded", text)}
    if not steps:
        at = "the record shows no step: when, s, and by how much, pu?"
        return {"vref": Noted([{"at": QUESTION, "step": QUESTION}], above=at)}
    return {
        "vref": [_step(inspection, *step) for step in zip(steps, sizes, strict=True)],
    }


def _step(inspection: Inspection, step: RecordedStep, given: float | None) -> Section:
    reference = inspection.channel_of("vref")
    if reference is not None and reference.name in step.seen_in:
        own = min((change.at for change in reference.steps), key=lambda at: abs(at - step.at))
        size = step.sizes.get(reference.name, 0.0)
        to_scale = Noted(QUESTION, f"pu; {reference.name} {size:+.4g}")
        return {
            "at": rounded(own),
            "step": rounded(size) if reference.seems_per_unit else to_scale,
        }
    if step.from_start:
        text = "the record moves from its first sample: made then, or before?"
        at = Noted(rounded(step.at), text)
    else:
        bounds = bounds_of_instant(step.at, inspection.time)
        at = Noted(_range(step.at, *bounds), f"+- {step.error:.1g} s")
    share = inspection.change_of_voltage(step)
    change = "" if share is None else f"; vt changed by {rounded(share)}"
    keyed_in = QUESTION if given is None else given
    return {"at": at, "step": Noted(keyed_in, f"pu, as keyed in{change}")}


def _unit_and_base(channel: InspectedChannel, base: Base | None) -> tuple[str, str | float]:
    """Find the unit and the base of a channel that needs both, as far as they are known."""
    known = channel.unit if channel.unit and unit_of(channel.unit) else None
    if base is None:
        return known or QUESTION, QUESTION
    return known or base.unit or QUESTION, base.in_unit(known, channel.name)


def _about(channel: InspectedChannel, scale: ScaleRange | None, loaded: bool) -> str:
    """Name the points to check of a channel."""
    by, _, _ = channel.why.partition(";")
    why = f"{'' if channel.sure else 'a guess: '}{channel.signal} by {by}"
    if scale is not None:
        return f"{why}; {channel.level:.4g} at rest: the base differs, and is fitted"
    if channel.system_base:
        return f"{why}; {channel.level:.5g} at rest"
    percent = channel.unit == "%"
    if percent or channel.seems_per_unit:
        unit = "%" if percent else "pu" if channel.unit else "taken for pu"
        doubt = loaded and channel.signal in FIELD
        return f"{why}; {unit}, {channel.level:.5g} at rest" + (BASE_ON_LOAD if doubt else "")
    base = SIGNALS[str(channel.signal)].base
    return f"{why}; {channel.level:.5g} {channel.unit or '?'} at rest; base: {base}"


def channel_entry(
    channel: InspectedChannel,
    base: Base | None,
    scale: ScaleRange | None = None,
    drives: bool = False,
) -> Any:
    """Make the entry of a channel: its column, and what makes its numbers per unit."""
    entries = {"column": channel.name, **_scaling(channel, base, scale)}
    if channel.spikes and not drives:
        entries["outliers"] = SPIKE_LIMIT
    return channel.name if len(entries) == 1 else entries


def _scaling(channel: InspectedChannel, base: Base | None, scale: ScaleRange | None) -> Section:
    percent = channel.unit == "%"
    if base is not None and (channel.seems_per_unit or percent):
        value = base.in_unit(channel.unit or "pu", channel.name)
        return {"unit": "%" if percent else "pu", "base": value}
    if scale is not None:
        return {"scale": _range(scale.start, scale.low, scale.high)}
    if channel.system_base:
        return {"unit": "pu", "base": QUESTION}
    if percent:
        return {"scale": 0.01}
    if channel.seems_per_unit:
        return {}
    return dict(zip(("unit", "base"), _unit_and_base(channel, base), strict=True))


def _range(start: float, low: float, high: float) -> Section:
    return {"start": rounded(start), "min": rounded(low), "max": rounded(high)}


def rounded(value: float) -> float:
    """Round to a few digits, an instant to no fewer than 0.1 ms."""
    return round(value, DIGITS) if abs(value) >= 1.0 else float(f"{value:.{DIGITS}g}")


def relative(file: Path, folder: Path) -> str:
    """Name a record as a case in a folder does."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()
