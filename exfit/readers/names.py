"""What the name of a column says: its unit, and whether it is the time."""

import re
from collections.abc import Sequence

# V, kV, MVA, Mvar, ms, ...: a prefix and a unit that recorders of generators write
_UNIT = re.compile(
    r"(?:[kKMGmuµμn]?(?:V|A|W|VA|var|VAr|VAR|Hz|s|Ohm|Ω|Nm)"
    r"|sec|msec|seconds|milliseconds|min|h"
    r"|pu|p\.u\.|p\.u|per unit|%|‰|-|deg|°|rad|rad/s|el\.deg|°C|C|K|rpm|r/min|1/min|1/s|U/min"
    r"|bar|m/s)",
    re.IGNORECASE,
)
PHASE = "S"  # of R, S and T, or the apparent power; s is a second
_TIME_UNIT = re.compile(r"s|sec|seconds|ms|msec|milliseconds|us|µs|μs|min", re.IGNORECASE)
_BRACKETS = re.compile(r"(.*\S)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))")
_FRACTION = re.compile(r"([^/]*[^/\s])\s*/\s*([^/\s]+)")
_BEHIND_COMMA = re.compile(r"([^,]*[^,\s])\s*,\s*([^,\s]+)")

_WHOLE = frozenset(("timestamp", "zeitstempel", "datetime", "date_time", "time_stamp"))  # no date
_TIMES = _WHOLE | {
    "t", "time", "tout", "zeit", "uhrzeit", "utc", "relative_time", "elapsed_time", "time_of_day",
}  # fmt: skip
_DATES = frozenset(("date", "datum"))


def is_unit(text: str) -> bool:
    """Tell whether a text is a unit such as kV, ms or p.u., also in brackets: [kV], (s)."""
    text = text.strip()
    if (text[:1], text[-1:]) in (("[", "]"), ("(", ")")):
        text = text[1:-1].strip()
    return _UNIT.fullmatch(text) is not None and text != PHASE


def unit_in(name: str) -> str | None:
    """Return the unit that a column's name ends in, or None: Ugen [kV], If (A), t/ms, Time, s.

    Only what is a unit counts: U (L1) has none. Behind a comma only a unit of time does, as A may
    be a phase, and behind a stroke only where a quantity stands before it, unlike in rad/s.
    """
    return _split(name)[1]


def clock_of(names: Sequence[str]) -> tuple[str, ...]:
    """Return the column that seems to hold the time, or those of date and time of day, or none."""
    bare = {name: re.sub(r"[\s\-/.]+", "_", _split(name)[0].casefold()) for name in names}
    times = [name for name in names if bare[name] in _TIMES]
    dates = [name for name in names if bare[name] in _DATES]
    whole = [name for name in times if bare[name] in _WHOLE]
    return tuple(whole[:1] or dates[:1] + times[:1])


def _split(name: str) -> tuple[str, str | None]:
    """Return a name without its unit, and the unit."""
    name = name.strip()
    if found := _BRACKETS.fullmatch(name):
        unit = (found[2] or found[3] or "").strip()
        return (found[1], unit) if is_unit(unit) else (name, None)
    if (found := _FRACTION.fullmatch(name)) and is_unit(found[2]) and not is_unit(name):
        last = found[1].split()[-1]
        return (name, None) if is_unit(last) else (found[1], found[2])
    if (found := _BEHIND_COMMA.fullmatch(name)) and _TIME_UNIT.fullmatch(found[2]):
        return found[1], found[2]
    return name, None
