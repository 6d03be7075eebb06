"""The questions of `exfit new` and `exfit verify`: what neither record nor planner's file says.

Each says where the answer is found and proposes one; a wrong answer is explained and asked again.
"""

from math import sqrt
from pathlib import Path

from exfit.case.case_draft import OpenValue
from exfit.case.yaml import QUESTION
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import refuse_existing
from exfit.cli.streams import echo
from exfit.errors import ExfitError
from exfit.features.start.answers import Given
from exfit.features.start.making import Inspections, inspected, key_of
from exfit.features.start.questions import (
    MOST_LISTED,
    NO,
    Conversation,
    ask,
    list_rows,
    number,
    one_of,
    place_of,
    say,
)
from exfit.features.start.record_files import records_among
from exfit.features.start.starting_tests import ALL_TESTS, doubtful_bases, refuse_other_size
from exfit.features.start.unit_questions import (
    ask_data,
    ask_models,
)
from exfit.output.inspections import in_words
from exfit.records.channel_names import connection_of
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import DetectedTest, tests_of, unique_names
from exfit.records.units import scale_between
from exfit.signals import SIGNALS
from exfit.util.text import dotted

# kV, of generators; the first four on the secondary side of voltage transformers
USUAL_KV = (
    0.1, 0.11, 0.115, 0.12, 0.4, 0.48, 0.69, 2.4, 3.3, 4.16, 6.0, 6.3, 6.6, 6.9, 7.2, 10.0, 10.5,
    11.0, 11.5, 12.0, 12.5, 13.2, 13.8, 14.4, 15.0, 15.75, 16.0, 16.5, 17.5, 18.0, 19.0, 20.0,
    21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0,
)  # fmt: skip
LARGE_SIZE = 0.0075  # pu: a step that is at least so large is rounded to the first of these
ROUNDED_TO = (0.005, 0.001)  # pu
IN_WORDS = {
    "f0": "Rated frequency, Hz",
    "X": "Reactance from the terminals to the source, pu of the machine",
    "P": "Active power before the step, pu of the rated MVA",
    "Q": "Reactive power before the step, pu of the rated MVA",
    "connection": "Connection of the recorded voltages: phase-to-ground or phase-to-phase",
    "angle_unit": "Unit of the recorded angle: deg or rad",
}
WHERE = {
    "f0": "Nameplate of the generator.",
    "X": "Data sheet of the step-up transformer, and the short-circuit power of the grid.",
    "connection": "Wiring of the recorder; a factor of sqrt(3).",
}
CHOICES = {"connection": ("phase-to-ground", "phase-to-phase"), "angle_unit": ("deg", "rad")}
FACTS = ("Plant", "Unit", "Tested by")


def fill_in(given: Given, read: Inspections) -> None:
    """Ask only what the case cannot do without; raises click.Abort at Ctrl-C and Ctrl-D."""
    _fill_in(Conversation(given, read), of_unit=True)


def converse(given: Given, read: Inspections, introduced: bool, names_case: bool) -> None:
    """Ask what is not given, and add the answers to ``given`` one by one.

    ``introduced``: it begins with what can be entered and what the record holds; ``names_case``:
    the name of the case is asked, too. Raises click.Abort at Ctrl-C and Ctrl-D.
    """
    talk = Conversation(given, read)
    if {"record", "tests"} & given.keys():
        talk.case()  # refuses what contradicts itself already, before anything is asked
    if introduced:
        say("Enter takes the answer in brackets, ? explains, Ctrl-C stops and keeps the answers.")
    if "record" not in given and "tests" not in given:
        given["record"] = _record(talk)
        introduced = True
    if "record" in given and introduced:
        _summary(talk.inspection)
    _confirm_voltage(talk)
    _fill_in(talk, of_unit=False)
    ask_models(talk)
    ask_data(talk)
    _fill_in(talk, of_unit=True)
    if "validate" not in given and "tests" not in given:
        _validation(talk)
    if "about" not in given or QUESTION in given["about"].values():
        _facts(given)
    if names_case:
        given["output"] = _name(given)


# ---- the record


def _record(talk: Conversation) -> str:
    """Ask for the record: the number of a file of the folder, or a path."""
    files = [str(path) for path in records_among(sorted(Path().iterdir()))][:MOST_LISTED]

    def read(text: str) -> str:
        place = place_of(text, files)
        return _readable(talk, text if place is None else files[place])

    list_rows({str(k): name for k, name in enumerate(files, 1)})
    return ask(
        "Record of the test: its number, or a path" if files else "Record of the test, a path",
        read,
        "The file of the recorder: CSV, COMTRADE (.cfg), MATLAB, Excel, Parquet.",
        "1" if files else "",
        "Any file that `exfit inspect` reads; a path may lead to another folder. The test is a "
        "step of the voltage reference with the breaker open or on load, or a grid event that a "
        "PMU recorded.",
    )


