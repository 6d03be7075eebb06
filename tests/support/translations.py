"""Results of fits that were never made: an exciter with any values on a machine."""

from dataclasses import replace

from cases import FIRST_ORDER, TIME, TRUTH

import exfit
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.util.vocabulary import TYPICAL

MACHINE = {
    "Tpd0": 6.0, "Tppd0": 0.035, "Xd": 1.8, "Xpd": 0.3, "Xppd": 0.25, "Xl": 0.2, "S10": 0.12,
    "S12": 0.4,
}  # fmt: skip
NETWORK = {"f0": 60.0, "R": 0.0, "X": 0.3, "Ra": 0.0, "Rc": 0.0, "Xc": 0.0, "P": 0.8, "Q": 0.1}
NO_LIMITS = {"VAMAX": 99.0, "VAMIN": -99.0, "VRMAX": 99.0, "VRMIN": -99.0}


def any_fit():
    """Return a fit of the smallest case."""
    record = exfit.Record.from_arrays(TIME, {"vt": TRUTH})
    content = {**FIRST_ORDER, "record": {"channels": {"vt": "vt"}}}
    return exfit.fit(exfit.Case.from_dict(content, record))


def fit_of(fit, model, machine="GENROU", network=None, **values):
    """Return a fit as if it had found an exciter's values, typical unless given."""
    own = {**typical(MODELS[model].sheet), **values}
    return replace(
        fit,
        model=model,
        parameters={},
        fixed=own,
        sources={name: TYPICAL for name in own if name not in values},
        machine={**typical(MACHINES[machine].sheet), **MACHINE},
        machine_model=machine,
        network=network or {},
        network_model="the network" if network else None,
    )
