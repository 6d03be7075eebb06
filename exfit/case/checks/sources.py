"""What contradicts itself in the sources and standard errors of a case's values."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from exfit.case.checks.node import ContentNode
from exfit.case.parts import Part, Parts, plants_of_records
from exfit.case.ties import is_tie
from exfit.case.yaml import Fault
from exfit.plants import PlantKind
from exfit.util.sources import TYPICAL
from exfit.util.text import Place, near


def source_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield sources and standard errors of values that the case does not give, or that follow."""
    sections: dict[Place, list[Part]] = {}
    for part in parts.all:
        sections.setdefault(part.sources, []).append(part)
    for place, of_section in sections.items():
        given = _given(content, [part.fixed for part in of_section])
        free = _given(content, [part.free for part in of_section if part.free])
        std_errors = content.at(*of_section[0].std_errors)
        yield from _faults(content.at(*place), {**given, **free}, of_section)
        yield from _std_error_faults(std_errors, given, free, of_section)
    for place in plants_of_records(content.content) if kind.closed_loop else ():
        network = content.at(*place, "network")
        yield from _faults(content.at(*place, "sources"), network.content, [])


def _given(content: ContentNode, places: Iterable[Place]) -> dict[str, object]:
    """Return what is given in several places, by name."""
    return {name: value for place in places for name, value in content.at(*place).content.items()}


def _faults(
    stated: ContentNode, given: Mapping[str, object], parts: Sequence[Part]
) -> Iterator[Fault]:
    """Yield the faults of one mapping of sources, beside the values of its parts."""
    known = dict.fromkeys(symbol for part in parts for symbol in part.symbols)
    for symbol, source in stated.sections:
        if symbol in given:
            if is_tie(given[symbol]):
                yield source.fault(f"follows others by {given[symbol]}: no source of its own")
        elif symbol in known:
            yield source.fault(f"source of a value that the case does not give: it is {TYPICAL}")
        else:
            yield source.fault(f"not given; {near(symbol, {**known, **given})}")


def _std_error_faults(
    stated: ContentNode,
    given: Mapping[str, object],
    free: Mapping[str, object],
    parts: Sequence[Part],
) -> Iterator[Fault]:
    """Yield the faults of one mapping of standard errors, beside the values of its parts."""
    known = dict.fromkeys(symbol for part in parts for symbol in part.symbols)
    for symbol, std_error in stated.sections:
        if symbol in free:
            yield std_error.fault("is free: the fit finds its standard error; see prior")
        elif symbol in given:
            if is_tie(given[symbol]):
                yield std_error.fault(f"follows others by {given[symbol]}: no error of its own")
        elif symbol in known:
            yield std_error.fault("standard error of a value that the case does not give")
        else:
            yield std_error.fault(f"not given; {near(symbol, {**known, **given})}")
