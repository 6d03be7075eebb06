"""A governor whose reference a load controller moves: one model, with the data of both."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

from exfit.models.blocks import Signal
from exfit.models.sheet import Model

CONTROLLER = "load_controller."  # how its parameters and states begin among the governor's


@cache
def controlled(governor: Model, controller: Model) -> Model:
    """Return a governor with a load controller; the same two give the same model."""
    states, setpoints = controller.states, controller.setpoints

    def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
        slopes = SimpleNamespace()
        added = controller.equations(_own(s), u, _own(p), slopes)
        _write(slopes, d)
        moved = SimpleNamespace(**{**vars(u), "pref": u.pref + added})
        return governor.equations(s, moved, p, d)

    def rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
        at = SimpleNamespace()
        added = controller.rest(0.0, u, _own(p), at)
        _write(at, x)
        return governor.rest(pm, u, p, x) - added

    rows = (row._replace(symbol=CONTROLLER + row.symbol) for row in controller.sheet)
    return replace(
        governor,
        sheet=(*governor.sheet, *rows),
        states=(*governor.states, *(CONTROLLER + name for name in states)),
        setpoints=(*governor.setpoints, *(CONTROLLER + name for name in setpoints)),
        equations=equations,
        rest=rest,
    )


def _own(values: Signal) -> SimpleNamespace:
    """Return the controller's among the values of both."""
    names = vars(values)
    return SimpleNamespace(
        **{name[len(CONTROLLER) :]: names[name] for name in names if name.startswith(CONTROLLER)}
    )


def _write(own: SimpleNamespace, to: Signal) -> None:
    """Write the controller's values among those of both."""
    for name, value in vars(own).items():
        setattr(to, CONTROLLER + name, value)
