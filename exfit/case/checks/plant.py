"""What contradicts itself in a plant, in what is attached to it, and in where data are from."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from exfit.case.checks.model import part_faults
from exfit.case.checks.node import ContentNode
from exfit.case.parts import Part, Parts, kind_of, network_part, plants_of_records
from exfit.case.ties import is_tie
from exfit.case.yaml import Fault
from exfit.models.sheet import Model, typical
from exfit.plants import (
    KINDS,
    Attached,
    PlantKind,
    Stabilised,
    acts_without_load,
    inputs_at,
    inputs_for_limiters,
)
from exfit.util.sources import TYPICAL
from exfit.util.text import Place, near, show, show_value

PROGRAM_HAS_IT = "the program has its own"


def plant_faults(plant: ContentNode) -> Iterator[Fault]:
    """Yield a kind of plant that is described but not installed: the folder of a feature has it."""
    for key in ("type", "twin"):
        if key in plant and plant.at(key).value not in KINDS:
            text = f"{plant.at(key).value}: this installation of exfit has no such plant"
            yield plant.at(key).fault(f"{text}; it has {', '.join(KINDS)}")


def model_faults(content: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield a model that is missing, or what describes one where there is none."""
    if not kind.has_equations:
        for key in ("model", "saturation", "efd_times_speed", "stabiliser", "governor"):
            if key in content:
                yield content.at(key).fault(f"only with plant.twin: {PROGRAM_HAS_IT}")
        return
    if kind.has_exciter:
        if "model" not in content:
            yield content.at("model").fault("is missing")
        return
    keys = (
        "model",
        "saturation",
        "efd_times_speed",
        "parameters",
        "stabiliser",
        "governor",
        "limiters",
    )
    for key in keys:
        if key in content:
            text = f"not allowed with plant {kind.name}: it has no exciter"
            yield content.at(key).fault(text)


def stabiliser_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield a stabiliser that does not act, and inputs of another number than its model's."""
    section = content.at("stabiliser")
    if not section.content:
        return
    yield from _idle_faults(section, content, kind, "stabiliser")
    if parts.stabiliser is not None:
        wrong = [*_number_of_inputs(section, parts.stabiliser)]
        yield from wrong
        if _on_load(content, kind) and not wrong:
            yield from _output_at_rest(section, parts.stabiliser)


def governor_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield a governor that does not act, or does not hold the power at the start."""
    section = content.at("governor")
    tests = (content, *content.at("records").entries, *content.at("validate").entries)
    if not section.content:
        for test in tests:
            for place in (test.at("test", "pref"), test.at("record", "channels", "pref")):
                if place.value is not None:
                    yield place.fault("needs a governor: there is none")
        return
    yield from _idle_faults(section, content, kind, "governor")
    if parts.governor is None:
        return
    from exfit.plants.controls import rests_at

    values = _start_values(section, parts.governor)
    plants = (content.at("plant"), *(test.at("plant") for test in tests[1:]))
    for power in dict.fromkeys(plant.at("network", "P").number for plant in plants):
        if power is None or values is None or rests_at(parts.governor, values, power):
            continue
        name = parts.governor.name
        text = f"{name} does not rest at P = {show(power)} pu: one of its limits is in the way"
        yield section.at("parameters").fault(text)


def limiter_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield limiters at a place that they or the exciter do not have, and what cannot be fitted."""
    by_kind = {limiter.kind: limiter for limiter in parts.limiters}
    for part in parts.all:
        if part.kind in by_kind and kind.has_exciter:
            section, limiter = content.at(*part.fixed[:-1]), by_kind[part.kind]
            yield from _place_faults(section, limiter, parts.exciter)
            idle = kind.closed_loop and not _on_load(content, kind)
            if idle and not acts_without_load(limiter) and section.at("free").content:
                text = f"on open circuit {limiter.model.name} does not act: there is no current"
                yield section.at("free").fault(text)


def _place_faults(
    section: ContentNode, limiter: Attached, exciter: Model | None
) -> Iterator[Fault]:
    """Yield a place at which a limiter cannot act."""
    place, name = section.at("place"), limiter.model.name
    if limiter.place not in limiter.model.places:
        places = ", ".join(limiter.model.places)
        yield place.fault(f"{show_value(limiter.place)}: {name} acts at {places}")
        return
    inputs = frozenset() if exciter is None else inputs_for_limiters(exciter)
    missing = [name for name in inputs_at(limiter).values() if name not in inputs]
    if exciter is None or not missing:
        return
    others = [
        other
        for other in limiter.model.places
        if inputs.issuperset(inputs_at(limiter._replace(place=other)).values())
    ]
    has = f"it has {', '.join(others)}" if others else "none of its inputs is for this limiter"
    word = f"{limiter.place} ({', '.join(missing)})"
    yield place.fault(f"{exciter.name} has no input {word} for {name}: {has}")


def _idle_faults(
    section: ContentNode, content: ContentNode, kind: PlantKind, name: str
) -> Iterator[Fault]:
    """Yield a stabiliser or governor in a plant where nothing feeds it, or that is not on load."""
    if kind.has_exciter and not kind.has_machine:
        yield section.fault(f"not allowed with plant {kind.name}: nothing feeds it")
    if kind.closed_loop and not _on_load(content, kind) and section.at("free").content:
        yield section.at("free").fault(f"on open circuit a {name} does not act")


def _on_load(content: ContentNode, kind: PlantKind) -> bool:
    """Tell if a unit is on load, in the plant of a case or of one of its records."""
    kinds = (kind, *map(kind_of, plants_of_records(content.content).values()))
    return any(kind.on_load for kind in kinds)


def _start_values(section: ContentNode, model: Model) -> dict[str, float] | None:
    """Return the values at which a fit starts; None where one lies outside its data sheet."""
    given = {symbol: value.number for symbol, value in section.at("parameters").sections} | {
        symbol: value.start for symbol, value in section.at("free").sections
    }
    values = typical(model.sheet)
    values |= {symbol: value for symbol, value in given.items() if value is not None}
    within = all(row.low <= values[row.symbol] <= row.high for row in model.sheet)
    return values if within else None


def _number_of_inputs(section: ContentNode, model: Model) -> Iterator[Fault]:
    """Yield inputs of another number than those of a stabiliser's model."""
    inputs = section.at("inputs")
    if isinstance(inputs.value, list) and len(inputs.value) != len(model.inputs):
        text = f"{len(inputs.value)} given; {model.name} takes {len(model.inputs)}"
        yield inputs.fault(text)


def _output_at_rest(section: ContentNode, model: Model) -> Iterator[Fault]:
    """Yield a stabiliser that moves the voltage of a unit at rest: its washout is left out."""
    from exfit.plants.controls import HEARD, rests_with_output

    values = _start_values(section, model)
    inputs = tuple(entry.text or "" for entry in section.at("inputs").entries) or model.inputs
    if values is None or not {*inputs} <= {*HEARD}:
        return
    if rests_with_output(Stabilised(model, inputs), values):
        heard = ", ".join(inputs)
        text = f"{model.name} does not rest at 0 with inputs {heard}: its washout is left out"
        yield section.at("parameters").fault(text)


def plants_of_records_faults(content: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of the plants that records have in place of the case's."""
    for place in plants_of_records(content.content):
        plant = content.at(*place)
        network = plant.at("network")
        if not kind.closed_loop:
            yield plant.fault(f"not allowed with plant {kind.name}")
        elif kind_of(plant.content).on_load and network.is_section:
            part = network_part(network.content, kind_of(plant.content), network.place)
            yield from part_faults(content, part, {}, {})


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
    """Collect by name the values that are given in several places."""
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
