"""Time the default fit of every exciter: processor time of whole processes, figures left out.

Run it as ``python tests/benchmarks/default_fits.py [FREE ...]``: so many free parameters of AC1A,
7, 8, 10 and 12 by default, then six of every exciter. First are those that a bump test is fitted
for, then time constants and saturation of the machine. Records are simulated at values drawn near
the typical ones, with noise. Each time is the least of three, in imports of NumPy as well, which
take turns with the fits.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from generated_cases import content_of, free_and_record
from places import CONFIGS
from processes import EXFIT, spent

from exfit.models import MODELS

OF_AC1A = (7, 8, 10, 12)
SIX = 6
OF_MACHINE = ("Tpd0", "Tppd0", "S10", "S12", "Xppd")
TURNS = 3
MODEL_CASES = CONFIGS / "models"


def written(folder, model, count):
    """Write a case with so many free parameters, and its record."""
    content = content_of(model.lower())
    values = {**content["parameters"]["fixed"]}
    values |= {f"machine.{name}": v for name, v in content["plant"].get("parameters", {}).items()}
    wanted = [row.symbol for row in MODELS[model].sheet if row.free]
    wanted += ["KE", *(f"machine.{name}" for name in OF_MACHINE)]
    names = [name for name in dict.fromkeys(wanted) if values.get(name)][:count]
    rng = np.random.default_rng([count, *model.encode()])
    free_and_record(content, names, rng, folder / "record.csv")
    (folder / "case.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")


def times_of(model, count):
    """Return the processor time (s) of the default fit, and of an import of NumPy."""
    with tempfile.TemporaryDirectory() as room:
        written(Path(room), model, count)
        command = (*EXFIT, "fit", f"{room}/case.yaml", "--quiet", "--no-plots")
        turns = [
            (spent(command, room, codes=(0, 3)), spent(("-c", "import numpy"), room))
            for _ in range(TURNS)
        ]
    return [min(times.processor for times in way) for way in zip(*turns, strict=True)]


def main(counts):
    """Print the table."""
    table = Table("exciter", "free", "s", "imports of NumPy")
    every = [(name, SIX) for name in MODELS if (MODEL_CASES / f"{name.lower()}.yaml").exists()]
    of_six = []
    for model, count in [*(("AC1A", count) for count in counts), *every]:
        try:
            taken, unit = times_of(model, count)
        except AssertionError as fault:
            print(model, fault, file=sys.stderr)
            continue
        table.add_row(model, f"{count}", f"{taken:.2f}", f"{taken / unit:.1f}")
        of_six += [taken / unit] * ((model, count) in every)
    Console().print(table)
    print(f"six free: median {np.median(of_six):.1f}, most {max(of_six):.1f} imports of NumPy")


if __name__ == "__main__":
    main([int(each) for each in sys.argv[1:]] or OF_AC1A)
