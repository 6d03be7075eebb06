"""What a recorder's file holds: its clock, its channels, their faults, the steps of the test."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from exfit.dsp.jumps import rest_end
from exfit.dsp.quality import mains_frequency
from exfit.dsp.sampling import Sampling, increasing, sampling_of
from exfit.errors import RecordError
from exfit.records.channel_inspection import (
    PLACES_LISTED,
    InspectedChannel,
    InspectedPhases,
    identified,
    inspect_channel,
    without_false_per_unit,
)
from exfit.records.channel_names import (
    Clarity,
    NameReading,
    guess_signals,
    read_names,
    three_phases,
)
from exfit.records.clock import Clock, check_finite, check_increasing, check_steps, why_unusable
from exfit.records.contradictions import base_findings, contradictions, is_on_load
from exfit.records.formats import PLAY_IN
from exfit.records.formats.table import (
    RecordTable,
    column_error,
    listed,
    refuse_uneven,
)
from exfit.records.kinds import EVENT, OF_GOVERNOR, REJECTION, STEADY, KindOfTest, kind_of
from exfit.records.phasors import Status, angle_findings, bad_rows, in_radians
from exfit.records.physics import RATED_HZ, readings_by_physics, waveforms_apart
from exfit.records.pmu_recognition import PmuContent, pmu_content
from exfit.records.record import FEWEST_SAMPLES
from exfit.records.rejection import BreakerOpening, breaker_opening, rejection_findings
from exfit.records.samples import Samples
from exfit.records.steps import SAME_STEP, RecordedStep, steps_of_record
from exfit.records.units import quantity_of, unit_in, usual
from exfit.signals import FIELDS, OF_EVENT, TERMINALS
from exfit.util.arrays import Array
from exfit.util.text import LARGEST

REFERENCE = "vref"
NEARLY_RATED = 0.003  # of the rated frequency: so far off it vt is off by as much
MOST_WAVEFORMS = 64  # columns among which three phases are looked for


@dataclass(frozen=True, eq=False)
class Inspection:
    """What a file holds; ``unreadable`` says by column why it has no numbers.

    ``opening`` is that of the breaker in a load rejection, ``pmu`` what there is of a phasor
    measurement unit, ``flagged`` what its flags say of bad rows; ``sheet`` and ``memory`` (GB) are
    what the user gave for reading, None where nothing.

    ``time`` (M,) in s and ``samples``, each (M,), are those whose time increases.
    """

    path: Path
    sha256: str
    clock: Clock
    sampling: Sampling
    backward_at: tuple[str, ...]
    channels: tuple[InspectedChannel, ...]
    phases: tuple[InspectedPhases, ...]
    steps: tuple[RecordedStep, ...]
    unreadable: Mapping[str, str]
    time: Array
    samples: Mapping[str, Array]
    opening: BreakerOpening | None = None
    pmu: PmuContent | None = None
    flagged: str = ""
    sheet: str | None = None
    memory: float | None = None

    def channel_of(self, signal: str) -> InspectedChannel | None:
        """Find the channel that seems to be a signal, None without one."""
        return next((channel for channel in self.channels if channel.signal == signal), None)

    @property
    def reference(self) -> InspectedChannel | None:
        """The channel of a recorded reference that rests and then moves, None without one."""
        channel = self.channel_of(REFERENCE)
        if channel is None or channel.missing:
            return None
        try:
            rest_end(self.samples[channel.name])
        except ValueError:
            return None
        return channel

    def change_of_voltage(self, step: RecordedStep) -> float | None:
        """Change of the voltage that lasts at a step, pu or a share of its level; None if none."""
        voltage = self.channel_of("vt")
        sources = (*(() if voltage is None else (voltage,)), *self.phases)
        changes = (source.change_at(step) for source in sources)
        return next((change for change in changes if change is not None), None)

    @property
    def plays_in(self) -> bool:
        """Whether it is a play-in file: what drives a unit, and nothing to compare."""
        return self.path.suffix.lower() == PLAY_IN

    @cached_property
    def kind(self) -> KindOfTest:
        """The kind of test that it holds, and why."""
        return kind_of(self)

    @property
    def is_event(self) -> bool:
        """Whether it seems to be a grid event."""
        return self.kind.name == EVENT

    @property
    def of_governor(self) -> bool:
        """Whether it seems to be a test of the governor, or a rejection with the gate recorded."""
        rejected = self.kind.name == REJECTION and self.channel_of("gate") is not None
        return rejected or self.kind.name in OF_GOVERNOR

    @property
    def findings(self) -> tuple[str, ...]:
        """What must be known before the record is used, in sentences."""
        if self.is_event or (self.of_governor and self.opening is None):
            of_channels = (
                text
                for each in self.channels
                for text in (
                    each.missing_samples,
                    each.question and f"{each.name}: {each.question}",
                )
            )
            return (
                *_clock_findings(self),
                *self._kind_findings(),
                *filter(None, (self.flagged, *of_channels)),
                *self._angle_findings(),
            )
        of_channels = (finding for channel in self.channels for finding in channel.findings)
        opening = self.opening
        of_reference = [step for step in self.steps if not (opening and opening.causes(step.at))]
        return (
            *_clock_findings(self),
            *self._kind_findings(),
            *of_channels,
            *rejection_findings(opening),
            *contradictions(self.channels, of_reference),
            *base_findings(self.channels),
            *self._speed_findings(),
        )

    def _kind_findings(self) -> Iterator[str]:
        """Ask for the kind of test where it is not sure; say what a steady point is good for."""
        if not self.kind.sure and self.opening is None:  # which is told as such
            yield f"a {self.kind.name}, by this: {self.kind.why}"
        if self.kind.name == STEADY:
            levels = (
                f"{signal} {channel.level:.5g} {channel.unit or ''}".rstrip()
                for signal in (*TERMINALS, *FIELDS)
                if (channel := self.channel_of(signal)) is not None
            )
            yield (
                "a steady point: it shows nothing of an exciter; on load it is a row of points "
                f"at rest in a programme: {', '.join(levels)}"
            )

    def _speed_findings(self) -> Iterator[str]:
        """Say that the voltage of a unit with its breaker open goes with its speed."""
        channel = self.channel_of("frequency")
        if channel is None or channel.unit != "Hz" or is_on_load(self.channels):
            return
        rated = min(RATED_HZ, key=lambda hertz: abs(channel.level - hertz))
        share = channel.level / rated
        if abs(share - 1.0) > NEARLY_RATED:
            yield (
                f"{channel.name}: rests at {channel.level:.5g} Hz, {share:.4g} of {rated:g}: with "
                "the breaker open vt goes with the speed, and a gain fitted as of rated speed is "
                f"{share:.4g} times what it is"
            )

    def _angle_findings(self) -> Iterator[str]:
        """Find what speaks against the angle of a PMU: its turns, and the frequency beside it."""
        pmu = self.pmu
        if pmu is not None and pmu.voltage.angle_unit is not None:
            angle = pmu.voltage.angles[0]
            frequency = None if pmu.frequency is None else self.samples[pmu.frequency]
            radians = in_radians(self.samples[angle], pmu.voltage.angle_unit)
            yield from angle_findings(self.time, angle, radians, frequency)

    @property
    def foremost(self) -> tuple[InspectedChannel, ...]:
        """The channels, those with a signal first, then those that step, constant ones last."""
        stepping = {name for step in self.steps for name in step.sizes}
        return tuple(
            sorted(
                self.channels,
                key=lambda channel: (
                    channel.signal is None,
                    channel.name not in stepping,
                    channel.constant,
                ),
            )
        )

    def as_json(self) -> dict[str, Any]:
        """Give the figures as plain data."""
        sampling = self.sampling
        return {
            "file": str(self.path),
            "sha256": self.sha256,
            "clock": list(self.clock.columns),
            "clock_unit": self.clock.unit,
            "samples": len(self.time),
            "sampling": {**asdict(sampling), "rate": sampling.rate, "even": sampling.even},
            "channels": [channel.as_json() for channel in self.channels],
            "phases": [asdict(group) for group in self.phases],
            "steps": [asdict(step) for step in self.steps],
            "breaker_opens": None if self.opening is None else asdict(self.opening),
            "pmu": None if self.pmu is None else asdict(self.pmu),
            "unreadable": dict(self.unreadable),
            "findings": list(self.findings),
        }


def inspect(
    table: RecordTable, clock: Sequence[str] | None = None, unit: str | None = None
) -> Inspection:
    """Inspect a recorder's file: its clock, its channels and their faults, the steps of the test.

    Args:
        table: the file.
        clock: the columns of the time, or of date and time; None: those that the file suggests.
        unit: of the time's numbers: s, ms, us or min; None: as the file says, else s.

    Raises:
        RecordError: no column seems to be the time, it cannot be read or never increases, fewer
            than two samples, or no column of numbers beside it.
    """
    place, stamps = _clock_of(table, clock, unit)
    sampling, time = sampling_of(stamps), stamps[increasing(stamps)]
    samples, unreadable = _columns_of_numbers(table, place, stamps)

    units = {name: _unit(table, name) for name in samples}
    stated = {name: unit for name, (unit, _) in units.items() if unit}
    pmu = pmu_content(samples, stated, table.names)
    of_pmu = frozenset() if pmu is None else pmu.columns.intersection(samples)
    plain = [name for name in samples if name not in of_pmu]
    groups = tuple(_phase_groups(time, samples, plain, stated))
    voltages = ((group.name, effective_value(samples, group.columns)) for group in groups)
    signals = samples.beside(Samples(voltages))
    readings = _readings(time, signals, stated, plain, groups)
    found = steps_of_record(time, signals, *_recognised(readings, plain, groups))
    inspected = [
        inspect_channel(name, units[name], time, column, found.channels[name], found.steps)
        for name, column in samples.items()
    ]
    channels = identified(inspected, found.steps, groups, of_pmu, readings)
    channels = without_false_per_unit(channels)
    opening = breaker_opening(time, samples, channels)
    return Inspection(
        path=table.path,
        sha256=table.sha256,
        clock=place,
        sampling=sampling,
        backward_at=tuple(table.place(row) for row in sampling.backward[:PLACES_LISTED]),
        channels=tuple(replace(channel, rejected_load=opening is not None) for channel in channels),
        phases=groups,
        steps=found.steps,
        unreadable=unreadable,
        time=time,
        samples=samples,
        opening=opening,
        pmu=pmu,
        flagged=_flagged(table, pmu),
    )


def _clock_of(
    table: RecordTable, columns: Sequence[str] | None, unit: str | None
) -> tuple[Clock, Array]:
    """Find the clock of a file and its time (M,) in s, which need not increase."""
    clock = Clock(tuple(columns or table.clock), unit)
    if not clock.columns:
        raise RecordError(
            f"{table.path}: no column seems to be the time; --time names one: {listed(table.names)}"
        )
    stamps = table.instants(clock.columns, unit)
    if len(stamps) < FEWEST_SAMPLES:
        raise RecordError(
            f"{table.path}: {len(stamps)} samples; at least {FEWEST_SAMPLES} are needed"
        )
    check_finite(stamps, clock.label, table.place)
    check_steps(stamps, clock.label, table.place)
    if np.count_nonzero(increasing(stamps)) < FEWEST_SAMPLES:
        check_increasing(stamps, clock.label, table.place)
    return clock, stamps


def _columns_of_numbers(
    table: RecordTable, clock: Clock, stamps: Array
) -> tuple[Samples, dict[str, str]]:
    """Read the columns of numbers where time increases, and the faults of the others.

    Raises RecordError where there is none.
    """
    forward = increasing(stamps)
    rows = slice(None) if forward.all() else forward
    refused: dict[str, str] = {}

    def usable() -> Iterator[tuple[str, Array]]:
        names = [name for name in table.names if name not in clock.columns]
        for name, column in table.each(names):
            fault = _fault_of(table, {clock.columns[0]: stamps}, name, column)
            if isinstance(column, RecordError) or fault is not None:
                refused[name] = str(fault)
            else:
                yield name, column[rows]

    samples = Samples(usable())
    if not samples:
        first = "; ".join(["", *refused.values()][:2])
        raise RecordError(f"{table.path}: no column of numbers beside the time{first}")
    return samples, refused


def _fault_of(
    table: RecordTable, time: Mapping[str, Array], name: str, column: Array | RecordError
) -> RecordError | None:
    """Find what keeps a column (M,) from being used beside the time (M,)."""
    if isinstance(column, RecordError):
        return column
    try:
        refuse_uneven(table.path, {**time, name: column})
    except RecordError as fault:
        return fault
    huge = np.isfinite(column) & (np.abs(column) > LARGEST)
    if huge.any():
        row = int(huge.argmax())
        what = f"{column[row]} {why_unusable(column[row])}"
        return column_error(table.place(row), name, what)
    return None


def _unit(table: RecordTable, name: str) -> tuple[str | None, str]:
    stated = table.units.get(name)
    unit = unit_in(name) if stated is None else stated
    return (None, "") if unit is None else (usual(unit), "name" if stated is None else "file")


def _readings(
    time: Array,
    signals: Mapping[str, Array],
    units: Mapping[str, str],
    names: Sequence[str],
    groups: Sequence[InspectedPhases],
) -> dict[str, NameReading]:
    """Read columns by their names, and those that leave it open by their numbers."""
    phases = {name for group in groups for name in group.columns}
    readings = read_names([*signals], units)
    readings |= {group.name: NameReading("vt", Clarity.WORDS, "phases") for group in groups}
    own = {
        name: readings[name]
        for name in (*names, *(group.name for group in groups))
        if name not in phases
    }
    return readings | readings_by_physics(time, signals, units, own)


def _recognised(
    readings: Mapping[str, NameReading], names: Sequence[str], groups: Sequence[InspectedPhases]
) -> tuple[list[str], set[str]]:
    """Find the channels of the reference, and all signals of a test."""
    phases = {name for group in groups for name in group.columns}
    guesses = guess_signals([name for name in names if name not in phases], {}, known=readings)
    references = [name for name, guess in guesses.items() if guess.signal == REFERENCE]
    of_test = {name for name, guess in guesses.items() if guess.signal not in OF_EVENT}
    return references, {*of_test, *(group.name for group in groups)}


def _phase_groups(
    time: Array, samples: Mapping[str, Array], names: Sequence[str], units: Mapping[str, str]
) -> Iterator[InspectedPhases]:
    """Yield three phases of a voltage, by their names or by their waveforms."""
    groups = three_phases(tuple(names), units)
    named = {name for group in groups for name in group}
    others = [name for name in names if name not in named]
    voltages = [name for name in others if quantity_of(units.get(name)) in (None, "voltage")]
    if not groups and len(voltages) <= MOST_WAVEFORMS:
        groups = tuple(waveforms_apart(time, samples, voltages))[:1]
    for group in groups:
        waves = {mains_frequency(time, samples[name]) is not None for name in group}
        effective = effective_value(samples, group)
        measured = effective[np.isfinite(effective)]  # where a sample of no phase is missing
        if len(waves) == 1 and len(measured):
            level = float(np.median(measured[: max(len(effective) // 10, 1)]))
            yield InspectedPhases(group, "waveform" if waves == {True} else "rms", level)


def effective_value(samples: Mapping[str, Array], columns: Sequence[str]) -> Array:
    """Effective value (M,) of three phases, waveforms or effective values each."""
    return np.asarray(np.sqrt(np.mean([samples[name] ** 2 for name in columns], axis=0)))


def _flagged(table: RecordTable, pmu: PmuContent | None) -> str:
    """Describe the bad rows by the flags of a PMU; "" where there are none."""
    if pmu is None or pmu.status is None:
        return ""
    try:
        bad = bad_rows(table, Status(pmu.status))
    except RecordError as fault:
        return str(fault)
    if not bad:
        return ""
    first, count = bad[0], "1 row is" if len(bad) == 1 else f"{len(bad)} rows are"
    return (
        f"{pmu.status}: {count} not valid, the first at {table.place(first.row)}: {first.flag}, "
        f"{first.why}"
    )


def _clock_findings(inspection: Inspection) -> Iterator[str]:
    sampling = inspection.sampling
    for gap in sampling.gaps[:PLACES_LISTED]:
        lost = f"about {gap.lost} samples are missing"
        yield f"the clock jumps from {gap.start:.6g} to {gap.end:.6g} s: {lost}"
    if len(sampling.gaps) > PLACES_LISTED:
        yield f"the clock jumps {len(sampling.gaps) - PLACES_LISTED} more times"
    if sampling.backward:
        places = ", ".join(inspection.backward_at)
        more = len(sampling.backward) - len(inspection.backward_at)
        rest = f" and {more} more" if more else ""
        yield (
            f"time repeats or goes back at {places}{rest}: left out here; a fit refuses them "
            "unless the rows are identical, or with `repeats: first` or `repeats: last`"
        )
    if sampling.step >= 1.0:
        yield f"samples are {sampling.step:g} s apart: is the time in s?"
    flags = None if inspection.pmu is None else inspection.pmu.status
    for name, reason in inspection.unreadable.items():
        if name != flags:
            yield f"{name}: no numbers: {reason}"
    for before, after in pairwise(inspection.steps):
        if after.at - before.at < SAME_STEP:
            yield (
                f"steps at {before.at:.4g} and {after.at:.4g} s are less than {SAME_STEP:g} s "
                "apart: a channel's step may belong to either"
            )
