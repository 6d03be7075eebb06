"""Units with governors whose data are drawn, their three tests by another simulation, and faults.

The tests are those of configs/programmes/hydro_unit.yaml: a step of the voltage reference, of an
isolated load, and of the governor's reference.
"""

from functools import cached_property

import numpy as np
import yaml
from event_sets import bounds
from places import CONFIGS
from scipy.signal import lfilter
from typed_governors import GOVERNORS, TYPICAL, TypedUnit
from whole_unit import EXCITER, MACHINE, SAMPLES, TESTS, noisy, response, save

from exfit.case.given_errors import given_std_errors
from exfit.features.programme.run import load_programme

FREE = {
    "TGOV1": ("R", "T1", "T2", "T3"),
    "IEEEG1": ("K", "T3", "T4", "T5"),
    "GAST": ("R", "T1", "T2", "Dturb"),
    "HYGOV": ("R", "r", "Tr", "TW"),
}
OUT_OF_REACH = {
    "TGOV1": {"VMAX": 2.0, "VMIN": -1.0},
    "IEEEG1": {"PMAX": 2.0, "PMIN": -1.0, "T1": 0.0, "T7": 0.0, "K7": 0.0},
    "GAST": {"AT": 1.8, "KT": 2.0, "VMAX": 2.0, "VMIN": -1.0},
    "HYGOV": {"GMAX": 2.0, "GMIN": -1.0},
}
POWER_REFERENCE = ("IEEEG1", "GAST")  # the others' is a speed
STEP = {"power": -0.1, "speed": -0.005}
SPREAD, START = 1.25, 1.6  # of true data to typical ones, of the start of a fit to them: a factor
BOUNDS = 6.0  # times the start
BAND = 0.001  # pu: dead band of a planted fault
LAG = 1.0  # s: of a planted transducer
LEAST = 0.3  # of a given value: what is left of it by a large error


def another_governor(content, columns):
    """Take a steam unit for a hydro unit, and any other for a steam unit."""
    kind = "HYGOV" if content["governor"]["model"] == "TGOV1" else "TGOV1"
    content["governor"] = {
        "model": kind,
        "parameters": {**TYPICAL[kind], **OUT_OF_REACH[kind]},
        "free": bounds({name: (TYPICAL[kind][name], 2.0 * BOUNDS) for name in FREE[kind]}),
    }
    for name in FREE[kind]:
        content["governor"]["parameters"].pop(name)
    step = content["tests"][2]["test"]["pref"][0]
    step["step"] = STEP["speed"]


def reference_size(content, columns):
    """Note a step of the governor's reference as a quarter larger."""
    content["tests"][2]["test"]["pref"][0]["step"] *= 1.25


def load_size(content, columns):
    """Note a step of the load as a quarter larger."""
    content["tests"][1]["test"]["network"][0]["YP"] = 0.5625


def inertia(content, columns):
    """Give the machine an inertia that is too small."""
    content["plant"]["parameters"]["H"] *= 0.7


def gate_scale(content, columns):
    """Let the gate's transducer show too much."""
    for each in columns.values():
        if "gate" in each:
            each["gate"] = 1.08 * each["gate"]


def power_lag(content, columns):
    """Let the transducer of the power have a lag."""
    for each in columns.values():
        if "p" in each:
            share = 1.0 - np.exp(-1.0 / (SAMPLES * LAG))
            at_rest = (1.0 - share) * each["p"][:10].mean()
            each["p"] = lfilter([share], [1.0, share - 1.0], each["p"], zi=[at_rest])[0]


def clock(content, columns):
    """Let the clock of the test of the load be fast."""
    columns["load"]["t"] = 1.05 * columns["load"]["t"]


def given_off(content, path, rng):
    """Give values as far from the truth as it lies about them: by their errors, if stated."""
    case = load_programme(path).shared_case()
    plant, fixed, values = content["plant"], content["parameters"]["fixed"], case.values()
    sections = {
        "machine": plant["parameters"],
        "network": plant["network"],
        "governor": content["governor"]["parameters"],
    }
    for name, error in given_std_errors(case).items():
        *part, symbol = name.split(".")
        section, true = sections[part[0]] if part else fixed, values[name]
        if symbol in section:
            share = 1.0 + error / abs(true) * float(rng.standard_normal())
            section[symbol] = true / max(share, LEAST)


FAULTS = {
    "another governor": another_governor,
    "size of the reference": reference_size,
    "size of the load": load_size,
    "inertia": inertia,
    "scale of the gate": gate_scale,
    "lag of the power": power_lag,
    "clock": clock,
    "dead band": None,  # of the unit itself
}
WORDS = {  # of a cause that names the fault
    "another governor": r"the model",
    "size of the reference": r"size of the step.* of reference",
    "size of the load": r"size of the step.* of load",
    "inertia": r"^machine\.H\b",
    "scale of the gate": r"the base of gate",
    "lag of the power": r"averages|filters",
    "clock": r"clock",
    "dead band": r"dead band|DB[HL]",
}


