"""A case in words and tables, as its report shows it: its models, its tests, its files."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from exfit.case.case import Case
from exfit.case.parts import Part
from exfit.case.schema import (
    AngleTable,
    BumpTest,
    ChannelSection,
    Filter,
    FindableStep,
    MedianSection,
    PhasesSection,
    Recording,
    Reference,
    ReferenceFile,
    ReferenceTable,
    Unknown,
)
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.nuisances import OPENING, prefix_from
from exfit.fitting.program import Program
from exfit.fitting.system import driving_after_opening
from exfit.inference.confidence import Interval
from exfit.plants import NETWORK, REFERENCES
from exfit.plants.parts import initial
from exfit.records.reading import file_hash
from exfit.records.record import Record
from exfit.results.comparisons import Comparison
from exfit.results.description import (
    NetworkParameter,
    OtherProgram,
    PartDescription,
    RecordedTest,
    SheetRow,
)
from exfit.results.model import FittedParameter
from exfit.signals import COMPARED_IN_EVENT, unit_of_signal
from exfit.util.criteria import Criteria
from exfit.util.files import on_disk
from exfit.util.text import rounded_value, show

RESTING = ("vt", *COMPARED_IN_EVENT)  # in the order in which a rest is described
SWING = {
    "power": "swing equation: Pm is a power, its torque (Pm - D dw) / (1 + dw)",
    "torque": "swing equation: Pm is a torque, less D dw",
}


def played_in(view: Case, recording: Recording, setup: ExperimentSetup) -> Iterator[str]:
    """Describe the playing in of a record; nothing where there was none.

    ``view`` is the case with the plant of the record.
    """
    if not setup.driving:
        return
    yield f"recorded {' and '.join(setup.driving)} played in"
    if setup.test.steady is not None:
        levels = ", ".join(_levels(setup))
        yield f"at rest until {setup.test.steady:.4g} s" + (f" with {levels}" if levels else "")
    if view.kind.has_machine and view.kind.has_exciter:
        yield SWING[getattr(view.plant, "swing", "power")]
    masks = (*recording.record.mask, *(switching.masked for switching in setup.switchings))
    left_out = ", ".join(f"{start:.4g} ... {end:.4g} s" for start, end in masks)
    if left_out:
        yield f"left out of the comparison: {left_out}"
    everything = _filter(recording.record.filter)
    if everything:
        yield f"all channels {everything}"
    yield from _filters(recording)


def _levels(setup: ExperimentSetup) -> Iterator[str]:
    """Yield the levels at the start that the record gives."""
    for signal in RESTING:
        level = setup.experiment.own.get(initial(signal))
        if level is not None and signal in setup.record.signals:
            yield f"{signal} {level:.4g} {unit_of_signal(signal)}"


def _filters(recording: Recording) -> Iterator[str]:
    """Yield the filters of the channels."""
    for signal, channel in recording.record.channels.items():
        text = _filter(channel.filter)
        if text:
            yield f"{signal} {text}"


def _filter(given: Filter | None) -> str:
    """Return a filter in words; "" for none."""
    if given is None:
        return ""
    if isinstance(given, MedianSection):
        return f"as medians of {given.median} samples"
    return f"below {show(given.lowpass)} Hz"


Estimated = tuple[float, float | None]  # a value, and half of its 95 % interval
Identified = Mapping[str, Estimated]  # what a fit found about its records, by name
Value = TypeVar("Value")


def labelled_records(case: Case) -> list[str]:
    """Return the labels of the records of a case: of those fitted, then of the validations."""
    fitted = [f"records.{recording.name}" for recording in case.records]
    fitted = fitted or ["record" for _ in case.recordings]
    return [*fitted, *(f"validate.{recording.name}" for recording in case.validations)]


def input_hashes(case: Case, setups: Sequence[ExperimentSetup]) -> dict[str, str]:
    """Return the SHA-256 of every file that goes into a result, by its label.

    ``setups`` are those of the fitted records, then of the validations.
    """
    hashes = {"case": file_hash(case.path)} if case.from_file else {}
    if case.parameter_file is not None:
        hashes["parameters"] = file_hash(case.parameter_file)
    if case.model is not None and case.model.endswith(".py"):
        hashes["model"] = file_hash(case.folder / case.model)
    hashes |= {label: file_hash(script) for label, script in _scripts(case).items()}
    return hashes | {label: record.sha256 for label, record in _records(case, setups)}


def input_names(case: Case, setups: Sequence[ExperimentSetup]) -> dict[str, str]:
    """Return the name of every file that goes into a result, by its label."""
    return {
        "case": case.path.name,
        "model": (case.folder / (case.model or "")).name,
        "parameters": "" if case.parameter_file is None else case.parameter_file.name,
        **{label: script.name for label, script in _scripts(case).items()},
        **{label: record.source.name for label, record in _records(case, setups)},
    }


def _scripts(case: Case) -> dict[str, Path]:
    """Return the files of what simulates a case in place of exfit, by their labels."""
    return {f"program{number or ''}": file for number, file in enumerate(case.program_files)}


def _records(case: Case, setups: Sequence[ExperimentSetup]) -> Iterator[tuple[str, Record]]:
    """Yield the records of a case by their labels, each with the files of its reference."""
    for label, setup in zip(labelled_records(case), setups, strict=True):
        yield label, setup.record
        yield from ((f"{label}.{signal}", file) for signal, file in setup.references.items())


def text_of(case: Case) -> str:
    """Return the text of the file of a case; "" for a case that was made in Python."""
    return on_disk(case.path).read_text(encoding="utf-8-sig") if case.from_file else ""


def criteria_of(case: Case) -> Criteria:
    """Return the criteria by which the report of a case judges."""
    return Criteria(**dict(case.report.criteria))


def values_by_part(case: Case, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the values of each part, by its kind and their symbols."""
    return {
        part.kind: {symbol: values[part.prefix + symbol] for symbol in part.symbols}
        for part in case.parts.all
    }


