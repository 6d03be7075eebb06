"""The exciters of IEEE Std 421.5-2016 are those of 2005 while what was added does nothing."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pytest
from on_load import system, values_on_load
from oracle import system_of, typical_values

from exfit.models.machines import MACHINES
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

NONE = 9999.0  # pu: a limit that is never met


class Form(NamedTuple):
    """The form of 2005 of an exciter, and what makes the new one equal to it.

    ``held`` are values of the new exciter, ``symbols`` its symbols of old quantities, ``changes``
    values of the old one that are not the typical ones.
    """

    name: str
    held: Mapping[str, float]
    symbols: Mapping[str, str] = MappingProxyType({})
    changes: Mapping[str, float] = MappingProxyType({})


SUPPLY = {"SW1": 2.0, "KP": 1.0, "KC1": 0.0, "VBMAX": NONE}  # of one, whatever happens
LOOP = {"SW1": 1.0, "VAMAX": NONE, "VAMIN": -NONE}  # from the terminals, no further limit
EFE = {"EFEMAX": "VRMAX", "EFEMIN": "VRMIN"}
VA = {"VAMAX": "VRMAX", "VAMIN": "VRMIN"}
FIELD = {"VFEMAX": NONE, "VEMIN": 0.0}
PID = {"KPR": "KP", "KIR": "KI", "KDR": "KD", "TDR": "TD"}
BETWEEN = {"VEMAX": NONE, "VEMIN": 0.0}  # the floor of 2005, and no ceiling
FROM_VT = {"SW1": 1.0, "KP": 1.0, "KI": 0.0, "XL": 0.0, "KC": 0.0, "VBMAX": NONE}
FROM_VT |= {"VMMAX": NONE, "VMMIN": -NONE}  # the supply VT itself, no further limit
GAIN = {"KPR": 1.0, "KIR": 0.0, "KDR": 0.0, "VPIDMAX": NONE, "VPIDMIN": -NONE}
# the changes: lags that typical data leave out
LAGS = {"TR": 0.02, "TB": 0.3, "TC": 0.1}
FORMS = {
    "DC1C": Form("DC1A", BETWEEN, changes=LAGS),
    "DC2C": Form("DC2A", BETWEEN, changes=LAGS),
    # DC4B multiplies with the voltage before the lag TA, DC4C behind it
    "DC4C": Form("DC4B", SUPPLY | {"SW1": 1.0, "KI": 0.0}, PID, {"TR": 0.02, "TA": 0.0}),
    "AC1C": Form("AC1A", FIELD, EFE, LAGS),
    "AC2C": Form("AC2A", {"VEMIN": 0.0}, EFE, LAGS),
    "AC3C": Form("AC3A", {"KIR": 0.0, "VPIDMAX": NONE, "VPIDMIN": -NONE}, changes=LAGS),
    "AC4C": Form("AC4A", {}, changes={"TR": 0.02, "KC": 0.1}),
    "AC5C": Form("AC5A", FIELD | {"KC": 0.0, "KD": 0.0}, VA, {"TR": 0.02, "TF3": 0.3}),
    "AC6C": Form("AC6A", FIELD, EFE),
    "AC7C": Form("AC7B", {"KC1": 0.0, "VBMAX": NONE}, changes={"KDR": 0.1, "KF3": 0.02}),
    "AC8C": Form("AC8B", SUPPLY, changes={"TR": 0.02, "TA": 0.05}),
    "ST1C": Form("ST1A", {}, changes={"TA": 0.02, "KF": 0.01}),
    "ST2C": Form("ST2A", {**GAIN, "XL": 0.0, "THETAP": 0.0, "VBMAX": NONE}, changes={"KC": 0.3}),
    "ST3C": Form("ST3A", {**GAIN, "SW1": 1.0}, changes={"TA": 0.02}),
    "ST4C": Form("ST4B", {**LOOP, "TG": 0.0, "VGMAX": NONE}, changes={"TA": 0.0, "KG": 0.5}),
    "ST5C": Form("ST5B", {}),
    "ST6C": Form("ST6B", {**FROM_VT, "TA": 0.0}, changes={"ILR": 99.0}),
    "ST7C": Form("ST7B", {"TA": 0.0}, changes={"TC": 1.2, "TB": 0.9}),
}


def values_of(form, old):
    """Return the values that make an exciter of 2016 equal to that of 2005."""
    renamed = {new: old[symbol] for new, symbol in form.symbols.items()}
    kept = {symbol: value for symbol, value in old.items() if symbol not in form.symbols.values()}
    return {**kept, **renamed, **form.held}


@pytest.mark.parametrize("name", FORMS)
def test_it_is_that_of_2005_over_large_steps_on_open_circuit(name):
    """Of both signs, so that the ceilings and the floors are met."""
    form = FORMS[name]
    old = {**typical_values(form.name), **form.changes}
    new = typical_values(name) | values_of(form, old)
    steps = (InputStep(0.1, 0.2), InputStep(1.5, -0.3), InputStep(3.0, 0.1))
    compare(system_of(form.name), old, system_of(name), new, Inputs(0.0, 5.0, steps))


@pytest.mark.parametrize("name", FORMS)
def test_it_is_that_of_2005_over_a_dip_on_load(name):
    form = FORMS[name]
    machine = MACHINES["GENROU"]
    old = {**values_on_load(machine, exciter=form.name), **form.changes}
    new = values_on_load(machine, exciter=name) | values_of(form, old)
    dip = (InputStep(0.2, -0.3, "E", ramp=0.05), InputStep(0.5, 0.3, "E", ramp=0.05))
    built = [system(machine, exciter=each) for each in (form.name, name)]
    compare(built[0], old, built[1], new, Inputs(0.0, 2.0, dip))


def compare(old_system, old, new_system, new, inputs):
    """Assert that two systems respond alike, and much."""
    times = np.linspace(0.0, inputs.end, 501)

    def response(built, values):
        own = {symbol: values[symbol] for symbol in built.parameters}
        return Simulator(built, inputs, times, 1e-3).response(own, ("vt", "efd", "vref")).signals

    expected, signals = response(old_system, old), response(new_system, new)
    assert np.ptp(expected["efd"]) > 0.5
    for name in ("vt", "efd", "vref"):
        # the same equations, in other words at most: rounding
        assert np.abs(signals[name] - expected[name]).max() < 1e-9, name
