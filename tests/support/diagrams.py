"""Block diagrams typed a second time: transfer functions, the rectifier, saturation, a lone run.

Nothing here uses a state or an equation of the models but ``alone``, which runs them.
"""

import math
from types import SimpleNamespace

import numpy as np
from scipy import signal
from scipy.optimize import brentq

from exfit.engine.trace import clip
from exfit.models import MODELS
from exfit.models.blocks import Limited
from exfit.plants import SATURATION
from exfit.plants.parts import Names, exciter_inputs, exciter_parameters

FREQUENCIES = np.array([0.01, 0.1, 0.5, 1.0, 3.0, 10.0, 30.0])  # Hz


class Transfer:
    """A transfer function, with the algebra of block diagrams; a number is one too."""

    def __init__(self, over, under=(1.0,)):
        self.over, self.under = np.poly1d(np.atleast_1d(over)), np.poly1d(np.atleast_1d(under))

    def __mul__(self, other):
        other = transfer(other)
        return Transfer((self.over * other.over).c, (self.under * other.under).c)

    def __add__(self, other):
        other = transfer(other)
        crossed = self.over * other.under + other.over * self.under
        return Transfer(crossed.c, (self.under * other.under).c)

    def __truediv__(self, other):
        other = transfer(other)
        return self * Transfer(other.under.c, other.over.c)

    __rmul__, __radd__ = __mul__, __add__

    def fed_back(self, path=1.0):
        """Return the loop of this forward path and a path subtracted at its input."""
        path = transfer(path)
        loop = self.under * path.under + self.over * path.over
        return Transfer((self.over * path.under).c, loop.c)

    def at(self, frequencies):
        """Return the responses to oscillations of one, complex."""
        s = 2j * np.pi * np.asarray(frequencies)
        return self.over(s) / self.under(s)

    def step(self, times):
        """Return the response to a step of one."""
        return signal.step((self.over.c, self.under.c), T=times)[1]


def transfer(value):
    return value if isinstance(value, Transfer) else Transfer(value)


def lag(K, T):
    return Transfer([K], [T, 1.0])


def lead_lag(TC, TB):
    return Transfer([TC, 1.0], [TB, 1.0])


def washout(K, T):
    return Transfer([K, 0.0], [T, 1.0])


def pid(KP, KI, KD=0.0, TD=0.0):
    return Transfer([KP, KI], [1.0, 0.0]) + washout(KD, TD)


# --- formulas of the standard ---------------------------------------------------------------------


def rectified(ve, load):
    """Return VE FEX(IN) with IN = load / VE, arc by arc as printed but with exact constants."""
    share = load / ve
    if share <= 0.0:
        return ve
    if share <= math.sqrt(3.0) / 4.0:
        return ve * (1.0 - share / math.sqrt(3.0))
    if share < 0.75:
        return ve * math.sqrt(0.75 - share**2)
    return ve * math.sqrt(3.0) * max(1.0 - share, 0.0)


def saturation(e, p):
    """Return VX and dVX/dE of the parabola through two points, by a line through their roots."""
    points, roots = (p["E1"], p["E2"]), np.sqrt([p["E1"] * p["SE1"], p["E2"] * p["SE2"]])
    rise, offset = np.polyfit(points, roots, 1)
    root = max(rise * e + offset, 0.0)
    return root * root, 2.0 * rise * root


def field_current(ve, ifd, p):
    """Return KE VE + VX(VE) + KD IFD."""
    return p["KE"] * ve + saturation(ve, p)[0] + p.get("KD", 0.0) * ifd


def slope(function, at, h=1e-5):
    return (function(at + h) - function(at - h)) / (2.0 * h)


class Rotating:
    """efd = a VE - b IFD and VFE = c VE + KD IFD, small and around a start."""

    def __init__(self, p, efd, ifd):
        def behind(ve, ifd):
            return rectified(ve, p["KC"] * ifd)

        ve = brentq(lambda ve: behind(ve, ifd) - efd, efd, 3.0 * efd + 1.0, xtol=1e-13)
        self.a = slope(lambda ve: behind(ve, ifd), ve)
        self.b = -slope(lambda ifd: behind(ve, ifd), ifd)
        self.c = slope(lambda ve: field_current(ve, ifd, p), ve)
        self.vfe = field_current(ve, ifd, p)


