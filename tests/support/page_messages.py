"""Messages of the page of exfit app, right ones and mutants, and what a page is told of them."""

import json

from exfit.errors import ExfitError
from exfit.features.app.messages import read_message

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


def mutant(rng):
    """Return a message with something wrong, or still right."""
    text = json.dumps(rng.choice([*GOOD.values()]))
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(text) + 1)
        text = text[:at] + rng.choice(PIECES) + text[at + rng.randint(0, 3) :]
    return text


def outcome(session, text):
    """Return what a page is told of a message: the kind of its answer, or why it is refused."""
    try:
        return session.answer(read_message(text), lambda _: None)["of"]
    except ExfitError as fault:
        return str(fault)
