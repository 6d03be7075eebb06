"""What contradicts itself in a case though every single value has the right form."""

import re
from collections.abc import Iterator
from typing import Any

from exfit import registry
from exfit.case.checks.bump_test import (
    bump_test_faults,
    driving_signals,
    findable_faults,
    missing_without_record,
    reference_faults,
)
from exfit.case.checks.model import parameter_faults, part_faults
from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import (
    channel_faults,
    channels_faults,
    name_faults,
    record_faults,
    weight_faults,
)
from exfit.case.parts import ANY_PLANT, Parts, kind_of, network_part, plants_of_records
from exfit.case.ties import Ties
from exfit.case.yaml import Fault
from exfit.plants import BREAKER, GATE, KINDS, OF_GOVERNOR, REFERENCES, PlantKind
from exfit.util.vocabulary import DEFAULT_SEARCH

OF_EXCITER = ("model", "saturation", "efd_times_speed", "stabiliser", "governor")
EQUIPMENT = ("stabiliser", "governor", "limiters", "further_units")
# key under estimate -> the key that decides on its use, the values without one, the others
NEEDS = {
    ("difference_step",): (("jacobian",), ("exact",), "central, forward or backward"),
    ("differences",): (("jacobian",), ("exact",), "central, forward or backward"),
    ("lm", "nu_min"): (("lm", "update"), ("radius", "armijo"), "ratio"),
    ("starts",): (("search",), ("local",), "global"),
    ("loss_scale",): (("loss",), ("least-squares",), "huber or soft-l1"),
}
USUAL = {"jacobian": "exact", "update": "radius", "search": DEFAULT_SEARCH, "loss": "least-squares"}


def states_more(content: dict[str, Any]) -> bool:
    """Tell whether content may have sources, standard errors or a model as found."""
    return re.search(r"'(value|sources?|std_errors?|as_found)':", str(content)) is not None


def contradictions(plain: dict[str, Any], parts: Parts, ties: Ties) -> Iterator[Fault]:
    """Yield the faults of a case file's content beyond its form.

    A value of the wrong form is left to the schema and skipped here.
    """
    content = ContentNode((), plain)
    kind = kind_of(content.at("plant").content)
    several = [entry for key in ("records", "validate") for entry in content.at(key).entries]
    yield from _plant_faults(content, several, kind)
    yield from parameter_faults(content, parts, ties)
    if kind.has_equations and any(key in content for key in EQUIPMENT):
        from exfit.case.checks.equipment import equipment_faults

        yield from equipment_faults(content, parts, kind)
    yield from _tests_faults(content, several, kind)
    driven = [(recording, _driving(recording, kind)) for recording in (content, *several)]
    balanced = content.at("estimate").content.get("weights") == "balanced"
    yield from weight_faults(driven, balanced)
    yield from name_faults(several)
    yield from _estimate_faults(content, parts)
    if states_more(plain):
        from exfit.case.checks.stated import stated_faults

        yield from stated_faults(content, parts, kind)
    node = content.at("plant", "type")
    if not KINDS.get(str(node.value), ANY_PLANT).has_equations:
        faults = registry.parts("FAULTS").get(str(node.value))
        if faults is None:
            text = f"{node.value}: its feature is not installed"
            yield node.fault(text)
        else:
            yield from faults.load()(content, parts)


def _tests_faults(
    content: ContentNode, several: list[ContentNode], kind: PlantKind
) -> Iterator[Fault]:
    """Yield tests that are missing, one beside several records, and what is wrong with each."""
    alone = "record" not in content and bool(content.at("validate").entries)  # nothing is fitted
    own_test = [] if "records" in content or alone else [content]
    for recording in (*own_test, *several):
        if "test" not in recording and recording.is_section and not kind.finds_rest:
            yield recording.at("test").fault("is missing")
    if "records" in content:
        for node in (content.at("test"), content.at("record")):
            if node.value is not None:
                yield node.fault("not allowed with records: each of them has its own")
    else:
        yield from _recording_faults(content, content, kind)
        if own_test and "record" not in content and not kind.plays_back:
            yield from missing_without_record(content.at("test"))
    for recording in several:
        yield from _recording_faults(recording, content, kind)


def _plant_faults(
    content: ContentNode, several: list[ContentNode], kind: PlantKind
) -> Iterator[Fault]:
    """Yield a plant that nothing here simulates, and what its kind needs or does not allow."""
    plant = content.at("plant")
    for key in ("type", "twin"):
        if key in plant and str(plant.at(key).value) not in KINDS:
            text = f"{plant.at(key).value}: this installation of exfit has no such plant"
            yield plant.at(key).fault(f"{text}; it has {', '.join(KINDS)}")
    if not kind.has_equations:
        for key in OF_EXCITER:
            if key in content:
                yield content.at(key).fault("only with plant.twin: the program has its own")
    elif kind.has_exciter:
        if "model" not in content:
            yield content.at("model").fault("is missing")
    else:
        yield from _faults_without_exciter(content, kind)
    for place in plants_of_records(content.content):
        own = content.at(*place)
        network, own_kind = own.at("network"), kind_of(own.content)
        if not kind.closed_loop:
            yield own.fault(f"not allowed with plant {kind.name}")
        elif own_kind.on_load and network.is_section:
            part = network_part(network.content, own_kind, place)
            yield from part_faults(content, part, {}, {})


