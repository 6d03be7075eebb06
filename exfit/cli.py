"""The command line: reads arguments, calls study, shows what comes back; it computes nothing.

Everything but click is imported in the command that needs it, so that help appears at once.
"""

import gc
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from exfit.errors import ExfitError

if TYPE_CHECKING:
    from exfit.case import Case
    from exfit.estimate import Method

# before NumPy is imported: starting its threads costs more than they gain on matrices this small
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# else pydantic searches all packages that are installed, and runs what they plug into it
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# a look for circles of dead objects at every 700 new ones takes a twentieth of a short fit
gc.set_threshold(100_000)

NOT_CONVERGED = 3
STRATEGIES = ("gn", "dgn", "lm", "lm-then-dgn", "auto", "robust")


class Refusal(click.ClickException):
    """Input that cannot be used: its faults on standard error, exit code 1."""

    def show(self, file: Any = None) -> None:
        """Print the message, all faults of a case under each other."""
        lines = self.message.splitlines()
        click.echo("Error: " + "\n       ".join(lines), err=True, file=file)


class Commands(click.Group):
    """The commands; what they refuse is told without a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command, and turn what is wrong with its input into a message."""
        try:
            return super().invoke(ctx)
        except ExfitError as fault:
            raise Refusal(str(fault)) from fault


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="exfit")
def main() -> None:
    """Find the parameters of a generator's excitation system from a recorded bump test."""


case_argument = click.argument("case", type=click.Path(path_type=Path))
output_option = click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="DIR", help="Folder for the files."
)
plots_option = click.option("--plots/--no-plots", default=True, help="Draw figures (default: yes).")
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print the result as JSON and nothing else."
)
parameters_option = click.option(
    "--parameters",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Values from the parameters.yaml of a fit.",
)


