"""What several commands share: their options, and small steps on the way."""

import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from exfit.cli.given_files import GivenFile, Kind, ParameterFile
from exfit.cli.streams import echo
from exfit.errors import ExfitError
from exfit.util.interrupts import SIGNALLED, interrupted
from exfit.util.text import printable

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.case.schema.values import GivenAs
    from exfit.output.blocks import Block
    from exfit.output.events import Events
    from exfit.output.figure_files import FigureFiles

NOT_CONVERGED = 3
TRUST = "exfit.trust"  # the option --trust, in what the contexts of a command share
NAMING_CODE = {"case", "cases", "programme", "model", "name"}  # parameters that may name some
LONGEST_LINE = 1000  # characters of a message: a longer one quotes what is no name of a file

case_argument = click.argument("case", type=GivenFile(Kind.CASE))
cases_argument = click.argument(
    "cases", type=GivenFile(Kind.CASE), nargs=-1, required=True, metavar="CASE [CASE]..."
)
parameters_option = click.option(
    "--parameters",
    type=ParameterFile(),
    metavar="FILE",
    help="Values from the parameters.yaml of a fit, or from the folder that holds it.",
)


def completed(by: str) -> Callable[[click.Context, click.Parameter, str], list[str]]:
    """Make what completes by a function of `exfit.cli.completion`; only a shell asks for it."""

    def words(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
        from exfit.cli import completion

        found: list[str] = getattr(completion, by)(ctx, parameter, incomplete)
        return found

    return words


set_option = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KA=400",
    help="Value of a parameter.",
    shell_complete=completed("assigned_parameters"),
)
ANY_PATH = click.Path(path_type=Path)
ABOVE_ZERO = click.FloatRange(min=0.0, min_open=True)


output_option = partial(click.option, "-o", "--output", type=ANY_PATH, metavar="FILE")
file_option = output_option(help="File to write; default: the terminal.")
force_option = click.option("--force", is_flag=True, help="Overwrite an existing file.")
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")


trust_option = click.Option(
    ["--trust"],
    is_flag=True,
    expose_value=False,
    callback=lambda ctx, _, value: ctx.meta.update({TRUST: value}),
    help="Run the code that a case names, and trust it from now on: see exfit trust.",
)


def with_trust_option(command: click.Command) -> click.Command:
    """Give a command the option --trust where its parameters may name code."""
    if trust_option not in command.params and NAMING_CODE & {it.name for it in command.params}:
        command.params.append(trust_option)
    return command


class Output(NamedTuple):
    """Where a command leaves its files, and what it prints: tables, JSON or nothing.

    ``progress`` is that of --progress; ``events`` takes what json announces, else it is None.
    """

    given: Path | None
    figures: bool
    quiet: bool
    as_json: bool
    progress: str = "auto"
    events: "Events | None" = None

    @property
    def shown(self) -> bool:
        """Whether tables are printed."""
        return not (self.quiet or self.as_json)

    @property
    def live(self) -> bool:
        """Whether progress is shown to a reader."""
        return self.shown and self.progress == "auto"

    def folder(self, default: str, files: Iterable[str] = ()) -> Path:
        """Find the folder for the ``files`` of a command, by default one in runs.

        Raises ExfitError where it cannot take them: before a run is spent on it.
        """
        from exfit.output import run_folder
        from exfit.util.files import within

        folder = self.given or within(Path("runs"), default)
        run_folder.refuse_unwritable(folder, files)
        if self.events is not None:
            self.events.folder = folder
        return folder

    def folder_of(
        self, case: "Case", command: str, files: Sequence[str], after_records: bool = False
    ) -> Path:
        """Find the folder for the ``files`` of a command that a case is given to.

        ``after_records``: further files are named after the records of the case.
        """
        folder = self.folder(f"{case.path.stem}-{command}", files)
        refuse_own_files(case, folder, files, after_records)
        return folder

    def show(
        self,
        content: Mapping[str, Any],
        blocks: "Iterable[Block]",
        folder: Path,
        figures: "FigureFiles",
    ) -> None:
        """Print a result as JSON or in blocks, with the folder of its files; draw its figures."""
        if self.as_json:
            print_json(content)
        elif self.shown:
            from exfit.output import terminal

            console = terminal.console()
            terminal.show(console, blocks)
            console.print()
            terminal.written(console, folder)
        self.draw(figures)

    def draw(self, figures: "FigureFiles", listed: bool = True) -> None:
        """Draw the figures of a run, last of all it does; ``listed``: with a line for each."""
        if not self.figures or interrupted(2):
            return
        if self.shown and listed:
            from exfit.output import terminal

            self.warn(figures.draw(partial(terminal.figure, terminal.console())))
        else:
            self.warn(figures.draw())

    def warn(self, texts: Iterable[str], label: str = "Warning") -> None:
        """Announce what went wrong beside a result, or write it to standard error."""
        if self.events is None:
            warn(texts, label)
            return
        for text in texts:
            self.events.write("warning", text=text)


