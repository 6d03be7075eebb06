"""What drove the fit of a grid event, as play-in files."""

from pathlib import Path

from exfit.cli.options import refuse_existing
from exfit.cli.streams import echo
from exfit.errors import ExfitError

BUS, MACHINE_ID = 1, "1"  # of the generator that plays, which no case has


def export_play_in(source: Path, output: Path, force: bool) -> None:
    """Write what the records of a fit of grid events played into the unit, a file for each."""
    from exfit.features.planner.play_in_file import play_in_record, play_in_text
    from exfit.features.planner.play_in_signals import played_in
    from exfit.results.io import load_result, result_file
    from exfit.util.files import write
    from exfit.workflows import load_case

    if output.suffix.lower() != ".plb":
        raise ExfitError(f"{output}: a play-in file is called NAME.plb")
    records = played_in(load_case(load_result(result_file(source)).case))
    files = {
        name: output if len(records) == 1 else output.with_stem(f"{output.stem}-{name}")
        for name in records
    }
    for file in files.values():
        refuse_existing(file, force)
    for name, file in files.items():
        own = records[name]
        rows = zip(own.time.tolist(), own.vt.tolist(), own.frequency.tolist(), strict=True)
        write(file, play_in_text(rows))
        record = play_in_record(BUS, MACHINE_ID, file.stem, own.f0)
        echo(f"written to {file}; voltage in pu, frequency in Hz")
        echo(f"record of PSS/E, as public files have it, at a bus of your own: {record}")
