"""What a shell completes: names of models and of parameters.

A shell calls it at every press of a key: nothing heavy is imported, and nothing can fail.
"""

from collections.abc import Callable, Iterable
from importlib import import_module
from itertools import chain
from pathlib import Path

import click

Completion = Callable[[click.Context, click.Parameter, str], list[str]]


def names_of(*shelves: str) -> Completion:
    """Complete the names of models on shelves of `exfit.models`, in upper or lower case."""

    def completed(_: click.Context, __: click.Parameter, incomplete: str) -> list[str]:
        catalogue = vars(import_module("exfit.models"))
        names = chain.from_iterable(catalogue[shelf] for shelf in shelves)
        return _beginning(names, incomplete.upper())

    return completed


models = names_of(
    *("MODELS", "MACHINE_NAMES", "STABILISERS", "GOVERNORS", "LOAD_CONTROLLERS", "LIMITERS")
)
exciters, machines = names_of("MODELS"), names_of("MACHINE_NAMES")
governors = names_of("GOVERNORS")


def several_exciters(_: click.Context, __: click.Parameter, incomplete: str) -> list[str]:
    """Return names of exciters behind those that are given already, separated by commas."""
    from exfit.models import MODELS

    given, comma, last = incomplete.rpartition(",")
    taken = given.upper().split(",")
    names = _beginning((name for name in MODELS if name not in taken), last.upper())
    return [f"{given}{comma}{name}" for name in names]


def free_parameters(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Return the free parameters of the case, but for those that are given already."""
    from exfit.case.peek import free_of

    given = ctx.params.get("parameters") or ()
    free = () if (case := _case(ctx)) is None else free_of(case)
    return _beginning((name for name in free if name not in given), incomplete)


def assigned_parameters(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Return the parameters that the case names, each ready for its value."""
    from exfit.case.peek import parameters_of

    names = () if (case := _case(ctx)) is None else parameters_of(case)
    return _beginning((f"{name}=" for name in names), incomplete)


def given_values(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Return parameters that the case names and does not fit, behind those given already."""
    from exfit.case.peek import free_of, parameters_of

    given, comma, last = incomplete.rpartition(",")
    if (case := _case(ctx)) is None:
        return []
    taken = {*free_of(case), *given.split(",")}
    names = _beginning((name for name in parameters_of(case) if name not in taken), last)
    return [f"{given}{comma}{name}" for name in names]


def noises(_: click.Context, __: click.Parameter, incomplete: str) -> list[str]:
    """Return the signals, each ready for its noise."""
    from exfit.signals import COMPARED

    return _beginning((f"{signal}=" for signal in COMPARED), incomplete)


def _case(ctx: click.Context) -> Path | None:
    """Return the case that is given already; the shell leaves a home folder as it is typed."""
    case = ctx.params.get("case") or next(iter(ctx.params.get("cases") or ()), None)
    if case is None:
        # behind an option that still lacks its value, click has not yet named the arguments
        case = next((word for word in ctx.args if not word.startswith("-")), None)
    if case is None:
        return None
    try:
        return Path(case).expanduser()
    except RuntimeError:  # there is no such user
        return None


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
