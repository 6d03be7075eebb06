"""What a batch writes for people: the tables and the page of its cases, the reports of its fits."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.features.fleet.folder import Fleet
from exfit.features.fleet.page import REPORT, fleet_page
from exfit.features.fleet.sisters import sisters
from exfit.features.fleet.table import fleet_table, parameter_table
from exfit.results.model import FitResult
from exfit.util.files import write_together

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
    from exfit.features.programme.result import ProgrammeResult
    from exfit.features.programme.show.programme_page import programme_page
    from exfit.features.report.page import fit_page, page_html

    if isinstance(result, ProgrammeResult):
        page = programme_page(result, folder)
    else:
        page = fit_page(result, folder)
    yield REPORT, page_html(page)
