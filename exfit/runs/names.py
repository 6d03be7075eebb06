"""Names of cases and fits that no other of their series has."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path


def distinct_names(paths: Sequence[Path]) -> list[str]:
    """Return the stem of each path, behind the name of its folder where several have one stem.

    What is the same even so is numbered; capitals make no difference, as on some disks.
    """
    stems = Counter(path.stem.casefold() for path in paths)
    return numbered(
        f"{path.absolute().parent.name}-{path.stem}"
        if stems[path.stem.casefold()] > 1
        else path.stem
        for path in paths
    )


def numbered(names: Iterable[str]) -> list[str]:
    """Return names with a number behind each that repeats an earlier one."""
    taken: dict[str, str] = {}
    for name in names:
        candidate, number = name, 1
        while candidate.casefold() in taken:
            number += 1
            candidate = f"{name}-{number}"
        taken[candidate.casefold()] = candidate
    return [*taken.values()]
