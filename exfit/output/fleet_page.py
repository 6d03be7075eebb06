"""The page of a batch: one HTML file with all cases, their overlays, and sister units."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import get_args

from exfit.fleet.folder import Fleet
from exfit.fleet.sisters import OUTLIER, SisterGroup, SisterParameter, SisterValue
from exfit.fleet.summary import CaseSummary, SummaryCurve, SummaryParameter
from exfit.inference.outliers import FEWEST, LEVEL
from exfit.output.fleet_pictures import HEIGHT, WIDTH, Picture, picture
from exfit.output.report.page import TEMPLATES, environment
from exfit.results.side_by_side import NOT_ACCEPTED
from exfit.results.verdict import GOOD, MATCHES, VerdictWords
from exfit.util.text import rounded

REPORT, RESULT, FAILED = "report.html", "result.json", "failed.json"
MOST_PICTURES = 3  # of a case: more are in its report
MOST_SISTERS = 40  # of a table; of more units only those that stand out are in it
ERRORS_IN_INTERVAL = 4.0  # standard errors: as many digits as the interval allows
STATUSES = ("failed", "timed out", "crashed", "refused", "not run", "no record")
VERDICTS: Sequence[str] = (*get_args(VerdictWords), NOT_ACCEPTED, "interrupted")
STYLES: Mapping[str, str] = {GOOD: "good", MATCHES: "fair", "no record": "none", "not run": "none"}


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
    outcome: str
    style: str
    order: int
    link: str
    rmse: float | None
    parameters: tuple[ParameterView, ...]
    pictures: tuple[Picture, ...]


@dataclass(frozen=True)
class SisterRow:
    """A unit among its sisters: its name, and a value of each parameter, None where it has none."""

    name: str
    values: tuple[SisterValue | None, ...]


@dataclass(frozen=True)
class SisterView:
    """Sisters as a table: a column for each parameter, a row for each unit that is shown."""

    group: SisterGroup
    rows: tuple[SisterRow, ...]
    hidden: int


def fleet_page(fleet: Fleet, groups: Sequence[SisterGroup]) -> str:
    """Return the page of a batch, with its sister units, as HTML."""
    outliers = {
        (value.case, parameter.name): value.remark
        for group in groups
        for parameter in group.parameters
        for value in parameter.remarkable
    }
    rows = [_case_view(fleet, case, outliers) for case in fleet.cases]
    counts = Counter((row.order, row.outcome, row.style) for row in rows)
    styles = ("report.css", "fleet.css")
    template = environment().get_template("fleet.html.jinja")
    text: str = template.render(
        title=fleet.folder.resolve().name,
        rows=rows,
        outcomes=[(outcome, style, count) for (_, outcome, style), count in sorted(counts.items())],
        models=sorted({case.model for case in fleet.cases if case.model}),
        unresolved=sum(bool(case.unresolved) for case in fleet.cases),
        not_accepted=sum(case.validation.outcome == NOT_ACCEPTED for case in fleet.cases),
        seconds=sum(case.seconds for case in fleet.cases),
        groups=[_sister_view(group) for group in groups],
        compared=sum(_is_judged(p) for group in groups for p in group.parameters),
        level=LEVEL,
        fewest=FEWEST,
        width=WIDTH,
        height=HEIGHT,
        statuses=sorted(fleet.counts.items()),
        sisters_apart=sum(len(p.remarkable) for group in groups for p in group.parameters),
        css="".join((TEMPLATES / name).read_text(encoding="utf-8") for name in styles),
        script=(TEMPLATES / "fleet.js").read_text(encoding="utf-8"),
        value_words=_value_words,
        interval_words=_interval,
    )
    return text


def _case_view(
    fleet: Fleet, case: CaseSummary, outliers: Mapping[tuple[str, str], str]
) -> CaseView:
    outcome = case.outcome
    words = (*VERDICTS, *STATUSES)
    worst = max((rmse for rmse in case.rmse.values() if isfinite(rmse)), default=None)
    return CaseView(
        case,
        outcome,
        STYLES.get(outcome, "bad"),
        words.index(outcome) if outcome in words else len(words),
        _link(fleet.folder, case),
        case.rmse.get("vt", worst),
        tuple(
            _parameter_view(case, name, value, outliers.get((case.name, name), ""))
            for name, value in case.fitted.items()
        ),
        tuple(picture(curve, _label(case, curve)) for curve in case.curves[:MOST_PICTURES]),
    )


def _label(case: CaseSummary, curve: SummaryCurve) -> str:
    """Return what a picture is of: the signal, and the record where there are several."""
    records = {each.record for each in case.curves}
    return f"{curve.signal} of {curve.record}" if len(records) > 1 else curve.signal


def _link(folder: Path, case: CaseSummary) -> str:
    """Return the file of a case, relative to the page, that says most of it; "" without any."""
    if case.key.isalnum() and case.key.isascii():
        for file in (REPORT, RESULT, FAILED):
            if (folder / case.key / file).is_file():
                return f"{case.key}/{file}"
    return ""


def _parameter_view(
    case: CaseSummary, name: str, value: SummaryParameter, remark: str
) -> ParameterView:
    marks = [OUTLIER if remark == OUTLIER else "differs"] if remark else []
    if name in case.unresolved:
        marks.append("unresolved")
    error = _error(value.low, value.high)
    unit = "" if value.unit in ("", "pu", "-") else f" {value.unit}"
    return ParameterView(
        name, rounded(value.value, error) + unit, _interval(value), ", ".join(marks)
    )


def _error(low: float | None, high: float | None) -> float | None:
    return None if low is None or high is None else (high - low) / ERRORS_IN_INTERVAL


def _interval(value: SummaryParameter | SisterValue) -> str:
    """Return the interval of a value in words, in the digits that it allows itself."""
    error = _error(value.low, value.high)
    if value.low is not None and value.high is not None:
        return f"{rounded(value.low, error)} … {rounded(value.high, error)}"
    if value.low is not None:
        return f"above {rounded(value.low)}"
    return "" if value.high is None else f"below {rounded(value.high)}"


def _sister_view(group: SisterGroup) -> SisterView:
    columns = [{value.case: value for value in p.values} for p in group.parameters]
    rows = [
        SisterRow(case.name, tuple(column.get(case.name) for column in columns))
        for case in group.cases
    ]
    if len(rows) <= MOST_SISTERS:
        return SisterView(group, tuple(rows), 0)
    remarkable = {value.case for p in group.parameters for value in p.remarkable}
    kept = tuple(row for row in rows if row.name in remarkable)
    return SisterView(group, kept, len(rows) - len(kept))


def _is_judged(parameter: SisterParameter) -> bool:
    return parameter.centre is not None


def _value_words(value: SisterValue) -> str:
    """Return a value in the digits that its interval allows."""
    return rounded(value.value, _error(value.low, value.high))
