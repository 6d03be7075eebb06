"""How far steps that are chosen by their accuracy err: all models, limits wide and narrowed.

Run it as ``python tests/studies/located_steps.py [--derivatives] [MODEL ...]``. Each scenario is
simulated with the step that an accuracy of 1e-6 chooses, crossings of limits located, and on the
literal grid at 20 and 10 us, extrapolated by first order where limits are met; where these two
differ by more than 2e-7 pu the grid is refined, down to 1.25 us; what differs by more even there
has no reference.

With ``--derivatives`` those of every parameter that moves the response are compared with central
differences where limits are narrowed, crossings located in both; the steps are divided by four
until both agree to 1e-5 of the column's largest, as a step that ends at another crossing errs
otherwise. Where the differences to both sides are not one, no derivative is known.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from step_scenarios import KINDS, models_of, scenarios

from exfit.errors import SimulationError
from exfit.plants import NETWORK, VT0
from exfit.simulation.inputs import each
from exfit.simulation.simulator import LARGEST_STEP, Simulator

ACCURACY = 1e-6  # pu of the compared signals
FINE = (1e-5, 5e-6, 2.5e-6, 1.25e-6)  # s, of the literal grid
APART = 2e-7  # pu: by more the fine grids may not differ
COARSEST, DIVISIONS = 2e-3, (1, 4, 16)  # s, of the steps of derivatives
CHANGES = (2e-4, 2e-5, 2e-6, 2e-7)  # of a parameter, for differences
ONE_SIDED = 1e-3  # of a derivative's largest: where those to both sides differ by less
LEAST_EFFECT = 1e-3  # of a parameter on the response, relative to the largest
ALIKE = 1e-5  # of the largest of a derivative


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


def moving(scenario):
    """Return the parameters that a derivative is asked for: no switch, no exponent, no network."""
    whole = ("M", "N", "SW1", "SCT", "Rselect", "Flag", "FBF", "VOS")
    return [
        name
        for name in scenario.system.parameters
        if scenario.values[name]
        and not name.startswith(NETWORK)
        and name not in (VT0, "p0", "q0", "speed0")
        and name.rpartition(".")[2] not in whole
    ]


def apart_of(scenario, simulator, name, derivative):
    """Return how far a derivative and its differences are apart, and the share left out."""
    value, size, best = scenario.values[name], np.abs(derivative).max(), (np.inf, 1.0)

    def at(change):
        changed = scenario.values | {name: value + change}
        return simulator.samples(changed, scenario.compared)[0]

    for share in CHANGES:
        change = share * abs(value)
        try:
            low, middle, high = (at(k * change) for k in (-1.0, 0.0, 1.0))
        except SimulationError:
            continue
        one = np.abs(high - 2.0 * middle + low) <= ONE_SIDED * size * change
        off = np.abs(derivative - (high - low) / (2.0 * change))[one]
        best = min(best, (float(off.max(initial=0.0)) / size, 1.0 - float(one.mean())))
    return best


def columns_of(scenario):
    """Yield each parameter, how far its derivative is from differences, the share left out."""
    step = min(chosen(scenario).step / 5.0, COARSEST)
    names = moving(scenario)
    for division in DIVISIONS:
        simulator = scenario.simulator(step / division, located=True)
        _, slopes = simulator.tangents(scenario.values, scenario.compared, each(names))
        effects = {
            name: np.abs(slopes[..., k]).max() * abs(scenario.values[name])
            for k, name in enumerate(names)
        }
        left = []
        for k, name in enumerate(names):
            if effects[name] < LEAST_EFFECT * max(effects.values()):
                continue
            off, out = apart_of(scenario, simulator, name, slopes[..., k])
            if off > ALIKE and division != DIVISIONS[-1]:
                left.append(name)
            else:
                yield name, off, out
        if not left:
            return
        names = left


def derivatives(models):
    """Print how far derivatives are from differences, for each kind of test."""
    for kind in KINDS:
        found, refused = [], []
        for model in (own for own in models_of(kind) if own in models or not models):
            for scenario in (one for one in scenarios(model, kind) if one.narrowed):
                try:
                    found += [
                        (off, out, f"{scenario.name}: {n}") for n, off, out in columns_of(scenario)
                    ]
                except SimulationError as fault:
                    refused.append(f"{scenario.name}: {fault}")
        known = [entry for entry in found if entry[1] < 1.0]
        beyond = sorted((entry for entry in known if entry[0] > ALIKE), reverse=True)
        largest = max((off for off, *_ in known), default=0.0)
        print(f"{kind}: {len(known)} derivatives, largest difference {largest:.1e}")
        print(
            "\n".join([f"above {ALIKE:g}: {len(beyond)}", *(f"{o:.1e} {n}" for o, _, n in beyond)])
        )
        one_sided = sum(out > 0.02 for _, out, _ in known)
        print(f"in part without one: {one_sided}; without: {len(found) - len(known)}")
        print("\n".join([f"refused: {len(refused)}", *refused]), flush=True)


def main(models):
    for kind in KINDS:
        errors, steps, refused, unknown = [], Counter(), [], []
        for model in (own for own in models_of(kind) if own in models or not models):
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
        largest = max(errors, default=0.0)
        print(f"{kind}: {len(errors)} scenarios, largest error {largest:.1e} pu ({shares})")
        print("\n".join([f"refused: {len(refused)}", *refused]))
        print("\n".join([f"without a reference: {len(unknown)}", *unknown]))


if __name__ == "__main__":
    asked = [name for name in sys.argv[1:] if name != "--derivatives"]
    (derivatives if "--derivatives" in sys.argv else main)(asked)
