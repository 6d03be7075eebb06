"""What a batch writes for people: the tables and the page of its cases, the reports of its fits."""

from collections.abc import Iterator
from pathlib import Path

from exfit.features.fleet.folder import Fleet
from exfit.features.fleet.page import REPORT, fleet_page
from exfit.features.fleet.sisters import sisters
from exfit.features.fleet.table import fleet_table, parameter_table
from exfit.results.model import FitResult
from exfit.util.files import write_together

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


def report_file(result: FitResult, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the report of a fit that will lie in a folder."""
    from exfit.features.report.page import html

    yield REPORT, html(result, folder)