def of_limiters(case: Case, by_kind: Mapping[str, Value]) -> dict[str, Value]:
    """Select the entries of the limiters of a case, by their kinds."""
    return {limiter.kind: by_kind[limiter.kind] for limiter in case.parts.limiters}


def fixed_values(case: Case, values: Mapping[str, float]) -> dict[str, float]:
    """Return the values of the exciter, and of helpers of ties, that are not free."""
    others = tuple(part.prefix for part in case.parts.all if part.prefix)
    free = case.free()
    return {
        name: values[name]
        for name in case.values()
        if name not in free and not name.startswith(others)
    }


def parts_of(case: Case) -> Iterator[PartDescription]:
    """Yield the parts of a case with their data sheets and drawings."""
    parts = case.parts
    models = {
        "exciter": parts.exciter,
        "stabiliser": parts.stabiliser,
        "governor": parts.governor,
        **{limiter.kind: limiter.model for limiter in parts.limiters},
    }
    for part in parts.all:
        model = parts.machine if part.kind == "machine" else models.get(part.kind)
        yield PartDescription(
            kind=part.kind,
            name=part.name,
            prefix=part.prefix,
            title=model.title if model else "",
            drawing=model.drawing if model else "",
            sheet={row.symbol: SheetRow(row.unit, row.meaning) for row in part.sheet},
            doubt=model.doubt if model else "",
        )


def tests_of(
    case: Case, setups: Sequence[ExperimentSetup], identified: Identified
) -> Iterator[RecordedTest]:
    """Yield the tests of a case with their records; ``setups`` as for `input_hashes`.

    ``identified`` holds what the fit identified about the records.
    """
    roles = [*("fitted" for _ in case.recordings), *("validation" for _ in case.validations)]
    recordings = (*case.recordings, *case.validations)
    for role, recording, setup in zip(roles, recordings, setups, strict=True):
        time = setup.record.time
        view = case.seen_from(recording)
        yield RecordedTest(
            name=recording.name,
            role=role,
            file=recording.record.file,
            plant=view.kind.title,
            done="; ".join(_done(view, recording, setup, identified)) or "no step of its own",
            channels="; ".join(_channel(*entry) for entry in recording.record.channels.items()),
            samples=len(time),
            first=float(time[0]),
            last=float(time[-1]),
            spacing=float(time[-1] - time[0]) / (len(time) - 1),
            network={} if view is case else _network(view),
        )


def _network(view: Case) -> dict[str, NetworkParameter]:
    values, sources = view.values(), view.sources()
    networks: Iterator[Part] = (part for part in view.parts.all if part.kind == "network")
    return {
        row.symbol: NetworkParameter(
            values[NETWORK + row.symbol], row.unit, row.meaning, sources[NETWORK + row.symbol]
        )
        for part in networks
        for row in part.sheet
    }


def _done(
    view: Case, recording: Recording, setup: ExperimentSetup, identified: Identified
) -> Iterator[str]:
    """Describe the test of a unit, or the event of the grid, in words."""
    yield from played_in(view, recording, setup)
    yield from _events(view, recording, identified)


