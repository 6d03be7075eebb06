"""What contradicts itself between the plant of a case, its model and its stabiliser."""

from collections.abc import Iterator

from exfit.case.checks.model import part_faults
from exfit.case.checks.node import ContentNode
from exfit.case.parts import Parts, kind_of, network_part, plants_of_records
from exfit.case.yaml import Fault
from exfit.models.sheet import Model, typical
from exfit.plants import HEARD, PlantKind, Stabilised, rests_with_output


def model_faults(content: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield a model that is missing, or what describes one where there is none."""
    if kind.has_exciter:
        if "model" not in content:
            yield content.at("model").fault("is missing")
        return
    for key in ("model", "saturation", "efd_times_speed", "parameters", "stabiliser"):
        if key in content:
            text = f"not allowed with plant {kind.name}: it has no exciter"
            yield content.at(key).fault(text)


def stabiliser_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield a stabiliser that does not act, and inputs of another number than its model's."""
    section = content.at("stabiliser")
    if not section.content:
        return
    if kind.has_exciter and not kind.has_machine:
        yield section.fault(f"not allowed with plant {kind.name}: nothing feeds it")
    kinds = (kind, *map(kind_of, plants_of_records(content.content).values()))
    on_load = any(kind.on_load for kind in kinds)
    if kind.closed_loop and not on_load and section.at("free").content:
        yield section.at("free").fault("on open circuit a stabiliser does not act")
    if parts.stabiliser is not None:
        wrong = [*_number_of_inputs(section, parts.stabiliser)]
        yield from wrong
        if on_load and not wrong:
            yield from _output_at_rest(section, parts.stabiliser)


def _number_of_inputs(section: ContentNode, model: Model) -> Iterator[Fault]:
    """Yield inputs of another number than those of a stabiliser's model."""
    inputs = section.at("inputs")
    if isinstance(inputs.value, list) and len(inputs.value) != len(model.inputs):
        text = f"{len(inputs.value)} given; {model.name} takes {len(model.inputs)}"
        yield inputs.fault(text)


def _output_at_rest(section: ContentNode, model: Model) -> Iterator[Fault]:
    """Yield a stabiliser that moves the voltage of a unit at rest: its washout is left out."""
    given = {symbol: value.number for symbol, value in section.at("parameters").sections} | {
        symbol: value.start for symbol, value in section.at("free").sections
    }
    values = typical(model.sheet)
    values |= {symbol: value for symbol, value in given.items() if value is not None}
    inputs = tuple(entry.text or "" for entry in section.at("inputs").entries) or model.inputs
    within = all(row.low <= values[row.symbol] <= row.high for row in model.sheet)
    if within and {*inputs} <= {*HEARD} and rests_with_output(Stabilised(model, inputs), values):
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
