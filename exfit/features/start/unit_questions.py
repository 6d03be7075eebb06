"""The questions about the unit: planner's file, models of exciter and generator, their data."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exfit.case.yaml import QUESTION
from exfit.cli.given_files import DYNAMICS_FILES, GivenFile, Kind
from exfit.cli.streams import echo
from exfit.errors import ExfitError
from exfit.features.planner.import_case import import_unit, units_of_file
from exfit.features.start.making import TITLES, typical_values
from exfit.features.start.questions import (
    MOST_LISTED,
    NO,
    Conversation,
    ask,
    list_rows,
    number,
    one_of,
    say,
)
from exfit.models import MODELS, find
from exfit.models.families import FAMILIES, edition_of, members
from exfit.models.machines import find_machine
from exfit.models.sheet import Parameter
from exfit.util.vocabulary import FITTED, SOURCES, TYPICAL

FAR = 20.0  # times a typical value: in another unit?
NO_LIMIT = 90.0  # pu: a ceiling beyond it stands for none
KINDS = {
    "DC": "rotating, DC: a commutator exciter",
    "AC": "rotating, AC: an alternator with rectifiers, brushless or not",
    "ST": "static: a controlled rectifier, fed from the terminals",
}
USUAL = {"DC": "DC1A", "AC": "AC8B", "ST": "ST1A"}
ROTORS = {"round": "GENROU", "salient": "GENSAL"}
OTHERS = "others"  # stands for the values of an exciter that are not asked one by one
OF_DATA_SHEET = [word for word in SOURCES if word not in (TYPICAL, FITTED)]


def ask_models(talk: Conversation) -> None:
    """Ask for a planner's file, or else for the models of exciter and generator."""
    given = talk.given
    if not {"dyr", "model"} & given.keys():
        _ask_planner(talk)
    if given.get("model") == QUESTION:
        given["model"] = _ask_model()
    known = {"dyr", "machine_model", "machine_from", "machine"} & given.keys()
    if not known and talk.case().draft.kind_of_plant != "none":
        given["machine_model"] = _ask_machine_model()


def _ask_planner(talk: Conversation) -> None:
    """Ask for a planner's file and, of several units, for the bus and the id."""
    files = sorted(str(p) for p in Path().iterdir() if p.suffix.lower() in DYNAMICS_FILES)
    given = talk.given

    def read(text: str) -> str:
        if text.lower() in NO:
            return ""
        path: Path = GivenFile(Kind.DYNAMICS).convert(Path(text).expanduser(), None, None)
        if not units_of_file(path).units:
            import_unit(path)  # says why
        return str(path)

    file = ask(
        "Planner's file of this unit, .dyr or .dyd",
        read,
        "Of PSS/E or PSLF. It holds the models and data of generator and exciter.",
        files[0] if len(files) == 1 else NO[0],
        "With it neither the type of the exciter nor data are asked, and the report compares the "
        "result with it.",
    )
    if not file:
        given["model"] = QUESTION
        return
    units = units_of_file(Path(file)).units
    unit = units[0]
    if len(units) > 1:
        rows = {
            f"{each.bus} {each.id}": f"{each.machine.definition.record.name}, "
            f"{each.exciter.definition.record.name}"
            for each in units
        }
        list_rows(dict([*rows.items()][:MOST_LISTED]))
        chosen = ask("Bus and id of the unit", one_of([*rows]), "One-line diagram.")
        unit = units[[*rows].index(chosen)]
    given.update(dyr=file, bus=unit.bus, id=unit.id)


def _ask_model() -> str:
    """Ask for the type of the exciter, then for a model of that type; any name is taken."""

    def by_name(text: str) -> str:
        return text if text.endswith(".py") and find(text, Path()) else find(text, Path()).name

    def read(text: str) -> str:
        for kind, words in zip(FAMILIES, KINDS.values(), strict=True):
            if text.upper() in (kind, str(FAMILIES.index(kind) + 1), words[:6].upper()):
                return kind
        if not text:
            raise ExfitError("A type or a model is needed; ? explains")
        return by_name(text)

    list_rows({str(k): KINDS[kind] for k, kind in enumerate(FAMILIES, 1)})
    kind = ask(
        "Type of the exciter: its number, or the name of a model",
        read,
        "Manual or nameplate of the exciter: what feeds the field winding?",
        more="If you know the model of IEEE 421.5 or PSS/E, enter it, as AC8B; `exfit models` "
        "lists all. If you do not know the type, take any: `exfit rank` then compares them.",
    )
    if kind not in KINDS:
        return kind
    names = [name for name in members(kind, USUAL[kind], MODELS) if edition_of(name)]
    list_rows({name: MODELS[name].title.partition(" (")[0] for name in names})
    return ask(
        "Model",
        by_name,
        "Manual of the regulator, or the planner. `exfit rank` compares models later.",
        USUAL[kind],
        "A digital regulator with a PID is AC8B on a rotating exciter. Any name of `exfit models` "
        "is taken, and the file of a model of yours, as my_exciter.py.",
    )


