"""The form: what a verification report must state, row by row, and what this one answers."""

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from exfit.features.programme.result import ProgrammeResult
from exfit.features.report.sections.usability import UsabilityCheck, no_usability, usability
from exfit.models.families import family_of
from exfit.results import facts
from exfit.results.criteria import judged_by_criteria
from exfit.results.description import PartDescription
from exfit.results.facts import AskedFact, Facts, answer, stated
from exfit.results.validation_result import Reported, ValidationResult
from exfit.util.sources import NOT_STATED, by_source
from exfit.util.text import rounded, show

TYPES = {"DC": "DC commutator exciter", "AC": "alternator exciter", "ST": "static exciter"}
MACHINE_DATA = (
    ("Reactances of the generator", ("X",)),
    ("Time constants of the generator", ("T",)),
    ("Saturation of the generator", ("S",)),
    ("Inertia of the generator", ("H",)),
)
TESTS = (facts.DATE, facts.TESTED, facts.INSTRUMENTS, facts.RECORDER)
AMBIENT = {facts.STATE: "cold or hot machine", facts.TAP: "of the transformer", facts.SPEED: ""}
NO_TEST = "no bump test in this programme"
REPORT = (facts.WRITTEN, facts.CHECKED, facts.APPROVED, facts.REVISION, facts.REPORTED)


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

    ``machine`` are its values by symbol, ``source_of`` says where the value of a name is from,
    ``excursions`` how far the frequency departed in grid events, if there were any.
    """

    responses: str
    parts: tuple[PartDescription, ...]
    machine: Mapping[str, float]
    source_of: Callable[[str], str]
    excitation: str
    before: str
    compensation: str
    usable: tuple[UsabilityCheck, ...]
    excursions: str = ""


def form(result: Reported) -> tuple[FormRow, ...]:
    """Return the rows of the form for a fit (cf. NERC MOD-026-1 R2.1 and R6)."""
    answers = FormAnswers(
        responses=_responses(result),
        parts=result.parts,
        machine=result.values_of("machine."),
        source_of=result.source_of,
        excitation=_excitation(result),
        before=_before(result),
        compensation=_compensation(result),
        usable=usability(result),
        excursions="; ".join(_excursions(result)),
    )
    return _rows(result.about, answers)


def form_of_validation(result: ValidationResult) -> tuple[FormRow, ...]:
    """Return the rows of the form for given values beside records."""
    return tuple(
        row._replace(section="validation" if row.section == "fit" else row.section)
        for row in form(result)
    )


def form_without_bumps(result: ProgrammeResult) -> tuple[FormRow, ...]:
    """Return the rows of the form for a programme in which no bump test was fitted."""
    why = "the fit of the bump tests has no result" if _has_bumps(result) else NO_TEST
    unit, silent = result.unit, f"{NOT_STATED}: {why}"
    exciter = _part(unit.parts, "exciter")
    answers = FormAnswers(
        responses=silent,
        parts=unit.parts,
        machine=unit.values_of("machine."),
        source_of=lambda name: unit.sources.get(name, NOT_STATED),
        excitation=silent if exciter is None else f"{exciter.name}, {exciter.title}; {why}",
        before=silent,
        compensation=stated(result.about, facts.COMPENSATION) or silent,
        usable=no_usability(silent),
    )
    return _rows(result.about, answers)


def _has_bumps(result: ProgrammeResult) -> bool:
    return "fit" in (*result.failed, *result.not_run)


def _rows(about: Facts, answers: FormAnswers) -> tuple[FormRow, ...]:
    return (
        *(_fact(about, "", fact, "test") for fact in (facts.PLANT, facts.UNIT)),
        FormRow("", facts.RATED.key, rated(about), "test"),
        FormRow("R2.1.1", "Model response beside a recorded response", answers.responses, "fit"),
        _fact(about, "R2.1.2", facts.MAKER),
        _fact(about, "R2.1.2", facts.MODEL),
        FormRow("R2.1.2", "Excitation type", _type(about, answers.parts), "model"),
        *_generator(answers),
        FormRow("R2.1.4", "Excitation model and data", answers.excitation, "parameters"),
        _fact(about, "R2.1.4", facts.REGULATOR),
        FormRow("R2.1.4", "Model in the planner's base", answers.before, "as-found"),
        FormRow("R2.1.5", "Compensation (droop, line drop)", answers.compensation),
        FormRow("R2.1.6", "Stabiliser", _stabiliser(about, answers.parts), "parameters"),
        *_governor(answers),
        *(FormRow("R6", check.name, _usable(*check[1:]), "flat") for check in answers.usable),
        *(_fact(about, "", fact, "test") for fact in TESTS),
        *(
            FormRow("", f"{fact.key}{f' ({words})' if words else ''}", answer(about, fact), "test")
            for fact, words in AMBIENT.items()
        ),
        *(_fact(about, "", fact, "signatures") for fact in REPORT),
    )


def _fact(about: Facts, cf: str, fact: AskedFact, section: str = "") -> FormRow:
    return FormRow(cf, fact.key, answer(about, fact), section)


def rated(about: Facts) -> str:
    """Return the rating, as one fact or as several whose names begin with Rated."""
    begins = f"{facts.RATED.key} "
    each = (
        f"{name.removeprefix(begins)} {value if isinstance(value, str) else show(value)}"
        for name, value in about.items()
        if name.startswith(begins)
    )
    return stated(about, facts.RATED) or ", ".join(each) or NOT_STATED


def _responses(result: Reported) -> str:
    names = ", ".join(match.name for match in result.comparisons)
    unseen = ", ".join(match.name for match in result.validation)
    text = f"validated on: {unseen}" if unseen else "no validation"
    text = f"fitted: {names}; {text}" if names else f"nothing fitted; {text}"
    every = (*result.comparisons, *result.validation)
    events = ", ".join(match.name for match in every if match.is_event)
    if events:
        text += f"; measured system disturbances, played in: {events}"
    return f"{text}; {judged_by_criteria(result).sentence}"


def _type(about: Facts, parts: tuple[PartDescription, ...]) -> str:
    """Return the type of the excitation system, as stated or as its model is."""
    given = stated(about, facts.TYPE)
    part = _part(parts, "exciter")
    if given is not None or part is None:
        return given or NOT_STATED
    family = family_of(part.name)
    return NOT_STATED if family is None else f"{TYPES[family]}, by its model {part.name}"


def _part(parts: tuple[PartDescription, ...], kind: str) -> PartDescription | None:
    return next((part for part in parts if part.kind == kind), None)


def _generator(answers: FormAnswers) -> Iterator[FormRow]:
    """Yield the rows of the generator: its model, and each kind of its data with the sources."""
    part = _part(answers.parts, "machine")
    name = NOT_STATED if part is None else f"{part.name}, {part.title}"
    yield FormRow("R2.1.3", "Generator model", name, "model")
    for asked, begins in MACHINE_DATA:
        symbols = [symbol for symbol in answers.machine if symbol.startswith(begins)]
        yield FormRow("R2.1.3", asked, _by_source(answers, symbols), "parameters")


def _by_source(answers: FormAnswers, symbols: list[str]) -> str:
    """Return values of the machine with where they are from."""
    sources = {symbol: answers.source_of(f"machine.{symbol}") for symbol in symbols}
    groups = by_source(symbols, sources)
    texts = (
        f"{', '.join(f'{symbol} {rounded(answers.machine[symbol])}' for symbol in group)} "
        f"({_source(word)})"
        for word, group in groups.items()
    )
    return "; ".join(texts) or f"{NOT_STATED}: the model has none"


def _source(word: str) -> str:
    return f"source {NOT_STATED}" if word == NOT_STATED else word


def _excitation(result: Reported) -> str:
    part = _part(result.parts, "exciter")
    if part is None:
        return f"{NOT_STATED}: the case has the machine alone"
    names = [name for name in result.values if "." not in name and name not in result.of_records]
    words = by_source(names, {name: result.source_of(name) for name in names})
    counts = ", ".join(f"{len(group)} {_source(word)}" for word, group in words.items())
    return f"{part.name}, {part.title}; {len(names)} values: {counts}"


def _before(result: Reported) -> str:
    unit = result.as_found
    if isinstance(result, ValidationResult):
        return NOT_STATED if unit is None else f"{unit.model}, {unit.source}"
    if unit is None or not unit.is_stated:
        return f"{NOT_STATED}; the start values of the fit are shown"
    return f"{unit.model}, {unit.source}"


def _compensation(result: Reported) -> str:
    """Return the load compensation, as stated and as the network of a test has it."""
    given = stated(result.about, facts.COMPENSATION)
    values = {name: result.network.get(name, 0.0) for name in ("Rc", "Xc")}
    for test in result.tests:
        values |= {name: test.network[name].value for name in values if name in test.network}
    in_model = ", ".join(f"{name} {show(value)} pu" for name, value in values.items() if value)
    if in_model:
        return f"{given}; in the model {in_model}" if given else in_model
    return given or f"{NOT_STATED}; none in the model"


def _stabiliser(about: Facts, parts: tuple[PartDescription, ...]) -> str:
    given, part = stated(about, facts.STABILISER), _part(parts, "stabiliser")
    if part is not None:
        return f"{part.name}, {part.title}" + (f"; {given}" if given else "")
    return given or f"{NOT_STATED} whether the unit has one; none in the model"


def _excursions(result: Reported) -> Iterator[str]:
    """Yield the departures of voltage and frequency from rest in each grid event."""
    for match in (*result.comparisons, *result.validation):
        if match.played is None or not match.is_event:
            continue
        texts = (
            f"{name} {signal.excursion.text(signal.unit)}"
            for name, signal in match.played.driving.items()
            if signal.excursion is not None
        )
        yield f"{match.name}: {', '.join(texts)}"


def _governor(answers: FormAnswers) -> Iterator[FormRow]:
    """Yield the rows on a governor where a grid event was played in, or the unit has one."""
    part = _part(answers.parts, "governor")
    if not answers.excursions and part is None:
        return
    name = "none in the model: the mechanical power is constant"
    if part is not None:
        name = f"{part.name}, {part.title}"
    yield FormRow("MOD-027-1 R2", "Turbine governor and load control", name, "parameters")
    if answers.excursions:
        yield FormRow("", "Recorded disturbances, from rest", answers.excursions, "fit")


def _usable(passed: bool | None, text: str) -> str:
    return text if passed is None else f"{'passed' if passed else 'FAILED'}: {text}"
