"""Valid cases that ask for much: long tests, short steps, many samples, parameters and records."""

import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

TYPICAL = yaml.safe_load(
    (Path(__file__).parents[2] / "configs/ac1a_typical.yaml").read_text(encoding="utf-8")
)
COMMANDS = ("simulate", "fit", "check", "fit")
CHANNELS = {"vt": 1e-4, "efd": 5e-3, "ifd": 5e-3}  # noise, pu
CHILD = r"""
import resource, subprocess, sys
limit = int(sys.argv[1])
hold = lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
done = subprocess.run(sys.argv[2:], capture_output=True, text=True, preexec_fn=hold)
own = resource.getrusage(resource.RUSAGE_CHILDREN)
print(done.returncode, own.ru_maxrss * 1024, own.ru_utime + own.ru_stime)
print(done.stderr.strip())
"""


class Ended(NamedTuple):
    """How a command ended: its exit code, peak of memory (bytes), processor time (s), its error."""

    code: int
    peak: int
    seconds: float
    error: str


def write_case(folder: Path, rng: np.random.Generator, command: str) -> float:
    """Draw a case into FOLDER/case.yaml; return the memory (GB) that it allows."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    memory = float(rng.choice([0.4, 0.6, 1.0, 2.0]))
    case = {**TYPICAL, "validate": [], "test": dict(TYPICAL["test"])}
    simulation = {"memory": memory, "output_step": float(f"{between(1e-3, 1.0):.2g}")}
    if rng.random() < 0.5:
        simulation["step"] = float(f"{between(1e-6, 1e-2):.2g}")
    free = {name: TYPICAL["parameters"]["free"][name] for name in
            [*TYPICAL["parameters"]["free"]][: int(rng.integers(1, 8))]}  # fmt: skip
    fixed = {**TYPICAL["parameters"]["fixed"]}
    fixed |= {n: row["start"] for n, row in TYPICAL["parameters"]["free"].items() if n not in free}
    case |= {"simulation": simulation, "parameters": {"fixed": fixed, "free": free}}
    case["estimate"] = {"iterations": 3, "search": "local", "causes": 0}
    if command in ("simulate", "check"):
        del case["record"]
        case["test"]["duration"] = float(f"{between(1.0, 1e6):.3g}")
    else:
        del case["record"], case["test"]
        duration = between(5.0, 1e4)
        samples = round(duration / between(max(1e-3, duration / 1e6), 0.25))
        names = [*CHANNELS][: int(rng.integers(1, 4))]
        file, time = folder / "record.csv", np.linspace(0.0, duration, samples)
        moved = 0.05 * np.where(time < 1.0, 0.0, 1.0 - np.exp(1.0 - time))
        columns = [1.0 + moved + CHANNELS[name] * rng.standard_normal(samples) for name in names]
        np.savetxt(file, np.column_stack([time, *columns]), "%.9g", ",",
                   header=",".join(("t", *names)), comments="")  # fmt: skip
        record = {"file": file.name, "time": "t", "channels": {name: name for name in names}}
        count = round(between(1, 12))
        case["records"] = [
            {"name": f"r{k}", "test": TYPICAL["test"], "record": record} for k in range(count)
        ]
    (folder / "case.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")
    return memory


def run(folder: Path, command: str, seconds: int) -> Ended:
    """Run a command on FOLDER/case.yaml in a process of its own, for so much processor time."""
    words = [sys.executable, "-m", "exfit", command, str(folder / "case.yaml")]
    if command != "check":
        words += ["-o", str(folder / "out"), "--quiet", "--no-plots"]
    lines = subprocess.run(
        [sys.executable, "-c", CHILD, str(seconds), *words], capture_output=True, text=True,
        check=True,
    ).stdout.splitlines()  # fmt: skip
    code, peak, taken = lines[0].split()
    return Ended(int(code), int(peak), float(taken), "\n".join(lines[1:]))
