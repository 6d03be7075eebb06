"""The d axis of a rotor with field and damper winding, and its saturation.

T'd0 dE'q/dt = efd - ifd and T''d0 dpsi/dt = E'q - psi - (X'd - Xl) id; the voltage behind X'' is
the subtransient flux, of which E'q and psi have shares (Sauer, Pai: Power System Dynamics and
Stability, 3.3 to 3.6; PSS/E GENROU, GENSAL).
"""

from exfit.engine.trace import Signal, exp, log, where
from exfit.models.blocks import SHORTEST, lag, modulus, quadratic
from exfit.models.machines.machine import Axes

D_AXIS = ("EQP", "PSID")
D_AXIS_DRAWING = """\
efd ─►(+)─►[   1   ]─┬─ EQP ─┬──────────────────►[Xppd - Xl]──►(+)─►(+)─► vq
      -▲   [ sTpd0 ] │       │                   [Xpd - Xl ]    ▲   -▲
       │             │       └►(+)─►[    1     ]─┬►[Xpd - Xppd]─┘    │
       │             │         -▲   [1 + sTppd0] │ [ Xpd - Xl ]   Xppd id
       └─── ifd ◄────┘          │                │
             ▲           (Xpd - Xl) id           │
             └──────────── PSID ─────────────────┘
"""
FIELD_CURRENT = """\
ifd = EQP + (Xd - Xpd) (id + k (EQP - PSID - (Xpd - Xl) id)) and saturation,
with k = (Xpd - Xppd) / (Xpd - Xl)^2."""


def damper_flux(s: Signal, p: Signal) -> Signal:
    """Return psi; on open circuit it is E'q where T''d0 is zero."""
    return where(p.Tppd0 < SHORTEST, s.EQP, s.PSID)


def subtransient_flux(s: Signal, p: Signal) -> Signal:
    """Return the flux along d, which is the voltage along q behind X''."""
    share = (p.Xppd - p.Xl) / (p.Xpd - p.Xl)
    return share * s.EQP + (1.0 - share) * damper_flux(s, p)


def unsaturated_field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current that holds the fluxes of a machine without saturation."""
    inner = p.Xpd - p.Xl
    coupling = (p.Xpd - p.Xppd) / (inner * inner)
    return s.EQP + (p.Xd - p.Xpd) * (i.d + coupling * (s.EQP - damper_flux(s, p) - inner * i.d))


def d_slopes(s: Signal, efd: Signal, ifd: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Write the slopes of field and damper."""
    d.EQP = (efd - ifd) / p.Tpd0
    _, d.PSID = lag(s.EQP - (p.Xpd - p.Xl) * i.d, s.PSID, 1.0, p.Tppd0)


def d_rest(v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the fluxes of field and damper that hold a voltage at a current."""
    x.EQP = v.q + p.Xpd * i.d
    x.PSID = x.EQP - (p.Xpd - p.Xl) * i.d


def curve(flux: Signal, p: Signal) -> Signal:
    """Compute the field current of saturation: quadratic through both points."""
    return quadratic(flux, 1.0, p.S10, 1.2, p.S12).vx


def power_curve(flux: Signal, p: Signal) -> Signal:
    """Compute the field current of saturation: flux times a power of it (GENROE)."""
    none = p.S10 <= 0.0
    base = where(none, 1.0, p.S10)
    exponent = log(where(none, 1.0, p.S12) / base) / log(1.2)
    return where(none, 0.0, flux * p.S10 * exp(exponent * log(flux)))


def along_axes(form: Signal, flux: Axes, p: Signal) -> Axes:
    """Compute the part of the saturated air-gap flux on both axes.

    ``flux`` is the voltage behind X''. The q axis saturates less, as its reactance is smaller.
    """
    size = modulus(flux.q, flux.d)
    if size is flux.q:  # open circuit
        return Axes(0.0, form(size, p))
    factor = form(size, p) / size
    return Axes(factor * flux.d * (p.Xq - p.Xl) / (p.Xd - p.Xl), factor * flux.q)


def quadrature(form: Signal, vt: Signal, i_p: Signal, i_q: Signal, p: Signal) -> Signal:
    """Return the reactance behind which the voltage lies on the q axis of a saturated machine."""
    flux = modulus(vt + p.Xppd * i_q, p.Xppd * i_p)
    saturated = 1.0 + form(flux, p) / flux * (p.Xq - p.Xl) / (p.Xd - p.Xl)
    return (p.Xq - p.Xppd) / saturated + p.Xppd


def unsaturated_quadrature(vt: Signal, i_p: Signal, i_q: Signal, p: Signal) -> Signal:
    """Give the reactance of a q axis that does not saturate: Xq."""
    return p.Xq
