"""Every command that writes files, in a folder with what each needs."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from commands import ENDING
from grid_events import event_case, recorded
from places import CONFIGS, SAMPLES

CASE = CONFIGS / "first_order.yaml"
WITHOUT_CAUSES = {"causes": 0}  # of a misfit they would be most of the time
FEW = ("KA", "TE")  # parameters of the AC1A case that are fitted here
# commands, and what they write: a file, or a folder in which no figure is drawn
WRITERS = {
    "fit": ("fit", "case.yaml", "--no-plots", "-o", "fitted"),
    "several fits": ("fit", "case.yaml", "other.yaml", "--no-plots", "-o", "fits"),
    "simulate": ("simulate", "case.yaml", "--no-plots", "-o", "simulated"),
    "validate": ("validate", "unit.yaml", "--no-plots", "--parameters", "fit/parameters.yaml",
                 "-o", "validated"),
    "profile": ("profile", "case.yaml", "--no-plots", "-o", "profiled"),
    "identify": ("identify", "case.yaml", "--no-plots", "-o", "identified"),
    "inspect": ("inspect", "record.csv", "--no-plots", "-o", "inspected"),
    "compare": ("compare", "record.csv", "record.csv", "--no-plots", "-o", "compared"),
    "translate": ("translate", "fit", "--model", "AC1A", "--no-plots", "-o", "translated"),
    "run": ("run", "case.yaml", "--no-plots", "-o", "programme"),
    "rank": ("rank", "unit.yaml", "--models", "AC1A", "--search", "local", "--no-plots",
             "-o", "ranked"),
    "report": ("report", "fit", "-o", "report.html"),
    "new": ("new", "--model", "AC1A", "--record", "record.csv", "--step", "0.05", "--force",
            "-o", "new.yaml"),
    "batch": ("batch", "case.yaml", "--workers", "1", "-o", "fleet"),
    "import all": ("import", "unit.dyr", "--all", "--force", "-o", "units"),
    "import": ("import", "unit.dyr", "--force", "-o", "imported.yaml"),
    "export": ("export", "fit", "--force", "-o", "exported.dyr"),
}  # fmt: skip


def prepare(place: Path) -> None:
    """Write what the commands read into a folder, but for the fit that they read too."""
    shutil.copy(SAMPLES / "ac1a_up.csv", place / "record.csv")
    shutil.copy(SAMPLES / "unit.dyr", place)
    for name, case, free in (("case", CASE, ()), ("unit", CONFIGS / "ac1a_typical.yaml", FEW)):
        content = yaml.safe_load(case.read_text(encoding="utf-8"))
        for recording in (content, *content["validate"]):
            file = recording["record"]["file"]
            recording["record"]["file"] = str((case.parent / file).resolve())
        if free:
            parameters = content["parameters"]
            others = {
                key: row["start"] for key, row in parameters["free"].items() if key not in free
            }
            parameters["fixed"] |= others
            parameters["free"] = {key: parameters["free"][key] for key in free}
        content["estimate"] = {"search": "local"}
        (place / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    content["estimate"] |= WITHOUT_CAUSES
    (place / "before.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    shutil.copy(place / "case.yaml", place / "other.yaml")


FIT_BEFORE = ("fit", "before.yaml", "--no-plots", "-o", "fit")  # which others read

# every command and what else a command writes; one that is new is given a case
OTHERS = {
    "batch": (*WRITERS["batch"], "--reports"),
    "fit --apply": ("fit", "late.yaml", "--apply", "1", "--no-plots", "--search", "local"),
    "verify": ("verify", "record.csv", "--model", "AC1A", "--step", "0.05", "--force",
               "-o", "verified.html"),
    "models": ("models", "AC1A", "--plot", "drawn"),
    "check": ("check", "old.yaml", "--write"),
    "show": ("show", "fit"),
    "schema": ("schema",),
    "trust": ("trust", "."),
    "export --plb": ("export", "event", "--plb", "event.plb", "--force"),
}  # fmt: skip
NAMED = {**WRITERS, **OTHERS}
EVERY = NAMED | {
    name: (name, "case.yaml") for name in ENDING - {arguments[0] for arguments in NAMED.values()}
}
INTERRUPTED = EVERY | {"app": ("app", "case.yaml", "--no-browser")}


def prepare_every(place: Path, run: Callable[..., object]) -> None:
    """Write what every command reads into a folder; ``run`` runs those that make it, there."""
    prepare(place)
    old = (CONFIGS / "models" / "sexs.yaml").read_text(encoding="utf-8")
    (place / "old.yaml").write_text(f"{old}  sources: {{K: maker}}\n", encoding="utf-8")
    columns = np.column_stack([TIME, TRUTH])
    np.savetxt(place / "bump.csv", columns, delimiter=",", header="t,vt")
    late = FIRST_ORDER | {  # the step of the record is at 0
        "test": {"vt0": 0.0, "vref": [{"at": 0.7, "step": 1.0}]},
        "record": {"file": "bump.csv", "time": "t", "channels": {"vt": "vt"}},
    }
    (place / "late.yaml").write_text(yaml.safe_dump(late), encoding="utf-8")
    (place / "grid").mkdir()
    recorded(place / "grid" / "event.csv")
    event_case(place / "grid", "event", estimate=WITHOUT_CAUSES)
    for case, *options in (("late.yaml",), ("grid/case.yaml", "-o", "event")):
        run("fit", case, "--no-plots", "--search", "local", "-q", *options)
    run(*FIT_BEFORE)
