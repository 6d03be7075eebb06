"""How far steps that are chosen by their accuracy err: all models, limits wide and narrowed.

Run it as ``python tests/studies/located_steps.py [MODEL ...]``. Each scenario is simulated with the
step that an accuracy of 1e-6 chooses, crossings of limits located, and on the literal grid at 20
and 10 us, extrapolated by first order where limits are met; where these two differ by more than
2e-7 pu the grid is refined, down to 1.25 us; what differs by more even there has no reference.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from step_scenarios import KINDS, models_of, scenarios

from exfit.errors import SimulationError
from exfit.simulation.simulator import LARGEST_STEP, Simulator

ACCURACY = 1e-6  # pu of the compared signals
FINE = (1e-5, 5e-6, 2.5e-6, 1.25e-6)  # s, of the literal grid
APART = 2e-7  # pu: by more the fine grids may not differ


def chosen(scenario, accuracy=ACCURACY):
    """Return the simulator with the step that an accuracy chooses; raises SimulationError."""
    first = Simulator(
        scenario.system,
        scenario.inputs,
        scenario.times,
        LARGEST_STEP,
        located=True,
        accuracy=accuracy,
    )
    return first.with_enough_substeps(scenario.values, scenario.compared)


def reference(scenario):
    """Return samples (M, ny) without steps, and how far the two finest grids are apart."""

    def on_grid(step):
        return scenario.simulator(step).samples(scenario.values, scenario.compared)[0]

    coarse = on_grid(2.0 * FINE[0])
    for step in FINE:
        finest = on_grid(step)
        apart = float(np.abs(finest - coarse).max())
        if apart <= APART:
            break
        coarse, before = finest, coarse
    else:
        coarse = before
    return (2.0 * finest - coarse if scenario.narrowed or step != FINE[0] else finest), apart


def error_of(scenario):
    """Return the largest error of a scenario, its step, and how far the finest grids are apart."""
    simulator = chosen(scenario)
    samples, _ = simulator.samples(scenario.values, scenario.compared)
    exact, apart = reference(scenario)
    return float(np.abs(samples - exact).max()), simulator.step, apart


def main(models):
    for kind in KINDS:
        errors, steps, refused, unknown = [], Counter(), [], []
        for model in models or models_of(kind):
            for scenario in scenarios(model, kind):
                try:
                    error, step, apart = error_of(scenario)
                except SimulationError as fault:
                    refused.append(f"{scenario.name}: {fault}")
                    continue
                steps[step] += 1
                if apart > APART:
                    unknown.append(f"{scenario.name}: grids {apart:.0e} apart")
                    continue
                errors.append(error)
                if error > ACCURACY:
                    print(f"{scenario.name}: {error:.1e} at {step:g} s; grids {apart:.0e} apart")
        shares = ", ".join(f"{1e3 * step:g} ms {count}" for step, count in sorted(steps.items()))
        print(f"{kind}: {len(errors)} scenarios, largest error {max(errors):.1e} pu ({shares})")
        print("\n".join([f"refused: {len(refused)}", *refused]))
        print("\n".join([f"without a reference: {len(unknown)}", *unknown]))


if __name__ == "__main__":
    main(sys.argv[1:])
