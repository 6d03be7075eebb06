"""What a batch writes for people: the table of its cases, and the reports of its fits."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from exfit.fleet.folder import Fleet
from exfit.fleet.summary import CaseSummary
from exfit.results.model import FitResult
from exfit.util.files import write

TABLE, REPORT = "fleet.csv", "report.html"


def write_tables(fleet: Fleet) -> None:
    """Write the table of a fleet into its folder; raises ExfitError where it cannot be written."""
    out = io.StringIO()
    rows = [_cells(case) for case in fleet.cases]
    writer = csv.DictWriter(out, [*dict.fromkeys(key for row in rows for key in row)], restval="")
    writer.writeheader()
    writer.writerows(rows)
    write(fleet.folder / TABLE, out.getvalue())


def _cells(case: CaseSummary) -> dict[str, str]:
    return {
        "case": case.name,
        "unit": case.unit,
        "model": case.model,
        "status": case.status,
        "verdict": case.verdict,
        "reason": case.reason,
        **{f"rmse {signal}": f"{rmse:.9g}" for signal, rmse in case.rmse.items()},
    }


def report_file(result: FitResult, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the report of a fit that will lie in a folder."""
    from exfit.output.report import html

    yield REPORT, html(result, folder)
