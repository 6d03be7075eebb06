"""Simulate a grid event in ANDES, and write tests/reference/andes_playback_*.csv and .json.

Run it as ``python tests/studies/andes_playback.py`` where ANDES 2.0.0 is installed. Units and a
larger machine feed a load; the larger one loses power and is excited less, both through its
controls, so that no voltage jumps. The record of each unit is what a phasor measurement unit at its
terminals shows, without noise. The tests of ``tests/plants/test_andes.py`` play it back.
"""

import andes
import numpy as np
from andes_on_load import (
    DC_EXCITER,
    EXST1,
    GAST,
    GENROU,
    HYGOV,
    IEEEG1,
    IEEEST,
    IEEET3,
    IEESGO,
    KV,
    MVA,
    REFERENCE,
    SEXS,
    ST2CUT,
    TGOV1,
    Part,
    UnitCase,
    at_rest,
    described,
    run,
    save,
    signals_of,
)

RATE, PER_SAMPLE, BEFORE, END = 60, 20, 1.0, 11.0  # 1/s, steps, s, s
LARGER = 15.0  # rated power of the larger machine over that of a unit
LOAD = {"p0": 13.0, "q0": 2.0}
LESS_POWER, LESS_VOLTAGE = -3.0, -0.06  # pu
UNITS = {
    "exst1": UnitCase(EXST1, IEEEST, HYGOV),
    "sexs": UnitCase(SEXS, None, TGOV1),
    "ieeet3": UnitCase(IEEET3, None, GAST),
    "ieeex1": UnitCase(Part("IEEEX1", DC_EXCITER), ST2CUT, IEEEG1),
    "exdc2": UnitCase(Part("EXDC2", DC_EXCITER), None, IEESGO),
}


def grid_of_units() -> andes.System:
    """Return units and a larger machine at rest, each unit behind a line to the load."""
    grid = andes.System(default_config=True, no_output=True)
    grid.add("Bus", {"idx": 0, "Vn": KV, "v0": 1.0, "a0": 0.0})
    grid.add("PQ", {"bus": 0, "Vn": KV, **LOAD})
    rated = LARGER * MVA
    grid.add("Slack", {"idx": 0, "bus": 0, "Vn": KV, "v0": 1.0, "a0": 0.0, "Sn": rated})
    grid.add("GENROU", {"idx": "L", "bus": 0, "gen": 0, "Vn": KV, "Sn": rated, **GENROU})
    for name, case in UNITS.items():
        case.add_to(grid, name)
    slow = {"TATB": 0.1, "TB": 10.0, "K": 100.0, "TE": 0.1, "EMIN": -5.0, "EMAX": 6.0}
    grid.add("SEXS", {"idx": "LE", "syn": "L", **slow})
    lagging = {"R": 0.05, "T1": 0.3, "VMAX": 1.2, "VMIN": 0.0, "T2": 1.0, "T3": 4.0, "Dt": 0.0}
    grid.add("TGOV1N", {"idx": "LG", "syn": "L", **lagging})
    return at_rest(grid)


def write() -> None:
    """Simulate an event and write the record of each unit, and what it is."""
    grid, step = grid_of_units(), 1.0 / (RATE * PER_SAMPLE)
    run(grid, BEFORE, step)
    grid.TGOV1N.paux0.v[:] += LESS_POWER
    grid.SEXS.vref0.v[grid.SEXS.idx2uid("LE")] += LESS_VOLTAGE
    grid.TDS.custom_event = True
    run(grid, END, step)
    wanted = np.arange(round(END * RATE) + 1) / RATE
    time = grid.dae.ts.t
    rows = np.array([np.abs(time - at).argmin() for at in wanted])
    assert np.abs(time[rows] - wanted).max() < 1e-9
    for name, case in UNITS.items():
        columns = signals_of(grid, name, case)
        columns["angle"] = grid.dae.ts.y[:, grid.Bus.a.a[grid.Bus.idx2uid(name)]]
        sampled = {signal: column[rows] for signal, column in columns.items()}
        what = described(case, {"Q": float(columns["q"][0])})
        what["steps"] = []
        what["provenance"] |= {"script": "tests/studies/andes_playback.py", "steps": [step]}
        del what["provenance"]["first_step_after_event"]
        save(REFERENCE / f"andes_playback_{name}.csv", sampled, what)


if __name__ == "__main__":
    write()
