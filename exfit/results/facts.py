"""The facts that reports and fleets ask for by name: keys of the section ``about`` of a case.

Upper and lower case, blanks and hyphens are the same. What is not stated is reported as such; any
other fact of a case is shown, too.
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

from exfit.util.text import show
from exfit.util.vocabulary import NOT_STATED

Facts = Mapping[str, float | str]


class AskedFact(NamedTuple):
    """A fact that a report asks for: its key, and other words for it."""

    key: str
    others: tuple[str, ...] = ()


PLANT = AskedFact("Plant", ("Station",))
UNIT = AskedFact("Unit", ("Generator",))
RATED = AskedFact("Rated", ("Rating",))
MAKER = AskedFact("Excitation maker", ("Exciter maker", "Excitation manufacturer"))
MODEL = AskedFact("Excitation model", ("Excitation system",))
TYPE = AskedFact("Excitation type", ("Exciter type",))
REGULATOR = AskedFact("Regulator", ("Voltage regulator", "AVR"))
COMPENSATION = AskedFact("Compensation", ("Droop", "Line drop compensation"))
STABILISER = AskedFact("Stabiliser", ("Stabilizer", "PSS"))
GOVERNOR = AskedFact("Governor", ("Governor control",))
TURBINE = AskedFact("Turbine", ("Turbine type",))
LOAD_CONTROL = AskedFact("Load control", ("Outer loop control",))
PLANNER = AskedFact("Planner's base", ("Planner",))
DATE = AskedFact("Test date", ("Date",))
TESTED = AskedFact("Tested by", ("Tester",))
INSTRUMENTS = AskedFact("Instruments", ("Transducers",))
RECORDER = AskedFact("Recorder")
STATE = AskedFact("Machine state", ("Temperature",))
TAP = AskedFact("Tap", ("Tap position",))
SPEED = AskedFact("Speed")
WRITTEN = AskedFact("Written by", ("Author",))
CHECKED = AskedFact("Checked by")
APPROVED = AskedFact("Approved by")
REVISION = AskedFact("Revision", ("Rev",))
REPORTED = AskedFact("Report date")
CHANGES = AskedFact("Revision note", ("Changes",))

ASKED = (
    PLANT, UNIT, RATED, MAKER, MODEL, TYPE, REGULATOR, COMPENSATION, STABILISER, GOVERNOR,
    TURBINE, LOAD_CONTROL, PLANNER, DATE, TESTED, INSTRUMENTS, RECORDER, STATE, TAP, SPEED,
    WRITTEN, CHECKED, APPROVED, REVISION, REPORTED, CHANGES,
)  # fmt: skip


def stated(about: Facts, fact: AskedFact) -> str | None:
    """Return a fact of a case as text; None where the case is silent."""
    wanted = {_plain(word) for word in (fact.key, *fact.others)}
    for name, value in about.items():
        if _plain(name) in wanted:
            return value if isinstance(value, str) else show(value)
    return None


def answer(about: Facts, fact: AskedFact) -> str:
    """Return a fact of a case as text, or that it is not stated."""
    return stated(about, fact) or NOT_STATED


def _plain(word: str) -> str:
    return re.sub(r"[\W_]+", "", word).lower()
