"""Exciters with an alternator, on their own: linear behaviour by algebra in s, and large steps.

What is typed here knows nothing of states and of the equations of the models but ``driven``,
which runs them.
"""

import numpy as np
from diagrams import Rotating, alone, field_current, rectified
from scipy.optimize import brentq

FREQUENCIES = np.geomspace(0.01, 50.0, 41)  # Hz
EFD, IFD, VT = 1.9, 1.8, 1.02  # a start of a machine on load, and off every limit
START = {"efd": EFD, "ifd": IFD, "vt": VT}
INPUTS = ("vref", "vs", "vt", "vc1", "ifd")


def behind_rectifier(ve, ifd, p):
    return rectified(ve, p.KC * ifd)


def holding_current(ve, ifd, p):
    return field_current(ve, ifd, vars(p))


def around(p):
    """Return the alternator and its rectifier, small and around the start."""
    return Rotating(vars(p), EFD, IFD)


def pid(s, KP, KI, KD, TD):
    return KP + KI / s + s * KD / (1.0 + s * TD)


def solved(s, p, forward, back=0.0, of_efd=0.0, supply=0.0):
    """Return efd per unit of each input where VFD = forward e - back VFE - of_efd efd + supply vt.

    e = vref + vs - vc1 / (1 + sTR), and sTE VE = VFD - VFE.
    """
    at = around(p)
    under = s * p.TE + (1.0 + back) * at.c + of_efd * at.a
    measured = -forward / (1.0 + s * p.TR)
    loaded = -(1.0 + back) * p.KD + of_efd * at.b
    ve = np.array([forward, forward, supply, measured, loaded]) / under
    return at.a * ve - at.b * np.array([0.0, 0.0, 0.0, 0.0, 1.0])


def driven(name, p, levels, seconds=12.0, step=5e-3):
    """Return efd at the end of each level of vref."""
    end = seconds * len(levels)

    def at(t):
        return levels[min(int(t / seconds), len(levels) - 1)]

    efd = alone(name, vars(p), vref=at, time=end, step=step, **START)[1]
    return efd[:: round(seconds / step)][1:]


def efd_where(vfe, p):
    """Return the efd of a rotating exciter whose field current stands at VFE."""
    ve = brentq(lambda ve: holding_current(ve, IFD, p) - vfe, 0.01, 50.0, xtol=1e-13)
    return behind_rectifier(ve, IFD, p)
