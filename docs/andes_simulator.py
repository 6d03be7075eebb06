"""ANDES as the plant of exfit: a unit behind a reactance to a stiff source.

    plant:
      type: external
      command: [python, andes_simulator.py, SEXS]
      twin: infinite-bus
      dialect: andes

The argument is the exciter's model as ANDES names it; its parameters are those of the request
without a dot in their names. Steps may be those of vref and E. It was run with ANDES 2.0.0.
"""

import json
import sys
from typing import Any

import andes
import numpy as np

MACHINE = {
    "Xd": "xd", "Xq": "xq", "Xpd": "xd1", "Xpq": "xq1", "Xl": "xl", "Tpd0": "Td10", "Tppd0": "Td20",
    "Tpq0": "Tq10", "Tppq0": "Tq20", "S10": "S10", "S12": "S12", "D": "D",
}  # fmt: skip
MVA, KV = 100.0, 20.0
STEP, FINE, FIRST = 5e-3, 1e-3, 1e-6  # s; the rule averages over a step: the first is short
FINE_FOR = 1.0  # s after each step of the test
SETTINGS = {"fixt": 1, "shrinkt": 0, "tol": 1e-8, "criteria": 0, "no_tqdm": 1}


def unit(exciter: str, values: dict[str, float]) -> Any:
    """Return the unit at rest."""
    network = {k[8:]: v for k, v in values.items() if k.startswith("network.")}
    machine = {k[8:]: v for k, v in values.items() if k.startswith("machine.")}
    vt0, P, X, R = values["vt0"], network["P"], network["X"], network.get("R", 0.0)
    grid = andes.System(default_config=True, no_output=True)
    E = network.get("E") or abs(vt0 - (R + 1j * X) * (P - 1j * network["Q"]) / vt0)
    grid.add("Bus", {"idx": 0, "Vn": KV, "v0": E, "a0": 0.0})
    grid.add("Bus", {"idx": 1, "Vn": KV, "v0": vt0, "a0": 0.0})
    grid.add("Slack", {"idx": 0, "bus": 0, "Vn": KV, "v0": E, "a0": 0.0, "Sn": MVA})
    grid.add("Line", {"bus1": 1, "bus2": 0, "r": R, "x": X, "b": 0.0, "Vn1": KV, "Vn2": KV})
    grid.add("PV", {"idx": 1, "bus": 1, "Vn": KV, "v0": vt0, "p0": P, "Sn": MVA})
    data = {theirs: machine[ours] for ours, theirs in MACHINE.items() if ours in machine}
    data |= {"xd2": machine["Xppd"], "xq2": machine["Xppd"], "M": 2.0 * machine["H"], "ra": 0.0}
    grid.add("GENROU", {"idx": 1, "bus": 1, "gen": 1, "Vn": KV, "Sn": MVA, **data})
    own = {name: value for name, value in values.items() if "." not in name and name != "vt0"}
    grid.add(exciter, {"idx": 1, "syn": 1, **own})
    grid.config.freq = network.get("f0", 60.0)
    grid.setup()
    grid.PFlow.config.tol = 1e-10
    if not grid.PFlow.run():
        raise RuntimeError("no power flow")
    for key, value in SETTINGS.items():
        setattr(grid.TDS.config, key, value)
    return grid


def run(grid: Any, until: float, step: float) -> None:
    """Go on until an instant with steps of one size, s."""
    if until - grid.dae.t < 0.5 * FIRST:
        return
    grid.TDS.config.tf, grid.TDS.config.tstep = until, step
    grid.TDS.h = grid.TDS.deltat = step
    if not grid.TDS.run():
        raise RuntimeError(f"no response beyond {float(grid.dae.t):g} s")


def simulated(exciter: str, asked: dict[str, Any]) -> dict[str, list[float]]:
    """Return the signals of a request."""
    grid, end = unit(exciter, asked["values"]), max(asked["times"])
    for change in sorted(asked["steps"], key=lambda step: step["at"]):
        if change["ramp"] or change["signal"] not in ("vref", "E"):
            raise RuntimeError("steps of vref and E only")
        run(grid, change["at"], STEP)
        where = grid.Slack.v0 if change["signal"] == "E" else getattr(grid, exciter).vref0
        where.v[0] += change["step"]
        grid.TDS.custom_event = True
        run(grid, change["at"] + FIRST, FIRST)
        following = [step["at"] for step in asked["steps"] if step["at"] > change["at"]]
        run(grid, min([change["at"] + FINE_FOR, end, *following]), FINE)
    run(grid, end, STEP)
    time, y, machine = grid.dae.ts.t, grid.dae.ts.y, grid.GENROU
    vd, vq, i_d, i_q = (y[:, getattr(machine, name).a[0]] for name in ("vd", "vq", "Id", "Iq"))
    columns = {
        "vt": y[:, grid.Bus.v.a[1]],
        "p": vd * i_d + vq * i_q,
        "q": vq * i_d - vd * i_q,
        "efd": y[:, machine.vf.a[0]],
        "ifd": y[:, machine.XadIfd.a[0]],
        "speed": grid.dae.ts.x[:, machine.omega.a[0]],
    }
    return {name: np.interp(asked["times"], time, columns[name]).tolist()
            for name in asked["signals"]}  # fmt: skip


def main() -> None:
    """Answer each line of the standard input."""
    answers, sys.stdout = sys.stdout, sys.stderr
    andes.config_logger(40)
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            answer = {"id": asked["id"], "signals": simulated(sys.argv[1], asked)}
        except Exception as fault:
            answer = {"id": asked["id"], "error": f"{type(fault).__name__}: {fault}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
