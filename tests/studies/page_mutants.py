"""Send the page of exfit app 10,000 mutants of its messages; count what it answers. Takes 20 s.

python tests/studies/page_mutants.py
"""

import os
import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

from page_messages import mutant, outcome  # noqa: E402

from exfit.features.app.session import Session  # noqa: E402

COUNT, SEED = 10_000, 99


def main():
    """Print how many were answered, how many refused; anything else ends it with a traceback."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("configs", "sample_data"):
            shutil.copytree(ROOT / name, Path(folder, name))
        os.chdir(folder)
        session, rng = Session(Path("configs/ac1a_good.yaml")), random.Random(SEED)
        session.read()
        told = Counter(outcome(session, mutant(rng)).partition(":")[0] for _ in range(COUNT))
        session.close()
        os.chdir(ROOT)
    for words, count in told.most_common(10):
        print(f"{count:6} {words}")


if __name__ == "__main__":
    main()