def _ask_machine_model() -> str:
    """Ask for the model of the generator by its rotor."""

    def read(text: str) -> str:
        begun = [name for word, name in ROTORS.items() if text and word.startswith(text.lower())]
        return begun[0] if begun else find_machine(text).name

    return ask(
        "Rotor: round, or salient (poles)",
        read,
        "Nameplate of the generator: round at 3000 or 3600, 1500 or 1800 turns a minute.",
        "round",
        "Or a machine model by its name: GENROU, GENROE, GENSAL, GENSAE, ONE_AXIS.",
    )


def ask_data(talk: Conversation) -> None:
    """Ask for the data that decide the response and are typical so far, then for their source."""
    given = talk.given
    for key, title in TITLES.items():
        if key not in given:
            given[key] = dict.fromkeys(_asked_names(talk, key), QUESTION)
        if QUESTION in given[key].values():
            _group(talk, key, title)
    if (given["machine"] or given["exciter"]) and "sources" not in given:
        given["sources"] = ask(
            "Source of these values",
            one_of(OF_DATA_SHEET),
            f"One of: {', '.join(OF_DATA_SHEET)}; the report names it.",
            "maker",
            "maker: the data sheet. If values have several sources, enter that of most, and "
            "change the others in the case.",
        )


def _asked_names(talk: Conversation, key: str) -> list[str]:
    """Name the values of a part that are asked; of the exciter its limits, then all others."""
    rows = typical_values(talk.case())[key]
    if key == "machine" or not rows:
        return [row.symbol for row in rows]
    limits = [row for row in rows if "MAX" in row.symbol or "MIN" in row.symbol]
    return [*(row.symbol for row in limits if abs(row.typical) < NO_LIMIT), OTHERS]


def _group(talk: Conversation, key: str, title: str) -> None:
    """Ask for the values of a part that are open; those that are typical leave the answers."""
    values: dict[str, Any] = talk.given[key]
    others = OTHERS in values
    part = getattr(talk.case().unit, key)
    rows = {row.symbol: row for row in part.model.sheet}
    echo("", err=True)
    say(f"Data sheet of the {title}. Enter keeps the typical value in brackets.", faint=True)
    typed = dict[str, float]()
    while asked := [name for name, value in values.items() if value == QUESTION and name in rows]:
        for symbol in asked:
            values[symbol] = _value(rows[symbol], part.values[symbol], typed.get(symbol))
        typed = {symbol: value for symbol, value in values.items() if value not in (None, QUESTION)}
        of_part = part.model.faults if key == "machine" else _limit_faults
        for fault in of_part({**part.values, **typed}):
            say(": ".join(fault))
            named = values.keys() & re.findall(r"\w+", " ".join(fault))
            values |= dict.fromkeys(named, QUESTION)
    for symbol in [symbol for symbol, value in values.items() if value is None]:
        del values[symbol]
    if others:
        values |= _further_values(talk, rows)
        del values[OTHERS]


def _limit_faults(values: Mapping[str, float]) -> list[tuple[str, str]]:
    """Find floors that are not below their ceilings."""
    pairs = [(name, name.replace("MIN", "MAX")) for name in values if "MIN" in name]
    return [
        (low, f"{values[low]:g} is not below {high} = {values[high]:g}")
        for low, high in pairs
        if high in values and values[low] >= values[high]
    ]


def _value(row: Parameter, before: float, typed: float | None) -> float | None:
    """Ask for a value of a data sheet; Enter keeps what was typed, or gives None for typical."""
    kept = before if typed is None else typed

    def read(text: str) -> float | None:
        if not text:
            return typed
        fault = row.range_fault(number(text))
        if fault is not None:
            raise ExfitError(fault)
        return number(text)

    def doubt(value: float | None) -> str:
        if value is None:
            return ""
        if not row.is_physical(value):
            return f"{value:g} lies outside {row.physical_range}, the usual range"
        far = row.typical and value and not 1.0 / FAR < abs(value / row.typical) < FAR
        return f"{value:g} {row.unit} is far from the typical {row.typical:g}" if far else ""

    printed = row.symbol.replace("pp", "''").replace("p", "'")  # as data sheets have it
    text = f"  {printed:6} {row.meaning}, {row.unit} [{kept:g}]"
    more = f"{row.symbol}: {row.meaning}, from {row.physical_range}; typical {row.typical:g}."
    return ask(text, read, more=more, doubt=doubt)


def _further_values(talk: Conversation, rows: Mapping[str, Parameter]) -> dict[str, float]:
    """Ask for any other values of the exciter, as NAME=VALUE, in one line."""

    def read(text: str) -> dict[str, float]:
        values = {}
        for word in re.split(r"[\s;]+", text) if text else []:
            name, equals, value = word.partition("=")
            if not equals:
                raise ExfitError(f"{word!r} is not of the form KE=1.0")
            values[name] = number(value)
        talk.case(exciter={**talk.given["exciter"], **values})
        return values

    part = talk.case().unit.exciter
    listing = ", ".join(f"{symbol}={part.values[symbol]:g}" for symbol in rows)
    text = "  Other values, as KE=1.0 TR=0.02 (Enter: none)"
    return ask(text, read, more=f"So far: {listing}.")
