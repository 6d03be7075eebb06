"""Messages of the page of exfit app, right ones and mutants, and what a page is told of them."""

import json
import math

from exfit.errors import ExfitError
from exfit.features.app.messages import read_message
from exfit.features.app.packing import packed

GOOD = {
    "try": {"do": "try", "values": {"KA": 500.0}, "moving": True},
    "store": {"do": "store", "values": {"KA": 500.0, "TE": 1.2}},
    "bound": {"do": "bound", "name": "KA", "low": 10.0, "high": 900.0},
    "lock": {"do": "lock", "name": "KC", "value": 0.5},
    "free": {"do": "free", "name": "KE"},
    "open": {"do": "open"},
    "save": {"do": "save case"},
}
PIECES = [
    '"',
    "{",
    "}",
    "[",
    "]",
    ":",
    ",",
    "null",
    "1e999",
    "NaN",
    "-1",
    "\\u0000",
    "KA",
    "do",
    "",
]

# of messages of the right form
NUMBERS = (
    *(0.0, -0.0, 1.0, -1.0, 0.02, 0.5, 400.0, 777.0, 1e4, 1e9, 1e-9),
    *(5e-324, 1e-300, 1e300, 1e308, -1e308, math.nan, math.inf),
)
NAMES = (
    *("KA", "KC", "KD", "KE", "KF", "TA", "TE", "TF", "TC", "VRMAX", "SE1", "machine.Tpd0"),
    *("", "nothing", "ka", "KA.start", "parameters.free", "__class__", "ä\u0000", "K" * 100),
)
FILES = (
    *("ac1a_good.yaml", "ac1a_good-draft.yaml", "up.csv", "up.yaml", "unit.dyr", "result.json"),
    *(
        "",
        ".",
        "..",
        "../up.csv",
        "/etc/hosts",
        "nothing.csv",
        "a\u0000.csv",
        "c" * 99,
        "C:\\up.csv",
    ),
)
MODELS = ("AC1A", "ST1A", "SEXS", "", "nothing", "GENROU", "../m.py")
COLUMNS = ("vt", "efd", "ifd", "t", "", "nothing", "vt [pu]")
SIGNALS = ("vt", "efd", "ifd", "p", "angle", "", "nothing", "VT")
UNITS = ("", "pu", "kV", "V", "A", "furlong", "]", "[", "kV] [V")
PLAIN = ("open", "stop", "save case", "discard", "save result")


def mutant(rng):
    """Return a message with something wrong, or still right."""
    text = json.dumps(rng.choice([*GOOD.values()]))
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(text) + 1)
        text = text[:at] + rng.choice(PIECES) + text[at + rng.randint(0, 3) :]
    return text


def odd(rng):
    """Return a message of the right form with odd values."""
    name, number = rng.choice(NAMES), rng.choice(NUMBERS)
    values = {rng.choice(NAMES): rng.choice(NUMBERS) for _ in range(rng.choice((0, 1, 1, 2, 20)))}
    some = [None, number, rng.choice(NUMBERS)]
    forms = {
        "try": {"values": values, "moving": rng.random() < 0.5},
        "store": {"values": values},
        "validate": {"values": values},
        "bound": {"name": name, "low": number, "high": rng.choice(NUMBERS)},
        "lock": {"name": name, "value": number},
        "free": {"name": name},
        "apply": {"cause": rng.randint(0, 3)},
        "look": {"file": rng.choice(FILES)},
        "correct": {
            "column": rng.choice(COLUMNS),
            "signal": rng.choice(SIGNALS),
            "unit": rng.choice(UNITS),
        },
        "drawing": {"model": rng.choice(MODELS)},
        "make": {
            "model": rng.choice(MODELS),
            "unit": rng.choice((0, 0, 1, 99_999)),
            "step": rng.choice(some),
            "kv": rng.choice(some),
            "machine": values if rng.random() < 0.3 else {},
        },
    }
    do = rng.choice([*forms, *forms, rng.choice(PLAIN)])
    return json.dumps({"do": do, **forms.get(do, {})})


def outcome(session, text):
    """Return what a page is told of a message: the kind of its answer, or why it is refused."""
    try:
        said = session.answer(read_message(text), lambda said: packed(said))
        packed(said)
        return said["of"]
    except ExfitError as fault:
        return str(fault)
    except OSError as fault:
        return f"{fault.strerror}"
    except KeyboardInterrupt:
        return "stopped"
