"""A unit's tests at rest and its load rejection, from equations typed for them alone.

``python tests/support/programme_records.py`` writes sample_data/programme_*.csv anew: the machine
of configs/ac8b_unit1.yaml, whose q axis has Xq = 1.72, of 120 MVA and 13.8 kV; 1 pu of field
current is 850 A. Saturation is B (flux - A)^2 of the flux. The rejection is that of
`typed_rejection`: at Q = -0.3 pu with a constant field voltage.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from typed_rejection import Load, recorded_rejection

SAMPLES = Path(__file__).parents[2] / "sample_data"
XD, XQ, XPPD, XL = 1.8, 1.72, 0.25, 0.2  # pu
S10, S12 = 0.12, 0.4
BASE, KILOVOLTS, MVA = 850.0, 13.8, 120.0  # A, kV, MVA
LOOP = 0.02  # pu, between rising and falling branch
READING = 1e-3  # of a reading: the class of the instruments
SEED = 15
UNIT = {
    "Tpd0": 6.0, "Tppd0": 0.035, "Tpq0": 0.7, "Tppq0": 0.08, "H": 3.5, "D": 0.0, "Xd": XD,
    "Xq": XQ, "Xpd": 0.3, "Xpq": 0.5, "Xppd": XPPD, "Xl": XL, "S10": S10, "S12": S12,
}  # fmt: skip
TIME = np.round(np.arange(0.0, 6.0, 0.01), 2)  # s, of the rejection
OPENS, NOISE = 1.003, 2e-4  # s, pu


def excess(flux):
    """Return what saturation adds to the field current (pu) at a flux: S10 at 1.0, S12 at 1.2."""
    root = np.sqrt(S10 / (1.2 * S12))
    knee = (1.0 - 1.2 * root) / (1.0 - root)
    return S10 / (1.0 - knee) ** 2 * np.maximum(flux - knee, 0.0) ** 2


def field_on_load(p, q, vt):
    """Return the field current (pu) that holds a round-rotor machine at rest, by its fluxes."""
    current = (p - 1j * q) / vt

    def axes(angle):
        v, i = vt * np.exp(-1j * angle), current * np.exp(-1j * angle)
        v_d, v_q, i_d, i_q = -v.imag, v.real, -i.imag, i.real
        psi_d, psi_q = v_q + XPPD * i_d, v_d - XPPD * i_q
        share = excess(np.hypot(psi_d, psi_q)) / np.hypot(psi_d, psi_q)
        return v_d, v_q, i_d, i_q, psi_d, psi_q, share

    def off_axis(angle):
        v_d, _, _, i_q, _, psi_q, share = axes(angle)
        return v_d - XQ * i_q + share * (XQ - XL) / (XD - XL) * psi_q

    _, v_q, i_d, _, psi_d, _, share = axes(brentq(off_axis, -0.4, 1.5, xtol=1e-14))
    return v_q + XD * i_d + share * psi_d


def saturation_rows(rng):
    """Return kV and A of points up to 1.2 pu and down again."""
    up, down = np.linspace(0.2, 1.2, 11), np.linspace(1.15, 0.25, 7)
    vt = np.concatenate([up, down])
    branch = np.repeat([1.0, -1.0], [len(up), len(down)])
    ifd = vt + excess(vt) + 0.5 * LOOP * branch
    return np.stack([read(KILOVOLTS * vt, rng), read(BASE * ifd, rng)], axis=1)


def v_curve_rows(rng):
    """Return MW, Mvar, kV and A of points at three powers."""
    points = [
        (p, q, 1.0 + 0.05 * q)
        for p, lowest in ((0.25, -0.4), (0.5, -0.4), (0.8, -0.3))
        for q in np.linspace(lowest, 0.5, 6)
    ]
    p, q, vt = np.array(points).T
    ifd = np.array([field_on_load(*point) for point in points])
    quantities = (MVA * p, MVA * q, KILOVOLTS * vt, BASE * ifd)
    return np.stack([read(quantity, rng) for quantity in quantities], axis=1)


def read(quantity, rng):
    """Return readings of a quantity, with the error of an instrument of its largest value."""
    return quantity + READING * np.abs(quantity).max() * rng.standard_normal(len(quantity))


def write(name, header, rows, formats):
    """Write a table as a recorder's file."""
    lines = [",".join(f.format(x) for f, x in zip(formats, row, strict=True)) for row in rows]
    (SAMPLES / name).write_text("\n".join([header, *lines, ""]), encoding="utf-8")


def main():
    """Write the three files."""
    rng = np.random.default_rng(SEED)
    write("programme_saturation.csv", "Vt,If", saturation_rows(rng), ["{:.3f}", "{:.1f}"])
    formats = ["{:.2f}", "{:.2f}", "{:.3f}", "{:.1f}"]
    write("programme_v_curve.csv", "P,Q,Vt,If", v_curve_rows(rng), formats)
    load = Load(0.0, -0.3)
    signals = recorded_rejection("GENROU", UNIT, load, OPENS, TIME, NOISE, SEED)
    rows = np.stack([TIME, signals["vt"], BASE * signals["ifd"]], axis=1)
    write("programme_rejection.csv", "t,vt,If", rows, ["{:.2f}", "{:.5f}", "{:.1f}"])


if __name__ == "__main__":
    main()
