"""`exfit.new`: the case of a record, from Python."""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

from exfit.errors import ExfitError
from exfit.features.start.answers import checked
from exfit.features.start.making import new_case
from exfit.util.files import write

File = str | PathLike[str]


def new(
    record: File,
    model: str | None = None,
    *,
    dyr: File | None = None,
    bus: int | None = None,
    id: str | None = None,
    step: float | Mapping[str, float] | None = None,
    kv: float | None = None,
    mva: float | None = None,
    base: Mapping[str, str] | None = None,
    governor: str | None = None,
    machine: Mapping[str, float] | None = None,
    exciter: Mapping[str, float] | None = None,
    sources: str | Mapping[str, str] | None = None,
    validate: Sequence[File] = (),
    about: Mapping[str, str] | None = None,
    output: File | None = None,
) -> str:
    """Make the case of a record, as ``exfit new`` does; return its text, in YAML.

    Args:
        record: file of a recorder, with one or more tests, or a grid event.
        model: exciter, by its name in the catalogue or the path of a model's file; None: that of
            ``dyr``.
        dyr: planner's file with the unit, of ``bus`` and ``id`` where it has several.
        step: size of the steps, pu, or of single tests, ``{"up": 0.05, "at-312s": 0.02}``.
        kv: rated voltage, line to line, kV; needed where the record is in V or kV.
        mva: rated power, MVA; needed where power is recorded in MW.
        base: value of 1 pu of other signals, with its unit, ``{"ifd": "550A"}``.
        governor: its model, of a record of one of its tests.
        machine, exciter: data that are not typical, by their symbols, in the units of
            ``exfit models``: s and pu of the machine's base.
        sources: where these are from, "maker" for all of them or a word each.
        validate: further records, on which the fit is validated.
        about: facts for the report.
        output: file to write; its folder is that from which the case names its files. A file that
            exists is replaced.

    What is not given and not in the record is "?" in the text: a fit refuses it by its line. Raises
    ExfitError for an answer that contradicts the record, a data sheet or another answer.

    Example:
        >>> text = exfit.new("bump.csv", "AC1A", step=0.05, kv=15.75, machine={"Tpd0": 6.0})
        >>> exfit.new("bump.csv", dyr="unit.dyr", bus=101, step=0.05, output="unit.yaml")
        >>> exfit.fit("unit.yaml").verdict.verdict
    """
    if model is None and dyr is None:
        raise ExfitError("model: missing; or give dyr, a planner's file with the unit")
    given = {
        "record": record, "model": model, "dyr": dyr, "bus": bus, "id": id, "step": step, "kv": kv,
        "mva": mva, "base": base, "governor": governor, "machine": machine, "exciter": exciter,
        "sources": sources, "validate": [str(file) for file in validate], "about": about,
    }  # fmt: skip
    stated = {
        key: str(value) if isinstance(value, PathLike) else value
        for key, value in given.items()
        if value is not None
    }
    path = None if output is None else Path(output)
    text = new_case(checked(stated), Path() if path is None else path.parent, {}).draft.text
    if path is not None:
        write(path, text)
    return text
