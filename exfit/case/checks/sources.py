"""What contradicts itself in the sources that a case states for its values."""

from collections.abc import Iterator, Mapping, Sequence

from exfit.case.checks.node import ContentNode
from exfit.case.parts import Part, Parts, plants_of_records
from exfit.case.ties import is_tie
from exfit.case.yaml import Fault
from exfit.plants import PlantKind
from exfit.util.sources import TYPICAL
from exfit.util.text import Place, near


def source_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield the sources of values that the case does not give, or that follow others."""
    sections: dict[Place, list[Part]] = {}
    for part in parts.all:
        sections.setdefault(part.sources, []).append(part)
    for place, of_section in sections.items():
        places = [values for part in of_section for values in (part.fixed, part.free) if values]
        given = {
            name: value for values in places for name, value in content.at(*values).content.items()
        }
        yield from _faults(content.at(*place), given, of_section)
    for place in plants_of_records(content.content) if kind.closed_loop else ():
        network = content.at(*place, "network")
        yield from _faults(content.at(*place, "sources"), network.content, [])


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
