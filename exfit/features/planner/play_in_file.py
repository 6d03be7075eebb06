"""Play-in files of PSS/E (.plb): what drives its model PLBVFU1 in place of a grid."""

from collections.abc import Iterable

DIGITS = 9  # significant, of every number


def play_in_text(rows: Iterable[tuple[float, float, float]]) -> str:
    """Return rows of time (s), voltage (pu) and frequency (Hz) as a play-in file."""
    return "".join(", ".join(f"{value:.{DIGITS}g}" for value in row) + "\n" for row in rows)


def play_in_record(bus: int, machine_id: str, name: str, f0: float) -> str:
    """Return the dynamics record that plays a file ``name``.plb at a bus, with ``f0`` in Hz.

    Its values are two flags, of voltage and frequency, the file, what both are divided by, and two
    lags, s.
    """
    head = f"{bus} 'USRMDL' {machine_id} 'PLBVFU1' 1 1 3 4 3 6"
    return f"{head} 1 1 '{name}' 1.0 {f0:g} 0.0 0.0 /"
