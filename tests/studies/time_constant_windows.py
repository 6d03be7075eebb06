"""T'd0 over windows of a playback: how often a constant one is said to move, and one that moves.

    python tests/studies/time_constant_windows.py 100

Each record has a step up and a step down with noise of vt and efd (tests/support/two_steps.py).
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

from two_steps import CASE, record_of_two_steps  # noqa: E402

from exfit.case.load import load_case  # noqa: E402
from exfit.workflows import fit  # noqa: E402

PAIRS = ((5.0, 5.0), (5.0, 5.05), (4.9, 5.3))  # s: T'd0 in the step up and in the step down


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "two_steps.yaml"
        file.write_text(CASE, encoding="utf-8")
        case = load_case(file)
        for pair in PAIRS:
            moves = holds = steps = 0
            for seed in range(count):
                record = record_of_two_steps(*pair, seed=seed)
                result = fit(replace(case, given_records={"fit": record}))
                low, high = result.parameters["machine.Tpd0"].interval
                moves += result.windows.moves
                holds += low <= pair[0] <= high and low <= pair[1] <= high
                own = [w for w in result.windows.windows if w.kind == "step"]
                steps += sum(
                    abs(w.value - truth) < 1.96 * w.std_error
                    for w, truth in zip(own, pair, strict=True)
                )
            shares = [100.0 * moves / count, 100.0 * holds / count, 50.0 * steps / count]
            words = "moves {:.0f} %, interval holds both {:.0f} %, steps within 1.96 s.e. {:.0f} %"
            print(f"T'd0 {pair[0]:g} s, then {pair[1]:g} s: {words.format(*shares)}")


if __name__ == "__main__":
    main()
