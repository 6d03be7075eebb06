"""Inspect made-up recorder's files whose truth is known, and judge the cases suggested for them.

Run it as ``python tests/studies/recorder_files.py [DRAWN]``. Twenty files are described in
tests/support/recorder_files.py, DRAWN others (10) have names, units, clocks and faults drawn from
tests/support/recorder_words.py: words of plants, makers and five languages, written down before
exfit's vocabulary was. A file counts as right if each of its signals has its column, base and
polarity and the step its instant; as asked if what is open is asked with the name of the column;
as missed if a signal, or a ripple of the mains, is passed over; as wrong if something is taken for
what it is not, without a word.
"""

import os
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from recorder_files import DRAWN, FIXED, drawn_file, write
from recorder_judge import ORDER, judged


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else len(DRAWN)
    files = (*FIXED, *(drawn_file(seed) for seed in range(count)))
    outcomes, table = Counter(), Table("file", "outcome", "what was asked, missed or wrong")
    with TemporaryDirectory() as folder:
        for file in files:
            result = judged(file, write(file, Path(folder)))
            outcomes[result.outcome] += 1
            table.add_row(file.name, result.outcome, "\n".join(result.reasons))
    console = Console()
    console.print(table)
    console.print(", ".join(f"{outcome}: {outcomes[outcome]}" for outcome in ORDER))


if __name__ == "__main__":
    main()
