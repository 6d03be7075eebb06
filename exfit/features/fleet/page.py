"""The page of a batch: one HTML file with all cases, their overlays, and similar units."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from pathlib import Path
from typing import get_args

import numpy as np

from exfit.dsp.sampling import kept_rows
from exfit.features.fleet.folder import FAILED, CaseSummary, Fleet, SummaryCurve, SummaryParameter
from exfit.features.fleet.sisters import OUTLIER, SisterGroup, SisterValue, missing_interval
from exfit.features.report.page import TEMPLATES, environment
from exfit.inference.outliers import FEWEST, LEVEL
from exfit.results.side_by_side import NOT_ACCEPTED
from exfit.results.verdict import GOOD, MATCHES, VerdictWords
from exfit.util.arrays import Array
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME

REPORT = "report.html"
MOST_PICTURES = 3  # of a case: more are in its report
MOST_SISTERS = 40  # of a table; of more units only those that stand out are in it
STATUSES = ("failed", "timed out", "crashed", "refused", "not run", "no record")
VERDICTS: Sequence[str] = (*get_args(VerdictWords), NOT_ACCEPTED, "interrupted")
REMEDIES: Mapping[str, str] = {  # of what gave no verdict, or none with a cause
    "failed": "run `exfit check` with this case and correct what it names; then `--retry failed`",
    "timed out": "give a longer `--time-limit` with `--retry failed`",
    "crashed": "run `exfit fit` with this case alone; then `--retry failed`",
    "refused": "correct what is named",
    "not run": "run the same command again: it continues the batch",
    "no record": "add a record to the case",
    "interrupted": "run `exfit fit` with this case again",
}
STYLES: Mapping[str, str] = {GOOD: "good", MATCHES: "fair", "no record": "none", "not run": "none"}


Point = tuple[int, int]

WIDTH, HEIGHT = 240, 64  # units of a picture, two to a pixel
MARGIN = 2  # above and below the lines
BINS = 20  # of a line, each with its least and greatest value


@dataclass(frozen=True)
class Thumbnail:
    """An overlay: the d of the paths of measured and simulated samples, and what it is of."""

    label: str
    measured: str
    simulated: str


def picture(curve: SummaryCurve, label: str) -> Thumbnail:
    """Return a signal beside its simulation as paths of whole numbers, two to a pixel."""
    lines = (curve.measured, curve.simulated)
    rows = kept_rows(lines, BINS)
    time, samples = curve.time[rows], [line[rows] for line in lines]
    finite = np.concatenate([line[np.isfinite(line)] for line in (*samples, np.zeros(0))])
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    begin, end = (float(time.min()), float(time.max())) if len(time) else (0.0, 1.0)
    across = (time - begin) / ((end - begin) or 1.0) * WIDTH
    span, room = (high - low) or 1.0, HEIGHT - 2 * MARGIN
    measured, simulated = (
        _path(across, HEIGHT - MARGIN - (line - low) / span * room) for line in samples
    )
    return Thumbnail(label, measured, simulated)


def _path(x: Array, y: Array) -> str:
    """Return the path of a line: its gaps are gaps, and points on a straight line are left out."""
    path = ""
    samples = zip(x.tolist(), y.tolist(), np.isfinite(y).tolist(), strict=True)
    for drawn, stroke in groupby(samples, lambda sample: sample[2]):
        if drawn:
            first, *others = _corners([(round(a), round(b)) for a, b, _ in stroke])
            steps = [f"{b[0] - a[0]} {b[1] - a[1]}" for a, b in pairwise([first, *others])]
            path += f"M{first[0]} {first[1]}" + (f"l{' '.join(steps)}" if steps else "h0")
    return path


def _corners(points: Sequence[Point]) -> Iterator[Point]:
    last = points[0]
    yield last
    for point, after in pairwise(points[1:]):
        ax, ay = point[0] - last[0], point[1] - last[1]
        bx, by = after[0] - point[0], after[1] - point[1]
        if ax * by != ay * bx or ax * bx + ay * by < 0:
            yield point
            last = point
    if len(points) > 1:
        yield points[-1]


def fleet_page(fleet: Fleet, groups: Sequence[SisterGroup]) -> str:
    """Write the page of a batch, with its similar units, as HTML."""
    cases, parameters = fleet.cases, [each for group in groups for each in group.parameters]
    among_sisters = {(v.case, each.name): v for each in parameters for v in each.values}
    outcomes = Counter(case.outcome for case in cases)
    text: str = (
        environment()
        .get_template("fleet.html.jinja")
        .render(
            title=fleet.folder.resolve().name,
            cases=cases,
            groups=[(group, _shown(group)) for group in groups],
            among_sisters=among_sisters,
            outcomes=[(word, outcomes[word]) for word in sorted(outcomes, key=_rank)],
            statuses=sorted(Counter(case.status for case in cases).items()),
            models=sorted({case.model for case in cases} - {""}),
            sisters_apart=sum(len(parameter.remarkable) for parameter in parameters),
            compared=sum(parameter.centre is not None for parameter in parameters),
            rank=_rank,
            styles=STYLES,
            link=partial(_link, fleet.folder),
            remedies=REMEDIES,
            folder=fleet.folder,
            unreported=any(
                case.status == "done" and not _link(fleet.folder, case).endswith(REPORT)
                for case in cases
            ),
            marks=_marks,
            interval=_interval,
            pictures=_pictures,
            level=LEVEL,
            fewest=FEWEST,
            width=WIDTH,
            height=HEIGHT,
            css="".join(_template(name) for name in ("report.css", "fleet.css")),
            script=_template("fleet.js"),
        )
    )
    return text


def _template(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def _rank(outcome: str) -> tuple[int, str]:
    """Return the place of an outcome among all, the best first."""
    words = (*VERDICTS, *STATUSES)
    return (words.index(outcome) if outcome in words else len(words)), outcome


def _shown(group: SisterGroup) -> list[CaseSummary]:
    """Select the units of a table: of very many those that stand out."""
    remarkable = {value.case for each in group.parameters for value in each.remarkable}
    few = len(group.cases) <= MOST_SISTERS
    return [case for case in group.cases if few or case.name in remarkable]


def _link(folder: Path, case: CaseSummary) -> str:
    """Return the file of a case, relative to the page, that says most of it; "" without any."""
    if case.key.isalnum() and case.key.isascii():
        for file in (REPORT, WHOLE_FIT, WHOLE_PROGRAMME, FAILED):
            if (folder / case.key / file).is_file():
                return f"{case.key}/{file}"
    return ""


def _marks(case: CaseSummary, name: str, among_sisters: SisterValue | None) -> str:
    """Word what is to be said of a fitted parameter, "" where nothing is."""
    marks, value = [], case.fitted[name]
    if among_sisters is not None and among_sisters.stands_out:
        marks.append(OUTLIER if among_sisters.is_outlier else "differs")
    if name in case.unresolved:
        marks.append("unresolved")
    elif value.low is None and value.high is None:
        marks.append(missing_interval(case, name))
    return ", ".join(marks)


def _interval(value: SummaryParameter) -> str:
    """Return the interval of a value in words, in the digits that it allows itself."""
    if value.low is not None and value.high is not None:
        return f"{value.rounded(value.low)} … {value.rounded(value.high)}"
    if value.low is not None:
        return f"above {value.rounded(value.low)}"
    return "" if value.high is None else f"below {value.rounded(value.high)}"


def _pictures(case: CaseSummary) -> Iterator[Thumbnail]:
    several = len({curve.record for curve in case.curves}) > 1
    for curve in case.curves[:MOST_PICTURES]:
        yield picture(curve, f"{curve.signal} of {curve.record}" if several else curve.signal)
