"""A case to start from: a model, records, and what is typical for all that is not known."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import wrap

from exfit.case.draft.free_parameters import bounds_of, free_of
from exfit.case.draft.starting_tests import StartingTest
from exfit.case.draft.starting_unit import PartData, UnitData
from exfit.case.draft.suggested_sections import event_plant, event_section, suggests_event
from exfit.case.draft.suggestion import (
    channel_lines,
    clock_text,
    gap_lines,
    number_text,
    plain_text,
    reading_lines,
    record_section,
    relative,
    steps_section,
    weights_section,
    window_lines,
)
from exfit.case.open_values import FILL_IN
from exfit.case.templates import (
    commented,
    in_comment,
    inputs_lines,
    parameter_line,
    source_lines,
)
from exfit.records.channel_inspection import InspectedChannel
from exfit.records.field_base import shows_power
from exfit.records.inspection import Inspection
from exfit.util.sources import TYPICAL
from exfit.util.text import first_texts, yaml_number

WIDTH = 80  # columns of a note
ALONE = "FIRST_ORDER"  # the model whose output is vt itself
IN_A_LIST = "    "  # before the lines of a section that is in an entry of a list


def starting_case(
    unit: UnitData,
    tests: Sequence[StartingTest],
    folder: Path,
    about: Mapping[str, str] | None = None,
) -> str:
    """Return the text of a case of a unit with the tests of one or more records.

    ``folder`` is where the case will be written, ``about`` what its report shows. What must be
    filled in is no number, so that the case is refused until it is.
    """
    exciter, first = unit.exciter.model, tests[0].inspection
    names = {test.inspection.path: relative(test.inspection.path, folder) for test in tests}
    recordings, validations = _recordings(tests, names, exciter.name)
    lines = [
        *_heading(unit, tests),
        *_about(about or {}),
        f"model: {unit.name}",
        *(["efd_times_speed: true"] if unit.exciter.times_speed else []),
        *_plant(unit, first),
        *_added(unit),
        *recordings,
        *_parameters(unit.exciter),
        *weights_section(first),
        *validations,
        *unit.as_found,
    ]
    return "\n".join(lines) + "\n"


def _heading(unit: UnitData, tests: Sequence[StartingTest]) -> Iterator[str]:
    """Yield what a case is made of and what must be known of it, as comments."""
    exciter = unit.exciter.model
    inspections = list({test.inspection.path: test.inspection for test in tests}.values())
    records = "the record" if len(inspections) == 1 else "the records"
    files = ", ".join(in_comment(inspection.path.name) for inspection in inspections)
    yield from _wrapped(f"{exciter.name} on {records} {files}: a case to start from.")
    yield from _advice(unit)
    for inspection in inspections:
        for text in first_texts(inspection.findings):
            yield from _note(text)


def _recordings(
    tests: Sequence[StartingTest], names: Mapping[Path, str], exciter: str
) -> tuple[list[str], list[str]]:
    """Return the sections of what is fitted, and of what validates."""
    if suggests_event(tests[0].inspection):
        return _events(tests, names)
    if len(tests) == 1:
        level = _voltage_before(exciter, tests[0])
        return _single(tests[0], names[tests[0].inspection.path], level), _validation_to_come()
    fitted, validations = _several(tests, names, exciter)
    validating = ["validate:", *validations] if validations else _validation_to_come()
    return ["records:", *fitted], validating


def _events(
    tests: Sequence[StartingTest], names: Mapping[Path, str]
) -> tuple[list[str], list[str]]:
    """Return the sections of grid events: the first, or every other one, is fitted."""
    sections = [
        event_section(test.inspection, names[test.inspection.path], test.bases) for test in tests
    ]
    if len(tests) == 1:
        return sections[0], []
    fitted, validations = list[str](), list[str]()
    for test, section in zip(tests, sections, strict=True):
        lines = [f"  - name: {test.name}", *(f"{IN_A_LIST}{line}" for line in section)]
        (validations if test.validates else fitted).extend(lines)
    return ["records:", *fitted], ["validate:", *validations]


def _advice(unit: UnitData) -> list[str]:
    """Return what to do with the values of a new case, as comments."""
    parts = [unit.exciter, unit.machine, *unit.added.values()]
    given = list(dict.fromkeys(part.origin for part in parts if part.origin))
    text = f"Values are {' and '.join(given)}. " if given else ""
    if any(TYPICAL in part.sources.values() for part in parts):
        those = "Replace those that are typical" if given else "Values are typical: replace them"
        text += f"{those} by those of the unit, and the words under `sources`. "
    return _wrapped(
        text + "`exfit check` tries the case, `exfit identify` shows what its test resolves, "
        "`exfit fit` fits."
    )


def _about(facts: Mapping[str, str]) -> list[str]:
    if not facts:
        return ["# about: {Plant: ..., Unit: ..., Rated: ..., Tested by: ...}  # for reports"]
    return [
        "about:",
        *(f"  {plain_text(name)}: {plain_text(fact)}" for name, fact in facts.items()),
    ]


def _voltage_before(exciter: str, test: StartingTest) -> list[str]:
    """Return the line of the voltage before a test: a number where the exciter is alone."""
    voltage = test.inspection.channel_of("vt")
    if exciter == ALONE and test.window is None:
        return [commented(f"  vt0: {number_text(voltage.level if voltage else 1.0)}", "at rest")]
    if exciter == ALONE or not test.steps or test.steps[0].from_start:
        return []
    return [commented("  vt0: {start: auto}", "at rest: the noise of its mean counts")]


def _single(test: StartingTest, file: str, level: list[str]) -> list[str]:
    """Return the sections test and record of a case with one test."""
    inspection, compared = test.inspection, ("vt", *test.bases)
    return [
        *steps_section(inspection, test.steps, test.sizes, level),
        *record_section(inspection, file, compared, test.bases, test.window),
    ]


def _validation_to_come() -> list[str]:
    return [
        "# validate:               # a record that the fit does not see, as the step down",
        "#   - name: down",
        "#     test: {vref: [{at: 1.0, step: -0.05}]}",
        "#     record: {file: down.csv, time: t, channels: {vt: vt}}",
    ]


def _several(
    tests: Sequence[StartingTest], names: Mapping[Path, str], exciter: str
) -> tuple[list[str], list[str]]:
    """Return the entries of the records that are fitted, and of those that validate.

    Channels stand once, at the first record of a file that has them; others refer to them.
    """
    anchors: dict[str, str] = {}
    fitted, validations = list[str](), list[str]()
    in_file = sorted(tests, key=lambda test: test.validates)
    for test in in_file:
        lines = [f"name: {test.name}"]
        level = _voltage_before(exciter, test)
        lines += steps_section(test.inspection, test.steps, test.sizes, level)
        lines += ["record:", f"  file: {plain_text(names[test.inspection.path])}"]
        lines += [f"  time: {clock_text(test.inspection)}"]
        lines += _channels_once(test, anchors)
        lines += [
            *window_lines(test.window),
            *gap_lines(test.inspection),
            *reading_lines(test.inspection),
        ]
        entry = [f"  - {lines[0]}", *(f"{IN_A_LIST}{line}" for line in lines[1:])]
        (validations if test.validates else fitted).extend(entry)
    return fitted, validations


def _channels_once(test: StartingTest, anchors: dict[str, str]) -> list[str]:
    """Return the channels of a record, or a reference to the same channels of one before."""
    channels = channel_lines(test.inspection, ("vt", *test.bases), test.bases)
    text = "\n".join(channels)
    if text in anchors:
        return [f"  channels: *{anchors[text]}"]
    anchors[text] = f"channels{len(anchors) + 1 if anchors else ''}"
    return [
        commented(f"  channels: &{anchors[text]}", "the records below have the same"),
        *channels,
    ]


def _plant(unit: UnitData, inspection: Inspection) -> Iterator[str]:
    machine = unit.machine
    if suggests_event(inspection):
        yield from event_plant(inspection)
        yield from _machine(machine, {"R": TYPICAL, "X": TYPICAL})
        return
    yield "plant:"
    if unit.exciter.model.name == ALONE:
        yield "  type: none"
        return
    power, sources = inspection.channel_of("p"), dict[str, str]()
    if power is not None and shows_power(power):
        yield commented("  type: infinite-bus", f"{in_comment(power.name)} shows power")
        yield from _network(inspection)
        sources = _network_sources(inspection)
    else:
        yield commented("  type: open-circuit", "the breaker is open, at rated speed")
    yield from _machine(machine, sources)


def _machine(machine: PartData, sources: Mapping[str, str]) -> Iterator[str]:
    """Yield the machine of a plant, and where its values and those of the network come from."""
    origin = machine.origin or machine.model.title
    yield commented(f"  machine: {machine.model.name}", in_comment(origin))
    yield "  parameters:"
    for row in machine.model.sheet:
        yield parameter_line(row, yaml_number(machine.values[row.symbol]), "    ")
    yield from source_lines({**sources, **machine.sources}, "  ")


def _added(unit: UnitData) -> Iterator[str]:
    """Yield the sections of stabiliser and governor."""
    for section, part in unit.added.items():
        yield f"{section}:"
        yield commented(f"  model: {part.model.name}", in_comment(part.origin))
        yield from inputs_lines(part.model, part.inputs)
        yield "  parameters:"
        for row in part.model.sheet:
            yield parameter_line(row, yaml_number(part.values[row.symbol]), "    ")
        yield from source_lines(part.sources, "  ")


def _wrapped(text: str) -> list[str]:
    """Return a text as lines of comment."""
    comment = f"# {in_comment(text)}"
    return wrap(comment, WIDTH, subsequent_indent="# ", break_long_words=False)


def _note(text: str) -> list[str]:
    """Return a note as lines of comment."""
    note = f"# note: {in_comment(text)}."
    return wrap(note, WIDTH, subsequent_indent="#   ", break_long_words=False)


def _network(inspection: Inspection) -> Iterator[str]:
    yield "  network:"
    yield commented(f"    f0: {FILL_IN}", "Hz, rated frequency")
    yield commented("    R: 0.0", "pu, resistance to the source")
    yield commented(f"    X: {FILL_IN}", "pu, reactance to the source: transformer and grid")
    yield commented(f"    P: {_level(inspection, 'p')}", "pu of the machine, before the step")
    yield commented(f"    Q: {_level(inspection, 'q')}", "pu, before the step")


def _network_sources(inspection: Inspection) -> dict[str, str]:
    """Return where the values of the network come from that are not to be filled in."""
    measured = [signal for signal in ("p", "q") if _level(inspection, signal) != FILL_IN]
    return {"R": TYPICAL, **{signal.upper(): "measured" for signal in measured}}


def _per_unit(channel: InspectedChannel) -> bool:
    return channel.unit in (None, "pu")


def _level(inspection: Inspection, signal: str) -> str:
    """Return the level of a signal at rest, to be filled in where the record does not show it."""
    channel = inspection.channel_of(signal)
    if channel is None or not _per_unit(channel):
        return FILL_IN
    return yaml_number(float(f"{channel.level:.4g}"))


def _parameters(exciter: PartData) -> Iterator[str]:
    model, values = exciter.model, exciter.values
    free = free_of(model, values)
    yield "parameters:"
    if len(free) < len(model.sheet):
        yield commented("  fixed:", "stays as it is; move to free what a fit is to find")
    for row in model.sheet:
        if row not in free:
            yield parameter_line(row, yaml_number(values[row.symbol]), "    ")
    if free:
        yield commented("  free:", "found between bounds about where it starts")
    for row in free:
        yield f"    # {row.unit}, {row.meaning}"
        value = values[row.symbol]
        start, low, high = map(_short, (value, *bounds_of(row, value)))
        yield f"    {row.symbol}: {{start: {start}, min: {low}, max: {high}}}"
    fixed = {row.symbol for row in model.sheet if row not in free}
    sources = {name: word for name, word in exciter.sources.items() if name in fixed}
    yield from source_lines(sources, "  ")


def _short(value: float) -> str:
    return yaml_number(float(f"{value:.6g}"))
