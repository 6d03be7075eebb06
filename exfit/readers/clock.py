"""The units of a time column."""

from collections.abc import Mapping
from pathlib import Path

from exfit.errors import RecordError

SECONDS: Mapping[str, float] = {
    "s": 1.0, "sec": 1.0, "seconds": 1.0,
    "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6,
    "min": 60.0,
}  # fmt: skip


def seconds_per_unit(path: Path, column: str, said: str | None, asked: str | None) -> float:
    """Return the factor from a time column to s.

    ``said`` is the unit that the file itself gives, ``asked`` the one that the reader is told;
    without either it is s. Raises RecordError for a unit that is none of time, and where the two
    contradict each other.
    """
    for unit in (said, asked):
        if unit is not None and unit.lower() not in SECONDS:
            raise RecordError(
                f"{path}: column {column!r}: {unit} is no unit of time: s, ms, us, min"
            )
    factors = [SECONDS[unit.lower()] for unit in (said, asked) if unit is not None]
    if len(set(factors)) > 1:
        raise RecordError(
            f"{path}: column {column!r} is in {said} as the file says, not in {asked}"
        )
    return factors[0] if factors else 1.0
