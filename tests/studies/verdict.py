"""Draw 200 cases with one fault each, fit them, and compare verdict and causes with the right ones.

    python tests/studies/verdict.py [SEED [SHARE]]

fits each case with its fault, and the same without it, by the noise of the same record. Verdict and
cause that are right stand in tests/support/faulty_cases.py, beside the fault. Chi-square is by how
much the fault raises the lowest cost that a fit reaches. The table and the figure go to
docs/verification.md and docs/img/verdict_faults.svg. It takes some ten minutes of processor time.
"""

import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from matplotlib.figure import Figure
from numpy.lib.stride_tricks import sliding_window_view
from rich.progress import track

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from faulty_cases import (
    KINDS,
    MATCHES,
    MISSES,
    NO_MATCH,
    REFUSED,
    FaultyCase,
    all_faults,
    cause_rank,
    drawn,
)
from places import ROOT
from small_svg import small_svg

from exfit.errors import ExfitError
from exfit.output.figures.style import GREEN, LIMIT, MEASURED, SIMULATED, WIDTH, PowersOfTen
from exfit.results.cause import Cause
from exfit.results.comparisons import Overlay
from exfit.results.model import FitResult
from exfit.workflows import fit

SEED = 2026
SEEN = 20.0  # chi-square: a fault that raises the cost by less is not to be seen in its record
LINES = 2  # in which the cause should stand
VISIBLE = 0.01  # of the range of a signal: a deviation that a reader of a figure sees
STRETCH = 50  # of a record: for so long it lasts
NEAR_CONSTANT = 5.0  # per cent: a match within this of a constant's may be called either
BAND = 1.5  # a deviation within this factor of the visible one may be called either
WORKERS = 2  # processes
PAGE_WIDTH = 120  # letters
PAGE, FIGURE = ROOT / "docs" / "verification.md", ROOT / "docs" / "img" / "verdict_faults.svg"
LEAST_DRAWN = 1.0  # chi-square
MARKERS = {
    "right verdict and cause": ("o", GREEN),
    "right verdict, cause not in two lines": ("^", LIMIT),
    "another verdict": ("X", SIMULATED),
    "not to be seen in its record": (".", MEASURED),
}
MARKS = ("<!-- verdict -->", "<!-- /verdict -->")


class Outcome(NamedTuple):
    """What a fit of a faulty case came to; ``rank`` is the line of the cause, 0 without it.

    ``share`` is the largest deviation of the response from the exact record, of its range;
    ``matched`` the fit percentage to it, of the signal that it is least for.
    """

    kind: str
    unit: str
    words: str
    raised: float
    share: float
    matched: float
    verdict: str
    rank: int
    causes: tuple[str, ...]
    sound: str

    @property
    def is_seen(self) -> bool:
        """Whether the record shows the fault."""
        return self.raised > SEEN

    @property
    def right(self) -> tuple[str, ...]:
        """The verdicts that are right.

        No better than by a constant is no match; what no reader would see does not miss the record.
        Near the border both are.
        """
        verdicts = KINDS[self.kind].verdicts
        if verdicts != (MISSES,):
            return verdicts
        if self.matched < NEAR_CONSTANT:
            return (NO_MATCH,) if self.matched < -NEAR_CONSTANT else (NO_MATCH, MISSES)
        if self.share > BAND * VISIBLE:
            return (MISSES,)
        return (MATCHES,) if self.share < VISIBLE / BAND else (MISSES, MATCHES)


