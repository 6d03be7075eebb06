"""From a record to a case in a page: what `inspect` reads, the model by its drawing, `new`."""

from pathlib import Path
from shlex import join
from typing import Any

from exfit import workflows
from exfit.case.load import parse_case
from exfit.cli.given_files import RECORDS
from exfit.errors import ExfitError, FileError
from exfit.features.app.messages import Make
from exfit.features.app.packing import thinned
from exfit.features.drawings.diagram import block_diagram, document
from exfit.features.start.starting import new
from exfit.models import MODELS
from exfit.models.machines import find_machine
from exfit.util.files import on_disk, read_limited, within, write

LARGEST = 200_000_000  # bytes of a record that is dropped on a page
MOST_CURVES = 12  # channels that are drawn
MACHINE = "GENROU"


def inspected(path: Path) -> dict[str, Any]:
    """Describe what a recorder's file contains, as `exfit inspect` reads it."""
    found = workflows.inspect(path)
    names = [each.name for each in found.channels][:MOST_CURVES]
    time, curves = thinned(found.time, [found.samples[name] for name in names])
    return {
        "of": "record",
        "file": path.name,
        "channels": [
            {
                "name": each.name,
                "unit": each.unit or "",
                "signal": each.signal or "",
                "level": f"{each.level:.5g}",
                "noise": f"{each.noise:.2g}",
            }
            for each in found.channels
        ],
        "time": time,
        "curves": dict(zip(names, curves, strict=True)),
        "findings": list(found.findings),
        "models": [*MODELS],
        "machine": [
            {
                "name": row.symbol,
                "unit": row.unit,
                "typical": row.typical,
                "low": row.low,
                "high": row.high,
                "meaning": row.meaning,
            }
            for row in find_machine(MACHINE).sheet
        ],
        "command": join(["exfit", "inspect", str(path)]),
    }


def drawn(name: str) -> dict[str, Any]:
    """Draw an exciter of the catalogue."""
    if name not in MODELS:
        raise ExfitError(f"model: {name}: not an exciter of the catalogue")
    model = MODELS[name]
    diagram = block_diagram(model.drawing, model.name, model.title)
    return {"of": "drawing", "title": model.title, "svg": document(diagram) if diagram else ""}


def made(record: Path, asked: Make) -> tuple[Path, str]:
    """Write the case of a record in the working folder, and return it with its command.

    Raises ExfitError, and writes nothing, where something is missing, or the file exists.
    """
    drawn(asked.model)
    text = new(record, asked.model, step=asked.step, kv=asked.kv, machine=asked.machine)
    place = within(Path(), f"{record.stem}.yaml")
    parse_case(text, place)
    if on_disk(place).exists():
        raise ExfitError(f"{place}: exists already: open it, or rename it")
    write(place, text)
    words = ["exfit", "new", "--record", str(record), "--model", asked.model, "-o", str(place)]
    words += [] if asked.step is None else ["--step", f"{asked.step:g}"]
    words += [] if asked.kv is None else ["--kv", f"{asked.kv:g}"]
    return place, join(words)


def dropped(name: str, data: bytes) -> Path:
    """Keep a record that was dropped on a page, in the working folder; return its place.

    Raises ExfitError for what has no name of a record, or the name of another file.
    """
    if Path(name).name != name or "\\" in name or Path(name).suffix.lower() not in RECORDS:
        raise FileError([f"{name[:100]}: not the name of a recorder's file ({' '.join(RECORDS)})"])
    place = within(Path(), name)
    if place.is_symlink():
        raise ExfitError(f"{name}: is a link: nothing is written through it")
    if not place.exists():
        write(place, data)
    elif read_limited(place, LARGEST) != data:
        raise ExfitError(f"{name}: exists with another content: rename one of them")
    return place
