"""A case in words and tables, as its report shows it: its models, its tests, its files."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from exfit.case.case import Case
from exfit.case.schema import (
    AngleTable,
    MedianSection,
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
from exfit.inference.confidence import closed
from exfit.models import LOAD_CONTROLLERS
from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.plants import GOVERNOR, MACHINE, NETWORK, REFERENCES, STABILISER, SWITCHED
from exfit.plants.parts import initial
from exfit.records.reading import file_hash
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
from exfit.util.files import on_disk
from exfit.util.text import rounded_value, show

RESTING = ("vt", *COMPARED_IN_EVENT)  # in the order in which a rest is described
OF_PSSE = "equations of PSS/E: Pm is a power, its torque (Pm - D dw) / (1 + dw)"
DIALECTS = {
    "standard": OF_PSSE,
    "psse": f"{OF_PSSE}; PSS4B is PSS/E's",
    "powerworld": "equations of PowerWorld: the stator's voltage follows the speed",
    "andes": "equations of ANDES: Pm is a torque, less D dw",
}


def _played_in(view: Case, recording: Recording, setup: ExperimentSetup) -> Iterator[str]:
    """Describe the playing in of a record; nothing where there was none."""
    if not setup.driving:
        return
    yield f"recorded {' and '.join(setup.driving)} played in"
    if setup.test.steady is not None:
        rest = {signal: setup.experiment.own.get(initial(signal)) for signal in RESTING}
        levels = ", ".join(
            f"{signal} {level:.4g} {unit_of_signal(signal)}"
            for signal, level in rest.items()
            if level is not None and signal in setup.record.signals
        )
        yield f"at rest until {setup.test.steady:.4g} s" + (f" with {levels}" if levels else "")
    if view.kind.has_machine and view.kind.has_exciter:
        yield DIALECTS[getattr(view.plant, "dialect", "standard")]
    masks = (*recording.record.mask, *(switching.masked for switching in setup.switchings))
    if masks:
        left_out = ", ".join(f"{start:.4g} ... {end:.4g} s" for start, end in masks)
        yield f"left out of the comparison: {left_out}"
    yield from _filters(recording)


def _filters(recording: Recording) -> Iterator[str]:
    filters = {"all channels": recording.record.filter}
    filters |= {signal: channel.filter for signal, channel in recording.record.channels.items()}
    for name, given in filters.items():
        if isinstance(given, MedianSection):
            yield f"{name} as medians of {given.median} samples"
        elif given is not None:
            yield f"{name} below {show(given.lowpass)} Hz"


Estimated = tuple[float, float | None]  # a value, and half of its 95 % interval
Identified = Mapping[str, Estimated]  # what a fit found about its records, by name


def inputs_of(
    case: Case, setups: Sequence[ExperimentSetup]
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the SHA-256 of every file that goes into a result, and the names, by its label.

    ``setups`` are those of the fitted records, then of the validations.
    """
    own = {"case": case.path if case.from_file else None, "parameters": case.parameter_file}
    if case.model is not None and case.model.endswith(".py"):
        own["model"] = case.folder / case.model
    hashes = {label: file_hash(path) for label, path in own.items() if path is not None}
    names = {
        "case": case.path.name,
        "model": (case.folder / (case.model or "")).name,
        "parameters": "" if case.parameter_file is None else case.parameter_file.name,
    }
    for number, script in enumerate(case.program_files):
        label = f"program{number or ''}"
        hashes[label], names[label] = file_hash(script), script.name
    for label, setup in zip(_labels(case), setups, strict=True):
        records = {f"{label}.{signal}": record for signal, record in setup.references.items()}
        for name, record in {label: setup.record, **records}.items():
            hashes[name], names[name] = record.sha256, record.source.name
    return hashes, names


def _labels(case: Case) -> list[str]:
    """Return the labels of the records of a case: of those fitted, then of the validations."""
    fitted = [f"records.{recording.name}" for recording in case.records]
    fitted = fitted or ["record" for _ in case.recordings]
    return [*fitted, *(f"validate.{recording.name}" for recording in case.validations)]


def text_of(case: Case) -> str:
    """Return the text of the file of a case; "" for a case that was made in Python."""
    return on_disk(case.path).read_text(encoding="utf-8-sig") if case.from_file else ""


def fixed_values(
    case: Case, values: Mapping[str, float], fitted: Collection[str] = ()
) -> dict[str, float]:
    """Return the values of the exciter, and of helpers of ties, that are not free or fitted."""
    others = tuple(part.prefix for part in case.parts.all if part.prefix)
    free = {*case.free(), *fitted}
    return {
        name: values[name]
        for name in case.values()
        if name not in free and not name.startswith(others)
    }


