"""The command line: reads arguments, calls the workflows, shows their results; it computes nothing.

Everything but click is imported in the command that needs it, so that help appears at once.
"""

import atexit
import gc
import os
import signal
from typing import TYPE_CHECKING, Any

import click

from exfit.cli.options import Interruption, Refusal, code_after, with_trust_option
from exfit.cli.streams import echo, unfailing_output
from exfit.errors import ExfitError
from exfit.registry import LazyCommand, LazyPart
from exfit.registry import commands as of_features
from exfit.util.gate import guarded
from exfit.util.interrupts import endings_as_interruptions

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

# before NumPy is imported: starting its threads costs more than they gain on matrices this small
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# else pydantic searches all packages that are installed, and runs what they plug into it
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# a look for circles of dead objects, where all memory goes anyway, takes a sixth of a short fit
atexit.register(gc.freeze)
# all is written then, and the exit code said: a late Ctrl-C changes neither
atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)


GROUPS = ("start", "fit", "examine", "hand over", "reference")
COMMAND_WIDTH = 9  # characters: the groups align


OF_CORE = {
    name: LazyCommand(group, text, LazyPart(f"exfit.cli.{place}"))
    for name, group, text, place in (
        ("inspect", "start", "Show the content of a recorder's file.", "records:inspect_"),
        ("fit", "fit", "Fit the free parameters of each CASE to its records.", "fitting:fit"),
        ("simulate", "examine", "Simulate CASE at its start values.", "simulating:simulate"),
        (
            "validate",
            "examine",
            "Compare fitted values with records that were not fitted.",
            "examining:validate",
        ),
        ("check", "examine", "Check a case before its fit.", "examining:check"),
        ("show", "examine", "Print a stored result again.", "examining:show"),
        (
            "profile",
            "examine",
            "Find the intervals of parameters by their profile likelihood.",
            "examining:profile",
        ),
        ("models", "reference", "List the models, or describe one.", "catalogue:models"),
        ("trust", "reference", "Trust code that cases name, or withdraw it.", "trusting:trust"),
        ("schema", "reference", "Print the JSON Schema of a case file.", "catalogue:schema"),
    )
}


def _commands() -> dict[str, LazyCommand]:
    return {**OF_CORE, **of_features()}


class Commands(click.Group):
    """The commands, each imported when it is called; what they refuse is reported in a line."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the names of all commands, in the order of their groups."""
        known = _commands()
        return sorted(known, key=lambda name: GROUPS.index(known[name].group))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; None where there is none of that name."""
        known = OF_CORE.get(cmd_name) or of_features().get(cmd_name)
        command: click.Command | None = None if known is None else known.part.load()
        return None if command is None else with_trust_option(command)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> "list[CompletionItem]":
        """Complete the name of a command, without importing any, or an option."""
        from click.shell_completion import CompletionItem

        known, names = _commands(), self.list_commands(ctx)
        items = [
            CompletionItem(name, help=known[name].help)
            for name in names
            if name.startswith(incomplete)
        ]
        return [*items, *click.Command.shell_complete(self, ctx, incomplete)]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by their groups, from what is known without importing them."""
        for group in GROUPS:
            known = ((name, each) for name, each in _commands().items() if each.group == group)
            if rows := [(name.ljust(COMMAND_WIDTH), each.help) for name, each in known]:
                with formatter.section(group.capitalize()):
                    formatter.write_dl(rows)

    def main(self, *arguments: Any, **settings: Any) -> Any:
        """Run as a program: no output that fails keeps a command from its files."""
        self.began = False
        with unfailing_output() as exit_code, endings_as_interruptions() as signals:
            try:
                return super().main(*arguments, obj=signals, **settings)
            except Interruption as interruption:
                interruption.show()
                raise SystemExit(code_after(signals, exit_code(interruption.exit_code))) from None
            except SystemExit as ended:
                code = exit_code(ended.code)
                if signals and not self.began:  # click makes an error of it
                    code = Interruption.exit_code
                    echo("Interrupted", err=True)
                elif signals and code != Interruption.exit_code:
                    echo("Interrupted: what was done until then is kept", err=True)
                raise SystemExit(code_after(signals, code or 0)) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command, and turn what is wrong with its input into a message."""
        self.began = True
        try:
            with guarded(lambda code: LazyPart("exfit.cli.trusting:permit").load()(ctx, code)):
                return super().invoke(ctx)
        except ExfitError as fault:
            raise Refusal(str(fault)) from fault
        except OSError as fault:
            # a name that is too long, a folder that may not be read
            if fault.filename is not None:
                raise Refusal(f"{fault.filename}: {fault.strerror}") from fault
            if isinstance(fault, FileNotFoundError):
                raise Refusal("the working folder has been removed") from fault
            raise  # it has nothing to do with a file that somebody named
        except KeyboardInterrupt as interruption:
            raise Interruption(str(interruption)) from None


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="exfit")
def main() -> None:
    """Find the parameters of a generator's excitation system from a recorded bump test.

    \b
    From a record to a report:      exfit verify RECORD -o report.html
    Step by step:                   exfit new, exfit fit CASE, exfit report RESULT
    The options of a command:       exfit COMMAND --help
    """
