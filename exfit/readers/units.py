"""Units of columns: what a recorder writes beside a name, or in a row of its own."""

import re

WORDS = {
    "volt": "V", "volts": "V", "amp": "A", "amps": "A", "ampere": "A", "amperes": "A",
    "watt": "W", "watts": "W", "hertz": "Hz", "ohm": "Ω", "ohms": "Ω",
    "second": "s", "seconds": "s", "sec": "s", "sek": "s", "seg": "s",
    "msec": "ms", "millisecond": "ms", "milliseconds": "ms", "usec": "us", "microseconds": "us",
    "µs": "us", "μs": "us",
    "p.u.": "pu", "p.u": "pu", "p. u.": "pu", "percent": "%", "°": "deg", "grad": "deg",
}  # fmt: skip
PLAIN = {"pu", "1", "-"}  # of numbers that need no base
OTHERS = {"%", "min", "h", "rad", "rpm", "deg", "1/min", "min-1", "°C", "dB", "us", *PLAIN}
PREFIXED = re.compile(
    r"[pnuµμmkKMG]?(?:V|A|W|VA|[vV][aA]?[rR]|Hz|HZ|s|Ω|F|H|T|Nm|Pa|v|a)"
    r"(?:[ _]?(?:dc|ac|DC|AC|rms|RMS|eff))?"
)
IN_NAME = (
    re.compile(r".*?\S?\s*\[\s*([^\[\]]+?)\s*\]"),
    re.compile(r".*?\S?\s*\(\s*([^()]+?)\s*\)"),
    re.compile(r".*\S\s*/\s*(\S+)"),
    re.compile(r".*\S\s+in\s+(\S+)"),
)
BRACKETS = re.compile(r"[\[(<{]\s*(.*?)\s*[\])>}]")


def unit_of(text: str) -> str | None:
    """Return the unit that a text is, without brackets; None where it is none."""
    text = text.strip()
    bare = BRACKETS.fullmatch(text)
    unit = bare[1] if bare else text
    known = unit in OTHERS or unit.casefold() in {*WORDS, *OTHERS} or PREFIXED.fullmatch(unit)
    return unit if known else None


def unit_in(name: str) -> str | None:
    """Return the unit at the end of a name: U [kV], If (A), t/ms, Voltage in p.u.; else None."""
    for form in IN_NAME:
        found = form.fullmatch(name)
        if found and unit_of(found[1]) is not None:
            return found[1]
    return None


def alike(one: str, other: str) -> bool:
    """Tell whether two texts are the same unit: kV and KV, pu and p.u.; but not MW and mW."""
    return _folded(one) == _folded(other)


def needs_base(unit: str) -> bool:
    """Tell whether numbers of a unit are per unit only after a division by their base."""
    return _folded(unit) not in PLAIN


def symbol(unit: str) -> str:
    """Return a unit that is written as a word by its symbol: Volts is V."""
    return WORDS.get(unit.strip().casefold(), unit.strip())


def _folded(unit: str) -> str:
    unit = symbol(unit)
    milli_or_mega = unit[:1] in ("m", "M") and len(unit) > 1
    return unit[0] + unit[1:].casefold() if milli_or_mega else unit.casefold()