# --- an exciter that nothing answers --------------------------------------------------------------


def standing(name, values, efd=1.3, vt=1.0, ifd=1.1, **inputs):
    """Return inputs, parameters and states of an exciter that rests at an output."""
    model, x = MODELS[name], Names()
    p = exciter_parameters(values, model, SATURATION["quadratic"])
    u = exciter_inputs(vt=vt, ifd=ifd, **inputs)
    u.vref = model.rest(efd, u, p, x)
    return u, p, x


def alone(name, values, vref=0.0, vc1=0.0, time=0.5, step=1e-3, held=None, **start):
    """Return times and efd of an exciter after steps at t = 0, by Runge-Kutta.

    ``vref`` and ``vc1`` are steps or several of them (a column of efd for each), vref also a
    function of time; the limiters ``held`` act from t = 0, and all other inputs stay.
    """
    model = MODELS[name]
    u, p, rest = standing(name, values, **start)
    known = vars(u) | {"vc1": u.vc1 + np.asarray(vc1)} | (held or {})
    reference, kept = u.vref, {name: vars(rest)[name] for name in model.setpoints}
    each = np.ones(np.broadcast_shapes(np.shape(vref), np.shape(vc1)))
    x = np.array([vars(rest)[state] * each for state in model.states])

    def motion(x, t):
        known["vref"] = reference + (vref(t) if callable(vref) else np.asarray(vref))
        s, d = SimpleNamespace(**dict(zip(model.states, x, strict=True)), **kept), Names()
        efd = model.equations(s, Names(**known), p, d)
        return efd * each, [vars(d)[one] for one in model.states]

    def slopes(rates):
        return np.array([getattr(s, "slope", s) * each for s in rates])

    times, found = np.linspace(0.0, time, round(time / step) + 1), []
    for t in times:
        middle = t + step / 2  # a reference jumps between two steps
        efd, rates = motion(x, middle)
        within = [
            clip(one, at.low, at.high) if isinstance(at, Limited) else one
            for one, at in zip(x, rates, strict=True)
        ]
        if not np.array_equal(x, within):
            x = np.array(within)
            efd, rates = motion(x, middle)
        found.append(efd)
        k1 = slopes(rates)
        k2 = slopes(motion(x + step / 2 * k1, middle)[1])
        k3 = slopes(motion(x + step / 2 * k2, middle)[1])
        k4 = slopes(motion(x + step * k3, middle)[1])
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return times, np.array(found)


def frequency_response(name, p, inputs, frequencies, start, h=1e-5):
    """Return efd per unit of each input (frequencies, inputs), by central differences."""
    model = MODELS[name]
    u, _, x = standing(name, vars(p), **start)
    n = len(model.states)
    kept = {setpoint: vars(x)[setpoint] for setpoint in model.setpoints}
    rest = np.array([*(vars(x)[state] for state in model.states), *(vars(u)[i] for i in inputs)])

    def motion(at):
        d = Names()
        states = Names(**dict(zip(model.states, at[:n], strict=True)), **kept)
        given = exciter_inputs(**vars(u) | dict(zip(inputs, at[n:], strict=True)))
        efd = model.equations(states, given, p, d)
        slopes = [getattr(vars(d)[state], "slope", vars(d)[state]) for state in model.states]
        return np.array([*slopes, efd])

    unit = h * np.eye(len(rest))
    whole = np.array([(motion(rest + e) - motion(rest - e)) / (2.0 * h) for e in unit]).T
    A, B, C, D = whole[:n, :n], whole[:n, n:], whole[n, :n], whole[n, n:]
    return np.array(
        [C @ np.linalg.solve(2j * np.pi * f * np.eye(n) - A, B) + D for f in frequencies]
    )


def assert_is_diagram(name, values, ways, **start):
    """An exciter answers each of its inputs as the transfer function does that leads from it."""
    p = SimpleNamespace(**values)
    found = frequency_response(name, p, list(ways), FREQUENCIES, start)
    for response, way in zip(found.T, ways.values(), strict=True):
        expected = way.at(FREQUENCIES)
        # differences over 1e-5: rounding over it, and a third derivative times its square
        assert np.abs(response - expected).max() < 1e-7 * np.abs(expected).max()
