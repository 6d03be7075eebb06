"""Cases whose intervals are hard to get right, and records of them made by simulation.

Each is a case of configs/, changed, with the truth that its records are made with. The records are
the exact response at the truth with new noise; the fit begins where the case says.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml
from linearised import autoregressive
from places import CONFIGS
from scipy.signal import lfilter

from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.case.load import parse_case
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import problem_of, residuals_of
from exfit.records.record import Record

# what the sample records were made with: sample_data/README.md
AC1A = {"KA": 364.1523, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542}
AC1A |= {"KC": 0.486, "KD": 0.4039}
UNIT2 = {"KPR": 85.6266, "KIR": 2.5912, "KDR": 25.381, "TDR": 0.2044, "TE": 1.8426}
UNIT2 |= {"KC": 0.3233, "KD": 0.0265}
FINE, COARSE = 1e-4, 5e-4  # pu: noise of vt, and the digit of a coarse recorder
LEAST = 0.3  # of a given value: what is left of it by a large error
TIME = np.linspace(0.0, 10.0, 1001)
EVERY_5_MS = np.linspace(0.0, 6.0, 1201)


@dataclass(frozen=True)
class HardCase:
    """A case, the truth of its records and their noise.

    changes   dotted place in the case file to what stands there; None removes it
    fixed     free parameters of the case that are fixed at the truth
    noise     standard deviation of the noise of each signal, per unit
    phi       share of each error in the next one
    rounding  of the recorder, whose zero lies anywhere: per unit
    """

    title: str
    config: str
    truth: Mapping[str, float]
    changes: Mapping[str, object] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    noise: Mapping[str, float] = field(default_factory=lambda: {"vt": FINE})
    phi: float = 0.0
    rounding: float = 0.0
    time: np.ndarray = field(default_factory=lambda: TIME)


def free(start, times=10.0, **more):
    """Return the section of a free parameter, from a start to so many times it either way."""
    return {"start": start, "min": start / times, "max": start * times, **more}


NO_LIMIT = {"parameters.fixed.VAMAX": 20.0, "parameters.fixed.VRMAX": 20.0}
STEADY = {"config": "ac1a_typical", "truth": AC1A, "fixed": ("KD", "KC"), "changes": NO_LIMIT}
HARD_CASES = {
    "linear": HardCase("AC1A, no limit reached", **STEADY),
    "ac1a_limit": HardCase("AC1A, VA near its limit", "ac1a_typical", AC1A, fixed=("KD",)),
    "ac1a_kd": HardCase("AC1A, KD free", "ac1a_typical", AC1A),
    "ac8b_unit2": HardCase("AC8B unit 2, two minima", "ac8b_unit2", UNIT2),
    "ac8b_unit2_both": HardCase("AC8B unit 2, both steps", "ac8b_unit2_both", UNIT2),
    "ac8b_ifd": HardCase(
        "AC8B, vt and ifd, KC and KD free",
        "ac8b_unit2",
        UNIT2 | {"KC": 0.25, "KD": 0.3},
        {"record.channels": {"vt": "vt", "ifd": "ifd"}},
        noise={"vt": FINE, "ifd": 3e-4},
    ),
    "st3a": HardCase(
        "ST3A, KM/TM alone is seen",
        "models/st3a",
        {"KM": 7.93, "TM": 0.4, "KA": 200.0},
        {
            "parameters.free.KM": free(7.93),
            "parameters.free.TM": free(0.4),
            "parameters.free.KA": free(150.0),
        },
    ),
    "uneven": HardCase(
        "AC1A, vt and efd, noise 1:100",
        "ac1a_typical",
        AC1A,
        {"record.channels": {"vt": "vt", "efd": "efd"}},
        fixed=("KD",),
        noise={"vt": FINE, "efd": 100.0 * FINE},
    ),
    "coarse": HardCase("AC1A, rounded to 5e-4", **STEADY, rounding=COARSE),
    "coloured": HardCase("AC1A, AR(1) of 0.6", **STEADY, phi=0.6),
    "coloured_slow": HardCase("AC1A, AR(1) of 0.9", **STEADY, phi=0.9),
    "st6b_instant": HardCase(
        "ST6B with efd, instant of the step free",
        "models/st6b",
        {"KPA": 18.038, "KIA": 45.094, "vref.at": 1.0049},
        {
            "record.channels": {"efd": "efd"},
            "test.vref": [{"at": {"start": 1.0, "min": 0.9, "max": 1.1}, "step": 0.05}],
            "parameters.free.KPA": free(30.0),
            "parameters.free.KIA": free(30.0),
        },
        noise={"efd": 5e-2},
        time=EVERY_5_MS,
    ),
}


def content_of(hard):
    """Return the content of the case file."""
    content = yaml.safe_load((CONFIGS / f"{hard.config}.yaml").read_text(encoding="utf-8"))
    content.pop("validate", None)
    content["test"] = {k: v for k, v in content.get("test", {}).items() if k != "duration"}
    single = {"file": "", "time": "t", "channels": {"vt": "vt"}}
    recordings = content.get("records") or [content | {"record": content.get("record", single)}]
    content |= {} if "records" in content else recordings[0]
    for place, value in hard.changes.items():
        *parents, last = place.split(".", 1) if place.count(".") < 2 else place.split(".", 2)
        section = content
        for parent in parents:
            section = section.setdefault(parent, {})
        section[last] = value
    for section in content.get("records", [content]):
        section["record"]["file"] = "record.csv"
    for name in hard.fixed:
        content["parameters"]["fixed"][name] = hard.truth[name]
    for name in hard.fixed:
        content["parameters"]["free"].pop(name)
    for name in content["parameters"]["free"]:
        content["parameters"]["fixed"].pop(name, None)
    if not content["test"]:
        content.pop("test")
    return content


@cache
def exact(name):
    """Return the case and its tests, whose records are the exact response at the truth."""
    hard = HARD_CASES[name]
    content = content_of(hard)
    signals = [*hard.noise]
    with TemporaryDirectory() as folder:
        columns = np.column_stack([hard.time, *[np.ones_like(hard.time)] * len(signals)])
        header = ",".join(["t", *signals])
        np.savetxt(Path(folder) / "record.csv", columns, "%.6g", ",", header=header, comments="")
        case = parse_case(yaml.safe_dump(content, sort_keys=False), Path(folder) / "case.yaml")
        values = {**case.values(), **hard.truth}
        setups = [setup.with_enough_substeps(values) for setup in build_experiments(case)]
    exact = []
    for setup in setups:
        samples = setup.experiment.samples(values)[0]
        channels = tuple(
            replace(channel, measured=samples[:, k])
            for k, channel in enumerate(setup.experiment.channels)
        )
        experiment = replace(setup.experiment, channels=channels)
        exact.append(replace(setup, experiment=experiment))
    return case, tuple(exact)


def noisy(name, rng):
    """Return the case, its tests with new noise on their records, and what is made small."""
    hard = HARD_CASES[name]
    case, setups = exact(name)
    tests = tuple(with_noise(setup, hard, rng) for setup in setups)
    return case, tests, problem_of(residuals_of(case, tests))


def with_noise(setup, hard, rng):
    """Return a test with new noise on the channels of its record."""

    def recorded(channel):
        noise = hard.noise[channel.signal] * autoregressive(rng, hard.phi, len(channel.measured))
        samples = channel.measured + noise
        if hard.rounding:
            zero = hard.rounding * rng.uniform()
            samples = zero + hard.rounding * np.round((samples - zero) / hard.rounding)
        return replace(channel, measured=samples)

    channels = tuple(recorded(channel) for channel in setup.experiment.channels)
    return replace(setup, experiment=replace(setup.experiment, channels=channels))


def about_given(case, rng):
    """Return a true value for each given one of a case that has an error, about it by that."""
    values = case.values()
    return {
        given: values[given] * max(1.0 + rng.standard_normal() * error / abs(values[given]), LEAST)
        for given, error in given_std_errors(case).items()
    }


def drawn(name, rng):
    """Return a case whose given values are as wrong as their default errors say, and the truth.

    Each true value lies about the given one by its error, those of no unit left out; the record is
    the response to these, with noise.
    """
    hard, content = HARD_CASES[name], content_of(HARD_CASES[name])
    content.pop("given", None)
    del content["record"]["file"]
    blank = {signal: np.ones_like(hard.time) for signal in hard.noise}
    case = Case.from_dict(content, Record.from_arrays(hard.time, blank))
    values, truth = case.values(), about_given(case, rng) | hard.truth
    (setup,) = build_experiments(case)
    setup = setup.with_enough_substeps({**values, **truth})
    samples = setup.experiment.samples({**values, **truth})[0]
    recorded = {
        channel.signal: samples[:, k]
        + hard.noise[channel.signal] * rng.standard_normal(len(samples))
        for k, channel in enumerate(setup.experiment.channels)
    }
    return Case.from_dict(content, Record.from_arrays(hard.time, recorded)), truth


def truth_of(name, problem):
    """Return the true parameters of a case as the estimator has them (N,)."""
    truth = HARD_CASES[name].truth
    return np.array(
        [parameter.scaled(truth[parameter.name]) for parameter in problem.residuals.free]
    )


def covariance_of(name, channel, slopes):
    """Return slopes' C slopes (N, N), C the covariance of the noise of a channel, slopes (M, N).

    Errors that repeat a share phi of the one before, and those of a recorder that rounds noisy
    samples, its zero anywhere: the Fourier series of what is left of the rounding by the noise.
    """
    hard = HARD_CASES[name]
    variance = hard.noise[channel.signal] ** 2
    filtered = lfilter([1.0], [1.0, -hard.phi], slopes[::-1], axis=0)[::-1]
    cross = slopes.T @ filtered
    middle = variance * (cross + cross.T - slopes.T @ slopes)
    if hard.rounding:
        exact_channel = {c.signal: c for c in exact(name)[1][0].experiment.channels}[channel.signal]
        noise, step = np.sqrt(variance), hard.rounding
        middle += step**2 / 12.0 * (slopes.T @ slopes)
        for k in range(1, 50):
            share = step**2 / (2.0 * (np.pi * k) ** 2)
            left = share * np.exp(-((2.0 * np.pi * k * noise / step) ** 2))
            wave = slopes.T @ np.exp(2j * np.pi * k * exact_channel.measured / step)
            middle += left * (np.outer(wave, wave.conj()).real - slopes.T @ slopes)
    return middle
