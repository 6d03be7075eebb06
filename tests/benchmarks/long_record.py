"""Time a fit of AC1A to a record of a million rows, as a whole process with all its figures.

Run it as ``python tests/benchmarks/long_record.py [ROWS]``. Beside it stands what NumPy takes for
reading the same file alone.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
ROWS = 1_000_000
REPEATS = 3
NOISE = 1e-4  # pu
TRUTH = ROOT / "tests" / "reference" / "reference_ac1a.csv"


def written(folder, rows):
    """Write the record, the reference trajectory with noise, and its case; return the case."""
    known = np.genfromtxt(TRUTH, delimiter=",", names=True)
    t = np.linspace(0.0, 10.0, rows, endpoint=False)
    noise = NOISE * np.random.default_rng(1).standard_normal(rows)
    vt = np.interp(t, known["t"], known["vt"]) + noise
    columns = np.column_stack([t, vt])
    np.savetxt(folder / "long.csv", columns, "%.7f", ",", header="t,vt", comments="")
    case = yaml.safe_load((ROOT / "configs" / "ac1a_typical.yaml").read_text())
    del case["validate"]
    case["record"]["file"] = "long.csv"
    (folder / "long.yaml").write_text(yaml.safe_dump(case))
    return folder / "long.yaml"


def fitted(case):
    """Return the seconds of a whole fit."""
    begin = time.perf_counter()
    code = "from exfit.cli import main; main()"
    command = [sys.executable, "-c", code, "fit", str(case), "-q", "-o", str(case.parent / "run")]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run(command, check=True, env=environment)
    return time.perf_counter() - begin


def read(case):
    """Return the seconds that NumPy takes for the file."""
    begin = time.perf_counter()
    np.loadtxt(case.parent / "long.csv", delimiter=",", skiprows=1)
    return time.perf_counter() - begin


def main():
    """Print the table."""
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else ROWS
    with tempfile.TemporaryDirectory() as room:
        case = written(Path(room), rows)
        fitted(case)  # compiles
        seconds = sorted(fitted(case) for _ in range(REPEATS))[REPEATS // 2]
        alone = sorted(read(case) for _ in range(REPEATS))[REPEATS // 2]
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
    table = Table("what", "seconds", "times reading", "peak (GB)", title=f"{rows} rows")
    table.add_row(
        "exfit fit, with figures", f"{seconds:.1f}", f"{seconds / alone:.1f}", f"{peak:.2f}"
    )
    table.add_row("numpy.loadtxt of the file", f"{alone:.2f}", "1.0", "")
    Console().print(table)


if __name__ == "__main__":
    main()
