"""The field voltage of an exciter times the speed of its machine.

A rotating exciter on the shaft gives a voltage in proportion to its speed. Some planning programs
take that into account, PSLF by the parameter ``spdmlt`` of a model; IEEE Std 421.5 does not.
"""

from dataclasses import replace
from functools import cache

from exfit.engine.trace import Signal
from exfit.models.sheet import Model

REMARK = "Here efd is multiplied by the speed of the machine (efd_times_speed)."


@cache
def times_speed(model: Model) -> Model:
    """Return an exciter whose output is the model's times ``u.speed``; its feedbacks do not see it.

    The same model gives the same exciter, which shares its machine code.
    """

    def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
        return model.equations(s, u, p, d) * u.speed

    def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
        return model.rest(efd / u.speed, u, p, x)

    drawing = f"{model.drawing}\n\n{REMARK}"
    return replace(model, drawing=drawing, equations=equations, rest=rest)
