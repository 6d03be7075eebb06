"""What contradicts itself in what is attached to a unit: stabiliser, governor, limiters."""

from collections.abc import Iterator, Mapping

import numpy as np

from exfit.case.checks.node import ContentNode
from exfit.case.parts import Parts, kind_of, plants_of_records
from exfit.case.yaml import Fault
from exfit.models.sheet import Model, typical
from exfit.plants import FURTHER, GATE, HEARD, PlantKind, Stabilised, acts_without_load, inputs_at
from exfit.plants.controls import gate_of, rests_with_output, why_no_rest
from exfit.plants.limiting import inputs_for_limiters
from exfit.plants.parts import Names
from exfit.util.text import show, show_value

HALF_LOAD = 0.5  # pu of power: within the limits of any governor
SMALL = 1e-4  # pu of speed


def equipment_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield what does not act, has other inputs than its model, or does not rest at the start."""
    plants = [kind, *map(kind_of, plants_of_records(content.content).values())]
    on_load = any(plant.on_load for plant in plants)
    off_line = kind.closed_loop and not on_load
    for name in ("stabiliser", "governor"):
        section = content.at(name)
        if section.content:
            if kind.has_exciter and not kind.has_machine:
                yield section.fault(f"not allowed with plant {kind.name}: it would have no input")
            if off_line and section.at("free").content:
                yield section.at("free").fault(f"on open circuit a {name} does not act")
    stabiliser, governor = content.at("stabiliser"), content.at("governor")
    if stabiliser.content and parts.stabiliser is not None:
        yield from _stabiliser_faults(stabiliser, parts.stabiliser, on_load)
    if governor.content and parts.governor is not None:
        yield from _governor_faults(governor, parts.governor, content)
    if "further_units" in content:
        yield from _further_unit_faults(content, parts, kind)
    if kind.has_exciter:
        yield from _limiter_faults(content, parts, off_line)


def _further_unit_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield further units of a plant without them, their stabilisers' faults, and records' names.

    A value of a record is named after it, so that it has another name than a unit.
    """
    if not kind.beside:
        yield content.at("further_units").fault(f"not allowed with plant {kind.name}")
    units = {each.prefix[:-1]: each for each in parts.further}
    for at, unit in enumerate(content.at("further_units").entries):
        own = units.get(f"{FURTHER}{at + 2}")
        if own is not None and own.stabiliser is not None:
            yield from _stabiliser_faults(unit.at("stabiliser"), own.stabiliser.model, True)
    several = (*content.at("records").entries, *content.at("validate").entries)
    for name in (recording.at("name") for recording in several):
        if name.text is not None and name.text.casefold().partition(".")[0] in units:
            yield name.fault(f"{name.text!r} is taken: names of a further unit begin with it")


def _stabiliser_faults(section: ContentNode, model: Model, on_load: bool) -> Iterator[Fault]:
    """Yield inputs of another number than the model's, and an output that moves a unit at rest."""
    inputs, values = section.at("inputs"), _start_values(section, model)
    if isinstance(inputs.value, list) and len(inputs.value) != len(model.inputs):
        text = f"{len(inputs.value)} given; {model.name} takes {len(model.inputs)}"
        yield inputs.fault(text)
        return
    heard = tuple(entry.text or "" for entry in inputs.entries) or model.inputs
    if not on_load or values is None or not {*heard} <= {*HEARD}:
        return
    if "fc" in heard and values.get("TCOMP", 0.0) <= 0.0:
        text = f"{model.name} has no TCOMP above 0, without which there is no input fc"
        yield section.at("parameters").fault(text)
    if rests_with_output(Stabilised(model, heard), values):
        rest = f"{model.name} does not rest at 0 with inputs {', '.join(heard)}"
        yield section.at("parameters").fault(f"{rest}: its washout is left out")


def _governor_faults(section: ContentNode, model: Model, content: ContentNode) -> Iterator[Fault]:
    """Yield a governor that does not hold the power at the start."""
    records = (*content.at("records").entries, *content.at("validate").entries)
    values = _start_values(section, model)
    alone = "governor" in kind_of(content.at("plant").content).needs  # it measures its own power
    for recording in (content, *records):
        channel, added = recording.at("record", "channels", GATE), recording.at("test", "fs")
        if channel.value is not None and gate_of(model) is None:
            yield channel.fault(f"{model.name} has no state that is the gate")
        waiting = section.at("load_controller") if alone else added
        if waiting.value is not None and values and _passes_speed_at_once(model, values):
            yield waiting.fault(f"the power of {model.name} must wait for its gate: give it a lag")
    nodes = (content.at("plant"), *(record.at("plant") for record in records))
    for power in dict.fromkeys(plant.at("network", "P").number for plant in nodes):
        if power is None or values is None:
            continue
        if why := why_no_rest(model, values, power):
            text = f"{model.name} does not rest at P = {show(power)} pu: {why}"
            yield section.at("parameters").fault(text)


def _passes_speed_at_once(governor: Model, values: Mapping[str, float]) -> bool:
    """Test whether the power of a governor follows its reference without any lag."""
    p, x = Names(**values), Names()
    u = Names(dw=0.0, p=np.float64(HALF_LOAD))
    with np.errstate(all="ignore"):
        pref = governor.rest(u.p, u, p, x)
        powers = [
            governor.equations(x, Names(**{**vars(u), "pref": pref + change}), p, Names())
            for change in (-SMALL, 0.0, SMALL)
        ]
    return bool(np.ptp(powers) > 0.0)


def _limiter_faults(content: ContentNode, parts: Parts, off_line: bool) -> Iterator[Fault]:
    """Yield limiters at a place that they or the exciter do not have, and what cannot be fitted."""
    exciter, by_kind = parts.exciter, {limiter.kind: limiter for limiter in parts.limiters}
    fed = frozenset() if exciter is None else inputs_for_limiters(exciter)
    for part in parts.all:
        limiter = by_kind.get(part.kind)
        if limiter is None:
            continue
        section, name = content.at(*part.section), limiter.model.name
        if limiter.place not in limiter.model.places:
            places = ", ".join(limiter.model.places)
            text = f"{show_value(limiter.place)}: {name} acts at {places}"
            yield section.at("place").fault(text)
        elif exciter is not None and (missing := {*inputs_at(limiter).values()} - fed):
            others = [
                other
                for other in limiter.model.places
                if fed.issuperset(inputs_at(limiter._replace(place=other)).values())
            ]
            word = f"{limiter.place} ({', '.join(sorted(missing))})"
            has = f"it has {', '.join(others)}"
            text = f"{exciter.name} has no input {word} for {name}: "
            text += has if others else "none of its inputs is for this limiter"
            yield section.at("place").fault(text)
        if off_line and not acts_without_load(limiter) and section.at("free").content:
            text = f"on open circuit {name} does not act: there is no current"
            yield section.at("free").fault(text)


def _start_values(section: ContentNode, model: Model) -> dict[str, float] | None:
    """Return the values at which a fit starts; None where one lies outside its data sheet."""
    given = {symbol: value.number for symbol, value in section.at("parameters").sections} | {
        symbol: value.start for symbol, value in section.at("free").sections
    }
    values = typical(model.sheet)
    values |= {symbol: value for symbol, value in given.items() if value is not None}
    within = all(row.low <= values[row.symbol] <= row.high for row in model.sheet)
    return values if within else None
