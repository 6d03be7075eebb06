"""Mutants of files: damaged bytes, trees and tables, each determined by its kind, seed and number.

Bytes are flipped, cut, repeated, swapped and spliced with another file; in trees, as YAML and JSON
hold, values change their type and size, keys go missing or are renamed; in tables clocks run
backwards, samples are missing or huge, and cells hold what no number is.
"""

import copy
import json
import random
import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

# set the title of a terminal, clear it, colour it, turn what follows around
CONTROL_TEXT = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e"
PAYLOADS = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</script><svg onload=alert(1)>",
    "{{7*7}}{% raw %}",
    "[bold red]markup[/]",
    "[/]",
    "%s%n{0}{x}",
    "$\\frac{$ and $",
    CONTROL_TEXT,
    "two\nlines\r\nError: a third",
    "nul\0inside",
    "\u202ereversed\u2066",
    "\ud7ff\uffff\U0001f600\u0301\u200b",
    "=1+1",
    "../../outside",
    "/dev/null",
    ".",
    "con",
    "a" * 5000,
    "ё" * 300,
    " ",
    "",
)
SMALL_BYTES = (b"\0", b"\xff", b"\x80", b"\x1b", b"\n", b"\r", b'"', b",", b";", b"\t", b" ", b"-")
NUMBERS = (
    "0", "-0.0", "1", "-1", "1e308", "-1e308", "1e-300", "5e-324", "1e400", "nan", "NaN", "inf",
    "-inf", "9" * 400, "1" + "0" * 5000, "0x10", "1_000", "1,5", "1e", "--1", "2147483648",
    "-2147483649", "18446744073709551616", "4294967295", "1.7976931348623157e308", "1e17", "٣",
)  # fmt: skip
WORDS = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
LONG_WORDS = (*WORDS, 1 << 40, (1 << 63) - 1, 1 << 63, (1 << 64) - 1)
VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 0.0, -0.0, 1e308, -1e308, 1e-300, 5e-324, 1e17, 3, 10**9, 10**400,
    -(10**400), float("nan"), float("inf"), float("-inf"), [], {}, [[]], [{}], {"": {}}, [None],
    {"start": 1.0, "min": 0.0, "max": 2.0}, {"start": "auto"}, "auto", "?", "t", "vt", "1e400",
    "2020-13-45", "yes", "20 %", [1.0, 2.0], ["t", "t"],
)  # fmt: skip
CELLS: tuple[Any, ...] = (
    None, float("nan"), float("inf"), float("-inf"), 1e308, -1e308, 1e-300, 0.0, -1.0, 1e17, True,
    "text", "", "1,5", "9" * 400, "12:34:56.789", "2020-02-30", "#DIV/0!", "1e400",
)  # fmt: skip
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
DEEP = 60  # levels of nesting, perhaps several times
MANY = 20_000  # keys or entries
LONGEST = 1 << 20  # bytes of a mutant: more would test patience


class Mutant(NamedTuple):
    """Files by their names, the first the one that is mutated, and what was done to it."""

    kind: str
    seed: int
    number: int
    files: Mapping[str, bytes]
    changes: tuple[str, ...]

    @property
    def main(self) -> str:
        """The name of the file that commands are given."""
        return next(iter(self.files))

    def __str__(self) -> str:
        """Return what makes it again, and what was done."""
        return f"{self.kind} {self.seed} {self.number}: {', '.join(self.changes)}"


def randomness(kind: str, seed: int, number: int) -> random.Random:
    """Return the source of all that is drawn for one mutant, the same on every computer."""
    return random.Random(f"{kind} {seed} {number}")


# ---- bytes

Bytes = bytes | bytearray


def _span(rng: random.Random, data: Bytes, longest: int = 4096) -> tuple[int, int]:
    """Return the ends of a part of data, more often a short one."""
    start = rng.randrange(len(data) + 1)
    length = int(min(longest, max(len(data), 1)) ** rng.random())
    return start, min(start + length, len(data))


def _flip(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8)) if out else 0):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return out


