"""An FMU as the plant of exfit, by FMPy.

    plant:
      type: external
      command: [python, fmu_simulator.py, unit.fmu]
      twin: open-circuit
      names: {KA: avr.K_A}

The parameters of the unit have the names that the request gives them; those that the FMU does not
have are left out, as vt0 is where the FMU has none. Its inputs vref, vs, E ... are the changes of
these since the start, its outputs vt, efd, ifd ... per unit. It was run with FMPy 0.3.32 and FMI 2
for co-simulation; other kinds are as FMPy has them.
"""

import json
import sys
from typing import Any

import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu

STEP = 1e-3  # s: of communication, and of what is sampled
JUMP = 1e-9  # s: a step of an input is a line so short


class Unit:
    """The FMU, extracted and loaded once."""

    def __init__(self, file: str) -> None:
        self.description = read_model_description(file)
        self.folder = extract(file)
        kind = "CoSimulation" if self.description.coSimulation else "ModelExchange"
        self.kind, self.instance = kind, instantiate_fmu(self.folder, self.description, kind)
        variables = self.description.modelVariables
        self.inputs = [variable.name for variable in variables if variable.causality == "input"]
        self.names = {variable.name for variable in variables}

    def simulated(self, asked: dict[str, Any]) -> dict[str, list[float]]:
        """Return the signals of a request."""
        times = np.array(asked["times"])
        start = min(0.0, float(times[0]))
        self.instance.reset()
        result = simulate_fmu(
            self.folder,
            model_description=self.description,
            fmu_instance=self.instance,
            fmi_type=self.kind,
            start_time=start,
            stop_time=float(times[-1]),
            output_interval=STEP,
            start_values={k: v for k, v in asked["values"].items() if k in self.names},
            input=self.changes(asked["steps"], start, float(times[-1])),
            output=asked["signals"],
        )
        return {
            name: np.interp(times, result["time"], result[name]).tolist()
            for name in asked["signals"]
        }

    def changes(self, steps: list[dict[str, Any]], start: float, end: float) -> Any:
        """Return the inputs as lines between instants; raises ValueError for one it has not."""
        missing = {step["signal"] for step in steps} - {*self.inputs}
        if missing:
            raise ValueError(f"the FMU has no input {', '.join(sorted(missing))}")
        if not steps:
            return None
        lines = [_line(step) for step in steps]
        corners = {instant for line in lines for instant in line}
        instants = np.array(sorted({start, *corners, end}))
        table = np.zeros(len(instants), [("time", float), *((n, float) for n in self.inputs)])
        table["time"] = instants
        for step, (begin, complete) in zip(steps, lines, strict=True):
            share = (instants - begin) / (complete - begin)
            table[step["signal"]] += step["step"] * share.clip(0.0, 1.0)
        return table


def _line(step: dict[str, Any]) -> tuple[float, float]:
    """Return begin and end of a ramp; a step is complete at its instant, which is on the grid."""
    at, ramp = step["at"], step["ramp"]
    return (at, at + ramp) if ramp else (at - JUMP, at)


def main() -> None:
    """Answer each line of the standard input."""
    answers, sys.stdout = sys.stdout, sys.stderr
    unit = Unit(sys.argv[1])
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            answer = {"id": asked["id"], "signals": unit.simulated(asked)}
        except Exception as fault:
            answer = {"id": asked["id"], "error": f"{type(fault).__name__}: {fault}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