def file_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command an ``output`` of -o, --plots and -q."""

    @output_option(metavar="DIR", help="Folder for the files.")
    @click.option("--plots/--no-plots", default=True, help="Draw figures (default: yes).")
    @quiet_option
    @wraps(command)
    def with_output(
        output: Path | None,
        plots: bool,
        quiet: bool,
        as_json: bool = False,
        progress: str = "auto",
        events: "Events | None" = None,
        **others: Any,
    ) -> None:
        given = Output(output, plots, quiet, as_json, progress, events)
        command(output=given, **others)

    return with_output


def progress_option(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the ``progress`` of --progress, and ``events`` for json; else these are None.

    It stands above output_options, which make both a part of ``output``.
    """

    @click.option(
        "--progress",
        type=click.Choice(["auto", "json", "none"]),
        default="auto",
        help="Progress: auto, above the result (default); json, an object a line on standard "
        "error, for programs; none.",
    )
    @wraps(command)
    def with_progress(progress: str, **others: Any) -> None:
        with announced(progress, **others) as events:
            command(progress=progress, events=events, **others)

    return with_progress


@contextmanager
def announced(progress: str, **arguments: Any) -> "Iterator[Events | None]":
    """Give what takes the events of a command with --progress json, the last one how it ends."""
    if progress != "json":
        yield None
        return
    from exfit.output.events import Events

    context = click.get_current_context()
    inputs = (arguments.get(name) for name in ("case", "cases", "programme", "record"))
    strategies = arguments.get("strategies") or arguments.get("strategy")
    events, code, error = Events(), 0, None
    try:
        events.start(str(context.info_name), [*_listed(inputs)], [*_listed([strategies])])
        yield events
    except SystemExit as ended:
        code = int(ended.code or 0)
        raise
    except KeyboardInterrupt:
        code = Interruption.exit_code
        raise
    except Interruption as ended:
        code, error = ended.exit_code, str(ended)
        raise
    except click.ClickException as fault:
        code, error = fault.exit_code, fault.format_message()
        raise
    except Exception as fault:
        code, error = Refusal.exit_code, str(fault)
        raise
    finally:
        events.end(code_after(context.find_root().obj, code), error)


def code_after(signals: Sequence[int], code: int) -> int:
    """Return the exit code of a command that signals met."""
    for number in signals:
        if number != signal.SIGINT:
            return SIGNALLED + number
    return NOT_CONVERGED if signals and code == 0 else code


def _listed(given: Iterable[Any]) -> Iterator[str]:
    """Yield the texts of arguments, of those that take several each."""
    for each in given:
        yield from map(str, each if isinstance(each, tuple) else [each] if each else [])


def output_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command an ``output`` of -o, --plots, -q and --json."""
    text = "Print the result as JSON and nothing else."
    return file_options(click.option("--json", "as_json", is_flag=True, help=text)(command))


class Refusal(click.ClickException):
    """Input that cannot be used: its faults on standard error, exit code 1."""

    def show(self, file: Any = None) -> None:
        """Print the message, all faults of a case under each other."""
        lines = (
            line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]}..."
            for line in self.message.splitlines()
        )
        echo("Error: " + "\n       ".join(lines), err=True, file=file)


class Interruption(Exception):
    """Ctrl-C where no result is at hand that it could keep: the exit code that shells expect.

    None of click's: where a second Ctrl-C meets a message of those, click ends without it.
    """

    exit_code = 130

    def show(self) -> None:
        """Print the message below the terminal's own ^C."""
        line = ": ".join(filter(None, ("Interrupted", str(self))))
        echo(f"\n{line}" if sys.stderr.isatty() else line, err=True)