@main.command()
@case_argument
@output_option
@click.option("--strategy", type=click.Choice(STRATEGIES), help="In place of the case's own.")
@plots_option
@quiet_option
@json_option
def fit(
    case: Path,
    output: Path | None,
    strategy: "Method | None",
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Fit the free parameters of CASE to its record.

    Writes result.json, parameters.yaml, history.csv, response.csv and figures to runs/CASE-fit, or
    to DIR. Ctrl-C keeps the best point so far. Exit code 0: converged; 1: bad input; 3: not
    converged, no match at all, or a validation beyond the limit that the case accepts.
    """
    from exfit import files, study
    from exfit.result import to_json

    loaded = _load(case)
    folder = output or _folder(case, "fit")
    files.refuse_unwritable(folder)
    if quiet or as_json:
        result = study.fit(loaded, strategy)
        files.write_fit(result, folder, plots)
        if as_json:
            click.echo(to_json(result.as_json()), nl=False)
    else:
        from exfit import show

        console = show.console()
        if loaded.estimate.starts > 1:
            with show.Bar(console).running() as progress:
                result = study.fit(loaded, strategy, progress=progress)
        else:
            with show.Watch(console, show.task(loaded, strategy)).running() as watch:
                result = study.fit(loaded, strategy, watch)
        files.write_fit(result, folder, plots)
        show.fit(console, result, folder)
    done = result.success and not result.interrupted
    if not (done and result.accepted and result.describes):
        raise SystemExit(NOT_CONVERGED)


@main.command()
@case_argument
@click.option("--set", "changes", multiple=True, metavar="KA=400", help="Value of a parameter.")
@parameters_option
@output_option
@plots_option
@quiet_option
def simulate(
    case: Path,
    changes: tuple[str, ...],
    parameters: Path | None,
    output: Path | None,
    plots: bool,
    quiet: bool,
) -> None:
    """Simulate CASE at its start values.

    Writes response.csv (t, vref, vt, efd, ifd and the states) and figures to runs/CASE-simulate, or
    to DIR. --set goes over --parameters, and both over the case; a parameter of the machine is
    named as in --set machine.Tpd0=6.
    """
    from exfit import files, study
    from exfit.changes import changed_values, read_parameters

    loaded = _load(case)
    folder = output or _folder(case, "simulate")
    files.refuse_unwritable(folder)
    values = read_parameters(loaded, parameters) if parameters else {}
    values |= changed_values(loaded, _assignments(changes, "--set"), "--set")
    simulation = study.simulate(loaded, values)
    files.write_simulation(simulation, case.stem, folder, plots)
    if not quiet:
        from exfit import show

        console = show.console()
        if simulation.comparison is not None:
            show.comparisons(console, [simulation.comparison])
        console.print(f"sub-steps {simulation.response.substeps}")
        show.notes(console, simulation.notes)
        show.written(console, folder)


@main.command(short_help="Compare fitted values with records that no fit saw.")
@case_argument
@parameters_option
@click.option(
    "--record",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Record in place of the first that the case validates on.",
)
@output_option
@plots_option
@quiet_option
@json_option
def validate(
    case: Path,
    parameters: Path | None,
    record: Path | None,
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Compare fitted values with the records of CASE that the fit never saw.

    The values are those of the last fit of the case, or of --parameters. Writes validation.json,
    samples and overlays to runs/CASE-validate, or to DIR.
    """
    from exfit import files, study
    from exfit.changes import read_parameters
    from exfit.result import to_json

    loaded = _load(case)
    folder = output or _folder(case, "validate")
    files.refuse_unwritable(folder)
    source = parameters or files.last_fit(case)
    found = study.validate(loaded, read_parameters(loaded, source), record)
    files.write_validation(found, folder, plots)
    if as_json:
        click.echo(to_json({"validation": [one.as_json() for one in found]}), nl=False)
    elif not quiet:
        from exfit import show

        console = show.console()
        console.print(f"values of {parameters or 'the last fit'}", soft_wrap=True, markup=False)
        show.comparisons(console, found)
        console.print()
        show.written(console, folder)
    if not all(one.accepted for one in found):
        raise SystemExit(NOT_CONVERGED)


@main.command(short_help="Check a case before its fit.")
@case_argument
def check(case: Path) -> None:
    """Check CASE before a fit: derivatives, bypasses, sub-steps, a flat run."""
    from exfit import show
    from exfit.check import check as checked

    found = checked(_load(case))
    show.check(show.console(), found)
    if not (found.agrees and found.flat):
        raise SystemExit(NOT_CONVERGED)


@main.command(short_help="Show how far each parameter can move with the others following.")
@case_argument
@click.argument("parameters", nargs=-1, metavar="[PARAM]...")
@output_option
@plots_option
@quiet_option
@json_option
def profile(
    case: Path,
    parameters: tuple[str, ...],
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Fit CASE, then find the 95 % interval of each PARAM from its profile likelihood.

    A parameter moves away from its fitted value, and the others are fitted anew, until the cost
    shows that the record refutes it. This serves where the linear theory of `exfit fit` does not.
    Without PARAM all free parameters are profiled. Writes profile.json, profile.csv and profile.png
    to runs/CASE-profile, or to DIR. Ctrl-C keeps what is done.
    """
    from exfit import files
    from exfit.profiles import profile as profiled
    from exfit.result import to_json

    loaded = _load(case)
    folder = output or _folder(case, "profile")
    files.refuse_unwritable(folder)
    if quiet or as_json:
        found = profiled(loaded, parameters)
    else:
        from exfit import show

        console = show.console()
        with show.Bar(console).running() as watch:
            found = profiled(loaded, parameters, watch)
    files.write_profiles(found, folder, plots)
    if as_json:
        click.echo(to_json(found.as_json()), nl=False)
    elif not quiet:
        show.profiles(console, found)
        show.written(console, folder)
    if found.interrupted:
        raise SystemExit(NOT_CONVERGED)


@main.command(short_help="Show what a planned test would tell of the parameters.")
@case_argument
@click.option(
    "--noise", multiple=True, metavar="vt=1e-4", help="Noise of a signal, pu; may be repeated."
)
@output_option
@plots_option
@quiet_option
@json_option
def identify(
    case: Path,
    noise: tuple[str, ...],
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Show which free parameters of CASE a test would determine, and how well; no record is needed.

    At the start values: the test of CASE, steps of 2, 5 and 10 %, a test twice as long, further
    channels. Writes identify.json and figures to runs/CASE-identify, or to DIR.
    """
    from exfit import files
    from exfit.design import identify as identified
    from exfit.result import to_json

    loaded = _load(case)
    folder = output or _folder(case, "identify")
    files.refuse_unwritable(folder)
    found = identified(loaded, _assignments(noise, "--noise"))
    files.write_design(found, folder, plots)
    if as_json:
        click.echo(to_json(found.as_json()), nl=False)
    elif not quiet:
        from exfit import show

        console = show.console()
        show.design(console, found)
        show.written(console, folder)


file_option = click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File to write; without it, to the terminal.",
)
force_option = click.option("--force", is_flag=True, help="Write over a file that exists.")
BUSES = click.IntRange(1, 999_999)


@main.command("import", short_help="Make a case of a PSS/E dynamics file.")
@click.argument("unit", type=click.Path(path_type=Path))
@click.option("--bus", type=BUSES, metavar="N", help="Bus of the unit.")
@click.option("--id", "machine_id", metavar="ID", help="Machine id of the unit, such as 1.")
@file_option
@force_option
def import_(
    unit: Path, bus: int | None, machine_id: str | None, output: Path | None, force: bool
) -> None:
    """Make a case of the machine, exciter and stabiliser in UNIT, a PSS/E .dyr file.

    The case is a step of 5 % on open circuit that `exfit simulate` runs as it stands. Where UNIT
    holds several units, --bus and --id choose one.
    """
    from exfit.case_writer import case_text, import_unit
    from exfit.psse import located

    if output is not None:
        _refuse_existing(output, force)
    found = import_unit(unit, bus, machine_id)
    _write(case_text(found, unit.name), output, located(found.warnings, str(unit)))
    if output is not None:
        click.echo(f"written to {output}; next: exfit simulate {output}")


@main.command(short_help="Write the result of a fit as PSS/E records.")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--format",
    "_format",
    type=click.Choice(["dyr"]),
    default="dyr",
    help="Kind of file: dyr, a PSS/E dynamics file (default).",
)
@click.option("--bus", type=BUSES, metavar="N", default=1, help="Bus of the unit (default: 1).")
@click.option(
    "--id",
    "machine_id",
    metavar="ID",
    default="1",
    callback=lambda _, __, value: _machine_id(value),
    help="Machine id of the unit (default: 1).",
)
@click.option(
    "--model", metavar="NAME", help="Another record of the exciter's model, such as ESAC8B."
)
@file_option
@force_option
def export(
    result: Path,
    _format: str,
    bus: int,
    machine_id: str,
    model: str | None,
    output: Path | None,
    force: bool,
) -> None:
    """Write the machine, exciter and stabiliser of RESULT as PSS/E records.

    RESULT is the result.json of a fit, or the folder that holds it. What a record cannot hold, or
    what is not sure about it, is told.
    """
    from exfit.export import export as exported

    if output is not None:
        _refuse_existing(output, force)
    found = exported(result, bus, machine_id, model)
    _write(found.text, output, found.warnings)
    if output is not None:
        click.echo(f"written to {output}")


