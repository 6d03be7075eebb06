"""The page of a batch: one HTML file with all cases, their overlays, and sister units."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from math import isfinite
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.decimation import kept_rows
from exfit.features.fleet.folder import FAILED, Fleet
from exfit.features.fleet.sisters import (
    OUTLIER,
    SisterGroup,
    SisterParameter,
    SisterValue,
    missing_interval,
)
from exfit.features.fleet.summary import CaseSummary, SummaryCurve, SummaryParameter
from exfit.features.report.page import TEMPLATES, environment
from exfit.inference.outliers import FEWEST, LEVEL
from exfit.results.side_by_side import NOT_ACCEPTED
from exfit.results.verdict import GOOD, MATCHES, VerdictWords
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME

REPORT = "report.html"
MOST_PICTURES = 3  # of a case: more are in its report
MOST_SISTERS = 40  # of a table; of more units only those that stand out are in it
STATUSES = ("failed", "timed out", "crashed", "refused", "not run", "no record")
VERDICTS: Sequence[str] = (*get_args(VerdictWords), NOT_ACCEPTED, "interrupted")
STYLES: Mapping[str, str] = {GOOD: "good", MATCHES: "fair", "no record": "none", "not run": "none"}


Array = NDArray[np.float64]
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
    time = curve.time[rows]
    samples = [line[rows] for line in lines]
    finite = np.concatenate([line[np.isfinite(line)] for line in (*samples, np.zeros(0))])
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    begin, end = (float(time.min()), float(time.max())) if len(time) else (0.0, 1.0)
    across = (time - begin) / ((end - begin) or 1.0) * WIDTH
    paths = [
        _path(
            across, HEIGHT - MARGIN - (line - low) / ((high - low) or 1.0) * (HEIGHT - 2 * MARGIN)
        )
        for line in samples
    ]
    return Thumbnail(label, *paths)


def _path(x: Array, y: Array) -> str:
    """Return the path of a line: its gaps are gaps, and points on a straight line are left out."""
    return "".join(
        _stroke([(round(a), round(b)) for a, b, _ in points])
        for drawn, points in groupby(
            zip(x.tolist(), y.tolist(), np.isfinite(y).tolist(), strict=True), lambda p: p[2]
        )
        if drawn
    )


def _stroke(points: Sequence[Point]) -> str:
    corners = [*_corners(points)]
    steps = [f"{b[0] - a[0]} {b[1] - a[1]}" for a, b in pairwise(corners)]
    return f"M{corners[0][0]} {corners[0][1]}" + (f"l{' '.join(steps)}" if steps else "h0")


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


@dataclass(frozen=True)
class ParameterView:
    """A fitted parameter in a line: its name, its value with its interval and unit, in words."""

    name: str
    value: str
    interval: str
    mark: str


@dataclass(frozen=True)
class CaseView:
    """A row of the page. ``order`` is the rank of its outcome, the best first."""

    case: CaseSummary
    style: str
    order: int
    link: str
    rmse: float | None
    parameters: tuple[ParameterView, ...]
    pictures: tuple[Thumbnail, ...]


@dataclass(frozen=True)
class SisterCell:
    """A parameter of a unit among its sisters, with its value and its interval in words."""

    value: SisterValue
    text: str
    interval: str


@dataclass(frozen=True)
class SisterRow:
    """A unit among its sisters: its name, and a cell for each parameter, None where it has none."""

    name: str
    cells: tuple[SisterCell | None, ...]


@dataclass(frozen=True)
class SisterView:
    """Sisters as a table: a column for each parameter, a row for each unit that is shown."""

    group: SisterGroup
    rows: tuple[SisterRow, ...]
    hidden: int


def fleet_page(fleet: Fleet, groups: Sequence[SisterGroup]) -> str:
    """Return the page of a batch, with its sister units, as HTML."""
    remarks = {
        (value.case, parameter.name): value.remark
        for parameter in _parameters(groups)
        for value in parameter.remarkable
    }
    template = environment().get_template("fleet.html.jinja")
    text: str = template.render(
        title=fleet.folder.resolve().name,
        rows=[_case_view(fleet, case, remarks) for case in fleet.cases],
        groups=[_sister_view(group) for group in groups],
        **_summary(fleet.cases),
        sisters_apart=len(remarks),
        compared=sum(parameter.centre is not None for parameter in _parameters(groups)),
        level=LEVEL,
        fewest=FEWEST,
        width=WIDTH,
        height=HEIGHT,
        css="".join(_template(name) for name in ("report.css", "fleet.css")),
        script=_template("fleet.js"),
    )
    return text


def _template(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def _parameters(groups: Sequence[SisterGroup]) -> Iterator[SisterParameter]:
    for group in groups:
        yield from group.parameters


def _summary(cases: Sequence[CaseSummary]) -> dict[str, Any]:
    """Return the counts of a page, and what its filters offer."""
    outcomes = Counter(case.outcome for case in cases)
    return {
        "outcomes": [(word, _style(word), outcomes[word]) for word in sorted(outcomes, key=_rank)],
        "statuses": sorted(Counter(case.status for case in cases).items()),
        "models": sorted({case.model for case in cases} - {""}),
        "unresolved": sum(bool(case.unresolved) for case in cases),
        "not_accepted": sum(case.validation.outcome == NOT_ACCEPTED for case in cases),
        "seconds": sum(case.seconds for case in cases),
    }


def _style(outcome: str) -> str:
    return STYLES.get(outcome, "bad")


def _rank(outcome: str) -> tuple[int, str]:
    words = (*VERDICTS, *STATUSES)
    return (words.index(outcome) if outcome in words else len(words)), outcome


def _case_view(fleet: Fleet, case: CaseSummary, remarks: Mapping[tuple[str, str], str]) -> CaseView:
    worst = max((rmse for rmse in case.rmse.values() if isfinite(rmse)), default=None)
    several = len({curve.record for curve in case.curves}) > 1
    return CaseView(
        case,
        _style(case.outcome),
        _rank(case.outcome)[0],
        _link(fleet.folder, case),
        case.rmse.get("vt", worst),
        tuple(
            _parameter_view(case, name, value, remarks.get((case.name, name), ""))
            for name, value in case.fitted.items()
        ),
        tuple(
            picture(curve, f"{curve.signal} of {curve.record}" if several else curve.signal)
            for curve in case.curves[:MOST_PICTURES]
        ),
    )


def _link(folder: Path, case: CaseSummary) -> str:
    """Return the file of a case, relative to the page, that says most of it; "" without any."""
    if case.key.isalnum() and case.key.isascii():
        for file in (REPORT, WHOLE_FIT, WHOLE_PROGRAMME, FAILED):
            if (folder / case.key / file).is_file():
                return f"{case.key}/{file}"
    return ""


def _parameter_view(
    case: CaseSummary, name: str, value: SummaryParameter, remark: str
) -> ParameterView:
    marks = [OUTLIER if remark == OUTLIER else "differs"] if remark else []
    if name in case.unresolved:
        marks.append("unresolved")
    elif value.low is None and value.high is None:
        marks.append(missing_interval(case, name))
    unit = "" if value.unit in ("", "pu", "-") else f" {value.unit}"
    return ParameterView(
        name, value.rounded(value.value) + unit, _interval(value), ", ".join(marks)
    )


def _interval(value: SummaryParameter) -> str:
    """Return the interval of a value in words, in the digits that it allows itself."""
    if value.low is not None and value.high is not None:
        return f"{value.rounded(value.low)} … {value.rounded(value.high)}"
    if value.low is not None:
        return f"above {value.rounded(value.low)}"
    return "" if value.high is None else f"below {value.rounded(value.high)}"


def _sister_view(group: SisterGroup) -> SisterView:
    cells: dict[tuple[str, str], SisterCell] = {}
    by_name = {case.name: case for case in group.cases}
    for parameter in group.parameters:
        for value in parameter.values:
            own = by_name[value.case].fitted[parameter.name]
            cell = SisterCell(value, own.rounded(own.value), _interval(own))
            cells[value.case, parameter.name] = cell
    rows = [
        SisterRow(case.name, tuple(cells.get((case.name, p.name)) for p in group.parameters))
        for case in group.cases
    ]
    if len(rows) <= MOST_SISTERS:
        return SisterView(group, tuple(rows), 0)
    remarkable = {value.case for p in group.parameters for value in p.remarkable}
    kept = tuple(row for row in rows if row.name in remarkable)
    return SisterView(group, kept, len(rows) - len(kept))