def _readable(talk: Conversation, file: str) -> str:
    """Return the path of a record that can be read; raises ExfitError."""
    if not file:
        raise ExfitError("A record is needed")
    path: Path = GivenFile(Kind.RECORD).convert(Path(file).expanduser(), None, None)
    inspected(talk.answers(), path, talk.read)
    return str(path)


def _summary(record: Inspection) -> None:
    """Say what was read: samples, channels, tests and how many notes."""
    sampling, channels = record.sampling, record.channels
    known = [channel for channel in channels if channel.signal]
    names = [f"{each.name} = {SIGNALS[str(each.signal)].name}" for each in known]
    others = len(channels) - len(known)
    tests = [test.name() for test in tests_of(record)]
    lines = [
        f"{record.path.name}: {len(record.time)} samples, {sampling.start:.6g} to "
        f"{sampling.end:.6g} s",
        in_words(sampling),
        ", ".join([*names, *([f"{others} other channels"] if others else [])]),
        "a grid event" if record.is_event else f"tests: {', '.join(tests) or 'no step found'}",
    ]
    if record.findings:
        lines.append(f"{len(record.findings)} notes, which stand in the case")
    echo("", err=True)
    for line in lines:
        say(f"  {line}", hang=4)


def _confirm_voltage(talk: Conversation) -> None:
    """Ask which column is the terminal voltage where the record does not show it for sure."""
    if "vt" in talk.given or "record" not in talk.given:
        return
    record = talk.inspection
    channel = record.channel_of("vt")
    if (channel is None and (record.phases or record.is_event)) or (channel and channel.sure):
        return
    names = [each.name for each in record.channels]
    list_rows(
        {
            str(k): f"{each.name}, {each.level:.5g} {each.unit or ''} at rest"
            for k, each in enumerate(record.channels[:MOST_LISTED], 1)
        }
    )
    talk.given["vt"] = ask(
        "Column of the terminal voltage: its number or name",
        one_of(names, numbered=True),
        "List of the recorder's channels.",
        channel.name if channel else "",
    )


# ---- what is open in the case


def _fill_in(talk: Conversation, of_unit: bool) -> None:
    """Ask what is open in the case; before the unit is known only its voltage, size and power."""
    while True:
        case = talk.case()
        keys = [(key_of(value, talk.answers(), case.tests), value) for value in case.open]
        if not of_unit:
            keys = [(key, value) for key, value in keys if not key.startswith("open.")]
        if not keys:
            return
        key, value = min(keys, key=lambda pair: pair[0] == "step")  # what it is a share of first
        if key == "vt":  # no channel is likely
            _confirm_voltage(talk)
        elif key == "kv":
            talk.given["kv"] = _kv(talk)
        elif key == "mva":
            talk.given["mva"] = ask(
                "Rated power of the unit, MVA", talk.number_of("mva"), "Nameplate of the generator."
            )
        elif key == "step":
            talk.given["step"] = _sizes(talk)
        else:
            talk.given.setdefault("open", {})[dotted(value.place)] = _other(talk, value)


def _kv(talk: Conversation) -> float:
    """Ask for the rated voltage; that nearest to the voltage at rest is proposed."""
    record = talk.inspection
    level = _level_kv(record)
    nearest = min(USUAL_KV, key=lambda kv: abs(kv - level)) if level else None

    def doubt(value: float) -> str:
        doubts = doubtful_bases(talk.case(kv=value).tests)
        return f"The voltage rests at {level:.5g} kV, far from {value:g} kV" if doubts else ""

    rests = f"; it rests at {level:.5g} kV in the record" if level else ""
    return ask(
        "Rated voltage of the generator, line to line, kV",
        talk.number_of("kv"),
        f"Nameplate of the generator{rests}.",
        f"{nearest:g}" if nearest else "",
        "The voltage that 1 pu is. If the recorder shows the secondary side of a voltage "
        "transformer, it is its rated secondary voltage, as 0.11.",
        doubt,
    )


def _level_kv(record: Inspection) -> float | None:
    """Find the voltage at rest, line to line, kV; None where its unit does not say it."""
    channel = record.channel_of("vt")
    if channel is not None:
        level, unit, factor = channel.level, channel.unit, 1.0
    elif record.phases:
        group = record.phases[0]
        unit = next(c.unit for c in record.channels if c.name == group.columns[0])
        level = group.level
        factor = 1.0 if connection_of(group.columns) == "phase-to-phase" else sqrt(3.0)
    elif record.pmu is not None:
        level, unit, factor = record.pmu.voltage.level, record.pmu.voltage.unit, 1.0
    else:
        return None
    scale = scale_between(unit, "kV") if unit else None
    return level * factor * scale if scale else None


