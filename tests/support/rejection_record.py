"""A record of a load rejection: a GENROU at Q = -0.3 pu with a constant field voltage.

    python tests/support/rejection_record.py

writes sample_data/rejection.csv anew. The equations of `typed_rejection` are integrated by SciPy's
DOP853; nothing of exfit takes part. What a recorder adds comes from a seeded generator.
"""

import numpy as np
from places import ROOT
from typed_rejection import Load, recorded_rejection

FILE = ROOT / "sample_data" / "rejection.csv"
SEED = 15
TIME = np.round(np.arange(0.0, 8.0, 0.004), 3)  # s
LOAD, OPENS, NOISE = Load(0.0, -0.3, 1.0), 1.0013, 2e-4
UNIT = {
    "Tpd0": 6.2, "Tppd0": 0.045, "Tpq0": 0.6, "Tppq0": 0.08, "H": 3.5, "D": 0.0, "Xd": 1.75,
    "Xq": 1.68, "Xpd": 0.29, "Xpq": 0.5, "Xppd": 0.22, "Xl": 0.15, "S10": 0.12, "S12": 0.4,
}  # fmt: skip


def rejection_record() -> str:
    """Return the text of the record: t (s), vt and ifd (pu)."""
    signals = recorded_rejection("GENROU", UNIT, LOAD, OPENS, TIME, NOISE, SEED)
    rows = zip(TIME, signals["vt"], signals["ifd"], strict=True)
    return "t,vt,ifd\n" + "".join(f"{t:.3f},{u:.5f},{i:.5f}\n" for t, u, i in rows)


if __name__ == "__main__":
    FILE.write_text(rejection_record(), encoding="utf-8")
