"""Mutants of command lines: every option that a command has, with values that it may not expect.

The files beside them are whole. A new command and a new option are among them by themselves.
"""

import random
import shlex
from collections.abc import Mapping
from functools import cache

import click
from commands import COMMANDS, ENDING
from mutants import NUMBERS, PAYLOADS
from places import SAMPLES

# whose values would start processes, reach a network, or never end
LEFT_OUT = {"--watch", "--scheduler", "--workers", "--trust"}
# what each command needs, quick as it is; an argument of a command not named is a case
NEEDS: Mapping[str, tuple[str, ...]] = {
    "inspect": ("record.csv",), "import": ("unit.dyr",),
    "verify": ("record.csv", "--model", "SEXS", "--step", "0.05"),
    "new": ("--record", "record.csv", "--model", "SEXS", "--step", "0.05"),
    "validate": ("case.yaml", "--parameters", "values.yaml"),
    "show": ("fit",), "export": ("fit",), "report": ("fit",),
    "translate": ("fit", "--model", "SEXS"), "compare": ("record.csv", "again.csv"),
    "rank": ("unit.yaml", "--models", "SEXS"), "models": ("AC1A",), "trust": (), "schema": (),
    "batch": ("case.yaml", "--workers", "0"), "run": ("programme.yaml",),
}  # fmt: skip
READ = (
    "case.yaml", "record.csv", "again.csv", "fit", "fit/result.json", "unit.dyr", "values.yaml",
    "programme.yaml", "net.raw", "answers.yaml", "tests.csv", "cases.csv", "unit.yaml", "missing",
    "unit.dyd", "event.plb", ".",
)  # fmt: skip
WRITTEN = ("out/x", "out", "case.yaml", "record.csv/x", "a" * 300, "out/ё.dyr", "out/x.dyd",
           "out/x.html", "missing/a/b", " ", "-")  # fmt: skip
WORDS = (
    "vt", "t", "ifd", "k", "a", "KA", "TE", "machine.Tpd0", "k,a", "AC1A", "SEXS,AC1A", "SEXS", "1",
    "101", "G2", "GENROU", "FIRST_ORDER", "auto", "?", "0.05", "-0.05", "up=0.05", "1/2", "1e-4",
    "vt=vt", "t=1", "averaged", "Unit=7", "noise", "vref", "*",
)  # fmt: skip
NUMERIC = (click.FloatRange, click.IntRange, type(click.FLOAT), type(click.INT))


@cache
def files() -> Mapping[str, bytes]:
    """Return the files that the options name."""
    from mutant_files import (
        CASES,
        EVENT,
        FITTED,
        POWER_FLOW,
        PROGRAMME_AT_REST,
        PSLF_UNITS,
        TESTS,
        UNIT,
        UNITS,
        csv,
        of_a_fit,
        recorded,
    )

    record = csv(recorded())
    return {
        "case.yaml": FITTED, "record.csv": record, "again.csv": record, "unit.dyr": UNITS,
        "unit.dyd": PSLF_UNITS, "unit.yaml": UNIT, "net.raw": POWER_FLOW, "tests.csv": TESTS,
        "cases.csv": CASES, "event.plb": EVENT, "programme.yaml": PROGRAMME_AT_REST,
        "values.yaml": b"parameters: {k: 2.5, a: 2.5}\n",
        "answers.yaml": (SAMPLES / "field_answers.yaml").read_bytes(),
        **{f"fit/{name}": data for name, data in of_a_fit("ac1a_good").items()},
    }  # fmt: skip


def _number(rng: random.Random) -> str:
    ordinary = f"{rng.choice((-1, 1)) * 10.0 ** rng.uniform(-9, 9):.3g}"
    return rng.choice((ordinary, ordinary, *rng.choices(NUMBERS, k=2)))


def _text(rng: random.Random, metavar: str | None) -> str:
    """Return a text: one of another option, or as the help shows it, with another number in it."""
    value = rng.choice((*rng.choices(WORDS, k=4), _number(rng), rng.choice(PAYLOADS)))
    if metavar and "=" in metavar and rng.random() < 0.8:
        value = f"{rng.choice(WORDS)}={rng.choice((value, _number(rng)))}"
    return value.replace("\0", "")  # which no argument of a program can hold


def _value(rng: random.Random, option: click.Parameter) -> str:
    if isinstance(option.type, click.Choice) and rng.random() < 0.9:
        return str(rng.choice([*option.type.choices]))
    if isinstance(option.type, NUMERIC):
        return _number(rng)
    if isinstance(option.type, click.Path):
        output = option.name in ("output", "plb", "plot")
        return rng.choice(WRITTEN if output else READ)
    return _text(rng, option.metavar if isinstance(option, click.Option) else None)


def arguments(rng: random.Random) -> tuple[str, ...]:
    """Return a command line with one to four options drawn from all that the command has."""
    name = rng.choice(sorted(ENDING))
    command = COMMANDS[name]
    needs = NEEDS.get(name, ("case.yaml",))
    if rng.random() < 0.1:
        needs = tuple(rng.choice((*READ, *WORDS)) for _ in needs)
    outputs = [option for option in command.params if option.name == "output"]
    out = ("-o", "out/x.html" if name in ("verify", "report") else "out/x") if outputs else ()
    figures = [option for option in command.params if "--no-plots" in option.secondary_opts]
    given = [*needs, *out]
    given += ["--no-plots"] if figures and rng.random() < 0.95 else []
    options = [
        option
        for option in command.params
        if isinstance(option, click.Option) and not LEFT_OUT & {*option.opts}
    ]
    for option in rng.choices(options, k=rng.choice((1, 1, 2, 3, 4))) if options else ():
        text = rng.choice([*option.opts, *option.secondary_opts])
        if text == "--plots" and rng.random() < 0.9:
            continue
        given += [text] if option.is_flag else [text, _value(rng, option)]
    return (name, *given)


def words(given: tuple[str, ...]) -> str:
    """Return a command line as a shell takes it."""
    return shlex.join(("exfit", *given))
