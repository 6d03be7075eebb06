"""Whether code that a case names may run: the question of a terminal, and the command trust."""

import sys
from pathlib import Path

import click

from exfit.cli.options import ANY_PATH, TRUST
from exfit.cli.streams import echo
from exfit.errors import ExfitError
from exfit.util.interrupts import interrupted
from exfit.util.trust import Code, is_trusted, why_refused
from exfit.util.trust import all_trusted as known
from exfit.util.trust import trust as remember
from exfit.util.trust import withdraw as forget

PERMITTED = "exfit.permitted"  # hashes of code, in what the contexts of a command share
HASH_DIGITS = 12
LARGEST = 1_000_000_000  # bytes, of an FMU with all its data


def permit(ctx: click.Context, code: Code) -> None:
    """Let code run that is trusted, that --trust allows, or who is asked; else raise ExfitError.

    It is remembered as trusted.
    """
    permitted = ctx.meta.setdefault(PERMITTED, set())
    if code.sha256 in permitted or is_trusted(code):
        return
    silent = _is_read_by_a_program()
    if not ctx.meta.get(TRUST):
        if silent or not all(stream and stream.isatty() for stream in (sys.stdin, sys.stderr)):
            raise ExfitError(why_refused(code))
        if not _confirmed(code):
            raise ExfitError(f"{code.words}: not run: you do not trust it")
    permitted.add(code.sha256)
    try:
        remember(code)
    except ExfitError as fault:
        echo(f"Warning: {fault}: trusted this time only", err=True)
    if not silent:
        echo(f"runs {code.words}, trusted from now on", err=True)


def _confirmed(code: Code) -> bool:
    """Ask; the end of the input, Ctrl-D, is a no."""
    echo("This would run with your rights, and is not trusted yet:", err=True)
    echo(f"  {code.words}\n  in {code.folder}", err=True)
    echo(f"  SHA-256 {code.sha256[:HASH_DIGITS]}...", err=True)
    try:
        return click.confirm("Do you trust it, having read it or knowing its author?", err=True)
    except click.Abort:
        if interrupted():
            raise KeyboardInterrupt from None
        echo("", err=True)
        return False


def _is_read_by_a_program() -> bool:
    context = click.get_current_context(silent=True)
    return context is not None and context.params.get("progress") == "json"


@click.command(short_help="Trust code that cases name, or withdraw it.")
@click.argument("places", type=ANY_PATH, nargs=-1, metavar="[FOLDER|FILE]...")
@click.option("--withdraw", is_flag=True, help="Trust them no more, or without any nothing at all.")
def trust(places: tuple[Path, ...], withdraw: bool) -> None:
    """Trust code that cases name: a model in Python, a command as the plant, an FMU.

    It runs with your rights. Each is known by its hash, so that a change of it is asked for again;
    of a FOLDER all code is trusted, below it and later, too. Without FOLDER or FILE all that is
    trusted is shown.
    """
    chosen = [_at(place, withdraw) for place in places]
    for code in [code for codes in chosen for code in codes]:
        (forget if withdraw else remember)(code)
    if withdraw and not places:
        for code in known():
            forget(code)
    for code in known():
        words = "" if code.words == code.place.name else f"  ({code.words})"
        echo(f"{code.sha256[:HASH_DIGITS]}  {code.place}{words}")


def _at(place: Path, withdraw: bool) -> list[Code]:
    """Find the code at a place; raises ExfitError where there is none."""
    if withdraw:
        own = place.resolve()
        given = (own, Path(str(place)))
        found = [
            code for code in known() if {code.place, Path(code.sha256[:HASH_DIGITS])} & {*given}
        ]
        if not found:
            raise ExfitError(f"{place}: not trusted; exfit trust shows what is")
        return found
    if place.is_dir():
        return [Code.of_folder(place)]
    from exfit.util.files import read_limited

    return [Code.of_file(place, read_limited(place, LARGEST))]
