"""A record of a ramp and a step of the reference, which was recorded too: the AC1A of the samples.

    python tests/support/ramp_record.py

writes sample_data/ac1a_ramp.csv anew. Equations that are typed for this unit alone are integrated
by another integrator, LSODA of scipy, from corner to corner of the reference; nothing of exfit
takes part. What a recorder adds comes from a seeded generator.
"""

import numpy as np
from places import ROOT
from typed_units import AC1A, integrated

from exfit.simulation.inputs import InputStep

FILE = ROOT / "sample_data" / "ac1a_ramp.csv"
SEED = 12
TIME = np.round(np.arange(0.0, 15.0, 0.01), 2)  # s
RAMP = InputStep(1.0, 0.05, ramp=0.5)
STEP = InputStep(9.0037, -0.05)
VT0, NOISE = 1.0, {"vt": 1e-4, "vref": 5e-5}  # pu
UNIT = {
    "KA": 364.1523, "TA": 0.0542, "KF": 0.0413, "TF": 1.458, "TE": 1.6724, "KC": 0.486,
    "KD": 0.4039, "KE": 1.0, "E1": 4.18, "SE1": 0.10, "E2": 3.14, "SE2": 0.03,
    "TR": 0.02, "TB": 1.0, "TC": 1.0,  # equal ones do nothing
    "machine.Tpd0": 6.0, "machine.Tppd0": 0.035, "machine.Xd": 1.8, "machine.Xpd": 0.3,
    "machine.Xppd": 0.25, "machine.Xl": 0.2, "machine.S10": 0.12, "machine.S12": 0.4,
}  # fmt: skip


def ramp_record() -> str:
    """Return the text of the record: t (s), vt and vref (pu)."""
    unit, rng = AC1A(UNIT, "GENROU"), np.random.default_rng(SEED)
    vt, _ = integrated(unit, VT0, (RAMP, STEP), TIME, "LSODA")
    way = RAMP.step * np.clip((TIME - RAMP.at) / RAMP.ramp, 0.0, 1.0)
    vref = unit.rest(VT0)[1] + way + np.where(STEP.at < TIME, STEP.step, 0.0)
    vt = vt + rng.normal(0.0, NOISE["vt"], len(TIME))
    vref = vref + rng.normal(0.0, NOISE["vref"], len(TIME))
    rows = zip(TIME, vt, vref, strict=True)
    return "t,vt,vref\n" + "".join(f"{t:.2f},{u:.5f},{r:.5f}\n" for t, u, r in rows)


if __name__ == "__main__":
    FILE.write_text(ramp_record(), encoding="utf-8")
