"""Fit grid events of units that are otherwise than their case says, and list the causes named.

    python tests/studies/event_causes.py [SEED ...]

fits, for each kind of tests/support/faulty_events.py and each seed, the case with the fault and the
one without. docs/verification.md has the figures.
"""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from faulty_events import KINDS, drawn

from exfit.case.load import load_case
from exfit.results.verdict import Verdict
from exfit.workflows import fit


def verdict_on(path: Path) -> Verdict:
    """Return the verdict on the local fit of a case."""
    return fit(load_case(path), search="local").verdict


def accusations(verdict: Verdict) -> list[str]:
    """Return the causes but for typical values, whose influence is true of sound cases as well."""
    return [cause.cause for cause in verdict.causes if "typical" not in cause.cause]


def main() -> None:
    """Print for each event which cause stands first, then how often that is the right one."""
    seeds = [int(seed) for seed in sys.argv[1:]] or [1]
    first = accused = 0
    with TemporaryDirectory() as folder:
        for seed in seeds:
            for kind, (_, _, words) in KINDS.items():
                event = drawn(kind, seed, Path(folder))
                faulty, sound = verdict_on(event.faulty), verdict_on(event.sound)
                likeliest = faulty.causes[0].sentence if faulty.causes else "no cause"
                right = words in likeliest
                named = accusations(sound)
                first, accused = first + right, accused + bool(named)
                print(f"{kind:16} {seed}: {faulty.verdict}; {likeliest}", flush=True)
                if named:
                    print(f"{kind:16} {seed}, sound: {'; '.join(named)}", flush=True)
    events = len(seeds) * len(KINDS)
    print(f"{first} of {events} right causes first; {accused} sound cases accused")


if __name__ == "__main__":
    main()
