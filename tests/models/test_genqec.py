"""The forms of the saturation of GENQEC and GENQEJ."""

from math import log, sqrt
from types import SimpleNamespace

import pytest

from exfit.models.machines import genqec

S10, S12 = 0.12, 0.45
FLAGS = (0, 1, 2)


def saturation(flag, flux):
    """Return the saturation of GENQEC at a flux."""
    values = SimpleNamespace(S10=S10, S12=S12, SATFLG=float(flag))
    return genqec.by_flux(flux, 0.0, values)


def by_hand(flag, flux):
    """Return it as the specification has it: S10 f^X, B (f - A)^2 / f, B (f - A)^2."""
    if flag == 0:
        return S10 * flux ** (log(S12 / S10) / log(1.2))
    root = sqrt((1.2 if flag == 1 else 1.0) * S12 / S10)
    knee = (root - 1.2) / (root - 1.0)
    squared = S10 / (1.0 - knee) ** 2 * max(flux - knee, 0.0) ** 2
    return squared / flux if flag == 1 else squared


@pytest.mark.parametrize("flag", FLAGS)
@pytest.mark.parametrize("flux", [0.5, 1.0, 1.1, 1.2, 1.3])
def test_each_flag_has_its_form_through_both_points(flag, flux):
    assert saturation(flag, flux) == pytest.approx(by_hand(flag, flux), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("changed", "symbol"), [({"SATFLG": 0.5}, "SATFLG"), ({"SATFLG": 0.0}, "S10")]
)
def test_a_flag_that_is_none_and_a_power_of_nothing_are_faults(changed, symbol):
    values = {row.symbol: row.typical for row in genqec.GENQEC.sheet}
    faults = dict(genqec.faults(values | {"S10": 0.0, "S12": 0.3} | changed))
    assert symbol in faults