def _sizes(talk: Conversation) -> float | dict[str, float]:
    """Ask for the size of the steps: of all at once where all seem alike, else of each test."""
    case = talk.case()
    tests = {test.inspection.path: test.inspection for test in case.tests}
    found = [(record, test) for record in tests.values() for test in tests_of(record)]
    names = unique_names([test.name() for _, test in found], [test for _, test in found])
    changes = [test.changes[0] for _, test in found]
    proposals = {_rounded(abs(change)) for change in changes if change}
    alike = len(proposals) == 1 and None not in changes
    if alike:
        which = f"of the {len(found)} steps" if len(found) > 1 else "of the step"
        return _size(talk, which, ALL_TESTS, {}, *found[0])
    sizes: dict[str, float] = {}
    for name, (record, test) in zip(names, found, strict=True):
        sizes[name] = _size(talk, f"of the step {name}", name, sizes, record, test)
    return sizes


def _size(
    talk: Conversation,
    which: str,
    key: str,
    others: dict[str, float],
    record: Inspection,
    test: DetectedTest,
) -> float:
    """Ask for the size of the steps that a key names, beside those of others."""

    def read(text: str) -> float:
        talk.case(step={**others, key: number(text)})
        return number(text)

    change = test.changes[0]

    def doubt(value: float) -> str:
        try:
            refuse_other_size(record, test, value)
        except ExfitError:
            share = 100.0 * (change or 0.0)
            return f"The voltage changes by {share:+.2g} % there, a step of {value:g} pu not"
        return ""

    moves = "" if change is None else f"; the voltage changes by {100.0 * change:+.3g} %"
    return ask(
        f"Size {which}, pu",
        read,
        f"Test log: as it was keyed in at the regulator{moves}.",
        "" if change is None else f"{_rounded(abs(change)):g}",
        "The change of the voltage reference: 5 % are 0.05 pu. The voltage changes by a "
        "little less. Its sign is that of the record, unless you give a minus.",
        doubt,
    )


def _rounded(change: float) -> float:
    """Round the change of a voltage (pu) to the size of a step that was keyed in."""
    to = ROUNDED_TO[0] if change >= LARGE_SIZE else ROUNDED_TO[1]
    return float(f"{max(round(change / to), 1) * to:.3g}")


def _other(talk: Conversation, value: OpenValue) -> float | str:
    """Ask for any other open value, by its place in the case."""
    place, key = dotted(value.place), str(value.place[-1])

    def read(text: str) -> float | str:
        if not text:
            raise ExfitError("An answer is needed: the case cannot do without it")
        answer: float | str = text
        if key in CHOICES:
            answer = one_of(CHOICES[key])(text)
        elif key not in ("column", "unit"):
            answer = number(text)
        talk.case(open={**talk.given.get("open", {}), place: answer})
        return answer

    more = f"The key of the case is {place}; docs/case_file.md describes it."
    return ask(IN_WORDS.get(key, place), read, WHERE.get(key, value.hint), more=more)


# ---- the end


def _validation(talk: Conversation) -> None:
    """Ask for a further record, unless the record has tests to validate on."""
    if len(talk.case().tests) > 1:
        return

    def read(text: str) -> list[str]:
        if text.lower() in NO:
            return []
        files = [_readable(talk, text)]
        talk.case(validate=files)
        return files

    talk.given["validate"] = ask(
        "Further record of this unit, to check the result on",
        read,
        "Another test, as a step the other way. It is not fitted: it shows if the result holds.",
        NO[0],
        "A path. Its steps are looked for, with the size that you gave.",
    )


def _facts(given: Given) -> None:
    """Ask for the facts that a report shows; Enter skips one."""
    facts = given.setdefault("about", dict.fromkeys(FACTS, QUESTION))
    echo("", err=True)
    say("For the report; Enter skips.", faint=True)
    for name in [name for name, fact in facts.items() if fact == QUESTION]:
        facts[name] = ask(f"  {name}", lambda text: text or None, more="Any text.")
    for name in [name for name, fact in facts.items() if fact is None]:
        del facts[name]


def _name(given: Given) -> str:
    """Ask for the name of the case."""

    def read(text: str) -> str:
        path = Path(text).expanduser()
        if path.suffix not in (".yaml", ".yml"):
            path = path.with_name(f"{path.name}.yaml")
        refuse_existing(path, force=False)
        return str(path)

    stem = Path(str(given.get("record") or "case")).stem
    where = "It holds all of this, with comments, and can be edited."
    return ask("File for the case", read, where, f"{stem}.yaml")
