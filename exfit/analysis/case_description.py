"""A case in words and tables, as its report shows it: its models, its tests, its files."""

from collections.abc import Iterator, Mapping, Sequence

from exfit.case.case import Case
from exfit.case.parts import Part
from exfit.case.schema import (
    BumpTest,
    ChannelSection,
    FindableStep,
    PhasesSection,
    Reference,
    ReferenceFile,
    ReferenceTable,
    Unknown,
    start_value,
)
from exfit.fitting.setup import ExperimentSetup
from exfit.plants import NETWORK, REFERENCES
from exfit.records.reading import file_hash
from exfit.records.record import Record
from exfit.results.description import (
    NetworkParameter,
    PartDescription,
    RecordedTest,
    SheetRow,
)


def labelled_records(case: Case) -> list[str]:
    """Return the labels of the records of a case: of those fitted, then of the validations."""
    fitted = [f"records.{recording.name}" for recording in case.records] or ["record"]
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
    return hashes | {label: record.sha256 for label, record in _records(case, setups)}


def input_names(case: Case, setups: Sequence[ExperimentSetup]) -> dict[str, str]:
    """Return the name of every file that goes into a result, by its label."""
    return {
        "case": case.path.name,
        "model": (case.folder / (case.model or "")).name,
        "parameters": "" if case.parameter_file is None else case.parameter_file.name,
        **{label: record.source.name for label, record in _records(case, setups)},
    }


def _records(case: Case, setups: Sequence[ExperimentSetup]) -> Iterator[tuple[str, Record]]:
    """Yield the records of a case by their labels, each with the files of its reference."""
    for label, setup in zip(labelled_records(case), setups, strict=True):
        yield label, setup.record
        yield from ((f"{label}.{signal}", file) for signal, file in setup.references.items())


def values_by_part(case: Case, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the values of each part, by its kind and their symbols."""
    return {
        part.kind: {symbol: values[part.prefix + symbol] for symbol in part.symbols}
        for part in case.parts.all
    }


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
    models = {"exciter": parts.exciter, "stabiliser": parts.stabiliser}
    for part in parts.all:
        model = models.get(part.kind)
        machine = parts.machine if part.kind == "machine" else None
        yield PartDescription(
            kind=part.kind,
            name=part.name,
            prefix=part.prefix,
            title=machine.title if machine else model.title if model else "",
            drawing=model.drawing if model else "",
            sheet={row.symbol: SheetRow(row.unit, row.meaning) for row in part.sheet},
        )


def tests_of(case: Case, setups: Sequence[ExperimentSetup]) -> Iterator[RecordedTest]:
    """Yield the tests of a case with their records; ``setups`` as for `input_hashes`."""
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
            done="; ".join(_events(recording.test)) or "no step of its own",
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


def _events(test: BumpTest) -> Iterator[str]:
    """Yield what was done to the unit, in words."""
    if test.vt0 is not None:
        yield f"vt0 {_given(test.vt0, 'g', 'pu')}"
    for signal in REFERENCES:
        yield from _reference(signal, getattr(test, signal))
    for event in test.E:
        yield f"E {event.step:+g} pu at {event.at:g} s"
    for switch in test.network:
        values = {name: getattr(switch, name) for name in ("R", "X", "E")}
        changes = (f"{name} {value:g} pu" for name, value in values.items() if value is not None)
        yield f"network switched at {switch.at:g} s: {', '.join(changes)}"


def _reference(signal: str, given: Reference) -> Iterator[str]:
    """Yield what the reference, or the stabiliser's signal, did."""
    if isinstance(given, ReferenceTable):
        (start, first), (end, last) = given.table[0], given.table[-1]
        rows = f"{len(given.table)} rows, {start:g} ... {end:g} s"
        yield f"{signal} by a table of {rows}, from {first:g} to {last:g} pu"
    elif isinstance(given, ReferenceFile):
        yield f"{signal} from the column {given.column} of {given.file}"
    elif isinstance(given, str):
        yield f"{signal} as recorded"
    else:
        yield from (_event(signal, event) for event in given)


def _event(signal: str, event: FindableStep) -> str:
    """Return a step or ramp of a signal."""
    change = f"{signal} {_given(event.step, '+g', 'pu')} at {_given(event.at, 'g', 's')}"
    return change if event.ramp is None else f"{change}, in a ramp of {event.ramp:g} s"


def _channel(signal: str, entry: ChannelSection | PhasesSection) -> str:
    """Return a signal with what 1 pu of it is."""
    return signal if entry.base is None else f"{signal}, 1 pu = {entry.base:g} {entry.unit}"


def _given(value: float | Unknown, form: str, unit: str) -> str:
    """Return a value of a test; one that the fit identified is among the parameters."""
    if not isinstance(value, Unknown):
        return f"{value:{form}} {unit}"
    start = start_value(value)
    about = "" if start is None else f"about {start:{form}} {unit} "
    return f"{about}(found by the fit)"
