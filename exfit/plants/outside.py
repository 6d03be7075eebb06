"""A unit that another program simulates, of which exfit knows the names of its parameters alone."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from math import inf
from pathlib import Path
from typing import Any

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.models.sheet import Model, Parameter
from exfit.plants import VT0, PlantKind, compared
from exfit.plants.parts import present, symbols
from exfit.signals import COMPARED

STATE = "rest"  # a system has at least one; it never moves


def model_of_names(name: str, parameters: Iterable[str]) -> Model:
    """Return a model with these parameters and no data sheet; its equations are elsewhere."""
    return Model(
        name=name,
        title="the model of another program",
        drawing="",
        aliases=(),
        sheet=tuple(Parameter(symbol, 0.0, "", -inf, inf, "") for symbol in parameters),
        states=(),
        setpoints=(),
        records=(),
        inputs=(),
        equations=_nowhere,
        rest=_nowhere,
    )


def stand_in(plant: Mapping[str, Any], names: Iterable[str]) -> Model:
    """Make the stand-in of a model that is elsewhere, by the section of its plant."""
    command = plant.get("command")
    words = [str(word) for word in command] if isinstance(command, list) else []
    files = [word for word in words[1:] if not word.startswith("-")]
    words += [str(plant[key]) for key in ("file", "type") if key in plant]
    return model_of_names(Path([*files, *words][0]).stem.upper(), names)


def _nowhere(*_: Any) -> Any:
    raise NotImplementedError("the equations are those of another program")


@cache
def outside(model: Model, inputs: tuple[str, ...]) -> System:
    """Stand in for the unit: all signals stay where they are, vt at its start."""

    def rest(_: Signals) -> Rest:
        return Rest({STATE: 0.0}, {})

    def equations(p: Signals, _: Signals, x: Signals, __: Signals) -> Motion:
        signals = {**dict.fromkeys(COMPARED, 0.0), "vt": p[VT0], STATE: x[STATE]}
        return Motion({STATE: 0.0}, {}, signals)

    return System(
        parameters=(*symbols(("", model.sheet)), VT0),
        setpoints=(),
        states=(STATE,),
        inputs=inputs,
        outputs=(*COMPARED, STATE),
        time_constants=(),
        rest=rest,
        motion=equations,
    )


OUTSIDE = PlantKind(
    name="external",
    title="a unit that another program simulates",
    needs=("exciter",),
    events=("vref", "vs", "pref", "E", "angle"),
    signals=compared(COMPARED),
    build=lambda equipment: outside(present(equipment.exciter), equipment.inputs),
    has_equations=False,
)

FMU = replace(OUTSIDE, name="fmu", title="a functional mock-up unit (FMU)")