def _set_byte(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    out = bytearray(data)
    if out:
        at = rng.randrange(len(out))
        out[at : at + 1] = rng.choice(SMALL_BYTES)
    return out


def _truncate(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    start, end = _span(rng, data)
    return data[:start] if rng.random() < 0.5 else data[: len(data) - (end - start)]


def _delete(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    start, end = _span(rng, data)
    return data[:start] + data[end:]


def _duplicate(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    start, end = _span(rng, data)
    times = rng.choice((2, 2, 3, 100, 2000))
    part = bytes(data[start:end])
    return data[:start] + (part * times)[:LONGEST] + data[end:]


def _swap(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    a, b, c, d = sorted(rng.randrange(len(data) + 1) for _ in range(4))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def _splice(rng: random.Random, data: Bytes, other: Bytes) -> Bytes:
    start, end = _span(rng, other, len(other) + 1)
    at, after = _span(rng, data)
    if rng.random() < 0.5:
        return data[:at] + other[start:]
    return data[:at] + other[start:end] + data[after:]


def _insert(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    at = rng.randrange(len(data) + 1)
    texts = (
        rng.choice(PAYLOADS).encode(errors="replace"),
        rng.choice(NUMBERS).encode(),
        rng.randbytes(rng.choice((1, 2, 8, 64, 1024))),
        bytes([rng.randrange(256)]) * rng.choice((1, 4, 1000, 50_000)),
        rng.choice((b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff", b"\xff\xfe\0\0", b"\x1a")),
    )
    return data[:at] + rng.choice(texts) + data[at:]


def _number(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    """Replace a number that stands there as text."""
    found = list(NUMBER.finditer(data))
    if not found:
        return _insert(rng, data, b"")
    number = rng.choice(found)
    return data[: number.start()] + rng.choice(NUMBERS).encode() + data[number.end() :]


def _word(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    """Overwrite a binary number, such as a length."""
    code, values = rng.choice((("H", WORDS[:9]), ("I", WORDS), ("Q", LONG_WORDS)))
    size = struct.calcsize(code)
    if len(data) < size:
        return data
    aligned = size if rng.random() < 0.7 else 1
    at = rng.randrange(len(data) - size + 1) // aligned * aligned
    packed = struct.pack(rng.choice("<>") + code, rng.choice(values))
    return data[:at] + packed + data[at + size :]


def _encode(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    """Write text in another encoding, or with a mark of one."""
    text = bytes(data).decode("utf-8", "replace")
    encodings = ("utf-16", "utf-16-be", "utf-32", "utf-8-sig", "cp1252", "utf-7")
    return text.encode(rng.choice(encodings), "replace")


def _lines(rng: random.Random, data: Bytes, _: Bytes) -> Bytes:
    """Delete, repeat, swap or sort lines."""
    lines = bytes(data).splitlines(keepends=True)
    if len(lines) < 2:
        return data
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(5):
        case 0:
            del lines[a]
        case 1:
            lines[a:a] = [lines[b]] * rng.choice((1, 2, 500))
        case 2:
            lines[a], lines[b] = lines[b], lines[a]
        case 3:
            lines[min(a, b) : max(a, b)] = reversed(lines[min(a, b) : max(a, b)])
        case _:
            lines = [line.rstrip() + rng.choice((b"\r", b"\r\n", b"\0\n")) for line in lines]
    return b"".join(lines)[:LONGEST]


OF_BINARY: tuple[Callable[[random.Random, Bytes, Bytes], Bytes], ...] = (
    _flip, _flip, _set_byte, _truncate, _delete, _duplicate, _swap, _splice, _insert, _word, _word,
    _word,
)  # fmt: skip
OF_TEXT = (
    _flip, _set_byte, _truncate, _delete, _duplicate, _swap, _splice, _insert, _number, _number,
    _number, _encode, _lines, _lines,
)  # fmt: skip


def mutated_bytes(
    rng: random.Random, data: bytes, other: bytes, changes: list[str], text: bool
) -> bytes:
    """Return data after one to three changes; ``other`` is what it may be spliced with."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        change = rng.choice(OF_TEXT if text else OF_BINARY)
        changes.append(change.__name__.strip("_"))
        data = bytes(change(rng, data, other))[:LONGEST]
    return data


# ---- trees

Place = tuple[str | int, ...]


def places_of(tree: Any, place: Place = ()) -> Iterator[Place]:
    """Yield the places of all values of a tree but its top."""
    items: Sequence[tuple[str | int, Any]] = ()
    if isinstance(tree, dict):
        items = [*tree.items()]
    elif isinstance(tree, list):
        items = [*enumerate(tree[:50])]  # of long ones the first are enough
    for key, value in items:
        yield (*place, key)
        yield from places_of(value, (*place, key))


def at_place(tree: Any, place: Place) -> Any:
    for key in place:
        tree = tree[key]
    return tree


def _nested(rng: random.Random, value: Any) -> Any:
    for _ in range(rng.choice((1, 3, 15, DEEP))):
        value = [value] if rng.random() < 0.5 else {"a": value}
    return value


def _some_value(rng: random.Random) -> Any:
    """Return a copy, which later changes may change."""
    return copy.deepcopy(rng.choice(VALUES))


def _many(rng: random.Random) -> int:
    """Return how many keys are added: seldom so many that reading them takes a second."""
    return MANY if rng.random() < 0.03 else rng.choice((1, 30, 300))


def _other_value(rng: random.Random, value: Any, other: Any) -> Any:
    """Return what stands in place of a value: of another type or size, or from another tree."""
    match rng.randrange(8):
        case 0 | 1:
            return _some_value(rng)
        case 2:
            return rng.choice(PAYLOADS)
        case 3:
            return _nested(rng, value)
        case 4:
            places = list(places_of(other))
            return copy.deepcopy(at_place(other, rng.choice(places))) if places else other
        case 5 if isinstance(value, list) and value:
            times = rng.choice((2, 2, 50))
            return (value * times)[:MANY]
        case 5 if isinstance(value, dict):
            return value | {f"key {k}": k for k in range(_many(rng))}
        case 6 if isinstance(value, str):
            return rng.choice((value.upper(), value[:-1], value * 2, value + rng.choice(PAYLOADS)))
    if isinstance(value, int | float) and not isinstance(value, bool):
        factors = (-1, 0, 1e-300, 1e300, 10, 0.1, 2, 1 + 1e-12, 1e6, 1e-6)
        return (float(value) if abs(value) < 1e300 else 1e300) * rng.choice(factors)
    return _some_value(rng)


def _changed(rng: random.Random, tree: Any, other: Any, names: Sequence[str]) -> str:
    """Change a tree somewhere, and return what was done; ``names`` are keys that may be added."""
    places = list(places_of(tree))
    if not places:
        return "nothing"
    place = rng.choice(places)
    holder, key = at_place(tree, place[:-1]), place[-1]
    match rng.randrange(10):
        case 0:
            del holder[key]
            return f"delete {place}"
        case 1 if isinstance(key, str):
            others = [name for each in places for name in each if isinstance(name, str)]
            holder[rng.choice((*PAYLOADS, *names, *others, key.upper(), key[:-1]))] = holder.pop(
                key
            )
            return f"rename {place}"
        case 2:
            second = rng.choice(places)
            value = copy.deepcopy(at_place(tree, second))
            holder[key] = value
            return f"copy {second} to {place}"
        case 5 | 6 if names and isinstance(holder, dict):
            name = rng.choice(names)
            value = _some_value(rng)
            holder[name] = {rng.choice(names): value} if rng.random() < 0.3 else value
            return f"add {name} beside {place}"
        case 3 if isinstance(holder, list):
            rng.shuffle(holder)
            return f"shuffle {place[:-1]}"
        case 4 if isinstance(other, dict) and isinstance(tree, dict) and other:
            name = rng.choice(list(other))
            tree[name] = copy.deepcopy(other[name])
            return f"take {name} of another"
    holder[key] = _other_value(rng, holder[key], other)
    return f"change {place}"


def mutated_tree(
    rng: random.Random, tree: Any, other: Any, changes: list[str], names: Sequence[str] = ()
) -> Any:
    """Change a tree one to four times, and return it.

    Parts of ``other`` are taken, and keys of ``names`` added.
    """
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        changes.append(_changed(rng, tree, other, names))
    return tree


Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


class _WithoutAliases(Dumper):
    """Writes every value where it stands."""

    def ignore_aliases(self, _: Any) -> bool:
        return True


def yaml_bytes(tree: Any) -> bytes:
    """Return a tree as YAML."""
    text = yaml.dump(tree, Dumper=_WithoutAliases, sort_keys=False, allow_unicode=True, width=1000)
    return str(text).encode(errors="replace")


def json_bytes(tree: Any) -> bytes:
    """Return a tree as JSON, with nan and infinity as Python writes them."""
    return json.dumps(tree).encode()


# ---- tables


@dataclass
class Table:
    """Columns of cells: names, units and as many samples each; ``None`` is an empty cell."""

    names: list[str]
    columns: list[list[Any]]
    units: list[str] = field(default_factory=list)


def _clock(rng: random.Random, table: Table) -> str:
    """Damage the first column, the time."""
    clock = table.columns[0]
    numbers = [x if isinstance(x, int | float) else float(k) for k, x in enumerate(clock)]
    if len(clock) < 2:
        return "nothing"
    at = rng.randrange(1, len(clock))
    step = rng.choice((0.0, 1e-300, 1e-12, 1e10, 1e300, -1.0))
    ways: Mapping[str, Callable[[], list[Any]]] = {
        "reversed": lambda: numbers[::-1],
        "constant": lambda: [numbers[0]] * len(numbers),
        "repeated": lambda: [*numbers[:at], numbers[at - 1], *numbers[at + 1 :]],
        f"jump of {step:g}": lambda: [*numbers[:at], *(x + step for x in numbers[at:])],
        f"step {step:g}": lambda: [step * k for k in range(len(numbers))],
        "offset": lambda: [x + 1e17 for x in numbers],
        "empty": lambda: [None] * len(numbers),
        "scaled": lambda: [x * 10.0 ** rng.randrange(-320, 300) for x in numbers],
    }
    name = rng.choice([*ways])
    table.columns[0] = ways[name]()
    return f"clock {name}"


def _cells(rng: random.Random, table: Table) -> str:
    column = rng.randrange(len(table.columns))
    cells = table.columns[column]
    if not cells:
        return "nothing"
    a = rng.choice((0, rng.randrange(len(cells))))
    b = a + rng.choice((1, 1, 5, len(cells)))
    value = rng.choice((*CELLS, *PAYLOADS))
    table.columns[column] = [*cells[:a], *([value] * (min(b, len(cells)) - a)), *cells[b:]]
    return f"cells {column}, {a} ... {b}: {str(value)[:20]!r}"


def _scaled(rng: random.Random, table: Table) -> str:
    column, power = rng.randrange(len(table.columns)), rng.randrange(-320, 310)
    factor = rng.choice((-1, 1)) * float(f"1e{power}")
    table.columns[column] = [
        x * factor if isinstance(x, float) else x for x in table.columns[column]
    ]
    return f"column {column} times {factor:g}"


def _names(rng: random.Random, table: Table) -> str:
    at = rng.randrange(len(table.names))
    table.names[at] = rng.choice((*PAYLOADS, *table.names, "time", "vref", "ifd", "1.5", "Date"))
    return f"name of column {at}"


def _units(rng: random.Random, table: Table) -> str:
    table.units = [
        rng.choice((*PAYLOADS, "kV", "ms", "s", "%", "A", "pu", "")) for _ in table.names
    ]
    return "units"


def _columns(rng: random.Random, table: Table) -> str:
    a, b = rng.randrange(len(table.names)), rng.randrange(len(table.names))
    match rng.randrange(4):
        case 0:
            table.names[a], table.names[b] = table.names[b], table.names[a]
        case 1:
            table.columns[a], table.columns[b] = table.columns[b], table.columns[a]
        case 2 if len(table.names) > 1:
            del table.names[a], table.columns[a]
            table.units = []
        case _:
            times = rng.choice((1, 3, 200))
            table.names += [table.names[a]] * times
            table.columns += [table.columns[a]] * times
            table.units = []
    return "columns"


def _rows(rng: random.Random, table: Table) -> str:
    count = rng.choice((0, 1, 2, 3, 5, 20))
    if rng.random() < 0.7:
        table.columns = [cells[:count] for cells in table.columns]
        return f"{count} rows"
    table.columns = [cells * 2 for cells in table.columns]
    return "twice"


OF_TABLE = (_clock, _clock, _cells, _cells, _cells, _scaled, _names, _units, _columns, _rows)


def mutated_table(rng: random.Random, table: Table, changes: list[str]) -> Table:
    """Return a table after up to three changes."""
    table = copy.deepcopy(table)
    for _ in range(rng.choice((0, 1, 1, 2, 3))):
        changes.append(rng.choice(OF_TABLE)(rng, table))
    return table
