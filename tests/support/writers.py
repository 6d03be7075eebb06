"""Every command that writes files, in a folder with what each needs."""

import shutil
from pathlib import Path

import yaml
from places import CONFIGS, SAMPLES

CASE = CONFIGS / "first_order.yaml"
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
    "rank": ("rank", "unit.yaml", "--models", "AC1A", "--no-plots", "-o", "ranked"),
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
    shutil.copy(place / "case.yaml", place / "other.yaml")


FIT_BEFORE = ("fit", "unit.yaml", "--no-plots", "-o", "fit")  # which others read

# every command: those that write, what else they write, and those that only show
EVERY = WRITERS | {
    "batch": (*WRITERS["batch"], "--reports"),
    "verify": ("verify", "record.csv", "--model", "AC1A", "--step", "0.05", "--force",
               "-o", "verified.html"),
    "models": ("models", "AC1A", "--plot", "drawn"),
    "check": ("check", "old.yaml", "--write"),
    "show": ("show", "fit"),
    "schema": ("schema",),
    "trust": ("trust", "."),
    "fit --apply": ("fit", "slow.yaml", "--apply", "1", "--no-plots", "-q"),
    "export --plb": ("export", "fit", "--plb", "unit.plb"),
}  # fmt: skip
READS_A_FIT = ("fit", "fit/parameters.yaml")


def needs_a_fit(name: str) -> bool:
    """Whether a command reads the fit that FIT_BEFORE makes."""
    return not {*READS_A_FIT}.isdisjoint(EVERY[name][1:])
