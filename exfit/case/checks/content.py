"""What contradicts itself in a case though every single value has the right form."""

from collections.abc import Iterator
from typing import Any

from exfit import registry
from exfit.case.checks.breaker import breaker_faults, driving_signals
from exfit.case.checks.bump_test import bump_test_faults, missing_without_record
from exfit.case.checks.model import as_found_faults, parameter_faults
from exfit.case.checks.node import ContentNode
from exfit.case.checks.nuisance import nuisance_faults
from exfit.case.checks.plant import (
    governor_faults,
    limiter_faults,
    model_faults,
    plant_faults,
    plants_of_records_faults,
    source_faults,
    stabiliser_faults,
)
from exfit.case.checks.record import (
    channels_faults,
    event_faults,
    level_faults,
    name_faults,
    noise_faults,
    record_faults,
    recorded_reference_faults,
    stabiliser_channel_faults,
    weight_faults,
)
from exfit.case.parts import ANY_PLANT, Parts, kind_of
from exfit.case.ties import Ties
from exfit.case.yaml import LONGEST_WHOLE, Fault
from exfit.plants import KINDS, PlantKind
from exfit.util.strategies import DEFAULT_SEARCH

WITH_PARAMETERS = ("parameters", "plant", "stabiliser", "governor")


def contradictions(plain: dict[str, Any], parts: Parts, ties: Ties) -> Iterator[Fault]:
    """Yield the faults of a case file's content beyond its form.

    A value of the wrong form is left to the schema and skipped here.
    """
    content = ContentNode((), plain)
    kind = kind_of(content.at("plant").content)
    several = [entry for key in ("records", "validate") for entry in content.at(key).entries]
    yield from plant_faults(content.at("plant"))
    yield from model_faults(content, kind)
    yield from parameter_faults(content, parts, ties)
    if kind.has_equations:
        yield from stabiliser_faults(content, parts, kind)
        yield from governor_faults(content, parts, kind)
        yield from limiter_faults(content, parts, kind)
    yield from source_faults(content, parts, kind)
    yield from plants_of_records_faults(content, kind)
    if not KINDS.get(str(content.at("plant", "type").value), ANY_PLANT).has_equations:
        yield from _faults_elsewhere(content, parts)
    yield from _missing_test_faults(content, kind)
    if "records" not in content:
        yield from _recording_faults(content, content, kind)
    for recording in several:
        yield from _recording_faults(recording, content, kind)
    driven = [(recording, _driving(recording, kind)) for recording in (content, *several)]
    yield from noise_faults(driven)
    if content.at("estimate").content.get("weights") == "balanced":
        yield from weight_faults([content, *content.at("records").entries])
    yield from name_faults(several)
    yield from _estimate_faults(content)
    yield from _starts_faults(content, parts)
    yield from as_found_faults(content, parts)
    yield from _fact_faults(content.at("about"))


def _faults_elsewhere(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Check a plant that exfit does not simulate."""
    kind = content.at("plant", "type")
    faults = registry.parts("FAULTS").get(str(kind.value))
    if faults is None:
        yield kind.fault(f"{kind.value}: nothing here can run it: that feature is not installed")
    else:
        yield from faults.load()(content, parts)


def _fact_faults(about: ContentNode) -> Iterator[Fault]:
    """Yield facts that are numbers of more digits than a number keeps, as a serial number."""
    for key, fact in about.numbers.items():
        if abs(fact) >= 10.0**LONGEST_WHOLE:
            text = f"more than {LONGEST_WHOLE} digits are not kept; put the number in quotes"
            yield about.at(key).fault(text)


def _missing_test_faults(content: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield tests that are missing, and one that is given beside several records."""
    several = (*content.at("records").entries, *content.at("validate").entries)
    own_test = "records" not in content and not _validates_alone(content)
    for recording in (content, *several) if own_test else several:
        if "test" not in recording and recording.is_section and not kind.finds_rest:
            yield recording.at("test").fault("is missing")
    if "records" not in content:
        return
    for key in ("test", "record"):
        if key in content:
            yield content.at(key).fault("not allowed with records: each of them has its own")


def _validates_alone(content: ContentNode) -> bool:
    """Tell if a case has records under validate, and none to fit."""
    return "record" not in content and bool(content.at("validate").entries)


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
    plant, kind = recording.at("plant"), _kind(recording, kind)
    network = plant.at("network") if plant.at("network").content else content.at("plant", "network")
    test, record = recording.at("test"), recording.at("record")
    has_record = "record" in recording
    yield from bump_test_faults(test, network, kind)
    yield from event_faults(test, record, kind)
    yield from nuisance_faults(test, record, kind, has_record)
    yield from breaker_faults(test, record, kind)
    yield from recorded_reference_faults(test, record, kind, has_record)
    if has_record:
        yield from record_faults(test, record)
        sections = [*map(content.at, WITH_PARAMETERS), *content.at("limiters").entries]
        fits = any(section.at("free").content for section in sections)
        yield from channels_faults(record.at("channels"), kind, fits or not kind.finds_rest)
        yield from stabiliser_channel_faults(record.at("channels"), content.at("stabiliser"), kind)
        yield from level_faults(record.at("channels"), plant.at("network"), kind)
    elif kind.plays_back:
        yield record.fault(f"is missing: plant {kind.name} plays it back")
    elif recording is content and not _validates_alone(content):
        yield from missing_without_record(test)


def _estimate_faults(content: ContentNode) -> Iterator[Fault]:
    """Yield settings that nothing uses."""
    estimate = content.at("estimate")
    jacobian = estimate.content.get("jacobian", "exact")
    for key in ("difference_step", "differences"):
        if key in estimate and jacobian == "exact":
            differences = "central, forward or backward"
            yield estimate.at(key).fault(f"only with estimate.jacobian: {differences}")
    update = estimate.at("lm").content.get("update", "radius")
    if "nu_min" in estimate.at("lm") and update in ("radius", "armijo"):
        yield estimate.at("lm", "nu_min").fault("only with estimate.lm.update: ratio")
    if "starts" in estimate and estimate.content.get("search", DEFAULT_SEARCH) == "local":
        yield estimate.at("starts").fault("only with estimate.search: global")
    if (
        "loss_scale" in estimate
        and estimate.content.get("loss", "least-squares") == "least-squares"
    ):
        yield estimate.at("loss_scale").fault("only with estimate.loss: huber or soft-l1")


def _starts_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield the bounds that are missing where starts are spread between them."""
    starts = content.at("estimate", "starts").number
    if starts is None or content.at("estimate").content.get("search") == "local":
        return
    for part in parts.all:
        for _, parameter in () if part.free is None else content.at(*part.free).sections:
            for bound in ("min", "max"):
                if parameter.is_section and bound not in parameter:
                    text = (
                        f"is missing: estimate.starts distributes {starts:g} starts over the bounds"
                    )
                    yield parameter.at(bound).fault(text)
