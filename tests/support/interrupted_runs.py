"""Runs of `exfit fit` that a signal meets at some moment, and what they leave of their folder."""

import json
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass

import yaml
from cases import FILES_OF_A_FIT
from ended_commands import heeding_interrupts
from places import ROOT

CASE = ROOT / "configs" / "first_order.yaml"
PROGRAM = (sys.executable, "-c", "from exfit.cli import main; main()")
NUMBERS = {name for name in FILES_OF_A_FIT if not name.endswith(".png")}
VALIDATED = "down-step.csv"
FORMER = "former-step"  # name of the record that the fit before was validated on
OWN = {f"{FORMER}.csv", f"{FORMER}.png"}  # which only that fit leaves
TEMPORARY = ".exfit-*"
PATIENCE = 120.0  # s


@dataclass(frozen=True)
class Outcome:
    """What a run left that a signal met.

    ``result`` is "old" or "new", or "lost" where it is neither of the two, whole; ``together``
    whether all numbers beside it are of the same run; ``temporary`` counts the temporary files.
    """

    result: str
    together: bool
    temporary: int
    code: int
    errors: str


def fit(case, folder):
    """Start a fit, figures included, in a process of its own."""
    with heeding_interrupts():
        return subprocess.Popen(
            [*PROGRAM, "fit", str(case), "-o", str(folder)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )


def fit_before(place):
    """Return the folder of a fit as the one before a run leaves it, and how long that took, s."""
    content = yaml.safe_load(CASE.read_text(encoding="utf-8"))
    for recording in (content, *content["validate"]):
        file = CASE.parent / recording["record"]["file"]
        recording["record"]["file"] = str(file.resolve())
    content["validate"][0]["name"] = FORMER
    (place / "case.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return place / "before", seconds_of_fit(place / "case.yaml", place / "before")


def seconds_of_fit(case, folder):
    """Return how long a fit takes with its figures, s."""
    began = time.perf_counter()
    process = fit(case, folder)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    return time.perf_counter() - began


def met_by(number, moment, before, folder, while_writing=False):
    """Return what a fit leaves that a signal meets a moment, s, after it began.

    The moment counts from its first temporary file on where it is to be met ``while_writing``.
    """
    shutil.copytree(before, folder)
    process = fit(CASE, folder)
    while while_writing and process.poll() is None and not any(folder.glob(TEMPORARY)):
        time.sleep(1e-4)
    time.sleep(moment)
    process.send_signal(number)
    _, errors = process.communicate(timeout=PATIENCE)
    return outcome(before, folder, process.returncode, errors)


def outcome(before, folder, code, errors):
    """Return what stands in a folder after a run that began with what stands in another."""
    left, temporary = names(folder), len([*folder.glob(TEMPORARY)])
    new = read(folder / "result.json")
    if new == read(before / "result.json"):
        tables = names(before) & (NUMBERS | OWN) - {f"{FORMER}.png"}
        together = all(read(before / name) == read(folder / name) for name in tables)
        return Outcome("old", together, temporary, code, errors)
    try:
        content = json.loads(new or b"")
        validated = {f"{match['name']}.csv" for match in content["validation"]}
        # one that was interrupted before its first iteration has none to show
        expected = NUMBERS - ({VALIDATED} if content["history"] else {VALIDATED, "iterations.csv"})
        result = "new" if content["parameters"] else "lost"
    except (ValueError, LookupError):
        return Outcome("lost", False, temporary, code, errors)
    # one that was interrupted between its search and its validation has none
    together = left >= expected | validated and not left & OWN
    return Outcome(result, together, temporary, code, errors)


def names(folder):
    """Return the names of the files in a folder."""
    return {path.name for path in folder.iterdir()}


def read(path):
    """Return the content of a file, None where there is none."""
    return path.read_bytes() if path.is_file() else None
