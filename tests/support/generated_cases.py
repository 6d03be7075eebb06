"""Cases of eight models with records that the simulator makes: as many as wanted, no two alike."""

import numpy as np
import yaml
from places import CONFIGS

from exfit import workflows
from exfit.case.case import Case

MODELS = ("ac1a", "ac4a", "ac8b", "dc1a", "exac4", "sexs", "st1a", "st4b")
# of these the first three that a model has, and that are not 0, are fitted
FITTED = ("KA", "KPR", "K", "TA", "TE", "KIR", "KF", "KPM", "TB", "TF", "TC")
FREE = 3
SPREAD = 0.25  # standard deviation of the logarithm of a true value about its start
BOUNDS = (0.1, 10.0)  # times the start
NOISE = 1e-4  # pu, of vt


def generated_cases(folder, count, seed=11):
    """Write so many cases and their records into a folder; return the paths of the cases."""
    rng = np.random.default_rng(seed)
    return [_case(folder, number, rng) for number in range(count)]


def _case(folder, number, rng):
    model = MODELS[number % len(MODELS)]
    content = content_of(model)
    fixed = content["parameters"]["fixed"]
    names = [name for name in FITTED if fixed.get(name)][:FREE]
    name = f"{number:04}_{model}"
    record, case = folder / "records" / f"{name}.csv", folder / "cases" / f"{name}.yaml"
    content["about"] = {"Unit": f"Unit {number}"}
    free_and_record(content, names, rng, record)
    content["record"]["file"] = f"../records/{name}.csv"
    case.parent.mkdir(parents=True, exist_ok=True)
    case.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return case


def content_of(model):
    """Return the case of a model with its typical data."""
    return yaml.safe_load((CONFIGS / "models" / f"{model}.yaml").read_text(encoding="utf-8"))


def free_and_record(content, names, rng, record):
    """Free values of a case, of its model or of the machine, and write a record that shows them.

    The truth is drawn near the values, which are the starts.
    """
    fixed, machine = content["parameters"]["fixed"], content["plant"].get("parameters", {})
    values = {**fixed, **{f"machine.{name}": value for name, value in machine.items()}}
    starts = {name: float(values[name]) for name in names}
    truth = {name: start * rng.lognormal(0.0, SPREAD) for name, start in starts.items()}
    response = workflows.simulate(Case.from_dict(content), truth).response
    vt = response.signals["vt"] + NOISE * rng.standard_normal(len(response.time))
    record.parent.mkdir(parents=True, exist_ok=True)
    rows = (f"{t:.10g},{v:.9g}" for t, v in zip(response.time, vt, strict=True))
    record.write_text("\n".join(["t,vt", *rows]) + "\n", encoding="utf-8")
    del content["test"]["duration"]
    for name, start in starts.items():
        of_machine, own = name.startswith("machine."), name.removeprefix("machine.")
        section = content["plant" if of_machine else "parameters"]
        del section["parameters" if of_machine else "fixed"][own]
        low, high = start * BOUNDS[0], start * BOUNDS[1]
        section.setdefault("free", {})[own] = {"start": start, "min": low, "max": high}
    content["record"] = {"file": record.name, "time": "t", "channels": {"vt": "vt"}}