def outcome(task: tuple[str, tuple[int, ...]]) -> Outcome:
    """Return what the fit of a case with a fault of a kind comes to."""
    name, seed = task
    fault = drawn(name, seed)
    sound = fit(fault.sound, search="local")
    own = sound.verdict.verdict if sound.verdict else ""
    try:
        result = fit(fault.faulty)
    except ExfitError as refusal:
        texts = (str(refusal),)
        rank = cause_rank(KINDS[name].causes, [Cause(str(refusal), "")])
        return Outcome(name, fault.unit, fault.words, np.inf, 1.0, 0.0, REFUSED, rank, texts, own)
    verdict = result.verdict
    assert verdict is not None
    return Outcome(
        kind=name,
        unit=fault.unit,
        words=fault.words,
        raised=2.0 * (result.cost - sound.cost) / fault.noise**2,
        share=deviation(fault, result),
        matched=least_match(fault, result),
        verdict=verdict.verdict,
        rank=cause_rank(KINDS[name].causes, verdict.causes),
        causes=tuple(cause.sentence for cause in verdict.causes),
        sound=own,
    )


def deviation(fault: FaultyCase, result: FitResult) -> float:
    """Return the largest deviation of a response from the exact record, of the signal's range.

    It is what half of the samples of some fiftieth of the record exceed.
    """
    shares = []
    for signal, overlay in result.comparison.overlays.items():
        exact = fault.exact[signal]
        away = np.abs(overlay.simulated - exact)
        lasting = np.median(sliding_window_view(away, max(10, len(away) // STRETCH)), axis=1)
        moved = max(np.ptp(exact), np.ptp(overlay.simulated))
        shares.append(float(np.max(lasting)) / float(moved))
    return max(shares)


def least_match(fault: FaultyCase, result: FitResult) -> float:
    """Return the fit percentage of a response to the exact record, the least of its signals."""
    overlays = result.comparison.overlays.items()
    return min(
        Overlay(fault.exact[signal], overlay.simulated).fit_percent for signal, overlay in overlays
    )


def outcomes(seed: int, share: float) -> list[Outcome]:
    """Return the outcome of every fault, or of a share of each kind."""
    tasks = [*all_faults(seed, share)]
    with ProcessPoolExecutor(WORKERS) as pool:
        return [*track(pool.map(outcome, tasks), "faults", len(tasks))]


def table(results: Sequence[Outcome]) -> Iterator[str]:
    """Yield the lines of the table: a row of each kind of fault."""
    yield "| fault | drawn | seen | good | right verdict | cause in two lines |"
    yield "|---|---|---|---|---|---|"
    for name in KINDS:
        yield row(name, [each for each in results if each.kind == name])
    yield row("**all**", results)


class Counts(NamedTuple):
    """How many faults are seen, and of these called good, judged rightly, and named."""

    seen: int
    good: int
    right: int
    named: int


def counts(results: Sequence[Outcome]) -> Counts:
    """Return the counts of some outcomes."""
    seen = [each for each in results if each.is_seen]
    return Counts(
        seen=len(seen),
        good=sum(each.verdict == "good" for each in seen),
        right=sum(each.verdict in each.right for each in seen),
        named=sum(0 < each.rank <= LINES for each in seen),
    )


def row(name: str, results: Sequence[Outcome]) -> str:
    """Return the row of some outcomes."""
    return f"| {name} | {len(results)} | {' | '.join(map(str, counts(results)))} |"


def section(results: Sequence[Outcome], seed: int) -> str:
    """Return the text of the page."""
    count, good, right, named = counts(results)
    alarms = [each for each in results if each.sound not in ("good", MATCHES)]
    doubted = [each for each in results if each.sound == MATCHES]
    hidden = ", ".join(
        f"{name} ({number})"
        for name in KINDS
        if (number := sum(each.kind == name and not each.is_seen for each in results))
    )
    plain = len(results) - len(alarms) - len(doubted)
    wrong = Counter(
        f"{each.kind}: {each.verdict}"
        for each in results
        if each.is_seen and each.verdict not in each.right
    )
    paragraphs = [
        f"`python tests/studies/verdict.py` draws {len(results)} cases with one fault each (seed "
        f"{seed}), over four units (AC1A, AC8B, ST1A with efd, AC1A with ifd), noise of 5e-5 to "
        "3e-4 pu and sampling of 5 to 20 ms, and fits each by the default search. The right "
        "verdict and cause of each were set before these fits, in "
        "`tests/support/faulty_cases.py`; a response that deviates from the exact record by less "
        f"than {100 * VISIBLE:g} % of its range does not miss it, and one no better than a "
        "constant is no match. A fault counts as seen where it raises the lowest "
        f"cost that a fit reaches by more than {SEEN:g} in chi-square.",
        "",
        f"* {count} faults are seen: {good} of them called good, {right} ({right / count:.1%}) "
        f"with the right verdict, {named} ({named / count:.1%}) with the cause in the first "
        f"{LINES} lines.",
        f"* Another verdict: {'; '.join(f'{words} ({k})' for words, k in wrong.items())}.",
        f"* Not to be seen in their record: {hidden}.",
        "* The model stands second where the likeliest cause leaves much unexplained, else last.",
        f"* The same {len(results)} cases without their fault: {plain} good, {len(doubted)} "
        f"matches, not all determined, {len(alarms)} worse.",
        "",
        "![Chi-square of each fault by kind, and what was said of it](img/verdict_faults.svg)",
        "",
    ]
    wrapped = [fill(text, PAGE_WIDTH, subsequent_indent=indent(text)) for text in paragraphs]
    return "\n".join([*wrapped, *table(results)])


def indent(text: str) -> str:
    """Return what the further lines of a paragraph begin with."""
    return "  " if text.startswith("* ") else ""


def figure(results: Sequence[Outcome]) -> Figure:
    """Return the chi-square of each fault, by kind, and what was said of it."""
    drawing = Figure(figsize=(WIDTH, 7.0), layout="constrained")
    axes = drawing.subplots()
    rows = {name: row for row, name in enumerate(KINDS)}
    for words, (marker, color) in MARKERS.items():
        own = [each for each in results if said_of(each) == words and np.isfinite(each.raised)]
        axes.plot(
            [max(each.raised, LEAST_DRAWN) for each in own],
            [rows[each.kind] for each in own],
            marker,
            color=color,
            label=f"{words} ({len(own)})",
        )
    axes.axvline(SEEN, color=MEASURED, linestyle="--", linewidth=1.0)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(PowersOfTen())
    axes.set_xlabel(f"chi-square by which the fault raises the lowest cost (dashed: {SEEN:g})")
    axes.set_yticks([*rows.values()], [*rows])
    axes.invert_yaxis()
    axes.grid(visible=True, axis="y", color="#e2e5e9", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    drawing.legend(loc="outside lower center", ncols=2, frameon=False)
    return drawing


def said_of(each: Outcome) -> str:
    """Return what was said of a fault, in words of the figure."""
    if not each.is_seen:
        return "not to be seen in its record"
    if each.verdict not in each.right:
        return "another verdict"
    named = 0 < each.rank <= LINES
    return "right verdict and cause" if named else "right verdict, cause not in two lines"


def write_page(text: str) -> None:
    """Put the text between the marks of the page."""
    before, rest = PAGE.read_text(encoding="utf-8").split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    page = f"{before}{MARKS[0]}\n{text}\n{MARKS[1]}{after}"
    PAGE.write_text(page, encoding="utf-8")


def main() -> None:
    """Print what is wrong, and write table and figure."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else SEED
    share = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    results = outcomes(seed, share)
    for each in results:
        if each.is_seen and (each.verdict not in each.right or not 0 < each.rank <= LINES):
            print(f"{each.kind}: {each.words} ({each.unit}), chi-square {each.raised:.0f}, "
                  f"deviation {each.share:.2%}: {each.verdict}")  # fmt: skip
            print(*(f"    {cause}" for cause in each.causes), sep="\n")
    print("\n".join(table(results)))
    if share == 1.0 and seed == SEED:
        write_page(section(results, seed))
        FIGURE.write_bytes(small_svg(figure(results)))


if __name__ == "__main__":
    main()