class Banded:
    """A governor with a dead band of the speed."""

    def __init__(self, governor):
        self.own = governor

    def __getattr__(self, name):
        return getattr(self.own, name)

    def slopes(self, x, dw, fs, pref):
        seen = dw + fs
        beyond = seen - np.clip(seen, -BAND, BAND)
        return self.own.slopes(x, dw, beyond - dw, pref)


class DrawnUnit:
    """A unit drawn by a number, its tests, and the case that finds its data."""

    def __init__(self, number):
        self.number, rng = number, np.random.default_rng([35, number])
        self.kind = [*GOVERNORS][number % len(GOVERNORS)]

        def drawn(values, spread=SPREAD):
            factors = spread ** rng.uniform(-1.0, 1.0, len(values))
            return {
                k: float(f"{v * f:.4g}") for (k, v), f in zip(values.items(), factors, strict=True)
            }

        times = {"Tpd0": MACHINE["Tpd0"], "H": MACHINE["H"]}
        self.machine = {**MACHINE, **drawn(times)}
        self.exciter = drawn(EXCITER)
        self.governor = drawn(TYPICAL[self.kind])
        if self.kind == "IEEEG1":  # whose shares make 1
            self.governor["K5"] = 1.0 - self.governor["K1"] - self.governor["K3"]
        known = {f"governor.{name}": self.governor[name] for name in FREE[self.kind]}
        known = self.exciter | known
        self.start = drawn(known, START)
        own = {f"governor.{name}": value for name, value in self.governor.items()}
        machine = {f"machine.{name}": value for name, value in self.machine.items()}
        network = {"network.X": self.tests["reference"][2][3]}
        self.truth = own | machine | network | known

    @property
    def tests(self):
        """The tests, by their names."""
        of_power = self.kind in POWER_REFERENCE
        size = STEP["power" if of_power else "speed"]
        *others, _ = TESTS["reference"]
        return {"avr": TESTS["avr"], "load": TESTS["load"],
                "reference": (*others, {"pref": ((2.03, size),)})}  # fmt: skip

    def content(self):
        """Return the content of the programme."""
        path = CONFIGS / "programmes" / "hydro_unit.yaml"
        content = yaml.safe_load(path.read_text(encoding="utf-8"))

        def free(names, prefix=""):
            return bounds({name: (self.start[prefix + name], BOUNDS) for name in names})

        own = {k: v for k, v in self.governor.items() if k not in FREE[self.kind]}
        content["plant"]["parameters"] = dict(self.machine)
        content["governor"] = {
            "model": self.kind,
            "parameters": {**own, **OUT_OF_REACH[self.kind]},
            "free": free(FREE[self.kind], "governor."),
        }
        content["parameters"]["free"] = free(self.exciter)
        content["tests"] = [each for each in content["tests"] if each["name"] in self.tests]
        for each in content["tests"]:
            each["record"]["file"] = f"{each['name']}.csv"
            each["test"].pop("vt0", None)
        content["tests"][1]["test"]["vt0"] = 1.0
        content["tests"][2]["test"] = {"vt0": 1.02, "pref": [
            {"at": 2.03, "step": self.tests["reference"][-1]["pref"][0][1]}]}  # fmt: skip
        return content

    def responses(self, dead_band=False):
        """Return the samples of each test, without noise."""
        unit = TypedUnit("GENSAL", self.machine, self.exciter, self.kind, self.governor)
        if dead_band:
            unit.governor = Banded(unit.governor)
        return {name: response(test, unit) for name, test in self.tests.items()}

    @cached_property
    def sound(self):
        """The samples of each test of the unit without a fault, without noise."""
        return self.responses()

    def write(self, folder, draw=0, fault=None, given="stated"):
        """Write the records and the programme, with a fault if one is named; return its path.

        Given values are true; ``given`` is "exact", where the case says so, or "drawn", where they
        are as wrong as their default errors say.
        """
        rng = np.random.default_rng([35, self.number, draw])
        content = self.content()
        clean = self.responses(dead_band=True) if fault == "dead band" else self.sound
        columns = {name: noisy(each, rng) for name, each in clean.items()}
        if fault is not None and FAULTS[fault] is not None:
            FAULTS[fault](content, columns)
        for name, each in columns.items():
            save(folder / f"{name}.csv", each)
        path = folder / "programme.yaml"
        if given == "exact":
            content["given"] = given
        if given == "drawn":
            path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
            given_off(content, path, rng)
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        return path
