"""Runs of `exfit run` that SIGKILL meets at some moment, and the runs that go on after them."""

import json
import subprocess
import sys
import time
from dataclasses import dataclass

PROGRAM = (sys.executable, "-c", "from exfit.cli import main; main()")
FOLDER = "out"
PATIENCE = 600.0  # s


@dataclass(frozen=True)
class Resumed:
    """What a kill left, and what the next run made of it.

    ``done`` names the tests whose results were there at the kill, ``again`` those among them that
    the next run did a second time, ``lost`` those whose result it changed; ``same_report`` is
    whether its report is that of a run without a kill, byte for byte; ``temporary`` counts the
    temporary files that are left after it.
    """

    done: tuple[str, ...]
    again: tuple[str, ...]
    lost: tuple[str, ...]
    same_report: bool
    temporary: int

    @property
    def whole(self):
        """Whether nothing was lost, done twice, or left over."""
        return self.same_report and not (self.again or self.lost or self.temporary)


def start(programme, place, *options):
    """Start a programme in a process of its own, in a folder of its own."""
    place.mkdir(parents=True, exist_ok=True)
    return subprocess.Popen(
        [*PROGRAM, "run", str(programme), "-o", FOLDER, "--json", *options],
        cwd=place,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def whole_run(programme, place, *options):
    """Return what a programme prints that no signal meets, and how long it took, s."""
    began = time.perf_counter()
    process = start(programme, place, *options)
    out, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode in (0, 3), errors
    return json.loads(out), time.perf_counter() - began


def killed_and_resumed(programme, place, moment, expected, *options):
    """Return what becomes of a programme that is killed a moment, s, after its start.

    ``expected`` is the report of a run without a kill.
    """
    process = start(programme, place, *options)
    try:
        process.communicate(timeout=moment)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
    folder = place / FOLDER
    left = {path.parent.name: path.read_bytes() for path in folder.glob("*/result.json")}
    content, _ = whole_run(programme, place, *options)
    kept = {test["name"] for test in content["tests"] if test["kept"]}
    after = {name: (folder / name / "result.json").read_bytes() for name in left}
    return Resumed(
        done=tuple(test["name"] for test in content["tests"] if test["name"] in left),
        again=tuple(name for name in left if name not in kept),
        lost=tuple(name for name in left if after[name] != left[name]),
        same_report=report_of(place) == expected,
        temporary=len([*folder.rglob(".exfit-*")]),
    )


def report_of(place):
    """Return the report of a programme; it says nothing of how long its fits took."""
    return (place / FOLDER / "report.html").read_bytes()