@main.command(short_help="List the models, or describe one.")
@click.argument("name", required=False)
@click.option(
    "--plot",
    "folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write a page with a figure of every model.",
)
def models(name: str | None, folder: Path | None) -> None:
    """List the models, or print the drawing, data sheet and states of one."""
    from exfit import show
    from exfit.models import MODELS, STABILISERS, find
    from exfit.models.machines import MACHINES

    if folder is not None:
        from exfit import files
        from exfit.overview import write_overview

        files.refuse_unwritable(folder)
        write_overview(folder)
        show.written(show.console(), folder)
    elif name is None:
        show.catalogue(show.console(), MODELS.values(), MACHINES.values(), STABILISERS.values())
    elif name.upper() in STABILISERS:
        show.model(show.console(), STABILISERS[name.upper()])
    elif name.upper() in MACHINES:
        show.machine(show.console(), MACHINES[name.upper()])
    else:
        show.model(show.console(), find(name, Path()))


@main.command(short_help="Print the JSON Schema of a case file.")
def schema() -> None:
    """Print the JSON Schema of a case file, for editors that complete and check."""
    from exfit.case import json_schema
    from exfit.result import to_json

    click.echo(to_json(json_schema()), nl=False)


def _load(case: Path) -> "Case":
    from exfit.case import load_case

    return load_case(case)


def _refuse_existing(output: Path, force: bool) -> None:
    """Raise ExfitError where a file would be lost: it may be the only copy of someone's work."""
    if output.is_dir():
        raise ExfitError(f"{output}: cannot be written: it is a folder")
    if output.exists() and not force:
        raise ExfitError(f"{output}: exists already; --force writes over it")


def _write(text: str, output: Path | None, warnings: Iterable[str]) -> None:
    from exfit.result import write

    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)
    for warning in warnings:
        click.echo(f"Warning: {warning}", err=True)


def _machine_id(value: str) -> str:
    if not (1 <= len(value) <= 2 and value.isascii() and value.isalnum()):
        raise click.BadParameter(f"{value!r} is not one or two letters or digits.")
    return value


def _folder(case: Path, command: str) -> Path:
    return Path("runs") / f"{case.stem}-{command}"


def _assignments(texts: tuple[str, ...], option: str) -> dict[str, float]:
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            example = "KA=400" if option == "--set" else "vt=1e-4"
            raise ExfitError(f"{option} {text}: not of the form {example}") from None
    return values
