"""The field current on load: the textbook's closed form, and equations that are typed again."""

import csv
import warnings

import numpy as np
import pytest
from oracle import saturated
from places import REFERENCE
from scipy.optimize import brentq

from exfit.features.programme.v_curve import field_on_load
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical

P = np.array([0.0, 0.0, 0.05, 0.4, 0.8, 0.8, 0.6])
Q = np.array([0.0, 0.5, -0.3, 0.2, -0.35, 0.6, 0.0])
VT = np.array([1.0, 1.04, 0.97, 1.01, 0.96, 1.05, 1.0])
SATURATED = {"S10": 0.12, "S12": 0.45}


@pytest.fixture(params=list(MACHINES))
def machine(request):
    return MACHINES[request.param]


def salient_pole_field(xd, xq, p, q, vt):
    """Eq = Vq + Xd Id, q along V + jXq I: Fitzgerald, Kingsley, Umans: Electric Machinery, 5.6."""
    current = (p - 1j * q) / vt
    angle = np.angle(vt + 1j * xq * current)
    i_d = -np.imag(current * np.exp(-1j * angle))
    return vt * np.cos(angle) + xd * i_d


def test_without_saturation_it_is_the_salient_pole_machine_of_the_textbooks(machine):
    data = typical(machine.sheet) | {"S10": 0.0, "S12": 0.0}
    expected = salient_pole_field(data["Xd"], data["Xq"], P, Q, VT)
    assert field_on_load(machine, data, P, Q, VT) == pytest.approx(expected, abs=1e-12)


def test_at_no_load_it_is_the_saturation_curve(machine):
    data = typical(machine.sheet) | SATURATED
    none = np.zeros(2)
    ifd = field_on_load(machine, data, none, none, np.array([1.0, 1.2]))
    assert ifd == pytest.approx([1.0 + 0.12, 1.2 * (1.0 + 0.45)], abs=1e-12)


def test_without_a_voltage_there_is_no_rest(machine):
    data, vt = typical(machine.sheet) | SATURATED, np.array([0.0, 1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ifd = field_on_load(machine, data, np.array([0.2, 0.2]), np.array([0.1, 0.1]), vt)
    assert np.isfinite(ifd).tolist() == [False, True]


OF_ANDES = {
    "Tpd0": 6.27, "Tppd0": 0.059, "Tpq0": 0.7, "Tppq0": 0.096, "H": 4.471, "D": 0.0,
    "Xd": 2.014, "Xq": 1.96, "Xpd": 0.331, "Xpq": 0.466, "Xppd": 0.2059, "Xl": 0.129,
    "S10": 0.14, "S12": 0.56,
}  # fmt: skip


@pytest.mark.parametrize("name", ["ieee", "openipsl"])
def test_a_saturated_machine_on_load_rests_as_another_simulator_has_it(name):
    """ANDES 2.0.0, GENROU behind a reactance: the first row of its run, to the digits printed."""
    with (REFERENCE / f"andes_ac8b_{name}_smib.csv").open() as file:
        first = next(csv.DictReader(file))
    p, q, vt, ifd = (float(first[column]) for column in ("pe", "qe", "vt", "xadifd"))
    ours = field_on_load(MACHINES["GENROU"], OF_ANDES, [p], [q], [vt])
    assert ours == pytest.approx([ifd], abs=5e-7)


def quadratic_excess(flux):
    """PSS/E: B (flux - A)^2 / flux of the flux, through S10 at 1.0 and S12 at 1.2."""
    root = np.sqrt(SATURATED["S10"] / (1.2 * SATURATED["S12"]))
    a = (1.0 - 1.2 * root) / (1.0 - root)
    b = SATURATED["S10"] / (1.0 - a) ** 2
    return b * max(flux - a, 0.0) ** 2 / flux


def power_excess(flux):
    """PSS/E's exponential form: S10 flux^n, as a share of the flux."""
    return SATURATED["S10"] * flux ** (np.log(SATURATED["S12"] / SATURATED["S10"]) / np.log(1.2))


def balanced_field(name, data, p, q, vt):
    """The field by the machine's fluxes at rest, the angle found by a root search (Kundur 3.6)."""
    current = (p - 1j * q) / vt
    xl, xpp = data.get("Xl", 0.0), data.get("Xppd", data["Xpd"])
    excess = power_excess if name in ("GENROE", "GENSAE") else quadratic_excess
    of_flux = name in ("GENROU", "GENROE", "GENSAE")

    if name in ("GENTPJ", "GENQEC", "GENQEJ"):
        share = excess(abs(vt + 1j * xl * current) + data.get("Kis", 0.0) * abs(current))
        q_share = share * data["Xq"] / data["Xd"] if name == "GENTPJ" else share
        x_q = (data["Xq"] - xl) / (1.0 + q_share) + xl
        turned = current * np.exp(-1j * np.angle(vt + 1j * x_q * current))
        behind = abs(vt + 1j * x_q * current) - turned.imag * ((data["Xd"] - xl) / (1.0 + share))
        field = (1.0 + share) * (behind - turned.imag * (xl - x_q))
        return field / (1.0 + data.get("Kw", 0.0) * turned.imag)

    def along(angle):
        at = np.exp(-1j * angle)
        v, i = vt * at, current * at  # real part along q, minus imaginary part along d
        return v.real, -v.imag, i.real, -i.imag

    def off_axis(angle):
        """Vd = Xq Iq less what saturation takes: zero where the angle is that of the q axis."""
        _, v_d, i_q, i_d = along(angle)
        if not of_flux:
            return v_d - data["Xq"] * i_q
        psi_q, psi_d = v_d - xpp * i_q, along(angle)[0] + xpp * i_d
        share = excess(np.hypot(psi_q, psi_d)) * (data["Xq"] - xl) / (data["Xd"] - xl)
        return v_d - data["Xq"] * i_q + share * psi_q

    angle = brentq(off_axis, -0.4, 1.5, xtol=1e-15)
    v_q, v_d, i_q, i_d = along(angle)
    if of_flux:
        psi_q, psi_d = v_d - xpp * i_q, v_q + xpp * i_d
        return v_q + data["Xd"] * i_d + excess(np.hypot(psi_q, psi_d)) * psi_d
    flux = v_q + data["Xpd"] * i_d
    return v_q + data["Xd"] * i_d + excess(flux) * flux


def test_saturated_it_is_the_same_equations_typed_a_second_time(machine):
    data = saturated(machine) | SATURATED
    expected = [balanced_field(machine.name, data, *point) for point in zip(P, Q, VT, strict=True)]
    assert field_on_load(machine, data, P, Q, VT) == pytest.approx(expected, abs=1e-10)
