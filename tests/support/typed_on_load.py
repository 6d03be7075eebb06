"""A machine on load as one would type it from a textbook, for another integrator."""

from math import pi

import numpy as np
from scipy.optimize import fsolve
from typed_rejection import typed_machine


def quadratic_curve(x, s10, s12):
    """Return B (x - A)^2 through S10 at 1 and 1.2 S12 at 1.2."""
    q = np.sqrt(s10 / (1.2 * s12))
    knee = (1.0 - 1.2 * q) / (1.0 - q)
    return 1.2 * s12 * (max(x - knee, 0.0) / (1.2 - knee)) ** 2


def power_curve(x, s10, s12):
    return s10 * x ** (1.0 + np.log(s12 / s10) / np.log(1.2))


class Typed:
    """A machine by flux linkages along d and q, with signs as textbooks have them: psi, not e.

    The stator and the line are solved as four linear equations in vd, vq, id, iq.
    """

    def __init__(self, name, m, n):
        self.name, self.m, self.n = name, m, n
        self.salient = name.startswith("GENSA")
        self.curve = quadratic_curve if name in ("GENROU", "GENSAL") else power_curve

    def subtransient(self, x):
        """Return psi''d and psi''q."""
        m, (eqp, psi1d, second, psi2q) = self.m, x[:4]
        gd = (m["Xppd"] - m["Xl"]) / (m["Xpd"] - m["Xl"])
        along_d = gd * eqp + (1.0 - gd) * psi1d
        if self.salient:
            return along_d, -psi2q
        gq = (m["Xppd"] - m["Xl"]) / (m["Xpq"] - m["Xl"])
        return along_d, -(gq * second + (1.0 - gq) * psi2q)

    def stator(self, x, E, R, X):
        (psi_d, psi_q), delta = self.subtransient(x), x[4]
        xpp = self.m["Xppd"]
        matrix = [
            [1.0, 0.0, 0.0, -xpp],  # vd = -psi''q + X'' iq
            [0.0, 1.0, xpp, 0.0],  # vq = psi''d - X'' id
            [1.0, 0.0, -R, X],
            [0.0, 1.0, -X, -R],
        ]
        return np.linalg.solve(matrix, [-psi_q, psi_d, E * np.sin(delta), E * np.cos(delta)])

    def saturation(self, x):
        """Return what is added to the field current, and to its mirror image on q."""
        m, (psi_d, psi_q) = self.m, self.subtransient(x)
        if self.name == "GENSAL":
            return self.curve(x[0], m["S10"], m["S12"]), 0.0
        size = np.hypot(psi_d, psi_q)
        se = self.curve(size, m["S10"], m["S12"]) / size
        return se * psi_d, se * -psi_q * (m["Xq"] - m["Xl"]) / (m["Xd"] - m["Xl"])

    def slopes(self, x, efd, Pm, E, R, X):
        m, (eqp, psi1d, edp, psi2q, _, dw) = self.m, x
        vd, vq, i_d, i_q = self.stator(x, E, R, X)
        sat_d, sat_q = self.saturation(x)
        inner = m["Xpd"] - m["Xl"]
        kd = (m["Xd"] - m["Xpd"]) * (m["Xpd"] - m["Xppd"]) / inner**2
        ifd = eqp + (m["Xd"] - m["Xpd"]) * i_d + kd * (eqp - psi1d - inner * i_d) + sat_d
        if self.salient:
            d_edp = 0.0
            d_psi2q = ((m["Xq"] - m["Xppd"]) * i_q - psi2q - sat_q) / m["Tppq0"]
        else:
            inner_q = m["Xpq"] - m["Xl"]
            kq = (m["Xq"] - m["Xpq"]) * (m["Xpq"] - m["Xppd"]) / inner_q**2
            current = edp - (m["Xq"] - m["Xpq"]) * i_q + kq * (edp - psi2q + inner_q * i_q)
            d_edp = -(current + sat_q) / m["Tpq0"]
            d_psi2q = (edp - psi2q + inner_q * i_q) / m["Tppq0"]
        torque = vd * i_d + vq * i_q
        return [
            (efd - ifd) / m["Tpd0"],
            (eqp - psi1d - inner * i_d) / m["Tppd0"],
            d_edp,
            d_psi2q,
            2.0 * pi * self.n["f0"] * dw,
            ((Pm - m["D"] * dw) / (1.0 + dw) - torque) / (2.0 * m["H"]),
        ], ifd

    def vt(self, x, E, R, X):
        return np.hypot(*self.stator(x, E, R, X)[:2])


class TypedSaturatingOnLoad:
    """GENTPJ, GENQEC, GENQEJ: current into the line by a root search; Te is power by speed."""

    salient = False

    def __init__(self, name, m, n):
        self.m, self.n, self.machine = m, n, typed_machine(name, m)

    def stator(self, x, E, R, X):
        own, speed = [x[0], x[1], -x[2], -x[3]], 1.0 + x[5]

        def off(i):
            v_d, v_q = self.machine.voltages(own, *i, speed)
            return [
                v_d - E * np.sin(x[4]) - R * i[0] + X * i[1],
                v_q - E * np.cos(x[4]) - X * i[0] - R * i[1],
            ]

        i = fsolve(off, [0.3, 0.8], xtol=1e-13)
        return *self.machine.voltages(own, *i, speed), *i

    def slopes(self, x, efd, Pm, E, R, X):
        v_d, v_q, i_d, i_q = self.stator(x, E, R, X)
        own, speed = [x[0], x[1], -x[2], -x[3]], 1.0 + x[5]
        d = self.machine.slopes(own, efd, i_d, i_q, speed)
        swing = (Pm - self.m["D"] * x[5] - v_d * i_d - v_q * i_q) / (1.0 + x[5])
        turn = 2.0 * pi * self.n["f0"] * x[5]
        moved = [d[0], d[1], -d[2], -d[3], turn, swing / (2.0 * self.m["H"])]
        return moved, self.machine.ifd(own, i_d, i_q, speed)

    def vt(self, x, E, R, X):
        return np.hypot(*self.stator(x, E, R, X)[:2])
