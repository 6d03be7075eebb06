"""Simulate units on load in ANDES, and write tests/reference/andes_load_*.csv and .json.

Run it as ``python tests/studies/andes_on_load.py [NAME ...]`` where ANDES 2.0.0 is installed;
nothing else here needs it. Each unit is a GENROU behind a reactance to a stiff source, whose
voltage drops for 0.2 s. All are simulated at once: at one stiff source no unit sees another. The
tests of ``tests/plants/test_andes.py`` compare exfit with the files.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import andes
import numpy as np

REFERENCE = Path(__file__).parents[1] / "reference"
GENROU = {
    "xd": 1.8, "xq": 1.7, "xd1": 0.3, "xq1": 0.55, "xd2": 0.25, "xq2": 0.25, "xl": 0.2, "ra": 0.0,
    "Td10": 6.0, "Td20": 0.05, "Tq10": 0.5, "Tq20": 0.05, "S10": 0.12, "S12": 0.4,
    "M": 8.0, "D": 0.0,
}  # fmt: skip
VT0, P0, X, KV, MVA = 1.02, 0.8, 0.3, 20.0, 100.0
DIP, AT, BACK, END = -0.25, 1.0, 1.2, 8.0  # pu of the source's voltage; s
CALM = 2.5  # s: from then on steps and rows are longer
ROWS = np.concatenate([np.arange(0.01, CALM, 0.02), np.arange(CALM, END, 0.05)])  # s
FINEST, FINE, COARSE = 1e-4, 2.5e-4, 5e-4  # s, steps: fine from the dip to CALM
JUMPED = 0.1  # s behind each jump the finest ones
FIRST = 1e-6  # s; the rule averages over a step, so the first one after a jump is short
SETTINGS = {
    "fixt": 1, "shrinkt": 0, "tol": 1e-9, "max_iter": 30, "criteria": 0, "honest": 0,
    "g_scale": 0, "linesearch": 0, "no_tqdm": 1,
}  # fmt: skip


class Part(NamedTuple):
    """A model as ANDES names it, with its values there."""

    model: str
    values: Mapping[str, float]


class UnitCase(NamedTuple):
    """A unit: exciter, and stabiliser and governor where it has them."""

    exciter: Part
    pss: Part | None = None
    governor: Part | None = None

    def add_to(self, grid: andes.System, name: str) -> None:
        """Add the unit to a grid whose bus 0 holds its voltage; its parts have its name."""
        grid.add("Bus", {"idx": name, "Vn": KV, "v0": 1.0, "a0": 0.0})
        line = {"r": 0.0, "x": X, "b": 0.0, "Vn1": KV, "Vn2": KV}
        grid.add("Line", {"bus1": name, "bus2": 0, **line})
        grid.add("PV", {"idx": name, "bus": name, "Vn": KV, "v0": VT0, "p0": P0, "Sn": MVA})
        machine = {"idx": name, "bus": name, "gen": name, "Vn": KV, "Sn": MVA}
        grid.add("GENROU", {**machine, **GENROU})
        grid.add(self.exciter.model, {"idx": name, "syn": name, **self.exciter.values})
        if self.pss is not None:
            grid.add(self.pss.model, {"idx": name, "avr": name, **self.pss.values})
        if self.governor is not None:
            grid.add(self.governor.model, {"idx": name, "syn": name, **self.governor.values})


SEXS = Part("SEXS", {"TATB": 0.1, "TB": 10.0, "K": 100.0, "TE": 0.05, "EMIN": -5.0, "EMAX": 6.0})
EXST1 = Part(
    "EXST1",
    {"TR": 0.02, "VIMAX": 0.2, "VIMIN": -0.2, "TC": 1.0, "TB": 5.0, "KA": 100.0, "TA": 0.05,
     "VRMAX": 20.0, "VRMIN": -20.0, "KC": 0.05, "KF": 0.02, "TF": 1.0},
)  # fmt: skip
IEEET3 = Part(
    "IEEET3",
    {"TR": 0.02, "KA": 60.0, "TA": 0.15, "VRMAX": 1.2, "VRMIN": -1.2, "VBMAX": 3.6, "KE": 1.0,
     "TE": 0.3, "KF": 0.05, "TF": 0.6, "KP": 1.5, "KI": 1.86},
)  # fmt: skip
DC_EXCITER = {
    "TR": 0.02, "TA": 0.05, "TB": 1.5, "TC": 0.4, "VRMAX": 30.0, "VRMIN": -30.0, "KA": 60.0,
    "KE": 1.0, "TE": 0.6, "KF1": 0.05, "TF1": 0.8, "E1": 3.05, "SE1": 0.279, "E2": 2.29,
    "SE2": 0.117,
}  # fmt: skip
ESST1A = Part(
    "ESST1A",
    {"TR": 0.02, "VIMAX": 0.3, "VIMIN": -0.3, "TB": 5.0, "TC": 1.0, "TB1": 0.3, "TC1": 0.1,
     "VAMAX": 9.0, "VAMIN": -9.0, "KA": 120.0, "TA": 0.03, "ILR": 9.0, "KLR": 0.0, "VRMAX": 5.0,
     "VRMIN": -4.0, "KF": 0.02, "TF": 1.0, "KC": 0.05, "UELc": 0, "VOSc": 1},
)  # fmt: skip
ESST3A = Part(
    "ESST3A",
    {"TR": 0.02, "VIMAX": 0.2, "VIMIN": -0.2, "KM": 8.0, "TC": 1.0, "TB": 10.0, "KA": 200.0,
     "TA": 0.02, "VRMAX": 10.0, "VRMIN": -10.0, "KG": 1.0, "KP": 6.15, "KI": 0.4, "VBMAX": 9.0,
     "KC": 0.0, "XL": 0.081, "VGMAX": 5.8, "THETAP": 10.0, "TM": 0.4, "VMMAX": 1.0, "VMMIN": 0.0},
)  # fmt: skip
ESST4B = Part(
    "ESST4B",
    {"TR": 0.02, "KPR": 3.0, "KIR": 3.0, "VRMAX": 9.0, "VRMIN": -9.0, "TA": 0.02, "KPM": 1.0,
     "KIM": 0.0, "VMMAX": 9.0, "VMMIN": -9.0, "KG": 0.0, "KP": 5.0, "KI": 0.3, "VBMAX": 11.63,
     "KC": 0.0, "XL": 0.124, "THETAP": 10.0},
)  # fmt: skip
IEEEST = Part(
    "IEEEST",
    {"MODE": 1, "A1": 0.061, "A2": 0.0017, "A3": 0.05, "A4": 0.002, "A5": 0.01, "A6": 0.0005,
     "T1": 0.3, "T2": 0.03, "T3": 0.15, "T4": 0.03, "T5": 1.65, "T6": 1.65, "KS": 12.0,
     "LSMAX": 0.06, "LSMIN": -0.04, "VCU": 0.0, "VCL": 0.0},
)  # fmt: skip
IEEEST_P = Part("IEEEST", IEEEST.values | {"MODE": 3, "KS": -0.2, "T1": 0.05})
ST2CUT = Part(
    "ST2CUT",
    {"MODE": 1, "MODE2": 3, "K1": 6.0, "K2": -0.2, "T1": 0.02, "T2": 0.03, "T3": 3.0, "T4": 3.0,
     "T5": 0.3, "T6": 0.03, "T7": 0.1, "T8": 0.03, "T9": 0.05, "T10": 0.02, "LSMAX": 0.05,
     "LSMIN": -0.04, "VCU": 0.0, "VCL": 0.0},
)  # fmt: skip
TGOV1 = Part(
    "TGOV1",
    {"R": 0.05, "T1": 0.2, "VMAX": 0.95, "VMIN": 0.3, "T2": 2.0, "T3": 5.0, "Dt": 0.3},
)
IEEEG1 = Part(
    "IEEEG1",
    {"K": 20.0, "T1": 0.15, "T2": 0.05, "T3": 0.2, "UO": 0.1, "UC": -0.15, "PMAX": 1.0, "PMIN": 0.3,
     "T4": 0.3, "K1": 0.3, "K2": 0.0, "T5": 2.0, "K3": 0.4, "K4": 0.0, "T6": 0.5, "K5": 0.2,
     "K6": 0.0, "T7": 0.4, "K7": 0.1, "K8": 0.0},
)  # fmt: skip
HYGOV = Part(
    "HYGOV",
    {"R": 0.05, "r": 0.5, "Tr": 2.0, "Tf": 0.05, "Tg": 0.3, "VELM": 0.2, "GMAX": 1.0, "GMIN": 0.0,
     "Tw": 1.0, "At": 1.2, "Dt": 0.5, "qNL": 0.08},
)  # fmt: skip
GAST = Part(
    "GAST",
    {"R": 0.05, "T1": 0.2, "T2": 0.1, "T3": 1.0, "AT": 0.82, "KT": 3.0, "VMAX": 1.0, "VMIN": 0.3,
     "Dt": 0.2},
)  # fmt: skip
IEESGO = Part(
    "IEESGO",
    {"T1": 0.05, "T2": 0.3, "T3": 0.1, "T4": 0.3, "T5": 2.0, "T6": 0.4, "K1": 20.0, "K2": 0.7,
     "K3": 0.4, "PMAX": 0.9, "PMIN": 0.5},
)  # fmt: skip
UNITS = {
    "exst1": UnitCase(EXST1),
    "ieeet3": UnitCase(IEEET3),
    "esst1a": UnitCase(ESST1A),
    "esst3a": UnitCase(ESST3A),
    "esst4b": UnitCase(ESST4B),
    "ieeex1": UnitCase(Part("IEEEX1", DC_EXCITER)),
    "exdc2": UnitCase(Part("EXDC2", DC_EXCITER)),
    "ieeest": UnitCase(EXST1, IEEEST),
    "ieeest_power": UnitCase(SEXS, IEEEST_P),
    "st2cut": UnitCase(EXST1, ST2CUT),
    "tgov1": UnitCase(SEXS, None, TGOV1),
    "ieeeg1": UnitCase(SEXS, None, IEEEG1),
    "hygov": UnitCase(SEXS, None, HYGOV),
    "gast": UnitCase(SEXS, None, GAST),
    "ieesgo": UnitCase(SEXS, None, IEESGO),
}


def at_source(cases: Mapping[str, UnitCase]) -> andes.System:
    """Return units at rest, each behind a reactance to a source that holds its voltage."""
    grid = andes.System(default_config=True, no_output=True)
    grid.add("Bus", {"idx": 0, "Vn": KV, "v0": 1.0, "a0": 0.0})
    grid.add("Slack", {"idx": 0, "bus": 0, "Vn": KV, "v0": 1.0, "a0": 0.0, "Sn": MVA})
    for name, case in cases.items():
        case.add_to(grid, name)
    return at_rest(grid)


def at_rest(grid: andes.System) -> andes.System:
    """Return a grid whose power flow is solved, and whose run is set up."""
    grid.config.freq = 60.0
    grid.setup()
    grid.PFlow.config.tol = 1e-12
    grid.PFlow.run()
    for key, value in SETTINGS.items():
        setattr(grid.TDS.config, key, value)
    return grid


def run(unit: andes.System, until: float, step: float) -> None:
    """Go on until an instant with steps of one size, s."""
    unit.TDS.config.tf, unit.TDS.config.tstep = until, step
    unit.TDS.h = unit.TDS.deltat = step
    if not unit.TDS.run():
        raise SystemExit(f"no response beyond {unit.dae.t:g} s")


def dipped(cases: Mapping[str, UnitCase]) -> andes.System:
    """Return units that went through a voltage dip."""
    grid = at_source(cases)
    run(grid, AT, COARSE)
    for instant, change in ((AT, DIP), (BACK, -DIP)):
        run(grid, instant, FINE)
        grid.Slack.v0.v[0] += change
        grid.TDS.custom_event = True
        run(grid, instant + FIRST, FIRST)
        run(grid, instant + JUMPED, FINEST)
    run(grid, CALM, FINE)
    run(grid, END, COARSE)
    return grid


def signals_of(grid: andes.System, name: str, case: UnitCase) -> dict[str, np.ndarray]:
    """Return what a unit showed, on its own base."""
    y, x, machine = grid.dae.ts.y, grid.dae.ts.x, grid.GENROU
    number = machine.idx2uid(name)

    def of_machine(variable: str) -> np.ndarray:
        return y[:, getattr(machine, variable).a[number]]

    vd, vq, i_d, i_q = map(of_machine, ("vd", "vq", "Id", "Iq"))
    columns = {
        "t": grid.dae.ts.t,
        "vt": y[:, grid.Bus.v.a[grid.Bus.idx2uid(name)]],
        "p": vd * i_d + vq * i_q,
        "q": vq * i_d - vd * i_q,
        "efd": of_machine("vf"),
        "ifd": of_machine("XadIfd"),
        "speed": x[:, machine.omega.a[number]],
        "pm": of_machine("tm"),
    }
    if case.pss is not None:
        pss = getattr(grid, case.pss.model)
        columns["vs"] = y[:, pss.vsout.a[pss.idx2uid(name)]]
    return columns


def rows(time: np.ndarray) -> np.ndarray:
    """Return the rows nearest to the instants wanted, none of them at an end of a short step."""
    apart = np.diff(time, prepend=-1.0, append=time[-1] + 1.0)
    whole = np.flatnonzero((apart[:-1] > 10 * FIRST) & (apart[1:] > 10 * FIRST))
    return whole[np.unique(np.abs(time[whole, None] - ROWS).argmin(axis=0))]


def described(case: UnitCase, found: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a test must know of a unit."""
    parts = {"exciter": case.exciter, "stabiliser": case.pss, "governor": case.governor}
    return {
        **{key: part._asdict() for key, part in parts.items() if part is not None},
        "generator": {"model": "GENROU", **GENROU},
        "network": {"f0": 60.0, "R": 0.0, "X": X, "P": P0, "vt0": VT0, **found},
        "steps": [[AT, DIP, "E"], [BACK, -DIP, "E"]],
        "provenance": {
            "tool": "ANDES", "andes": andes.__version__, "script": "tests/studies/andes_on_load.py",
            "solver": "implicit trapezoidal, fixed steps", "steps": [FINEST, FINE, COARSE],
            "first_step_after_event": FIRST,
        },
    }  # fmt: skip


def save(path: Path, columns: Mapping[str, np.ndarray], what: Mapping[str, Any]) -> None:
    """Write a table of signals and what they are of."""
    table, header = np.column_stack(list(columns.values())), list(columns)
    formats = ["%.6f", *["%.8f"] * (len(header) - 1)]
    np.savetxt(path, table, formats, ",", header=",".join(header), comments="")
    text = json.dumps(what, indent=1)
    path.with_suffix(".json").write_text(text + "\n", encoding="utf-8")
    swing = zip(header, np.ptp(table, axis=0), strict=True)
    print(f"{path.stem}: {len(table)} rows,", *(f"{name} {size:.3g}" for name, size in swing))


def write(cases: Mapping[str, UnitCase]) -> None:
    """Simulate units and write their tables and what they are."""
    grid = dipped(cases)
    kept = rows(grid.dae.ts.t)
    for name, case in cases.items():
        columns = signals_of(grid, name, case)
        what = described(case, {"Q": float(columns["q"][0])})
        sampled = {signal: column[kept] for signal, column in columns.items()}
        save(REFERENCE / f"andes_load_{name}.csv", sampled, what)


if __name__ == "__main__":
    write({name: UNITS[name] for name in sys.argv[1:] or UNITS})
