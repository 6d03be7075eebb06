"""What a sine as a nuisance gains beside a sway of the grid, and what it costs without one.

    python tests/studies/sine.py [RECORDS]

Synthetic records of known truth: white noise with a sway of 0.8 to 1.2 Hz, white noise alone, and
coloured noise, AR(1). Each is fitted without a sine, with an automatic one, and with one at the
largest line of the residuals, whatever it is. Printed is the root mean square error of the
parameters without a sine over that with it: least, median and largest over the parameters.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

import exfit
from exfit.dsp.lines import largest_line

CONFIGS = Path(__file__).parents[2] / "configs"
RECORDS = 20
NOISE = 1e-4  # pu
MARGIN = 1.3  # of the truth: where the fits start
WEAK = ("KC", "KD")  # hardly seen in these records: held


class Disturbance(NamedTuple):
    """What is added to a response: the amplitude of a sway (pu), the memory of the noise."""

    label: str
    sway: float
    memory: float


CASES = ("ac1a_typical", "ac8b_unit1")
DISTURBANCES = (
    Disturbance("white noise 1e-4, sway 1e-4", 1e-4, 0.0),
    Disturbance("white noise 1e-4, sway 3e-4", 3e-4, 0.0),
    Disturbance("white noise 1e-4, sway 1e-3", 1e-3, 0.0),
    Disturbance("white noise 1e-4, no sway", 0.0, 0.0),
    Disturbance("AR(1) 0.8, 1e-4, no sway", 0.0, 0.8),
    Disturbance("AR(1) 0.95, 1e-4, no sway", 0.0, 0.95),
)


class Unit(NamedTuple):
    """A case with its true parameters, and its response to them."""

    content: dict
    truth: dict
    time: np.ndarray
    vt: np.ndarray


def unit_of(name):
    """Return a case whose parameters are those of its fit to its sample record."""
    path = CONFIGS / f"{name}.yaml"
    content = yaml.safe_load(path.read_text())
    fitted = exfit.fit(path, search="local")
    held = {key: each.value for key, each in fitted.parameters.items() if key in WEAK}
    truth = {key: each.value for key, each in fitted.parameters.items() if key not in WEAK}
    content["parameters"]["fixed"] |= held
    content["parameters"]["free"] = {
        key: {"start": MARGIN * value, "min": value / 10, "max": value * 10}
        for key, value in truth.items()
    }
    content.pop("validate", None)
    content["estimate"] = {"search": "local"}
    comparison = exfit.simulate(path, {**truth, **held}).comparison
    return Unit(content, truth, comparison.time, comparison.overlays["vt"].simulated)


def noise(rng, count, memory):
    """Return noise of unit variance."""
    errors = rng.standard_normal(count)
    for k in range(1, count):
        errors[k] = memory * errors[k - 1] + np.sqrt(1.0 - memory**2) * errors[k]
    return errors


def fitted(unit, vt, sine):
    """Return the fit of a record with a sine section, None without one."""
    channel = {"column": "vt"} | ({} if sine is None else {"sine": {"frequency": sine}})
    content = {**unit.content, "record": {"channels": {"vt": channel}}}
    record = exfit.Record.from_arrays(unit.time, {"vt": vt})
    return exfit.fit(exfit.Case.from_dict(content, record))


def largest_frequency(result):
    """Return the frequency of the largest line of residuals, Hz."""
    error = result.comparison.overlays["vt"].error
    return largest_line(result.comparison.time, error, np.isfinite(error)).frequency


def study(unit, disturbance, records):
    """Return the errors (records, parameters) of each way, and how many automatic sines were."""
    rng = np.random.default_rng(7)
    errors, automatic = {"none": [], "auto": [], "always": []}, 0
    for _ in range(records):
        frequency, phase = rng.uniform(0.8, 1.2), rng.uniform(0.0, 2 * np.pi)
        sway = disturbance.sway * np.cos(2 * np.pi * frequency * unit.time + phase)
        vt = unit.vt + NOISE * noise(rng, len(unit.time), disturbance.memory) + sway
        plain = fitted(unit, vt, None)
        auto = fitted(unit, vt, {"start": "auto"})
        always = fitted(unit, vt, largest_frequency(plain))
        automatic += bool(auto.of_records)
        for way, result in zip(errors, (plain, auto, always), strict=True):
            shares = [np.log(result.parameters[key].value / unit.truth[key]) for key in unit.truth]
            errors[way].append(shares)
    return {way: np.sqrt(np.mean(np.square(own), axis=0)) for way, own in errors.items()}, automatic


def main():
    """Print the table."""
    records = int(sys.argv[1]) if len(sys.argv) > 1 else RECORDS
    print("| case | record | sine fitted | error without / with it | with one in any case |")
    print("|---|---|---|---|---|")
    for name in CASES:
        unit = unit_of(name)
        for disturbance in DISTURBANCES:
            errors, automatic = study(unit, disturbance, records)
            gains = [errors["none"] / errors[way] for way in ("auto", "always")]
            texts = [f"{g.min():.2f} ... {np.median(g):.2f} ... {g.max():.2f}" for g in gains]
            row = (name, disturbance.label, f"{automatic} of {records}", *texts)
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
