"""Play-in files of PSS/E (.plb): the recorded input of a grid event, and its model PLBVFU1."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from exfit.cli.options import refuse_existing
from exfit.cli.streams import echo
from exfit.errors import CaseError, ExfitError
from exfit.fitting.build import build_experiment
from exfit.simulation.inputs import SplinedInput

DIGITS = 9  # significant, of every number
TURN = 2.0 * np.pi
BUS, MACHINE_ID = 1, "1"  # of the generator that plays, which no case has


def play_in_text(rows: Iterable[tuple[float, float, float]]) -> str:
    """Return rows of time (s), voltage (pu) and frequency (Hz) as a play-in file."""
    return "".join(", ".join(f"{value:.{DIGITS}g}" for value in row) + "\n" for row in rows)


def play_in_record(bus: int, machine_id: str, name: str, f0: float) -> str:
    """Return the dynamics record that plays a file ``name``.plb at a bus, with ``f0`` in Hz.

    Its values are two flags, of voltage and frequency, the file, what both are divided by, and two
    lags, s.
    """
    head = f"{bus} 'USRMDL' {machine_id} 'PLBVFU1' 1 1 3 4 3 6"
    return f"{head} 1 1 '{name}' 1.0 {f0:g} 0.0 0.0 /"


def export_play_in(source: Path, output: Path, force: bool) -> None:
    """Write what the records of a fit of grid events played into the unit, a file for each."""
    from exfit.results.io import load_result, result_file
    from exfit.util.files import write
    from exfit.workflows import load_case

    if output.suffix.lower() != ".plb":
        raise ExfitError(f"{output}: the name of a play-in file ends with .plb")
    case = load_case(load_result(result_file(source)).case)
    if not case.kind.finds_rest:
        raise CaseError(f"{case.path}: plant {case.kind.name} is not driven by a grid event")
    f0 = case.plant.given["f0"]
    texts: dict[str, str] = {}
    for recording in case.recordings:
        setup = build_experiment(case, recording, case.values())
        time, angle = setup.record.time, setup.experiment.simulator.inputs.recorded["angle"]
        assert isinstance(angle, SplinedInput)
        vt, frequency = setup.record.signals["vt"], f0 + angle.slope(time) / TURN
        # the rest before the event is at the rated frequency
        rows = zip((time - time[0]).tolist(), vt.tolist(), frequency.tolist(), strict=True)
        texts[setup.name] = play_in_text(rows)
    files = {
        name: output if len(texts) == 1 else output.with_stem(f"{output.stem}-{name}")
        for name in texts
    }
    for file in files.values():
        refuse_existing(file, force)
    for name, file in files.items():
        write(file, texts[name])
        record = play_in_record(BUS, MACHINE_ID, file.stem, f0)
        echo(f"written to {file}; voltage in pu, frequency in Hz")
        echo(f"record of PSS/E, in the order of public files; replace bus and id: {record}")
