"""A machine played back over a step up and a step down, its T'd0 another one in each."""

import numpy as np

from exfit.models.blocks import quadratic
from exfit.records.record import Record

SATURATION = (1.0, 0.1, 1.2, 0.4)  # E1, S10, E2, S12
CLOCK = 0.01  # s, of the recorder
UP, DOWN, END = 2.0, 16.0, 30.0  # s
STEP, HASTE = 0.05, 1.5  # pu; rise of efd beside what holds the new voltage, of a regulator
DECAY = 1.2  # s, of that rise

CASE = """
plant:
  type: machine-playback
  machine: ONE_AXIS
  parameters: {Xd: 1.8, Xpd: 0.3}
  free:
    Tpd0: {start: 4.0, min: 1.0, max: 20.0}
    S10:  {start: 0.08, min: 0.005, max: 1.0}
    S12:  {start: 0.3, min: 0.02, max: 2.0}
test: {steady_until: 1.5}
record:
  file: two_steps.csv
  time: t
  channels: {efd: efd, vt: vt}
estimate: {search: local}
"""


def demand(flux):
    """Return the field current that holds a flux without load."""
    return flux + quadratic(flux, *SATURATION).vx


def record_of_two_steps(of_up, of_down, seed=1, noise=(1e-4, 5e-3)):
    """Return the record of T'd0 dE'q/dt = efd - ifd, with noise of vt and efd (pu)."""
    time = np.arange(0.0, END, CLOCK)
    efd = field_voltage(time)
    vt = np.empty_like(time)
    vt[0] = flux = 1.0
    for k in range(len(time) - 1):
        tpd0 = of_up if time[k] < DOWN - 1e-9 else of_down
        ends = (efd[k], 0.5 * (efd[k] + efd[k + 1]), efd[k + 1])
        vt[k + 1] = flux = stepped(flux, ends, CLOCK, tpd0)
    generator = np.random.default_rng(seed)
    noisy = {
        name: samples + generator.normal(0.0, spread, len(time))
        for (name, samples), spread in zip({"vt": vt, "efd": efd}.items(), noise, strict=True)
    }
    return Record.from_arrays(time, noisy, "two_steps.csv")


def field_voltage(time):
    """Return efd as a regulator moves it: a jump that decays to what holds the new voltage."""
    low, high = demand(1.0), demand(1.0 + STEP)
    efd = np.full(len(time), low)
    for at, start, end in ((UP, low, high), (DOWN, high, low)):
        after = time >= at - 1e-9
        jump = HASTE * np.sign(end - start) * np.exp(-(time[after] - at) / DECAY)
        efd[after] = end + jump * 0.25
    return efd


def stepped(flux, efd, h, tpd0):
    """Return the flux a step of Runge and Kutta later."""

    def slope(x, u):
        return (u - demand(x)) / tpd0

    a = slope(flux, efd[0])
    b = slope(flux + 0.5 * h * a, efd[1])
    c = slope(flux + 0.5 * h * b, efd[1])
    d = slope(flux + h * c, efd[2])
    return flux + h * (a + 2.0 * b + 2.0 * c + d) / 6.0
