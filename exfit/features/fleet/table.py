"""The tables of a batch as CSV: a line for each case, and a line for each fitted parameter.

The texts come from the files of others: a spreadsheet must not take one for a formula.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exfit.features.fleet.folder import CaseSummary, Fleet, SummaryParameter
from exfit.features.fleet.page import REPORT, fleet_page
from exfit.features.fleet.sisters import SisterGroup, missing_interval, sisters
from exfit.results.model import FitResult
from exfit.results.tables import DIGITS, csv_text
from exfit.signals import SIGNALS
from exfit.util.files import within, write_together
from exfit.util.text import printable

if TYPE_CHECKING:
    from exfit.features.programme.result import ProgrammeResult

TABLE, PARAMETERS, PAGE = "fleet.csv", "parameters.csv", "fleet.html"
BYTE_ORDER_MARK = "\ufeff"  # Excel reads the letters of all languages behind it
FORMULA = r"[=+\-@＝＋－＠]"
STARTS_FORMULA = re.compile(FORMULA)
STARTS_FORMULA_WITHIN = re.compile(rf";(?={FORMULA})")  # where semicolons part the cells

# what they have of a case, the first ones also beside each of its parameters
CASE_COLUMNS: Mapping[str, str] = {
    "name": "name",
    "unit": "unit",
    "bus": "bus",
    "id": "machine_id",
    "model": "model",
    "machine": "machine_model",
    "status": "status",
    "verdict": "verdict",
    "reason": "reason",
    "validation": "validation.outcome",
    "validation rmse": "validation.rmse",
    "criteria": "criteria",
    "unresolved": "unresolved",
    "seconds": "seconds",
    "case": "case",
    "key": "key",
}
OF_UNIT = 6  # columns
PARAMETER_COLUMNS = ("parameter", "value", "low", "high", "unit of value")
SISTER_COLUMNS = ("sisters", "centre", "spread", "deviation", "probability", "remark")


def fleet_table(cases: Sequence[CaseSummary]) -> str:
    """Return cases as CSV, a line for each in the order of their names.

    Behind the columns that every table has stands the rmse of each signal, and the value and the
    ends of the interval of each parameter that any case fitted; the first cause of the verdict with
    its remedy is last. What a case does not have is blank.
    """
    signals = [name for name in SIGNALS if any(name in case.rmse for case in cases)]
    parameters = sorted({name for case in cases for name in case.fitted})
    header = [*CASE_COLUMNS, *(f"rmse {signal}" for signal in signals)]
    header += [text_cell(name) + end for name in parameters for end in ("", " low", " high")]
    rows = [[*header, "cause"]]
    for case in _by_name(cases):
        cells = [*_case_cells(case), *(_cell(case.rmse.get(signal)) for signal in signals)]
        for name in parameters:
            cells += _interval(case.fitted.get(name))
        rows.append([*cells, _cell(case.cause)])
    return BYTE_ORDER_MARK + csv_text(rows)


def parameter_table(cases: Sequence[CaseSummary], groups: Iterable[SisterGroup]) -> str:
    """Return the fitted parameters of all cases as CSV, each with those of similar units."""
    compared = {
        (value.case, parameter.name): (parameter, value)
        for group in groups
        for parameter in group.parameters
        for value in parameter.values
    }
    rows = [[*[*CASE_COLUMNS][:OF_UNIT], *PARAMETER_COLUMNS, *SISTER_COLUMNS]]
    for case in _by_name(cases):
        for name, own in case.fitted.items():
            of_unit = _case_cells(case)[:OF_UNIT]
            cells = [*of_unit, text_cell(name), *_interval(own), text_cell(own.unit)]
            if (case.name, name) in compared:
                all_of_them, value = compared[case.name, name]
                of_all = (all_of_them.centre, all_of_them.spread)
                numbers = (*of_all, value.deviation, value.probability)
                cells += [str(len(all_of_them.values)), *map(_cell, numbers), _cell(value.remark)]
            else:
                cells += [""] * len(SISTER_COLUMNS[1:]) + [missing_interval(case, name)]
            rows.append(cells)
    return BYTE_ORDER_MARK + csv_text(rows)


def _by_name(cases: Sequence[CaseSummary]) -> list[CaseSummary]:
    return sorted(cases, key=lambda case: (case.name.casefold(), case.name))


def _case_cells(case: CaseSummary) -> list[str]:
    values = {column: attrgetter(path)(case) for column, path in CASE_COLUMNS.items()}
    values |= {"unresolved": " ".join(case.unresolved), "seconds": f"{case.seconds:.3f}"}
    return [*map(_cell, values.values())]


def _interval(parameter: SummaryParameter | None) -> list[str]:
    return [*map(_cell, (None, None, None) if parameter is None else parameter[:3])]


def _cell(value: Any) -> str:
    """Write a text or a number; what is not known is blank."""
    if isinstance(value, str):
        return text_cell(value)
    if isinstance(value, int):
        return str(value)  # of a bus, which may have more digits than a measured number
    return "" if value is None or value != value else f"{value:.{DIGITS}g}"


def text_cell(text: str) -> str:
    """Return a text in one line that no spreadsheet takes for a formula."""
    line = STARTS_FORMULA_WITHIN.sub("; ", printable(" ".join(text.split())))
    return f"'{line}" if STARTS_FORMULA.match(line) else line


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
    from exfit.features.report.page import page_html, result_page

    if isinstance(result, ProgrammeResult):
        page = programme_page(result, folder)
    else:
        page = result_page(result, folder)
    yield REPORT, page_html(page)


def write_missing_reports(fleet: Fleet) -> bool:
    """Write the reports of fits that an earlier run has made without; return whether any was."""
    folders = dict.fromkeys(fleet.folder_of(case) for case in fleet.of_run)
    missing = [folder for folder in folders if folder and not (folder / REPORT).is_file()]
    for folder in missing:
        from exfit.features.report.writing import write_report

        write_report(within(fleet.folder, folder.name))
    return bool(missing)
