"""The command report."""

from pathlib import Path

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import force_option
from exfit.cli.streams import echo


@click.command(short_help="Make a verification report of a fit or a validation.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File to write (default: report.html beside the result).",
)
@click.option("--pdf", is_flag=True, help="Write a PDF too, beside the page.")
@click.option(
    "--against",
    type=click.Path(path_type=Path),
    metavar="RESULT",
    help="Another fit to be shown beside it: an earlier revision, or another unit.",
)
@force_option
def report(result: Path, output: Path | None, pdf: bool, against: Path | None, force: bool) -> None:
    """Make a verification report of RESULT: one HTML file, to read, print and hand in.

    RESULT is the result.json of a fit, the validation.json of exfit validate, or the folder that
    holds it. Nothing else is read, and nothing is run. A former report is replaced, another file
    only with --force.

    --pdf, or a FILE that ends in .pdf, writes the report as PDF too, with bookmarks and page
    numbers. It needs the package WeasyPrint: pip install 'exfit[pdf]'.
    """
    from exfit.features.report.writing import write_report

    for path in write_report(result, output, force, pdf, against):
        echo(f"written to {path}")