def _faults_without_exciter(content: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield what such a plant needs, and what it does not allow."""
    for key in (*OF_EXCITER, "parameters", "limiters"):
        if key in kind.needs:
            if not content.at(key).content:
                yield content.at(key).fault(f"is missing: plant {kind.name} needs it")
        elif key in content:
            text = f"not allowed with plant {kind.name}: it has no exciter"
            yield content.at(key).fault(text)


def _kind(recording: ContentNode, kind: PlantKind) -> PlantKind:
    """Return the kind of plant of a record: its own, or else that of the case."""
    plant = recording.at("plant")
    return kind_of(plant.content) if "type" in plant else kind


def _driving(recording: ContentNode, kind: PlantKind) -> tuple[str, ...]:
    """Return the signals of a record that drive its simulation."""
    kind = _kind(recording, kind)
    after_opening = driving_signals(recording.at("test"), recording.at("record"), kind)
    return (*kind.driving, *kind.recorded_inputs, *after_opening)


def _recording_faults(
    recording: ContentNode, content: ContentNode, kind: PlantKind
) -> Iterator[Fault]:
    """Check a test together with its record; a single one is the whole content."""
    own, kind = recording.at("plant", "network"), _kind(recording, kind)
    network = own if own.content else content.at("plant", "network")
    test, record = recording.at("test"), recording.at("record")
    has_record = "record" in recording
    yield from bump_test_faults(test, network, kind)
    yield from findable_faults(test, record, kind, has_record)
    if BREAKER in test or kind.events == (BREAKER,):
        from exfit.case.checks.breaker import breaker_faults

        yield from breaker_faults(test, record, kind)
    yield from reference_faults(test, record, kind, has_record)
    for signal in REFERENCES:
        if "file" in test.at(signal):
            yield from channel_faults(signal, test.at(signal), kind.per_unit)
    if not content.at("governor").content and "governor" not in kind.needs:
        yield from _faults_without_governor(test, record, kind)
    if not has_record:
        if kind.plays_back:
            yield record.fault(f"is missing: plant {kind.name} plays it back")
        return
    yield from record_faults(test, record, "governor" not in kind.needs)
    fits = _fits(content)
    yield from channels_faults(record, own, kind, fits or not kind.finds_rest)
    if kind.plays_back and "vs" in record.at("channels") and content.at("stabiliser").content:
        text = "not allowed with a stabiliser, whose output it is: leave one of them out"
        yield record.at("channels", "vs").fault(text)


def _faults_without_governor(
    test: ContentNode, record: ContentNode, kind: PlantKind
) -> Iterator[Fault]:
    """Yield what acts on a governor, or shows it, where there is none."""
    channels = record.at("channels")
    for place in (*map(test.at, OF_GOVERNOR), *map(channels.at, (*OF_GOVERNOR, GATE))):
        if place.value is not None and kind.has_equations:
            yield place.fault("needs a governor: there is none")


def _fits(content: ContentNode) -> bool:
    """Tell if a parameter of any part is free."""
    sections = [*(part for _, part in content.sections), *content.at("limiters").entries]
    sections += [part for unit in content.at("further_units").entries for _, part in unit.sections]
    return any(x.at("free").content or x.at("load_controller", "free").content for x in sections)


def _estimate_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield settings that nothing uses, and bounds that are missing where starts are spread."""
    estimate = content.at("estimate")
    simulation = content.at("simulation")
    if simulation.at("accuracy").value is not None and simulation.at("step").number is not None:
        yield simulation.at("accuracy").fault("only with simulation.step: auto")
    for place, (deciding, idle, others) in NEEDS.items():
        given = estimate.at(*deciding).value or USUAL[deciding[-1]]
        if estimate.at(*place).value is not None and given in idle:
            yield estimate.at(*place).fault(f"only with estimate.{'.'.join(deciding)}: {others}")
    starts = estimate.at("starts").number
    if starts is None or estimate.at("search").value == "local":
        return
    for part in parts.all:
        for _, parameter in () if part.free is None else content.at(*part.free).sections:
            for bound in ("min", "max"):
                if parameter.is_section and bound not in parameter:
                    text = "is missing: estimate.starts distributes"
                    yield parameter.at(bound).fault(f"{text} {starts:g} starts over the bounds")