def parts_of(case: Case) -> Iterator[PartDescription]:
    """Yield the parts of a case with their data sheets and drawings."""
    parts = case.parts
    models: dict[str, Model | Machine | None] = {
        "exciter": parts.exciter,
        "machine": parts.machine,
        "stabiliser": parts.stabiliser,
        "governor": parts.governor,
        **{limiter.kind: limiter.model for limiter in parts.limiters},
    }
    for each in parts.further:
        stabiliser = None if each.stabiliser is None else each.stabiliser.model
        found = (each.exciter, each.machine, stabiliser, each.governor)
        names = ("", MACHINE, STABILISER, GOVERNOR)
        models |= {(each.prefix + n)[:-1]: one for n, one in zip(names, found, strict=True)}
    for part in parts.all:
        model = models.get(part.kind) or LOAD_CONTROLLERS.get(part.name)
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
        time, view = setup.record.time, case.seen_from(recording)
        done = [*_played_in(view, recording, setup), *_events(view, recording, identified)]
        channels = [
            signal if entry.base is None else f"{signal}, 1 pu = {entry.base:g} {entry.unit}"
            for signal, entry in recording.record.channels.items()
        ]
        values, sources = view.values(), view.sources()
        networks = [] if view is case else [p for p in view.parts.all if p.kind == "network"]
        network = {
            row.symbol: NetworkParameter(
                values[NETWORK + row.symbol], row.unit, row.meaning, sources[NETWORK + row.symbol]
            )
            for part in networks
            for row in part.sheet
        }
        yield RecordedTest(
            name=recording.name,
            role=role,
            file=recording.record.file,
            plant=view.kind.title,
            done="; ".join(done) or "no step of its own",
            channels="; ".join(channels),
            samples=len(time),
            first=float(time[0]),
            last=float(time[-1]),
            spacing=float(time[-1] - time[0]) / (len(time) - 1),
            network=network,
        )


def _events(case: Case, recording: Recording, identified: Identified) -> Iterator[str]:
    test, prefix = recording.test, prefix_from(recording.name)
    if test.vt0 is not None:
        yield f"vt0 {_given(test.vt0, 'g', 'pu', identified.get(f'{prefix}vt0'))}"
    for signal in REFERENCES:
        yield from _reference(signal, getattr(test, signal), prefix, identified)
    for event in test.E:
        yield f"E {event.step:+g} pu at {event.at:g} s"
    if isinstance(test.angle, AngleTable):
        yield _by_table("angle of the source", test.angle.table, test.angle.unit)
    else:
        for each in test.angle:
            change = f"angle of the source {each.step:+g} {each.unit} at {each.at:g} s"
            yield change + _ramp(each.ramp)
    for switch in test.network:
        values = {name: getattr(switch, name) for name in SWITCHED}
        changes = (f"{name} {value:g} pu" for name, value in values.items() if value is not None)
        yield f"network switched at {switch.at:g} s: {', '.join(changes)}"
    for fault in test.fault:
        impedance = f"{fault.R:g} + j{fault.X:g} pu"
        yield f"fault of {impedance} at the terminals, {fault.at:g} ... {fault.cleared:g} s"
    if test.breaker is not None:
        opens = _given(test.breaker.opens, "g", "s", identified.get(f"{prefix}{OPENING}"))
        drivers = driving_after_opening(case, recording)
        follows = f", then driven by the recorded {' and '.join(drivers)}" if drivers else ""
        yield f"breaker opens at {opens}{follows}"


def _reference(signal: str, given: Reference, prefix: str, identified: Identified) -> Iterator[str]:
    """Describe the course of a reference, or of the stabiliser's signal."""
    if isinstance(given, ReferenceTable):
        yield _by_table(signal, given.table, "pu")
    elif isinstance(given, ReferenceFile):
        yield f"{signal} from the column {given.column} of {given.file}"
    elif isinstance(given, str):
        yield f"{signal} as recorded"
    else:
        for number, event in enumerate(given):
            which = f"{prefix}{signal}{number + 1 if number else ''}"
            size = _given(event.step, "+g", "pu", identified.get(f"{which}.step"))
            instant = _given(event.at, "g", "s", identified.get(f"{which}.at"))
            yield f"{signal} {size} at {instant}{_ramp(event.ramp)}"


def _by_table(what: str, table: Sequence[tuple[float, float]], unit: str) -> str:
    (start, first), (end, last) = table[0], table[-1]
    rows = f"{len(table)} rows, {start:g} ... {end:g} s"
    return f"{what} by a table of {rows}, from {first:g} to {last:g} {unit}"


def _ramp(seconds: float | None) -> str:
    return "" if seconds is None else f", in a ramp of {seconds:g} s"


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
    return f"{sign}{rounded_value(number, half)}{error} {unit} (fitted)"


def identified_values(
    parameters: Mapping[str, FittedParameter], validations: Iterable[Comparison]
) -> dict[str, Estimated]:
    """Collect the values that a fit found about its records, each with half of its interval."""
    found: dict[str, Estimated] = {
        name: (value, None) for match in validations for name, value in match.of_record.items()
    }
    for name, parameter in parameters.items():
        if parameter.of_record:
            own = parameter.interval
            found[name] = (parameter.value, 0.5 * (own[1] - own[0]) if closed(own) else None)
    return found


def other_program_of(
    case: Case, program: Program | None, setups: Sequence[ExperimentSetup]
) -> OtherProgram | None:
    """Describe what simulated settled tests, with its runs until now; None where exfit did."""
    section = case.external
    if section is None or program is None:
        return None
    differences = program.differences(setups)
    return OtherProgram(section.simulator, section.twin, program.runs, program.failed, differences)
