"""What a verification report states: the form, unit and test, how it is made again, signatures."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from shlex import join
from typing import NamedTuple

from exfit import __version__
from exfit.features.programme.result import ProgrammeResult
from exfit.features.report.behaviour import UsabilityCheck, no_usability, usability
from exfit.features.report.words import DASH, INTERRUPTED, number
from exfit.models.families import family_of
from exfit.output.blocks import (
    Block,
    Cell,
    Facts,
    Heading,
    Note,
    Table,
    TableColumn,
    Verbatim,
    columns,
    row,
)
from exfit.plants import LOAD_CONTROLLER
from exfit.results import facts
from exfit.results.causes_in_words import options_of
from exfit.results.criteria import judged_by_criteria
from exfit.results.description import PartDescription, RecordedTest, values_of_part
from exfit.results.facts import AskedFact, answer, stated
from exfit.results.model import OF_PROGRAMME, FitResult
from exfit.results.validation_result import Reported, ValidationResult
from exfit.util.text import rounded, show
from exfit.util.vocabulary import NOT_STATED, by_source

TYPES = {"DC": "DC commutator exciter", "AC": "alternator exciter", "ST": "static exciter"}
MACHINE_DATA = {  # by the letter that the symbols begin with
    "X": "Reactances of the generator",
    "T": "Time constants of the generator",
    "S": "Saturation of the generator",
    "H": "Inertia of the generator",
}
TESTS = (facts.DATE, facts.TESTED, facts.INSTRUMENTS, facts.RECORDER)
AMBIENT = {facts.STATE: "cold or hot machine", facts.TAP: "of the transformer", facts.SPEED: ""}
REPORT = (facts.WRITTEN, facts.CHECKED, facts.APPROVED, facts.REVISION, facts.REPORTED)
NOT_IN_MODEL = f"{NOT_STATED}; none in the model"
NO_TEST = "no bump test in this programme"
CONSTANT_POWER = "none in the model: the mechanical power is constant"
SILENT = "The case does not say which unit this is: state it under `about`."
WHERE_STATED = (
    "A case states facts of the unit, the test and the report under `about`, by the names of their "
    "rows, and beside a value its source."
)


class FormRow(NamedTuple):
    """A row of the form: what is asked, by which words of the standard, and the answer.

    ``section`` is the id of the section that has the rest, "" for none.
    """

    cf: str
    asked: str
    answer: str
    section: str = ""

    @property
    def is_stated(self) -> bool:
        """Whether the case, or the fit, answers it."""
        return not self.answer.startswith(NOT_STATED)


class FormAnswers(NamedTuple):
    """What the rows of the form have from a fit or a programme, facts of the case aside.

    ``machine`` and ``governor`` are their values by symbol, ``source_of`` says where the value of
    a name is from, ``excursions`` how far the frequency departed in grid events, if there were any.
    """

    responses: str
    parts: tuple[PartDescription, ...]
    machine: Mapping[str, float]
    governor: Mapping[str, float]
    source_of: Callable[[str], str]
    excitation: str
    before: str
    compensation: str
    usable: tuple[UsabilityCheck, ...]
    excursions: str = ""

    def part(self, kind: str) -> PartDescription | None:
        """Return the part of a kind, None where there is none."""
        return next((part for part in self.parts if part.kind == kind), None)

    def model(self, kind: str, missing: str) -> str:
        """Name the model of a part of a kind, or say what is ``missing``."""
        part = self.part(kind)
        return missing if part is None else f"{part.name}, {part.title}"

    def data(self, prefix: str, values: Mapping[str, float]) -> str:
        """List values of a part by symbol, each with its source."""
        sources = {symbol: self.source_of(prefix + symbol) for symbol in values}
        texts = (
            f"{', '.join(f'{symbol} {rounded(values[symbol])}' for symbol in group)} "
            f"({_source(word)})"
            for word, group in by_source([*values], sources).items()
        )
        return "; ".join(texts) or f"{NOT_STATED}: the model has none"


def form_table(rows: Sequence[FormRow]) -> Iterator[Block]:
    """Yield the form: a table of what is stated, and a list of what is not."""
    heads = (*columns("cf.", "asked"), TableColumn("answer", folds=True))
    yield Table(
        (*heads, TableColumn("section", number=True)),
        tuple(
            (Cell(each.cf), Cell(each.asked), Cell(each.answer), Cell("", see=each.section))
            for each in rows
            if each.is_stated
        ),
        "What a verification report states (cf.: clauses of NERC MOD-026-1)",
        leading=2,
        style="form",
    )
    missing: dict[str, list[str]] = {}
    for each in rows:
        if not each.is_stated:
            asked = f"{each.asked} ({each.cf})" if each.cf else each.asked
            missing.setdefault(each.answer, []).append(asked)
    for answered, asked_for in missing.items():
        label = f"{answered[:1].upper()}{answered[1:]}:"
        yield Note(f"{', '.join(asked_for)}.", "warning", label, "strong")
    yield Note(WHERE_STATED)


def form(result: Reported) -> tuple[FormRow, ...]:
    """Return the rows of the form for a fit (cf. NERC MOD-026-1 R2.1 and R6)."""
    unit = result.as_found
    before = NOT_STATED if unit is None else f"{unit.model}, {unit.source}"
    if isinstance(result, FitResult) and (unit is None or not unit.is_stated):
        before = f"{NOT_STATED}; the start values of the fit are shown"
    answers = FormAnswers(
        responses=_responses(result),
        parts=result.parts,
        machine=result.values_of("machine."),
        governor=result.values_of("governor."),
        source_of=result.source_of,
        excitation=f"{NOT_STATED}: the case has the machine alone",
        before=before,
        compensation=_compensation(result),
        usable=usability(result),
        excursions="; ".join(_excursions(result)),
    )
    if answers.part("exciter") is not None:
        own = [name for name in result.values if "." not in name and name not in result.of_records]
        words = by_source(own, {name: result.source_of(name) for name in own})
        counts = ", ".join(f"{len(group)} {_source(word)}" for word, group in words.items())
        text = f"{answers.model('exciter', '')}; {len(own)} values: {counts}"
        answers = answers._replace(excitation=text)
    rows = _rows(result.about, answers)
    if isinstance(result, FitResult):
        return rows
    return tuple(
        each._replace(section="validation" if each.section == "fit" else each.section)
        for each in rows
    )


def _responses(result: Reported) -> str:
    fitted = ", ".join(match.name for match in result.comparisons)
    unseen = ", ".join(match.name for match in result.validation)
    every = (*result.comparisons, *result.validation)
    events = ", ".join(match.name for match in every if match.is_event)
    texts = (
        f"fitted: {fitted}" if fitted else "nothing fitted",
        f"validated on: {unseen}" if unseen else "no validation",
        f"measured system disturbances, played in: {events}" if events else "",
        judged_by_criteria(result).sentence,
    )
    return "; ".join(filter(None, texts))


def _excursions(result: Reported) -> Iterator[str]:
    """Yield the departures of voltage and frequency from rest in each grid event."""
    for match in (*result.comparisons, *result.validation):
        if match.played is not None and match.is_event:
            texts = (
                f"{name} {signal.excursion.text(signal.unit)}"
                for name, signal in match.played.driving.items()
                if signal.excursion is not None
            )
            yield f"{match.name}: {', '.join(texts)}"


def form_without_bumps(result: ProgrammeResult) -> tuple[FormRow, ...]:
    """Return the rows of the form for a programme in which no bump test was fitted."""
    has_bumps = "fit" in (*result.failed, *result.not_run)
    why = "the fit of the bump tests has no result" if has_bumps else NO_TEST
    unit, silent = result.unit, f"{NOT_STATED}: {why}"
    answers = FormAnswers(
        responses=silent,
        parts=unit.parts,
        machine=values_of_part(unit.values, "machine."),
        governor=values_of_part(unit.values, "governor."),
        source_of=lambda name: unit.sources.get(name, NOT_STATED),
        excitation=silent,
        before=silent,
        compensation=stated(result.about, facts.COMPENSATION) or silent,
        usable=no_usability(silent),
    )
    if answers.part("exciter") is not None:
        answers = answers._replace(excitation=f"{answers.model('exciter', '')}; {why}")
    return _rows(result.about, answers)


def _rows(about: facts.Facts, answers: FormAnswers) -> tuple[FormRow, ...]:
    stabiliser = answers.model("stabiliser", "")
    stabiliser = "; ".join(filter(None, (stabiliser, stated(about, facts.STABILISER))))
    usable = (
        (name, text if passed is None else f"{'passed' if passed else 'FAILED'}: {text}")
        for name, passed, text in answers.usable
    )
    ambient = {f"{key.key}{f' ({words})' if words else ''}": key for key, words in AMBIENT.items()}
    kind, machine = _excitation_type(about, answers), answers.model("machine", NOT_STATED)
    return (
        *(_fact(about, "", fact, "test") for fact in (facts.PLANT, facts.UNIT)),
        FormRow("", facts.RATED.key, rated(about), "test"),
        FormRow("R2.1.1", "Model response beside a recorded response", answers.responses, "fit"),
        _fact(about, "R2.1.2", facts.MAKER),
        _fact(about, "R2.1.2", facts.MODEL),
        FormRow("R2.1.2", "Excitation type", kind, "model"),
        FormRow("R2.1.3", "Generator model", machine, "model"),
        *_generator(answers),
        FormRow("R2.1.4", "Excitation model and data", answers.excitation, "parameters"),
        _fact(about, "R2.1.4", facts.REGULATOR),
        FormRow("R2.1.4", "Model in the planner's base", answers.before, "as-found"),
        FormRow("R2.1.5", "Compensation (droop, line drop)", answers.compensation),
        FormRow("R2.1.6", "Stabiliser", stabiliser or NOT_IN_MODEL, "parameters"),
        *_governor(about, answers),
        *(FormRow("R6", name, text, "flat") for name, text in usable),
        *(_fact(about, "", fact, "test") for fact in TESTS),
        *(FormRow("", asked, answer(about, key), "test") for asked, key in ambient.items()),
        *(_fact(about, "", fact, "signatures") for fact in REPORT),
    )


def _excitation_type(about: facts.Facts, answers: FormAnswers) -> str:
    """Return the type of the excitation system, as stated or as its model is."""
    given, exciter = stated(about, facts.TYPE), answers.part("exciter")
    family = None if exciter is None else family_of(exciter.name)
    if given is not None or exciter is None or family is None:
        return given or NOT_STATED
    return f"{TYPES[family]}, by its model {exciter.name}"


def _generator(answers: FormAnswers) -> Iterator[FormRow]:
    """Yield the rows of each kind of data of the generator, with their sources."""
    for letter, asked in MACHINE_DATA.items():
        own = {k: value for k, value in answers.machine.items() if k.startswith(letter)}
        yield FormRow("R2.1.3", asked, answers.data("machine.", own), "parameters")


def _governor(about: facts.Facts, answers: FormAnswers) -> Iterator[FormRow]:
    """Yield the rows on a governor where a grid event was played in, or the unit has one."""
    if answers.excursions or answers.part("governor") is not None:
        model = answers.model("governor", CONSTANT_POWER)
        if answers.part(LOAD_CONTROLLER) is not None:
            model = f"{model}; {answers.model(LOAD_CONTROLLER, '')}"
        yield FormRow("MOD-027-1 R2", "Turbine governor and load control", model, "parameters")
    if answers.part("governor") is not None:
        for fact in (facts.GOVERNOR, facts.TURBINE, facts.LOAD_CONTROL):
            yield _fact(about, "MOD-027-1 R2", fact)
        data = answers.data("governor.", answers.governor)
        yield FormRow("MOD-027-1 R2", "Data of turbine and governor", data, "parameters")
    if answers.excursions:
        yield FormRow("", "Recorded disturbances, from rest", answers.excursions, "fit")


def _fact(about: facts.Facts, cf: str, fact: AskedFact, section: str = "") -> FormRow:
    return FormRow(cf, fact.key, answer(about, fact), section)


def rated(about: facts.Facts) -> str:
    """Return the rating, as one fact or as several whose names begin with Rated."""
    begins = f"{facts.RATED.key} "
    each = (
        f"{name.removeprefix(begins)} {value if isinstance(value, str) else show(value)}"
        for name, value in about.items()
        if name.startswith(begins)
    )
    return stated(about, facts.RATED) or ", ".join(each) or NOT_STATED


def _source(word: str) -> str:
    return f"source {NOT_STATED}" if word == NOT_STATED else word


def _compensation(result: Reported) -> str:
    """Return the load compensation, as stated and as the network of a test has it."""
    given = stated(result.about, facts.COMPENSATION)
    values = {name: result.network.get(name, 0.0) for name in ("Rc", "Xc")}
    for test in result.tests:
        values |= {name: test.network[name].value for name in values if name in test.network}
    in_model = ", ".join(f"{name} {show(value)} pu" for name, value in values.items() if value)
    if in_model:
        return f"{given}; in the model {in_model}" if given else in_model
    return given or NOT_IN_MODEL


def unit_and_test(result: Reported) -> Iterator[Block]:
    """Yield the facts of the unit, and its tests with their records."""
    return _unit(result.about, result.tests, INTERRUPTED)


def unit_without_bumps(result: ProgrammeResult) -> Iterator[Block]:
    """Yield the unit and tests of a programme whose bump tests gave no fit."""
    fits = (test.result for test in result.tests if isinstance(test.result, FitResult))
    tests = tuple(test for fit in fits for test in fit.tests)
    return _unit(result.about, tests, "No test with a recorded response was fitted.")


def _unit(about: facts.Facts, tests: Sequence[RecordedTest], missing: str) -> Iterator[Block]:
    if about:
        texts = {
            name: value if isinstance(value, str) else show(value) for name, value in about.items()
        }
        yield Facts(tuple(texts.items()))
    else:
        yield Note(SILENT, mark="faint")
    if not tests:
        yield Note(missing, mark="faint")
        return
    words = (TableColumn(title, folds=True) for title in ("record", "condition", "done"))
    numbers = ("from (s)", "to (s)", "samples", "every (s)")
    rows = (
        row(
            *(test.name, "to fit" if test.role == "fitted" else "to validate", test.file),
            *(test.plant, test.done, test.channels, number(test.first), number(test.last)),
            *(str(test.samples), number(test.spacing, 4)),
        )
        for test in tests
    )
    yield Table(
        (*columns("test", "used"), *words, *columns("channels", *numbers, numbers=numbers)),
        tuple(rows),
        "Tests and their records",
    )


def command_of(result: Reported, folder: Path | None = None) -> str:
    """Return the command that gives the result again, in a ``folder``."""
    output = () if folder is None else ("-o", str(folder))
    if isinstance(result, ValidationResult):
        return join(("exfit", "validate", str(result.case), *output, *result.options))
    if OF_PROGRAMME in result.inputs:
        return join(("exfit", "run", str(result.case), *output))
    return join(("exfit", "fit", str(result.case), *output, *options_of(result)))


def reproduction(result: Reported, folder: Path) -> Iterator[Block]:
    """Yield how the report is made again: by which commands, from which files, by what."""
    commands = f"{command_of(result, folder)}\n{join(('exfit', 'report', str(folder)))}\n"
    yield Verbatim(commands, "Commands")
    versions = {**result.versions}
    if versions.get("exfit") != __version__:
        versions["exfit that made this report"] = __version__
    yield Note(f"Made with {', '.join(f'{name} {each}' for name, each in versions.items())}.")
    hashes = (
        row(label, result.files.get(label, DASH), sha256) for label, sha256 in result.inputs.items()
    )
    heads = columns("input", "file", "SHA-256")
    yield Table(heads, tuple(hashes), "SHA-256 of the inputs", style="hashes")
    yield Heading("The case", 2)
    if result.given_values:
        numbers = ("value", "in the case")
        given = (
            row(
                *(name, number(each.value), number(each.in_case)),
                *("start" if each.start else "fixed", each.source),
            )
            for name, each in result.given_values.items()
        )
        yield Table(
            columns("parameter", *numbers, "role", "given by", numbers=numbers),
            tuple(given),
            "Values used in place of those in the case file",
        )
    if result.case_text:
        yield Verbatim(result.case_text, "The case file")
    else:
        yield Note("The result does not contain the case file.", mark="faint")


def signatures(result: Reported | ProgrammeResult) -> Iterator[Block]:
    """Yield the block of unit, revision and signatures: empty cells are filled in by hand."""
    about = result.about
    named = {
        fact.key: given
        for fact in (facts.PLANT, facts.UNIT, facts.REVISION, facts.REPORTED, facts.CHANGES)
        if (given := stated(about, fact)) is not None
    }
    if named:
        yield Facts(tuple(named.items()))
    tested, written = (stated(about, fact) or "" for fact in (facts.DATE, facts.REPORTED))
    dates = {facts.TESTED: tested, facts.WRITTEN: written, facts.CHECKED: "", facts.APPROVED: ""}
    rows = (row(role.key, stated(about, role) or "", date, "") for role, date in dates.items())
    heads = columns("role", "name", "date", "signature")
    yield Table(heads, tuple(rows), "Signatures", style="signatures")