def refuse_own_files(
    case: "Case", folder: Path, written: Iterable[str], after_records: bool = False
) -> None:
    """Raise ExfitError where the results of a command would write over the files of its case."""
    from exfit.output import run_folder

    recordings = (*case.recordings, *case.validations)
    files = [
        case.path,
        *(case.folder / recording.record.file for recording in recordings),
        *(case.folder / file for test in case.tests for file in test.files),
        *filter(None, [case.parameter_file]),
    ]
    names = [recording.name for recording in recordings] if after_records else ()
    run_folder.refuse_inputs(written, files, folder, names)


class Given(NamedTuple):
    """Values given beside a case: a file of parameters, and those of --set over it.

    ``counting`` says how given values count, None: as the case says. The fit finds those that
    ``freed`` names, too.
    """

    parameters: Path | None
    changes: tuple[str, ...]
    counting: "GivenAs | None" = None
    freed: tuple[str, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that they are read from."""
        return () if self.parameters is None else (self.parameters,)

    def load(self, case: Path) -> "Case":
        """Return the case of a file with these values in place of its own.

        Raises CaseError with all faults of the case, or for values that it cannot start from.
        """
        own = self._own(case)
        return own if self.counting is None else replace(own, given=self.counting)

    def _own(self, case: Path) -> "Case":
        path = self.parameters
        if path is None and not self.changes:
            return self._freed(load(case))
        from exfit.workflows.given_values import (
            fitted_code,
            read_parameters,
            sources_in,
            with_given_values,
        )

        loaded = self._freed(load(case, *(fitted_code(path) if path else ())))
        if path:
            values = read_parameters(loaded, path)
            loaded = with_given_values(loaded, values, path, sources_in(path))
        return with_given_values(loaded, assignments(self.changes, "--set"), "--set")

    def _freed(self, case: "Case") -> "Case":
        if not self.freed:
            return case
        from exfit.case.rewriting import with_freed

        return with_freed(case, self.freed)


def load(case: Path, model_sha256: str = "", program_sha256: str = "") -> "Case":
    """Return the case of a file; raises CaseError with all faults of it.

    A user's own model, or a program, is run only if its file has the hash given, where one is.
    """
    from exfit.case.load import load_case, refuse_changed_program

    loaded = load_case(case, model_sha256)
    refuse_changed_program(loaded, program_sha256)
    return loaded


def refuse_existing(output: Path, force: bool) -> None:
    """Raise ExfitError where a file would be lost: it may be the only copy of someone's work."""
    if output.is_dir():
        raise ExfitError(f"{output}: cannot be written: it is a folder")
    if output.exists() and not force:
        raise ExfitError(f"{output}: exists already; --force overwrites it")


def write_text(text: str, output: Path | None, warnings: Iterable[str]) -> None:
    """Write a file, or to the terminal, and the warnings to standard error."""
    from exfit.util.files import write

    if output is None:  # a file that a shell makes of it is UTF-8, as exfit reads it
        click.echo(printable(text) if sys.stdout.isatty() else text.encode(), nl=False)
    else:
        write(output, text)
    warn(warnings)


def print_json(content: Mapping[str, Any]) -> None:
    """Write JSON to standard output, which may be unable to hold every character as it is."""
    from exfit.util.text import CONTROLS, to_json

    encoding = str(sys.stdout.encoding or "")
    text = to_json(content, ascii_only=not encoding.lower().startswith("utf"))
    click.echo(CONTROLS.sub(lambda control: f"\\u{ord(control[0]):04x}", text), nl=False)


def warn(texts: Iterable[str], label: str = "Warning") -> None:
    """Write what went wrong beside a result to standard error."""
    for text in texts:
        echo(f"{label}: {text}", err=True)


def assignments(texts: tuple[str, ...], option: str) -> dict[str, float]:
    """Return the numbers of an option such as --set KA=400; raises ExfitError for other text."""
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            example = "KA=400" if option == "--set" else "vt=1e-4"
            raise ExfitError(f"{option} {text}: not of the form {example}") from None
    return values
