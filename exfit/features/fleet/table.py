"""The tables of a batch as CSV: a line for each case, and a line for each fitted parameter.

The texts come from the files of others: a spreadsheet must not take one for a formula.
"""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.features.fleet.folder import Fleet
from exfit.features.fleet.page import REPORT, fleet_page
from exfit.features.fleet.sisters import (
    SisterGroup,
    SisterParameter,
    SisterValue,
    missing_interval,
    sisters,
)
from exfit.features.fleet.summary import CaseSummary, SummaryParameter
from exfit.results.model import FitResult
from exfit.results.tables import DIGITS
from exfit.signals import SIGNALS
from exfit.util.files import write_together
from exfit.util.text import printable

BYTE_ORDER_MARK = "\ufeff"  # Excel reads the letters of all languages behind it
FORMULA = r"[=+\-@＝＋－＠]"
STARTS_FORMULA = re.compile(FORMULA)
STARTS_FORMULA_WITHIN = re.compile(rf";(?={FORMULA})")  # where semicolons part the cells

CASE_COLUMNS: Mapping[str, Callable[[CaseSummary], str]] = {
    "name": lambda case: text_cell(case.name),
    "unit": lambda case: text_cell(case.unit),
    "bus": lambda case: "" if case.bus is None else str(case.bus),
    "id": lambda case: text_cell(case.machine_id or ""),
    "model": lambda case: text_cell(case.model),
    "machine": lambda case: text_cell(case.machine_model),
    "status": lambda case: case.status,
    "verdict": lambda case: text_cell(case.verdict),
    "reason": lambda case: text_cell(case.reason),
    "validation": lambda case: case.validation.outcome,
    "validation rmse": lambda case: _number(case.validation.rmse),
    "unresolved": lambda case: text_cell(" ".join(case.unresolved)),
    "seconds": lambda case: f"{case.seconds:.3f}",
    "case": lambda case: text_cell(case.case),
    "key": lambda case: text_cell(case.key),
}
PARAMETER_COLUMNS = (
    "name", "unit", "bus", "id", "model", "machine", "parameter", "value", "low", "high",
    "unit of value", "sisters", "centre", "spread", "deviation", "probability", "remark",
)  # fmt: skip


def fleet_table(cases: Sequence[CaseSummary]) -> str:
    """Return cases as CSV, a line for each in the order of their names.

    Behind the columns that every table has stands the rmse of each signal, and the value and the
    ends of the interval of each parameter that any case fitted. What a case does not have is blank.
    """
    ordered = _by_name(cases)
    signals = [name for name in SIGNALS if any(name in case.rmse for case in ordered)]
    parameters = sorted({name for case in ordered for name in case.fitted})
    header = [*CASE_COLUMNS, *(f"rmse {signal}" for signal in signals)]
    header += [text_cell(name) + end for name in parameters for end in ("", " low", " high")]
    return _csv(header, (_case_cells(case, signals, parameters) for case in ordered))


def _by_name(cases: Sequence[CaseSummary]) -> list[CaseSummary]:
    return sorted(cases, key=lambda case: (case.name.casefold(), case.name))


def _case_cells(
    case: CaseSummary, signals: Sequence[str], parameters: Sequence[str]
) -> Iterator[str]:
    for text in CASE_COLUMNS.values():
        yield text(case)
    for signal in signals:
        yield _number(case.rmse.get(signal))
    for name in parameters:
        yield from _interval(case.fitted.get(name))


def parameter_table(cases: Sequence[CaseSummary], groups: Iterable[SisterGroup]) -> str:
    """Return the fitted parameters of all cases as CSV, a line for each beside its sisters'."""
    compared = {
        (value.case, parameter.name): (parameter, value)
        for group in groups
        for parameter in group.parameters
        for value in parameter.values
    }
    rows = (
        [
            *(CASE_COLUMNS[column](case) for column in PARAMETER_COLUMNS[:6]),
            text_cell(name),
            *_interval(value),
            text_cell(value.unit),
            *_beside_sisters(compared.get((case.name, name)), missing_interval(case, name)),
        ]
        for case in _by_name(cases)
        for name, value in case.fitted.items()
    )
    return _csv(PARAMETER_COLUMNS, rows)


def text_cell(text: str) -> str:
    """Return a text in one line that no spreadsheet takes for a formula."""
    line = STARTS_FORMULA_WITHIN.sub("; ", printable(" ".join(text.split())))
    return f"'{line}" if STARTS_FORMULA.match(line) else line


def _beside_sisters(place: tuple[SisterParameter, SisterValue] | None, remark: str) -> list[str]:
    """Write the comparison of a parameter, for one without sisters a remark alone."""
    if place is None:
        return [""] * len(PARAMETER_COLUMNS[11:-1]) + [remark]
    parameter, value = place
    numbers = (parameter.centre, parameter.spread, value.deviation, value.probability)
    return [str(len(parameter.values)), *map(_number, numbers), text_cell(value.remark)]


def _interval(parameter: SummaryParameter | None) -> list[str]:
    if parameter is None:
        return ["", "", ""]
    return [_number(number) for number in (parameter.value, parameter.low, parameter.high)]


def _number(value: float | None) -> str:
    return "" if value is None or value != value else f"{value:.{DIGITS}g}"


def _csv(header: Sequence[str], rows: Iterable[Iterable[str]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return BYTE_ORDER_MARK + out.getvalue()


if TYPE_CHECKING:
    from exfit.features.programme.result import ProgrammeResult

TABLE, PARAMETERS, PAGE = "fleet.csv", "parameters.csv", "fleet.html"


def write_tables(fleet: Fleet) -> None:
    """Write the tables and the page of a fleet; raises ExfitError where they cannot be written."""
    groups = sisters(fleet.cases)
    contents = {
        PARAMETERS: parameter_table(fleet.cases, groups),
        PAGE: fleet_page(fleet, groups),
        TABLE: fleet_table(fleet.cases),
    }
    write_together(fleet.folder, contents)


def report_file(result: "FitResult | ProgrammeResult", folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the report of a fit, or a programme, that will lie in a folder."""
    from exfit.features.programme.programme_page import programme_page
    from exfit.features.programme.result import ProgrammeResult
    from exfit.features.report.page import fit_page, page_html

    if isinstance(result, ProgrammeResult):
        page = programme_page(result, folder)
    else:
        page = fit_page(result, folder)
    yield REPORT, page_html(page)
