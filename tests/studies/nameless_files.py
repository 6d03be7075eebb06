"""Inspect drawn files of every kind of test, named in six languages or not at all.

Run it as ``python tests/studies/nameless_files.py [FILES] [SEED]``; 60 files take about two
minutes. Forty are recorders' files (bump tests without and on load, load rejections, steady
points), twenty grid events; tests/support/drawn_recordings.py makes them without exfit. A file is
right if its kind, its channels with their bases, and its step are; as asked if what is open is
asked; as missed if a channel that the case needs is passed over; as wrong if something is taken for
what it is not, without a word.
"""

import os
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

from rich.console import Console
from rich.markup import escape
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from drawn_recordings import FILES, drawn
from recorder_judge import ORDER
from recordings_judge import judged


def main() -> None:
    count, seed = (int(text) for text in (sys.argv[1:] + [str(FILES), "34"][len(sys.argv) - 1 :]))
    outcomes, table = Counter(), Table("file", "outcome", "what was asked, missed or wrong")
    with TemporaryDirectory() as folder:
        for number in range(count):
            file = drawn(number, seed)
            result = judged(file, file.write(Path(folder)))
            outcomes[result.outcome] += 1
            table.add_row(file.name, result.outcome, escape("\n".join(result.reasons)))
    console = Console(width=120)
    console.print(table)
    console.print(", ".join(f"{outcome}: {outcomes[outcome]}" for outcome in ORDER))


if __name__ == "__main__":
    main()
