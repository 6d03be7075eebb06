"""No plant: a model alone, whose output is the voltage."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.models.blocks import quadratic
from exfit.models.sheet import Model
from exfit.plants import VT0, PlantKind, compared
from exfit.plants.parts import (
    Names,
    exciter_inputs,
    exciter_output,
    exciter_parameters,
    motion,
    present,
    refuse_taken,
    rest_of,
    seconds,
    symbols,
)

OUTPUTS = ("vref", "vt")


@cache
def alone(model: Model) -> System:
    """Return a model without a plant: its output is ``vt``."""
    refuse_taken(model, OUTPUTS)

    def rest(p: Signals) -> Rest:
        u = exciter_inputs(vt=p[VT0], ifd=0.0)
        return rest_of(model, p[VT0], u, exciter_parameters(p, model, quadratic))

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        vref, d = r["vref"] + u["vref"], Names()
        output = exciter_output(model, quadratic, exciter_inputs(vref=vref), p, {**r, **x}, d)
        return motion(d, model.states, {"vref": vref, "vt": output, **x})

    return System(
        parameters=(*symbols(("", model.sheet)), VT0),
        setpoints=("vref", *model.setpoints),
        states=model.states,
        inputs=("vref",),
        outputs=(*OUTPUTS, *model.states),
        time_constants=seconds(("", model.sheet)),
        rest=rest,
        motion=equations,
    )


ALONE = PlantKind(
    name="none",
    title="the model alone",
    needs=("exciter",),
    events=("vref",),
    signals=compared(OUTPUTS),
    build=lambda equipment: alone(present(equipment.exciter)),
    per_unit=False,
)
