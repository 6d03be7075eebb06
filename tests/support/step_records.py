"""Synthetic records of step responses, drawn by a seeded generator, whose truth is known."""

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import yaml
from columns import Columns
from places import CONFIGS

from exfit.case.load import load_case
from exfit.workflows import simulate

MODELS = ("AC1A", "AC8B", "ST1A", "ST6B")
INTERVALS = (0.005, 0.01)  # s between two samples
NOISE = (1e-5, 1e-3)  # of the level of each channel: its standard deviation
SIZES = (0.01, 0.05)  # pu, of the reference, up or down
FINE = 5e-4  # s: the grid of the simulation, on which the steps are made
CHANNELS = ("vt", "efd", "ifd")


@dataclass(frozen=True)
class StepRecord:
    """A record of a step of the reference by ``size`` (pu) at ``at`` (s), and how it was drawn."""

    table: Columns
    at: float
    size: float
    model: str
    interval: float
    noise: float


@cache
def _response(model: str, size: float, at: float, length: float):
    return response_of_unit(model, size, at, length)


def response_of_unit(model: str, size: float, at: float, length: float, plant: dict | None = None):
    """Return the instants (M,) and the signals (M,) of a unit with typical data, per unit.

    ``plant`` is what differs from a unit on open circuit.
    """
    content = yaml.safe_load((CONFIGS / "models" / f"{model.lower()}.yaml").read_text("utf-8"))
    content["plant"] |= plant or {}
    content["test"] = {"vt0": 1.0, "duration": length, "vref": [{"at": at, "step": size}]}
    content["simulation"] = {"output_step": FINE}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.yaml"
        path.write_text(yaml.safe_dump(content), "utf-8")
        response = simulate(load_case(path)).response
    return response.time, response.signals


def step_record(seed: int, with_reference: bool = False, length: float = 10.0) -> StepRecord:
    """Return a record of all channels; ``with_reference``: the reference as well, with noise."""
    rng = np.random.default_rng(seed)
    model, interval = MODELS[seed % len(MODELS)], float(rng.choice(INTERVALS))
    size = round(float(rng.choice([-1.0, 1.0]) * rng.uniform(*SIZES)), 4)
    at = round(float(rng.uniform(1.0, 2.0)) / FINE) * FINE
    noise = float(np.exp(rng.uniform(*np.log(NOISE))))
    fine, signals = _response(model, size, at, length)
    time = np.arange(0.0, length, interval)
    clean = {name: np.interp(time, fine, signals[name]) for name in CHANNELS}
    if with_reference:
        clean["vref"] = np.where(time < at, 1.0, 1.0 + size)
    noisy = {name: y + rng.normal(0.0, noise * abs(y[0]), time.size) for name, y in clean.items()}
    return StepRecord(Columns({"t": time, **noisy}), at, size, model, interval, noise)
