"""The programme of configs/programmes with few free parameters, so that its fits take a second."""

from pathlib import Path

import yaml
from places import ROOT

EXAMPLE = ROOT / "configs" / "programmes" / "ac8b_unit1.yaml"
TRUTH = {
    "KPR": 78.84, "KIR": 2.4636, "KDR": 37.05, "TDR": 0.1638, "TE": 1.4044, "KC": 0.0301,
    "KD": 0.0511,
}  # fmt: skip
FREE = ("KPR", "TE")
TPD0 = {"start": 5.0, "min": 2.0, "max": 12.0}
OF_MACHINE = "off-line"  # its test of the machine in place of a rejection: a step, for T'd0


def programme_content():
    """Return the content of a programme in which the exciter is nearly known."""
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    for test in content["tests"]:
        section = test.get("record", test)
        section["file"] = str((EXAMPLE.parent / section["file"]).resolve())
    fixed, free = content["parameters"]["fixed"], content["parameters"]["free"]
    content["parameters"] = {
        "fixed": {**fixed, **{name: TRUTH[name] for name in TRUTH if name not in FREE}},
        "free": {name: {**free[name], "start": TRUTH[name]} for name in FREE},
    }
    content["estimate"] = {"search": "local"}
    *at_rest, _, up, down = content["tests"]
    machine = {**up, "name": OF_MACHINE, "kind": "rejection", "free": {"Tpd0": TPD0}}
    content["tests"] = [*at_rest, up, down, machine]
    content["plant"]["parameters"]["Xpd"] = 0.3
    return content


def written(content, folder, name="unit.yaml"):
    """Return the file of a programme or case."""
    path = Path(folder) / name
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path
