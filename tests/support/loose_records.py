"""PSS/E records with drawn values, as anyone may have typed them."""

import re
from math import exp, log

from exfit.features.planner.records import contradictions, unused_of, with_exchanged
from exfit.models.sheet import typical

TRIES = 500
SWAPPED = {"E1": "E2", "SE1": "SE2", "E2": "E1", "SE2": "SE1"}


def within(row, random):
    """Return a value of a parameter's range: an end, a typical one, or any of any size."""
    kind = random.integers(5)
    if kind == 0:
        return float(random.choice([row.low, row.high]))
    if kind == 1:
        return row.typical
    if kind == 2:
        return float(random.uniform(row.low, row.high))
    least = max(row.low, 1e-5)
    size = exp(random.uniform(log(least), log(max(row.high, least))))
    return float(min(max(size, row.low), row.high))


def sound(definition, random):
    """Return values within the sheet that do not contradict each other, and that all may act."""
    rows = {row.symbol: row for row in definition.model.sheet}
    held = {name: row for name, row in rows.items() if name in definition.names}
    whole = dict(definition.record.icons)
    unseen = typical(definition.model.sheet) | dict(definition.record.held)

    def drawn_values(names):
        values = {name: within(held[name], random) for name in names}
        return {name: float(round(v)) if name in whole else v for name, v in values.items()}

    values = unseen | drawn_values(held)
    for _ in range(TRIES):
        values |= dict.fromkeys(unused_of(definition.record, values), 0.0)
        wrong = [*contradictions(definition.model, values)]
        if not wrong:
            return values
        symbol, text = wrong[random.integers(len(wrong))]
        drawn = SWAPPED if symbol in SWAPPED else [symbol, *re.findall(r"\w+", text)]
        values |= drawn_values(name for name in drawn if name in held)
    return unseen


def styled(value, random):
    """Return a number in one of the ways in which Fortran writes it, none of which rounds."""
    text = repr(float(value))
    ways = [text, text.upper(), f"{value:.17g}", f"{value:.16e}", f"{value:.16E}"]
    ways.append(f"{value:.16e}".replace("e", "D"))
    ways.append(f"{value:.16e}".replace("e", "d"))
    if text.endswith(".0"):
        ways += [text[:-2], text[:-1]]
    if text.startswith("0."):
        ways.append(text[1:])
    if text.startswith("-0."):
        ways.append("-" + text[2:])
    if value >= 0:
        ways.append("+" + text)
    return str(random.choice(ways))


def quoted(text, random):
    return str(random.choice([text, f"'{text}'", f'"{text}"', f"'{text} '", f"' {text}'"]))


def loose(definition, values, random, bus=1, machine_id="1"):
    """Return a record in the free format, as anyone may have typed it."""
    ignored = {symbol: float(random.normal()) for symbol in definition.record.ignored}
    given = {**values, **ignored, **dict(definition.record.absent)}
    given = with_exchanged(definition.record, given)
    name = definition.record.name
    name = name.lower() if random.integers(4) == 0 else name
    fields = [str(bus), quoted(name, random), quoted(machine_id, random)]
    icons = dict(definition.record.icons)
    fields += [
        str(int(values.get(name, icons[name]))) if name in icons else styled(given[name], random)
        for name in definition.names
    ]
    gaps = [" ", "\t", ",", " , ", ", ", "   ", "\n", ",\n  ", "\r\n", "\n// it's 1 2 3 / 'x\n"]
    gaps += ["\n@! the unit's, \"\n  ", "\n\n"]
    text = fields[0]
    for field in fields[1:3]:  # on one line, as everyone writes them
        text += str(random.choice(gaps[:6])) + field
    for field in fields[3:]:
        text += str(random.choice(gaps)) + field
    return text + str(random.choice(["/", " /", " / the end, 'as of' 1999", "\n/", " , /"])) + "\n"
