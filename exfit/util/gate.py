"""The gate that code of a case passes before it is run."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exfit.util.trust import Code

# raise ExfitError for what may not be run; of all threads, which a context would not be
_gates: list[Callable[["Code"], None]] = []


def refuse_untrusted(code: "Code") -> None:
    """Raise ExfitError for code that a command may not run; a program in Python may run any."""
    for gate in _gates[:1]:
        gate(code)


@contextmanager
def guarded(gate: Callable[["Code"], None]) -> Iterator[None]:
    """Ask a gate before any code is run inside, unless one stands around it."""
    _gates.append(gate)
    try:
        yield
    finally:
        _gates.pop()
