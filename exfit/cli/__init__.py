"""The command line: reads arguments, calls the workflows, shows their results; it computes nothing.

Everything but click is imported in the command that needs it, so that help appears at once.
"""

import atexit
import gc
import os
from typing import Any

import click

from exfit.cli.catalogue import models, schema
from exfit.cli.fitting import check, fit
from exfit.cli.options import Interruption, Refusal
from exfit.cli.records import inspect_
from exfit.cli.responses import simulate, validate
from exfit.cli.streams import unfailing_output
from exfit.cli.uncertainty import identify, profile
from exfit.errors import ExfitError
from exfit.features.compare.command import compare
from exfit.features.fleet.command import batch
from exfit.features.planner.commands import export, import_
from exfit.features.programme.command import run
from exfit.features.rank.command import rank
from exfit.features.report.command import report
from exfit.features.start.command import new
from exfit.features.translate.command import translate
from exfit.util.interrupts import SIGNALLED, endings_as_interruptions

# before NumPy is imported: starting its threads costs more than they gain on matrices this small
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# else pydantic searches all packages that are installed, and runs what they plug into it
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# a look for circles of dead objects at every 700 new ones takes a twentieth of a short fit
gc.set_threshold(100_000)
# and at the end of the program, where all memory goes anyway, a sixth
atexit.register(gc.freeze)


class Commands(click.Group):
    """The commands; what they refuse is reported without a traceback."""

    def main(self, *arguments: Any, **settings: Any) -> Any:
        """Run as a program: no output that fails keeps a command from its files."""
        with unfailing_output() as exit_code, endings_as_interruptions() as signals:
            try:
                return super().main(*arguments, **settings)
            except SystemExit as ended:
                code = exit_code(ended.code)
                raise SystemExit(SIGNALLED + signals[0] if signals else code) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command, and turn what is wrong with its input into a message."""
        try:
            return super().invoke(ctx)
        except ExfitError as fault:
            raise Refusal(str(fault)) from fault
        except OSError as fault:
            raise Refusal(_of_system(fault)) from fault
        except KeyboardInterrupt as interruption:
            raise Interruption(str(interruption)) from None


def _of_system(fault: OSError) -> str:
    """Return what the system refuses: a name that is too long, a folder that may not be read.

    Raises the fault again where it has nothing to do with a file that somebody named.
    """
    if fault.filename is not None:
        return f"{fault.filename}: {fault.strerror}"
    if isinstance(fault, FileNotFoundError):
        return "the working folder has been removed"
    raise fault


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="exfit")
def main() -> None:
    """Identify the parameters of a generator's excitation system from a recorded bump test."""


OF_RECORDS = (inspect_, new)
OF_CASES = (fit, batch, run, rank, simulate, validate, check, profile, identify)
OF_RESULTS = (report, compare, translate, import_, export)
COMMANDS = (*OF_RECORDS, *OF_CASES, *OF_RESULTS, models, schema)
for command in COMMANDS:
    main.add_command(command)
