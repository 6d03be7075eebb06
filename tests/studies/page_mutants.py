"""Send the page of exfit app 10,000 mutants of its messages; count what it answers. Takes a minute.

python tests/studies/page_mutants.py

A fifth are texts with letters changed. The others have the right form and odd values, in any order,
after a case, a record, a result or a planner's file; now and then a fit runs beside them, which one
of them may stop.
"""

import os
import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from threading import Thread

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

from page_messages import mutant, odd, outcome  # noqa: E402

import exfit  # noqa: E402
from exfit.features.app.session import Session  # noqa: E402
from exfit.output import run_folder  # noqa: E402

COUNT, SEED = int(os.environ.get("N", "10000")), 99
ROUND = 50  # messages to one page, which then is closed
FITS = 0.1  # of the pages, beside whose messages a fit runs


def main():
    """Print how many were answered, how many refused; anything else ends it with a traceback."""
    rng, told = random.Random(SEED), Counter()
    with tempfile.TemporaryDirectory() as folder:
        for name in ("configs", "sample_data"):
            shutil.copytree(ROOT / name, Path(folder, name))
        os.chdir(folder)
        case = Path("ac1a_good.yaml")
        text = Path("configs", case).read_text(encoding="utf-8").replace("../", "")
        case.write_text(text, encoding="utf-8")
        shutil.copy("sample_data/unit.dyr", "unit.dyr")
        shutil.copy("sample_data/ac1a_up.csv", "up.csv")
        run_folder.write_fit(exfit.fit(case, search="local"), Path("fitted"))
        shutil.copy("fitted/result.json", "result.json")
        for _ in range(COUNT // ROUND):
            told.update(of_page(rng, rng.choice((None, case, Path("up.csv"), Path("fitted")))))
            case.write_text(text, encoding="utf-8")
            for written in ("ac1a_good-draft.yaml", "up.yaml", "up-draft.yaml"):
                Path(written).unlink(missing_ok=True)
        os.chdir(ROOT)
    for words, count in told.most_common(40):
        print(f"{count:6} {words}")


def of_page(rng, given):
    """Send messages to a new page; return what it answers, without what varies."""
    session, told = Session(given), []
    session.prepare()
    beside = Thread(target=lambda: told.append(outcome(session, '{"do": "fit"}')))
    if rng.random() < FITS:
        beside.start()
    for _ in range(ROUND):
        said = outcome(session, mutant(rng) if rng.random() < 0.2 else odd(rng))
        told.append(said.partition(":")[0])
        if session.view.explorer is not None:
            exfit.load_case(session.path)
    session.close()
    if beside.ident is not None:
        beside.join()
    return told


if __name__ == "__main__":
    main()
