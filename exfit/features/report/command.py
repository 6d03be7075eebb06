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
    help="File to write (default: report.html beside the result, or report.pdf).",
)
@click.option("--pdf", is_flag=True, help="Make a PDF, with bookmarks and page numbers.")
@click.option(
    "--against",
    type=click.Path(path_type=Path),
    metavar="RESULT",
    help="Another fit to be shown beside it: an earlier revision, or another unit.",
)
@force_option
def report(result: Path, output: Path | None, pdf: bool, against: Path | None, force: bool) -> None:
    """Make a verification report of RESULT: one HTML file, to be read, printed and handed in.

    RESULT is the result.json of a fit, the validation.json of exfit validate, or the folder that
    holds it: nothing else is read, and nothing is run. A former report is replaced, another file
    only with --force. With --pdf it is a PDF, which needs the package WeasyPrint:
    pip install 'exfit[pdf]'.
    """
    from exfit.features.report.writing import write_report

    echo(f"written to {write_report(result, output, force, pdf, against)}")
