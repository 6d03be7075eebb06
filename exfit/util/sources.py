"""Where the value of a parameter comes from, in the words of case, result, report and export."""

from collections.abc import Iterable, Mapping

TYPICAL = "typical"
FITTED = "fitted"
NOT_STATED = "not stated"  # of a given value without a source
SOURCES = ("nameplate", "maker", "test report", "measured", TYPICAL, FITTED)  # that a case may give
# of several values the first of these is the source of what follows from them all
LEAST_CERTAIN_FIRST = (TYPICAL, NOT_STATED, FITTED, "measured", "test report", "maker", "nameplate")


def least_certain(sources: Iterable[str]) -> str:
    """Return the source of a value that follows from others, given theirs."""
    among = set(sources)
    return next((source for source in LEAST_CERTAIN_FIRST if source in among), NOT_STATED)


def by_source(names: Iterable[str], sources: Mapping[str, str]) -> dict[str, list[str]]:
    """Return names by the source of their values, in the order in which these first appear."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(sources.get(name, NOT_STATED), []).append(name)
    return groups
