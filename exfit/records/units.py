"""Units of columns: what a recorder writes after a name, or in a row or a field of its own."""

import re
from collections.abc import Callable, Mapping
from math import pi
from typing import NamedTuple

# body of a unit, folded -> its usual spelling, and the quantity that it measures
BODIES: Mapping[str, tuple[str, str]] = {
    "v": ("V", "voltage"), "a": ("A", "current"), "w": ("W", "power"), "var": ("var", "reactive"),
    "va": ("VA", "apparent"), "hz": ("Hz", "frequency"), "s": ("s", "time"),
    "ohm": ("Ω", "resistance"), "ω": ("Ω", "resistance"), "nm": ("Nm", "torque"),
    "pa": ("Pa", "pressure"),
}  # fmt: skip
SPELLINGS: Mapping[str, str] = {
    "V": "volt, volts", "A": "amp, amps, ampere, amperes", "W": "watt, watts", "Hz": "hertz",
    "Ω": "ohm, ohms", "s": "second, seconds, sec, sek, seg",
    "ms": "msec, millisecond, milliseconds", "us": "usec, microseconds",
    "pu": "pu, p.u., p.u, p. u., per unit", "%": "percent",
    "deg": "deg, degree, degrees, °, grad", "rad": "radian, radians", "min": "min", "h": "h",
}  # fmt: skip
WORDS = {word: unit for unit, words in SPELLINGS.items() for word in words.split(", ")}
OTHER_UNITS = frozenset(
    ("%", "‰", "-", "rad", "rad/s", "el.deg", "°C", "K", "rpm", "r/min", "1/min", "min-1", "U/min",
     "1/s", "m/s", "bar", "dB")
)  # fmt: skip
PER_UNIT = frozenset(("", "-", "1", "pu"))  # of numbers that need no base
ANGLES: Mapping[str, float] = {"rad": 1.0, "deg": pi / 180.0, "el.deg": pi / 180.0}  # in rad
SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}

# a prefix depends on its case; S is a phase, and so is a small a
_PREFIXED = re.compile(
    r"(?P<prefix>[nuµμmkKMG]?)(?P<body>(?i:VA|var|Hz|Ohm)|[VvAWwΩs]|Nm|Pa)"
    r"(?:[ _]?(?i:dc|ac|rms|eff))?"
    r"|(?P<small>[mk])(?P<ampere>a)|(?P<milli>M)(?P<second>S)"
)
_MEGA = re.compile(r"mw|mva|m(?i:var)")  # no generator makes milliwatts in small letters, or mvar
_ALONE = re.compile(r"[kKMG](?:V|A|W|(?i:var))|mvar|mw")  # a unit in place of a name
_PREFIXES: Mapping[str, str] = {"K": "k", "µ": "u", "μ": "u"}
FACTORS: Mapping[str, float] = {
    "": 1.0, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9
}  # fmt: skip
_BARE = re.compile(r"[\[({<]\s*(.*?)\s*[\])}>]")
_TIME = re.compile(r"t|time|zeit|tiempo|temps|tempo", re.IGNORECASE)
_OF_PHASES = re.compile(r"[uve]\w{0,4}|.*(?:volt|spannung|phase|tensi)\w*", re.IGNORECASE)


def unit_of(text: str) -> str | None:
    """Return the unit that a text is, as it is written, without brackets; None where it is none."""
    text = text.strip()
    bracketed = _BARE.fullmatch(text)
    unit = bracketed[1] if bracketed else text
    return unit if unit in OTHER_UNITS or unit.casefold() in WORDS or _prefixed(unit) else None


def usual(unit: str) -> str:
    """Return the usual spelling of a unit: V of Volts and Vrms, kV of KV, Mvar of mvar."""
    unit = unit.strip()
    word = WORDS.get(unit.casefold())
    parts = _prefixed(unit)
    return word or (parts.symbol if parts else unit)


def alike(unit: str, other: str) -> bool:
    """Compare two texts as units: kV is KV, pu is p.u.; but MW is not mW."""
    return usual(unit) == usual(other) or (
        unit_of(unit) is None and unit.strip().casefold() == other.strip().casefold()
    )


def quantity_of(unit: str | None) -> str | None:
    """Quantity that a unit measures: voltage, current, power, reactive, time ...; None if none."""
    if unit is None:
        return None
    symbol = usual(unit)
    if symbol in SECONDS or symbol == "h":
        return "time"
    if symbol in ANGLES:
        return "angle"
    prefixed = _prefixed(symbol)
    return prefixed.quantity if prefixed else None


