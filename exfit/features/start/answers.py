"""What `exfit new` and `exfit verify` ask, as a file of answers: --answers."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from exfit.case.case_draft import CaseDraft
from exfit.case.load import faults_with_lines, plain_content, validated
from exfit.case.schema.values import (
    Bus,
    Frozen,
    MachineId,
    Number,
    Positive,
    Section,
    Source,
    Text,
    nothing,
)
from exfit.case.suggestion import relative
from exfit.case.yaml import QUESTION, Fault, open_places, read_text, read_yaml
from exfit.errors import FileError
from exfit.features.start.starting_tests import ALL_TESTS
from exfit.util.text import dotted

HEADING = "Answers to the questions of exfit new and exfit verify"  # begins a file of answers
FILES = ("record", "tests", "dyr", "machine_from", "validate", "model", "output")


def _as_list(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


def _of_all(value: Any) -> Any:
    return value if isinstance(value, Mapping) else {ALL_TESTS: value}


def _as_text(value: Any) -> Any:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _with_texts(value: Any) -> Any:
    """Read the numbers of a mapping as texts: a base without a unit, the number of a unit."""
    if not isinstance(value, Mapping):
        return value
    plain = (int, float)
    return {k: f"{v:.12g}" if isinstance(v, plain) else v for k, v in value.items()}


NONE: Any = Field(default_factory=nothing)
List = Annotated[tuple[Text, ...], BeforeValidator(_as_list)]
Values = Frozen[Number]
Texts = Annotated[Frozen[Text], BeforeValidator(_with_texts)]


class Answers(Section):
    """The answers to what a new case needs, each under the name of its option."""

    record: Text | None = None
    time: List = ()  # column, or date and time
    time_unit: Text | None = None
    sheet: Text | None = None
    memory: Positive | None = None  # GB
    vt: Text | None = None  # column of the terminal voltage
    kv: Positive | None = None  # rated, line to line
    mva: Positive | None = None  # rated
    base: Texts = NONE  # value of 1 pu by signal, {ifd: 550A}
    step: Annotated[Values, BeforeValidator(_of_all)] = NONE  # pu; {up: 0.05, at-312s: 0.02}
    tests: Text | None = None  # a table of tests
    dyr: Text | None = None
    bus: Bus | Text | None = None  # its number, or its name in a .dyd
    id: Annotated[MachineId, BeforeValidator(_as_text)] | None = None
    model: Text | None = None  # of the exciter
    machine_model: Text | None = None
    governor: Text | None = None  # its model, where it is tested
    machine_from: Text | None = None  # another case, whose generator is taken
    machine: Values = NONE  # data of the generator that are not typical
    exciter: Values = NONE  # data of the exciter that are not typical
    sources: Annotated[Frozen[Source], BeforeValidator(_of_all)] = NONE  # of these data
    open: Frozen[Number | Text] = NONE  # other values by their place, {plant.network.X: 0.2}
    validations: List = Field((), alias="validate")
    about: Texts = NONE
    output: Text | None = None  # file of the case, or of the report

    def source_of(self, symbol: str) -> str:
        """Find the source of a value, "" where it is not stated."""
        return str(self.sources.get(symbol) or self.sources.get(ALL_TESTS) or "")


Given = dict[str, Any]  # answers by key, of which some may be "?"


def read_answers(path: Path) -> Given:
    """Return the answers of a file, its paths as they are from the working folder.

    Of those that are open, "?", only the model stays: there is no planner's file then.
    Raises CaseError with all faults of the file, each with its line and place.
    """
    top, faults = read_yaml(read_text(path), path)
    _checked(top.value, faults)
    if faults:
        raise faults_with_lines(faults, top, path)
    given = {k: value for k, value in top.value.items() if value != QUESTION or k == "model"}
    return _with_paths(given, lambda file: str(path.parent / file))


def checked(given: Mapping[str, Any]) -> Answers:
    """Return the answers given so far; those that are open, "?", count as not given.

    Raises ExfitError with the faults of all of them.
    """
    faults = list[Fault]()
    answers = _checked(plain_content(given, faults), faults)
    if answers is None or faults:
        raise FileError(f"{dotted(fault.place)}: {fault.text}" for fault in faults)
    return answers


def _checked(content: Mapping[str, Any], faults: list[Fault]) -> Answers | None:
    closed = _without(content, QUESTION)
    return validated(closed, faults, Answers, schema=Answers.model_json_schema)


def _without(given: Mapping[str, Any], gap: Any) -> Given:
    """Leave out the entries that are a gap, at the top and one level below."""
    return {
        key: _without(value, gap) if isinstance(value, Mapping) else value
        for key, value in given.items()
        if value != gap
    }


def still_open(given: Mapping[str, Any]) -> list[str]:
    """List the places of the answers that are "?"."""
    return [dotted(place) for place in open_places(given)]


def answers_text(given: Mapping[str, Any], path: Path) -> str:
    """Write answers as a file at a path, from where its paths are relative."""
    kept = _without(given, None)
    kept.pop("output", None)
    if isinstance(kept.get("step"), dict) and kept["step"].keys() == {ALL_TESTS}:
        kept["step"] = kept["step"][ALL_TESTS]
    sections = _with_paths(kept, lambda file: relative(Path(file), path.parent))
    heading = f'{HEADING}, for `exfit new --answers {path.name}`; "?" is asked.'
    return CaseDraft(sections, (heading,)).text


def _with_paths(given: Mapping[str, Any], path_of: Any) -> Given:
    """Return answers with other paths; a model is one where it is a file."""

    def changed(key: str, value: Any) -> Any:
        if isinstance(value, list | tuple):
            return [changed(key, entry) for entry in value]
        is_path = key != "model" or str(value).endswith(".py")
        return path_of(value) if is_path and value != QUESTION else value

    return {key: changed(key, value) if key in FILES else value for key, value in given.items()}


def contradictions(answers: Answers) -> Iterator[str]:
    """Find answers that exclude each other, by their options."""
    if answers.tests and answers.step:
        yield "--step: not allowed with --tests, which has a column step."
    if answers.machine_model and (answers.dyr or answers.machine_from):
        yield "--machine: not allowed with --dyr or --machine-from."
    if answers.governor and answers.dyr:
        yield "--governor: not allowed with --dyr, which has that of the unit."
    if not answers.dyr and (answers.bus is not None or answers.id is not None):
        yield "--bus and --id: only with --dyr."
