"""From files to a case in a page: what `inspect` reads, the model by its drawing, `new`."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from shlex import join
from typing import Any, NamedTuple

from exfit.case.load import parse_case
from exfit.case.suggestion import RecordSettings
from exfit.cli.given_files import CASES, DYNAMICS_FILES, RECORDS
from exfit.errors import ExfitError, FileError
from exfit.features.app.messages import Correct, Make
from exfit.features.app.packing import thinned
from exfit.features.drawings.diagram import block_diagram, document
from exfit.features.planner.import_case import import_unit, units_of_file
from exfit.features.planner.units import Unit
from exfit.features.start.answers import checked
from exfit.features.start.making import new_case
from exfit.models import MODELS
from exfit.models.machines import find_machine
from exfit.models.sheet import Parameter
from exfit.records.inspection import Inspection
from exfit.signals import RECORDED
from exfit.util.files import on_disk, read_limited, within, write
from exfit.util.text import near

LARGEST = 200_000_000  # bytes of a file that is dropped on a page
MOST_CURVES = 12  # channels that are drawn
MACHINE = "GENROU"
SHOWN = (*RECORDS, *CASES, *DYNAMICS_FILES, ".json")


class PlannersFile(NamedTuple):
    """A planner's file and its units."""

    file: Path
    units: Sequence[Unit]


def planned(file: Path) -> PlannersFile:
    """Read a planner's file; raises DynamicsError where it cannot be read, or has no unit."""
    return PlannersFile(file, units_of_file(file).units or (import_unit(file),))  # which says why


def planner_content(planner: PlannersFile) -> dict[str, Any]:
    """Describe the units of a planner's file."""
    units = [
        {
            "name": f"bus {each.bus}, id {each.id}",
            "exciter": each.exciter.definition.model.name,
            "machine": machine_form(each.machine.definition.model.sheet, each.machine.values),
        }
        for each in planner.units
    ]
    command = join(["exfit", "import", str(planner.file)])
    return {"of": "planner", "file": planner.file.name, "units": units, "command": command}


def machine_form(sheet: Iterable[Parameter], values: Mapping[str, float]) -> list[dict[str, Any]]:
    """List the data of a machine: what they are if nobody says another, and their limits."""
    return [
        {
            "name": row.symbol,
            "unit": row.unit,
            "typical": values.get(row.symbol, row.typical),
            "low": row.low,
            "high": row.high,
            "meaning": row.meaning,
        }
        for row in sheet
    ]


def record_content(found: Inspection) -> dict[str, Any]:
    """Describe what a recorder's file contains, as `exfit inspect` reads it."""
    names = [each.name for each in found.channels][:MOST_CURVES]
    time, curves = thinned(found.time, [found.samples[name] for name in names])
    return {
        **channels_content(found),
        "of": "record",
        "file": found.path.name,
        "signals": list(RECORDED),
        "time": time,
        "curves": dict(zip(names, curves, strict=True)),
        "models": [*MODELS],
        "machine": machine_form(find_machine(MACHINE).sheet, {}),
        "command": join(["exfit", "inspect", str(found.path)]),
    }


def channels_content(found: Inspection) -> dict[str, Any]:
    """Describe the channels of a record, and what must be known of them."""
    channels = [
        {
            "name": each.name,
            "unit": each.unit or "",
            "signal": each.signal or "",
            "level": f"{each.level:.5g}",
            "noise": f"{each.noise:.2g}",
        }
        for each in found.channels
    ]
    return {"of": "channels", "channels": channels, "findings": list(found.findings)}


def corrected(found: Inspection, asked: Correct) -> Inspection:
    """Take a column for a signal, in a unit; raises ExfitError where there is no such."""
    if asked.signal not in ("", *RECORDED):
        raise ExfitError(f"{asked.signal}: no signal; {near(asked.signal, RECORDED)}")
    if asked.signal:
        text = f"{asked.column} [{asked.unit}]" if asked.unit else asked.column
        return RecordSettings(channels={asked.signal: text}).with_channels(found)
    names = [each.name for each in found.channels]
    if asked.column not in names:
        raise ExfitError(f"{asked.column}: no column of numbers; {near(asked.column, names)}")
    channels = (
        replace(each, signal=None) if each.name == asked.column else each for each in found.channels
    )
    return replace(found, channels=tuple(channels))


def drawn(name: str) -> dict[str, Any]:
    """Draw an exciter of the catalogue."""
    if name not in MODELS:
        raise ExfitError(f"model: {name}: not an exciter of the catalogue")
    model = MODELS[name]
    diagram = block_diagram(model.drawing, model.name, model.title)
    return {"of": "drawing", "title": model.title, "svg": document(diagram) if diagram else ""}


def made(found: Inspection, planner: PlannersFile | None, asked: Make) -> tuple[Path, str]:
    """Write the case of a record in the working folder, and return it with its command.

    Its unit is one of a planner's file, where there is one. Raises ExfitError, and writes nothing,
    where something is missing, or the file exists.
    """
    given: dict[str, Any] = {"record": str(found.path)}
    if planner is None:
        drawn(asked.model)
        given["model"] = asked.model
    elif asked.unit < len(planner.units):
        unit = planner.units[asked.unit]
        given |= {"dyr": str(planner.file), "bus": unit.bus, "id": unit.id}
    else:
        raise ExfitError(f"unit: {asked.unit}: {planner.file.name} has {len(planner.units)}")
    place = within(Path(), f"{found.path.stem}.yaml")
    words = ["exfit", "new", *_options(given), "-o", str(place)]
    numbers = {"step": asked.step, "kv": asked.kv}
    own = {key: number for key, number in numbers.items() if number is not None}
    words += _options({key: f"{number:g}" for key, number in own.items()})
    answers = checked({**given, **own, "machine": asked.machine})
    text = new_case(answers, Path(), {found.path: found}).draft.text
    parse_case(text, place)
    if on_disk(place).exists():
        raise ExfitError(f"{place}: exists already: open it, or rename it")
    write(place, text)
    return place, join(words)


def _options(given: Mapping[str, Any]) -> Iterable[str]:
    return [word for key, value in given.items() for word in (f"--{key}", str(value))]


def dropped(name: str, data: bytes) -> Path:
    """Keep a file that was dropped on a page, in the working folder; return its place.

    Raises ExfitError for what has no name of such a file, or the name of another file.
    """
    if Path(name).name != name or "\\" in name or Path(name).suffix.lower() not in SHOWN:
        raise FileError([f"{name[:100]}: not the name of a file to show ({' '.join(SHOWN)})"])
    place = within(Path(), name)
    if place.is_symlink():
        raise ExfitError(f"{name}: is a link: nothing is written through it")
    if not place.exists():
        write(place, data)
    elif read_limited(place, LARGEST) != data:
        raise ExfitError(f"{name}: exists with another content: rename one of them")
    return place