def needs_base(unit: str) -> bool:
    """Check whether numbers of a unit are per unit only after a division by their base."""
    return usual(unit) not in PER_UNIT


def unit_in(name: str) -> str | None:
    """Return the unit at the end of a column's name, None without one.

    Ugen [kV], If (A), t/ms, U in V, Time, s and U_kV have one, MW is one; U (L1), Phase, A, P_min
    and U (A), where letters are phases and limits, have none.
    """
    return _split(name)[1]


def bare(name: str) -> str:
    """Return the name of a column without its unit."""
    return _split(name)[0]


def _split(name: str) -> tuple[str, str | None]:
    name = name.strip()
    if _ALONE.fullmatch(name):
        return name, name
    for form, holds in FORMS:
        parts = form.fullmatch(name)
        if parts and holds(parts["name"], parts["unit"]) and name not in OTHER_UNITS:
            return parts["name"] or name, parts["unit"]
    return name, None


def _in_brackets(name: str, unit: str) -> bool:
    return unit_of(unit) is not None and not (unit == "A" and _OF_PHASES.fullmatch(name))


def _after_slash(name: str, unit: str) -> bool:
    """Check for the unit of what precedes it, and no part of one, as in V/Hz."""
    before = quantity_of(name.split()[-1])
    of_another = unit_of(name.split()[-1]) is not None and before != quantity_of(unit)
    return _in_brackets(name, unit) and not of_another


def _apart(name: str, unit: str) -> bool:
    """Check for a unit that follows a mark that may also be a part of the name.

    There letters alone are phases, and min is a limit, except after a time.
    """
    quantity = quantity_of(unit)
    if quantity == "time":
        return _TIME.fullmatch(name) is not None
    electric = quantity is not None and len(usual(unit)) > 1 and unit.casefold() not in WORDS
    return electric or usual(unit) in ("pu", "%")


# how a unit is set apart from the name before it, and whether the two are a name and its unit
FORMS: tuple[tuple[re.Pattern[str], Callable[[str, str], bool]], ...] = (
    (re.compile(r"(?P<name>.*?)\s*[\[({<]\s*(?P<unit>[^\[\](){}<>]+?)\s*[\])}>]"), _in_brackets),
    (
        re.compile(r"(?P<name>.*\S)\s+in\s+(?P<unit>.*\S)"),
        lambda _, unit: unit_of(unit) is not None,
    ),
    (re.compile(r"(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>\S+)"), _after_slash),
    (re.compile(r"(?P<name>.*[^\s_,])(?:\s*,\s*|\s+|_+)(?P<unit>[^\s_,]+)"), _apart),
)


def scale_between(unit: str, other: str) -> float | None:
    """Number of another unit that makes one of a unit: 1000 V for a kV; None for no such pair."""
    symbol, wanted = usual(unit), usual(other)
    if symbol in ANGLES and wanted in ANGLES:
        return ANGLES[symbol] / ANGLES[wanted]
    first, second = _prefixed(symbol), _prefixed(wanted)
    if first is None or second is None or first.quantity != second.quantity:
        return None
    return first.factor / second.factor


def base_of_own(unit: str, own: str, rated: float = 1.0) -> float | None:
    """Number of a ``unit`` that makes one of a signal's ``own``; None where none does.

    1 pu of a frequency is the ``rated`` one, Hz.
    """
    if usual(unit) == "pu" and own == "Hz":
        return 1.0 / rated
    return scale_between(own, unit)


class _Prefixed(NamedTuple):
    """A prefix and a unit in their usual spelling, the quantity, and the factor of the prefix."""

    symbol: str
    quantity: str
    factor: float


def _prefixed(unit: str) -> _Prefixed | None:
    parts = _PREFIXED.fullmatch(unit)
    if parts is None:
        return None
    prefix = parts["prefix"] or parts["small"] or (parts["milli"] or "").casefold()
    body = parts["body"] or parts["ampere"] or parts["second"]
    symbol, quantity = BODIES[body.casefold()]
    prefix = "M" if _MEGA.fullmatch(prefix + body) else _PREFIXES.get(prefix, prefix)
    return _Prefixed(prefix + symbol, quantity, FACTORS[prefix])
