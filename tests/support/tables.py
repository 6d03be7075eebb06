"""What the tests of the readers share."""

from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import strategies as st

from exfit.errors import RecordError
from exfit.records.formats import open_table


def read_columns(path, names):
    """Return columns of a file by name, as they stand."""
    return open_table(path).numbers(names)


def in_this_process(read):
    """Return a function that reads a file by a module of a binary format, without its child."""
    from exfit.records.formats.table import memory_limit

    def table(path, *sheet):
        return replace(read(path, *sheet), limit=memory_limit(path, None))

    return table


def everything(table):
    """Ask a table for all that it may hold, as a user might; what is refused is RecordError."""
    if table.clock:
        table.instants(table.clock)
    columns = {}
    for name in table.names:
        with suppress(RecordError):
            columns |= table.numbers([name], frozenset([name]))
    return columns


def refused(read, *named):
    """Check that something is refused, by a message that names all these; return it."""
    with pytest.raises(RecordError) as caught:
        read()
    message = str(caught.value)
    for one in named:
        assert one in message, f"{one!r} is not in {message!r}"
    assert "\n" not in message
    return message


@st.composite
def damage(draw):
    """Draw a way to damage bytes: cut off, some overwritten, a piece taken out."""
    kind = draw(st.sampled_from(["cut", "overwrite", "remove"]))
    where = draw(st.floats(0.0, 1.0))
    other = draw(st.binary(min_size=1, max_size=8))

    def apply(data: bytes) -> bytes:
        at = int(where * len(data))
        if kind == "cut":
            return data[:at]
        behind = data[at + len(other) :]
        return data[:at] + (other if kind == "overwrite" else b"") + behind

    return apply