def _events(case: Case, recording: Recording, identified: Identified) -> Iterator[str]:
    """Describe the steps and switchings of a test."""
    test, prefix = recording.test, prefix_from(recording.name)
    if test.vt0 is not None:
        yield f"vt0 {_given(test.vt0, 'g', 'pu', identified.get(f'{prefix}vt0'))}"
    for signal in REFERENCES:
        yield from _reference(signal, getattr(test, signal), prefix, identified)
    for event in test.E:
        yield f"E {event.step:+g} pu at {event.at:g} s"
    yield from _source_angle(test)
    for switch in test.network:
        values = {name: getattr(switch, name) for name in ("R", "X", "E")}
        changes = (f"{name} {value:g} pu" for name, value in values.items() if value is not None)
        yield f"network switched at {switch.at:g} s: {', '.join(changes)}"
    if test.breaker is not None:
        opens = _given(test.breaker.opens, "g", "s", identified.get(f"{prefix}{OPENING}"))
        drivers = driving_after_opening(case, recording)
        follows = f", then driven by the recorded {' and '.join(drivers)}" if drivers else ""
        yield f"breaker opens at {opens}{follows}"


def _source_angle(test: BumpTest) -> Iterator[str]:
    """Describe the angle of the source."""
    if isinstance(test.angle, AngleTable):
        (start, first), (end, last) = test.angle.table[0], test.angle.table[-1]
        rows = f"{len(test.angle.table)} rows, {start:g} ... {end:g} s"
        change = f"from {first:g} to {last:g} {test.angle.unit}"
        yield f"angle of the source by a table of {rows}, {change}"
        return
    for event in test.angle:
        change = f"angle of the source {event.step:+g} {event.unit} at {event.at:g} s"
        yield change if event.ramp is None else f"{change}, in a ramp of {event.ramp:g} s"


def _reference(signal: str, given: Reference, prefix: str, identified: Identified) -> Iterator[str]:
    """Describe the course of a reference, or of the stabiliser's signal."""
    if isinstance(given, ReferenceTable):
        (start, first), (end, last) = given.table[0], given.table[-1]
        rows = f"{len(given.table)} rows, {start:g} ... {end:g} s"
        yield f"{signal} by a table of {rows}, from {first:g} to {last:g} pu"
    elif isinstance(given, ReferenceFile):
        yield f"{signal} from the column {given.column} of {given.file}"
    elif isinstance(given, str):
        yield f"{signal} as recorded"
    else:
        for number, event in enumerate(given):
            which = f"{prefix}{signal}{number + 1 if number else ''}"
            own = (identified.get(f"{which}.step"), identified.get(f"{which}.at"))
            yield _event(signal, event, *own)


def _event(
    signal: str, event: FindableStep, size: Estimated | None, instant: Estimated | None
) -> str:
    """Return a step or ramp of a signal, as it was given or identified."""
    change = f"{signal} {_given(event.step, '+g', 'pu', size)}"
    change += f" at {_given(event.at, 'g', 's', instant)}"
    return change if event.ramp is None else f"{change}, in a ramp of {event.ramp:g} s"


def _channel(signal: str, entry: ChannelSection | PhasesSection) -> str:
    """Return a signal with what 1 pu of it is."""
    return signal if entry.base is None else f"{signal}, 1 pu = {entry.base:g} {entry.unit}"


def _given(
    value: float | Unknown, form: str, unit: str, identified: Estimated | None = None
) -> str:
    """Return a value of a test, as it was given or identified, with half its 95 % interval."""
    if not isinstance(value, Unknown):
        return f"{value:{form}} {unit}"
    if identified is None:
        return "unknown"
    number, half = identified
    sign = "+" if form.startswith("+") and number > 0.0 else ""
    error = "" if half is None else f" +- {half:.2g}"
    return f"{sign}{rounded_value(number, half)}{error} {unit} (found by the fit)"


def identified_values(
    parameters: Mapping[str, FittedParameter], validations: Iterable[Comparison]
) -> dict[str, Estimated]:
    """Collect the values that a fit found about its records, each with half of its interval."""
    of_validations = {
        name: (value, None) for match in validations for name, value in match.of_record.items()
    }
    fitted = {
        name: (parameter.value, _half_of(parameter.interval))
        for name, parameter in parameters.items()
        if parameter.of_record
    }
    return {**of_validations, **fitted}


def _half_of(interval: Interval | None) -> float | None:
    low, high = interval or (None, None)
    return None if low is None or high is None else 0.5 * (high - low)


def other_program_of(
    case: Case, program: Program | None, setups: Sequence[ExperimentSetup]
) -> OtherProgram | None:
    """Describe what simulated settled tests, with its runs until now; None where exfit did."""
    section = case.external
    if section is None or program is None:
        return None
    differences = program.differences(setups)
    return OtherProgram(section.simulator, section.twin, program.runs, program.failed, differences)
