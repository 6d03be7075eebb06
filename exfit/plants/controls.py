"""Governor and stabiliser, which control a unit on load: their inputs, their state of rest."""

from collections.abc import Mapping

import numpy as np

from exfit.engine.system import Signals
from exfit.engine.trace import Signal
from exfit.models.blocks import Limited
from exfit.models.governor_parts import AT_LIMIT
from exfit.models.sheet import Model
from exfit.plants import GATE, GOVERNOR, Stabilised
from exfit.plants.parts import Names, output_of
from exfit.util.text import show

ROUNDING_AT_REST = 1e-9  # pu/s
# the state that is the opening of a gate or a (fuel) valve, pu, where GATE and VALVE are not
GATES = {"GAST": "V1", "GAST2A": "VALVE", "GASTWD": "VALVE", "HYGOV": "G", "TGOV1": "V1"}


def gate_of(governor: Model) -> str | None:
    """Return the state of a governor that is the opening of its gate, None where none is."""
    states = (name for name in ("GATE", "VALVE") if name in governor.states)
    return GATES.get(governor.name) or next(states, None)


def gate(governor: Model | None, state: Signals) -> dict[str, Signal]:
    """Return the opening of the gate under its name; nothing where no state is one."""
    own = None if governor is None else gate_of(governor)
    return {} if own is None else {GATE: state[GOVERNOR + own]}


def turbine_power(
    governor: Model, seen: Names, fs: Signal, p: Signals, state: Signals, d: Names
) -> Signal:
    """Write the slopes of a governor into ``d`` and return Pm.

    The signal ``fs`` is added to the speed that the governor measures, and not to the speed by
    which the turbine's power falls (Dt, Dturb): the output is read at the speed itself. For that
    the power must wait for the gate, see `case.checks.equipment`.
    """
    measured = Names(**{**vars(seen), "dw": seen.dw + fs})
    power = output_of(GOVERNOR, governor, measured, p, state, d)
    if isinstance(fs, float):
        return power
    return output_of(GOVERNOR, governor, seen, p, state, Names())


def why_no_rest(governor: Model, values: Mapping[str, float], power: float) -> str | None:
    """Name the limits that keep a governor with these values from holding a power at rest."""
    p, x, d = Names(**values), Names(), Names()
    u = Names(dw=0.0, p=np.float64(power))
    with np.errstate(all="ignore"):
        u.pref = governor.rest(u.p, u, p, x)
        governor.equations(x, u, p, d)
    slopes = [slope.slope if isinstance(slope, Limited) else slope for slope in vars(d).values()]
    if np.all(np.abs(slopes) <= ROUNDING_AT_REST):
        return None
    starts = {name.removesuffix("0"): getattr(x, name) for name in governor.setpoints}
    passed = [
        f"{symbol} = {show(values[symbol])} where it needs {start:.6g}"
        for symbol, start in starts.items()
        if symbol in values and abs(start - values[symbol]) > AT_LIMIT
    ]
    return ", ".join(passed) or "one of its limits is in the way"


def listening(stabiliser: Stabilised, heard: Names) -> Names:
    """Inputs of a stabiliser, ``vsi1`` and ``vsi2``; of the speed, its deviation.

    The power ``p`` and the voltage ``vt`` are there too: some are switched by one of them, whatever
    they listen to.
    """
    inputs = {f"vsi{k}": getattr(heard, of) for k, of in enumerate(stabiliser.inputs, 1)}
    return Names(p=heard.p, vt=heard.vt, **inputs)


def rests_with_output(stabiliser: Stabilised, values: Mapping[str, float]) -> bool:
    """Test whether a stabiliser with these values has an output while its unit is at rest."""
    model, p, x = stabiliser.model, Names(**values), Names()
    seen = listening(stabiliser, Names(speed=0.0, p=1.0, vt=1.0, pa=0.0, fc=0.0, none=0.0))
    model.rest(0.0, seen, p, x)
    return bool(abs(model.equations(x, seen, p, Names())) > ROUNDING_AT_REST)
