"""What mutants are made from, and those of each kind: cases, records, planners' files, results.

The files that a fit or a programme leaves are made by one, once for each process.
"""

import hashlib
import io
import json
import math
import random
import re
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import yaml
from governor_programme import PROGRAMME
from mutants import (
    Mutant,
    Table,
    at_place,
    json_bytes,
    mutated_bytes,
    mutated_table,
    mutated_tree,
    places_of,
    randomness,
    yaml_bytes,
)
from places import CONFIGS, ROOT
from power_flow_files import power_flow

Files = dict[str, bytes]
Changes = list[str]
Random = random.Random

SAMPLES_IN_TABLE = 160
EARLIEST = (1980, 1, 1, 0, 0, 0)  # that a ZIP archive can name: its bytes depend on no clock
TREE = 0.6  # share of the mutants of YAML and JSON whose tree is changed, not their bytes


# ---- cases, programmes and the values beside them


@cache
def _configs(folder: str) -> tuple[tuple[str, bytes], ...]:
    """Return the case files of a folder whose paths lead to ../sample_data, by name."""
    files = sorted((CONFIGS / folder).glob("*.yaml"))
    up = b"../../sample_data" if folder else b"../sample_data"
    return tuple((file.name, file.read_bytes().replace(up, b"../sample_data")) for file in files)


@cache
def _keys_of_cases() -> tuple[str, ...]:
    """Return every key that a case file knows."""
    from exfit.case.json_schema import json_schema

    schema = json_schema()
    parts = [schema, *schema["$defs"].values()]
    return tuple(sorted({key for part in parts for key in part.get("properties", ())}))


@cache
def _example() -> bytes:
    """Return the case of the documentation that has every section."""
    page = (ROOT / "docs" / "case_file.md").read_text(encoding="utf-8")
    return page.partition("```yaml\n")[2].partition("```")[0].encode()


def _yaml(rng: Random, sources: tuple[bytes, ...], changes: Changes) -> bytes:
    """Return a mutant of one of several YAML files, perhaps with parts of another one."""
    one, other = rng.choice(sources), rng.choice(sources)
    if rng.random() < TREE:
        trees = yaml.safe_load(one), yaml.safe_load(other)
        return yaml_bytes(mutated_tree(rng, *trees, changes, _keys_of_cases()))
    return mutated_bytes(rng, one, other, changes, text=True)


# a case whose channels, steps and estimate have many of their keys
RICH = b"""model: AC8B
plant:
  type: infinite-bus
  machine: GENROU
  parameters: {Tpd0: 6.27, Xd: 2.014, Xq: 1.96, Xpd: 0.331, Xppd: 0.2059, Xl: 0.129}
  network: {f0: 60, R: 0.0, X: 0.3, P: 0.8, E: 1.0}
stabiliser: {model: PSS1A, parameters: {KS: 5.0}}
test:
  vref: [{at: 1.0, step: 0.02, ramp: 0.1}, {at: 4.0, step: -0.01}]
  E: [{at: 6.0, step: -0.01}]
  network: [{at: 7.0, X: 0.35}]
record:
  file: ../sample_data/ac8b_on_line.csv
  time: {column: t, unit: s}
  window: [0.5, 9.5]
  delay: 0.01
  resample: 50.0
  channels:
    vt: {column: vt, noise: 1.0e-4, filter: {lowpass: 5.0}, outliers: 6, scale: 1.0, offset: 0.0}
    p: {column: p, noise: 1.0e-3, filter: {median: 3}}
    efd: {column: efd, noise: 0.01, averaged: 0.05, scale: {start: 1.0, min: 0.9, max: 1.1}}
parameters:
  fixed: {KA: 1.0, TA: 0.01, TR: =2*TA, VRMAX: 35.0, VRMIN: 0.0}
  free:
    KPR: {start: 60, min: 6, max: 600, prior: {mean: 60, std: 10}}
    TE: {start: 0.8, min: 0.1, max: 10, scale: linear}
estimate: {strategy: lm, loss: huber, loss_scale: 1.0, starts: 4, iterations: 50}
simulation: {step: 0.002, output_step: 0.01}
as_found: {source: base, parameters: {KPR: 50.0, machine.Xd: 2.0}}
criteria: {source: us, limits: [{quantity: rms, limit: 1.0e-3, to: 5.0}]}
about: {Unit: 1, Rated MVA: 120}
"""


def _case(rng: Random, changes: Changes) -> Files:
    folder = rng.choice(("", "", "models"))
    sources = tuple(data for _, data in _configs(folder))
    return {"case.yaml": _yaml(rng, (*sources, *(_example(), RICH) * 3), changes)}


def _programme(rng: Random, changes: Changes) -> Files:
    sources = tuple(data for _, data in _configs("programmes"))
    return {"programme.yaml": _yaml(rng, sources, changes)}


def _run_programme(rng: Random, changes: Changes) -> Files:
    """Return a programme whose own text, whose records or whose samples are damaged."""
    way = rng.random()
    if way < 0.4:
        return {"programme.yaml": _yaml(rng, (PROGRAMME_AT_REST, GOVERNED), changes)} | {
            name: csv(table) for name, table in _records_of_governor().items()
        }
    programme = PROGRAMME_AT_REST.replace(b"../sample_data/", b"")
    if way < 0.6:
        files = {"programme.yaml": programme}
        for key in ("programme_saturation.csv", "programme_v_curve.csv"):
            data = (ROOT / "sample_data" / key).read_bytes()
            files[key] = mutated_bytes(rng, data, data, changes, text=True)
        return files
    if way < 0.8:
        programme, records = GOVERNED, dict(_records_of_governor())
    elif way < 0.97:
        records = {
            key: _sample(key) for key in ("programme_saturation.csv", "programme_v_curve.csv")
        }
    else:  # with simulations, which take longer
        whole = dict(_configs("programmes"))["ac8b_unit1.yaml"]
        programme = whole.replace(b"../sample_data/", b"")
        records = {
            key.decode(): _sample(key.decode()) for key in re.findall(rb"\w+\.csv", programme)
        }
    name = rng.choice(sorted(records))
    records[name] = _with_damaged_samples(rng, records[name], changes)
    return {"programme.yaml": programme} | {name: csv(table) for name, table in records.items()}


@cache
def _sample(name: str) -> Table:
    """Return a record of the samples."""
    first, *rows = (ROOT / "sample_data" / name).read_text().splitlines()
    columns = zip(*(map(float, row.split(",")) for row in rows), strict=True)
    return Table(first.split(","), [[*column] for column in columns])


GOVERNED = PROGRAMME.encode()


@cache
def _records_of_governor() -> Mapping[str, Table]:
    """Return a record of a speed that wanders, and points of gate over power."""
    noise = random.Random(0)
    slow: list[list[float]] = [[], [], []]
    speed, gate = 0.0, 60.0
    for k in range(300):
        speed += -0.02 * speed + noise.gauss(0.0, 0.004)  # Hz
        gate += 0.3 * (60.0 - 40.0 * speed - gate)
        for column, value in zip(slow, (4.0 * k, 60.0 + speed, gate), strict=True):
            column.append(value)
    power = [0.1 + 0.08 * k for k in range(11)]
    gates = [p / 1.17 + 0.06 + noise.gauss(0.0, 1e-3) for p in power]
    return {
        "slow.csv": Table(["t", "f (Hz)", "Y (%)"], slow),
        "gate.csv": Table(["P", "Y"], [power, gates]),
    }


def _with_numbers(rng: Random, tree: Any, changes: Changes) -> Any:
    """Change one to three numbers of a tree by powers of ten, as a slip of the keyboard does."""
    numbers = [
        place
        for place in places_of(tree)
        if type(at_place(tree, place)) in (int, float) and place[-1] not in ("number", "Unit")
    ]
    for place in rng.choices(numbers, k=rng.choice((1, 1, 2, 3))):
        holder, key, power = at_place(tree, place[:-1]), place[-1], rng.choice((1, 2, 3, 6, 9, 12))
        factor = rng.choice((10.0, 0.1)) ** rng.uniform(0.1, power)
        whole = isinstance(holder[key], int) and rng.random() < 0.7
        value = (holder[key] or 1.0) * factor * rng.choice((1, 1, 1, -1))
        holder[key] = round(value) if whole else value
        changes.append(f"{place}: {holder[key]:g}")
    return tree


def _extremes(rng: Random, changes: Changes) -> Files:
    """Return a case whose numbers are numbers, but extreme."""
    configs = dict(_configs(""))
    few = configs["ac1a_good.yaml"], configs["grid_event.yaml"], RICH  # which take longer
    sources = few if rng.random() < 0.03 else (FITTED, UNIT)
    tree = _with_numbers(rng, yaml.safe_load(rng.choice(sources)), changes)
    record = csv(recorded())
    return {"case.yaml": yaml_bytes(tree), "record.csv": record, "again.csv": record}


def _criteria(rng: Random, changes: Changes) -> Files:
    sources = tuple(path.read_bytes() for path in sorted((CONFIGS / "criteria").glob("*.yaml")))
    if rng.random() < 0.4:
        limits = yaml_bytes(_with_numbers(rng, yaml.safe_load(rng.choice(sources)), changes))
    else:
        limits = _yaml(rng, (*sources, CRITERIA), changes)
    record = csv(recorded())
    case = FITTED + b"criteria: {file: limits.yaml}\n"
    return {"limits.yaml": limits, "case.yaml": case, "record.csv": record, "again.csv": record}


def _power_flow_file(rng: Random, changes: Changes) -> Files:
    flow = power_flow(version=rng.choice((33, 34, 35)), buses=(101, 7)).encode()
    data = mutated_bytes(rng, flow, POWER_FLOW, changes, text=True)
    return {"net.raw": data, "unit.dyr": UNITS}


def _trust(rng: Random, changes: Changes) -> Files:
    """Return what is trusted, and a model that is, of which one is damaged."""
    source = (ROOT / "exfit" / "models" / "exciters" / "first_order.py").read_bytes()
    key = hashlib.sha256(source).hexdigest()
    entry = {"words": "own.py", "place": "own.py", "sha256": key}
    case = FITTED.replace(b"FIRST_ORDER", b"own.py")
    record = csv(recorded())
    files = {f"configuration/trusted/{key}.json": json_bytes(entry), "own.py": source}
    damaged = rng.choice([*files])
    changes.append(damaged)
    if damaged == "own.py":
        files[damaged] = mutated_bytes(rng, source, source, changes, text=True)
    else:
        files[damaged] = _json(rng, files[damaged], files[damaged], changes)
    return {"own.yaml": case, **files, "record.csv": record, "again.csv": record}


def _options(rng: Random, changes: Changes) -> Files:
    from mutant_options import arguments, files, words

    given = arguments(rng)
    changes.append(words(given))
    return {"arguments.json": json_bytes(given), **files()}


def _parameters(rng: Random, changes: Changes) -> Files:
    fitted = (of_a_fit()["parameters.yaml"], of_a_fit("ac1a_good")["parameters.yaml"])
    case = dict(_configs(""))["ac1a_good.yaml"]
    return {"parameters.yaml": _yaml(rng, fitted, changes), "case.yaml": case}


# ---- what exfit itself writes


def _programme_at_rest() -> bytes:
    """Return a programme of two tests at rest, which takes no simulation."""
    content = yaml.safe_load(dict(_configs("programmes"))["ac8b_unit1.yaml"])
    content["tests"] = content["tests"][:2]
    del content["parameters"]["free"]
    content["parameters"]["fixed"] |= {"KPR": 84, "KIR": 5, "KDR": 10, "TDR": 0.1, "TE": 1.3}
    return yaml_bytes(content)


PROGRAMME_AT_REST = _programme_at_rest()


@cache
def of_a_fit(name: str = "first_order") -> Mapping[str, bytes]:
    """Return the numbers that a fit of a case leaves."""
    from exfit import fit
    from exfit.output.run_folder import write_fit

    with tempfile.TemporaryDirectory() as folder:
        write_fit(fit(CONFIGS / f"{name}.yaml", search="local"), Path(folder))
        files = {file.name: file.read_bytes() for file in sorted(Path(folder).iterdir())}
    content = json.loads(files["result.json"]) | {"seconds": 1.0}  # else no two would be alike
    return files | {"result.json": json_bytes(content)}


@cache
def _of_a_programme() -> Mapping[str, bytes]:
    """Return what a programme of two tests at rest leaves, by paths in its folder."""
    from exfit.features.programme.folder import write_programme, write_test
    from exfit.features.programme.programme import load_programme
    from exfit.features.programme.run import run

    content = yaml.safe_load(PROGRAMME_AT_REST)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for test in content["tests"]:
            test["file"] = str(ROOT / test["file"].removeprefix("../"))
        (folder / "unit.yaml").write_bytes(yaml_bytes(content))
        result = run(load_programme(folder / "unit.yaml"), folder, keep=write_test)
        write_programme(result, folder)
        files = [file for file in sorted(folder.rglob("*.json")) if file.is_file()]
        read = {file.relative_to(folder).as_posix(): file.read_bytes() for file in files}
    return {"programme.json": read.pop("programme.json"), **read}


@cache
def _of_a_batch() -> Mapping[str, bytes]:
    """Return what a batch of a case that is done, one that failed and one refused leaves."""
    from exfit.features.fleet.folder import (
        CaseOutcome,
        Failure,
        IndexEntry,
        prepare_folder,
        summary_of,
        write_entry,
        write_outcome,
    )
    from exfit.results.io import load_result

    done, failed = "0" * 31 + "1", "0" * 31 + "2"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = of_a_fit()["result.json"]
        (folder / "result.json").write_bytes(text)
        summary = summary_of(load_result(folder), done, 1.0)
        (folder / "result.json").unlink()
        files = {"result.json": text.decode()}
        write_outcome(folder, done, CaseOutcome(files, summary))
        write_outcome(folder, failed, CaseOutcome(failure=Failure("crashed", "why", 2.0)))
        entries = [IndexEntry("../a.yaml", done), IndexEntry("../b.yaml", failed)]
        entries.append(IndexEntry("../c.yaml", "", "refused", "c.yaml:1: model: is missing"))
        prepare_folder(folder)
        for entry in entries:
            write_entry(folder, entry)
        paths = sorted(path for path in folder.rglob("*.json") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _batch(rng: Random, changes: Changes) -> Files:
    files = dict(_of_a_batch())
    name = rng.choice([*files])
    changes.append(name)
    files[name] = _json(rng, files[name], files[rng.choice([*files])], changes)
    return files


def _json(rng: Random, one: bytes, other: bytes, changes: Changes) -> bytes:
    if rng.random() < TREE:
        return json_bytes(mutated_tree(rng, json.loads(one), json.loads(other), changes))
    return mutated_bytes(rng, one, other, changes, text=True)


def _result(rng: Random, changes: Changes) -> Files:
    results = [of_a_fit(name)["result.json"] for name in ("first_order", "ac1a_good")]
    return {"result.json": _json(rng, rng.choice(results), rng.choice(results), changes)}


def _programme_result(rng: Random, changes: Changes) -> Files:
    files = dict(_of_a_programme())
    name = rng.choice([*files])
    changes.append(name)
    files[name] = _json(rng, files[name], files[rng.choice([*files])], changes)
    return files


# ---- records


@cache
def recorded(phases: bool = False) -> Table:
    """Return a bump test of vt, ifd and efd in pu, or the waveforms of three phases."""
    noise = random.Random(0)
    step = 0.001 if phases else 0.025
    time = [step * k for k in range(SAMPLES_IN_TABLE)]
    level = [1.0 + 0.05 * (1.0 - math.exp(-max(t - 1.0, 0.0) / 0.4)) for t in time]
    if phases:
        turn = 2.0 * math.pi * 50.0
        columns = [
            [math.cos(turn * t - 2.0 * math.pi * k / 3.0) + noise.gauss(0.0, 1e-4) for t in time]
            for k in range(3)
        ]
        return Table(["t", "Ua", "Ub", "Uc"], [time, *columns], ["s", "kV", "kV", "kV"])
    field = [
        1.1 * x + (0.4 if t > 1.0 else 0.0) * math.exp(1.0 - t)
        for t, x in zip(time, level, strict=True)
    ]
    slopes = [(b - a) / step for a, b in zip(level, [*level[1:], level[-1]], strict=True)]
    drive = [x + 5.0 * slope for x, slope in zip(field, slopes, strict=True)]
    shown = [[x + noise.gauss(0.0, 1e-4) for x in column] for column in (level, field, drive)]
    return Table(["t", "vt", "ifd", "efd"], [time, *shown], ["s", "pu", "pu", "pu"])


def _table(rng: Random, changes: Changes) -> Table:
    return mutated_table(rng, recorded(rng.random() < 0.1), changes)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _rows(table: Table) -> list[tuple[Any, ...]]:
    """Return the rows of a table; columns end where they end."""
    longest = max(map(len, table.columns), default=0)
    filled = [column + [None] * (longest - len(column)) for column in table.columns]
    return list(zip(*filled, strict=True))


def _time_cells(rng: Random, table: Table) -> None:
    """Write the time as timestamps, where it is numbers of a day."""
    clock = table.columns[0]
    if not all(isinstance(t, float) and 0.0 <= t < 86_400.0 for t in clock):
        return
    stamps = [divmod(round(1000.0 * t), 1000) for t in clock]
    hours = [f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}.{ms:03d}" for s, ms in stamps]
    if rng.random() < 0.5:
        table.columns[0] = [f"20.09.2015 {text}" for text in hours]
    else:
        table.columns[:1] = [["2015-09-20"] * len(hours), hours]
        table.names[:1] = ["Date", "Time"]
        table.units = []


def _text_record(rng: Random, changes: Changes) -> Files:
    table = _table(rng, changes)
    if rng.random() < 0.3:
        _time_cells(rng, table)
    separator, decimal = rng.choice(((",", "."), (";", ","), ("\t", "."), (" ", "."), (";", ".")))
    lines = ["Unit 1; bump test", "# a title"][: rng.choice((0, 0, 1, 2))]
    lines.append(separator.join(table.names))
    if table.units and rng.random() < 0.3:
        lines.append(separator.join(table.units))
    lines += [
        separator.join(_cell(value).replace(".", decimal) for value in row) for row in _rows(table)
    ]
    data = "\n".join(lines).encode(rng.choice(("utf-8", "utf-8", "utf-16", "cp1252")), "replace")
    return {"record" + rng.choice((".csv", ".txt")): _damaged(rng, data, changes, text=True)}


FITTED = b"""model: FIRST_ORDER
plant: {type: none}
test: {vt0: 1.0, vref: [{at: 1.0, step: 0.05}]}
record: {file: record.csv, time: t, channels: {vt: vt}}
parameters: {free: {k: {start: 2.0, min: 0.1, max: 50.0}, a: {start: 2.0, min: 0.1, max: 50.0}}}
estimate: {search: local, iterations: 10}
validate:
  - name: again
    test: {vref: [{at: 1.0, step: 0.05}]}
    record: {file: again.csv, time: t, channels: {vt: vt}}
"""


def _with_damaged_samples(rng: Random, table: Table, changes: Changes) -> Table:
    """Return a record whose samples are damaged, but numbers in a table still; seldom its time."""
    columns = [[*column] for column in table.columns]
    for _ in range(rng.randint(1, 3)):
        column = rng.choice([*columns, *columns[1:], *5 * [columns[1]]])
        first = rng.choice((0, rng.randrange(len(column))))
        last = min(first + rng.choice((1, 1, 2, 20, len(column))), len(column))
        what, change = rng.choice([*SAMPLE_CHANGES.items()])
        column[first:last] = [
            None if value is None else change(value, rng) for value in column[first:last]
        ]
        changes.append(f"samples {first} to {last} of column {columns.index(column)}: {what}")
    return Table(table.names, columns, table.units)


def _fitted_record(rng: Random, changes: Changes) -> Files:
    """Return a case with a damaged record to fit, or to validate its fit."""
    table = recorded()
    damaged = _with_damaged_samples(rng, table, changes)
    both = [damaged, table] if rng.random() < 0.7 else [table, damaged]
    return {"case.yaml": FITTED} | dict(
        zip(("record.csv", "again.csv"), map(csv, both), strict=True)
    )


def csv(table: Table) -> bytes:
    """Return a table as text with commas."""
    rows = [table.names, *_rows(table)]
    return "\n".join(",".join(map(_cell, row)) for row in rows).encode()


SAMPLE_CHANGES: Mapping[str, Callable[[float, Random], float | None]] = {
    "missing": lambda value, rng: None,
    "the same": lambda value, rng: 1.0,
    "zero": lambda value, rng: 0.0,
    "reversed": lambda value, rng: -value,
    "huge": lambda value, rng: value * 10.0 ** rng.choice((3, 30, 150, 300)),
    "tiny": lambda value, rng: value * 10.0 ** -rng.choice((3, 30, 150, 300)),
    "another base": lambda value, rng: 15.75 * value,
    "far off": lambda value, rng: value + 1e6,
    "noise": lambda value, rng: value + rng.gauss(0.0, 0.1),
    "coarse": lambda value, rng: round(value, 1),
}


UNIT = b"""model: SEXS
plant:
  type: open-circuit
  machine: GENSAL
  parameters: {Tpd0: 5.0, Xd: 1.1, Xq: 0.7, Xpd: 0.25, Xppd: 0.2, Xl: 0.15, S10: 0.11, S12: 0.4}
test: {vt0: 1.0, vref: [{at: 1.0, step: 0.05}]}
record: {file: record.csv, time: t, channels: {vt: vt, ifd: ifd}}
parameters: {fixed: {TE: 0.05}, free: {K: {start: 50, min: 5, max: 500}}}
estimate: {search: local, iterations: 10}
"""
CRITERIA = b"""source: a planner
limits:
  - {quantity: rms, limit: 1.5e-4}
  - {quantity: largest, percent: 8, from: 0.02, to: 5}
  - {quantity: mean, limit: 1.0e-3}
  - {quantity: final_value, percent: 2}
  - {quantity: rise_time, percent: 10, limit: 0.02}
  - {signals: [vt], quantity: damping_ratio, limit: 0.03}
  - {quantity: peak, percent: 10}
"""


def _damaged(rng: Random, data: bytes, changes: Changes, text: bool = False) -> bytes:
    """Return data, half the time with changed bytes."""
    if changes and rng.random() < 0.5:
        return data
    return mutated_bytes(rng, data, data, changes, text)


def _archive(files: Mapping[str, bytes], compressed: bool) -> bytes:
    """Return files as a ZIP archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in files.items():
            kind = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
            archive.writestr(zipfile.ZipInfo(name, EARLIEST), data, kind)
    return buffer.getvalue()


def _xml(text: str) -> str:
    """Return a text as XML holds it, without the characters that it cannot hold."""
    return escape("".join(c for c in text if c >= " " and c not in "\ufffe\uffff"), {'"': "&quot;"})


def _xlsx(table: Table) -> Files:
    """Return the parts of a workbook with one sheet."""
    rows = []
    for number, row in enumerate([table.names, *_rows(table)], 1):
        cells = []
        for at, value in enumerate(row):
            name = f"{chr(65 + at % 26)}{number}" if at < 26 else f"A{chr(65 + at % 26)}{number}"
            if isinstance(value, float) and math.isfinite(value):
                cells.append(f'<c r="{name}"><v>{value!r}</v></c>')
            elif value is not None:
                cells.append(f'<c r="{name}" t="inlineStr"><is><t>{_xml(str(value))}</t></is></c>')
        rows.append(f'<row r="{number}">{"".join(cells)}</row>')
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    relations = "http://schemas.openxmlformats.org/package/2006/relationships"
    kinds = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    content = "http://schemas.openxmlformats.org/package/2006/content-types"
    book_type = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{content}"><Default Extension="rels" '
        'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{book_type}.sheet.main+xml"/>'
        f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{book_type}.worksheet+xml"/>'
        "</Types>",
        "_rels/.rels": f'<Relationships xmlns="{relations}"><Relationship Id="rId1" '
        f'Type="{kinds}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{kinds}"><sheets>'
        '<sheet name="Bump" sheetId="1" r:id="rId1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{relations}"><Relationship '
        f'Id="rId1" Type="{kinds}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
        "xl/worksheets/sheet1.xml": f'<worksheet xmlns="{main}"><sheetData>{"".join(rows)}'
        "</sheetData></worksheet>",
    }
    return {name: text.encode(errors="replace") for name, text in parts.items()}


def _ods(table: Table) -> Files:
    """Return the parts of an OpenDocument sheet."""
    rows = []
    for row in [table.names, *_rows(table)]:
        cells = []
        for value in row:
            if isinstance(value, float) and math.isfinite(value):
                cells.append(
                    f'<table:table-cell office:value-type="float" office:value="{value!r}" '
                    'table:number-columns-repeated="1"/>'
                )
            else:
                text = "" if value is None else _xml(str(value))
                cells.append(
                    '<table:table-cell office:value-type="string">'
                    f"<text:p>{text}</text:p></table:table-cell>"
                )
        rows.append(
            f'<table:table-row table:number-rows-repeated="1">{"".join(cells)}</table:table-row>'
        )
    space = "urn:oasis:names:tc:opendocument:xmlns"
    body = (
        f'<?xml version="1.0"?><office:document-content xmlns:office="{space}:office:1.0" '
        f'xmlns:table="{space}:table:1.0" xmlns:text="{space}:text:1.0"><office:body>'
        f'<office:spreadsheet><table:table table:name="Bump">{"".join(rows)}</table:table>'
        "</office:spreadsheet></office:body></office:document-content>"
    )
    kind = b"application/vnd.oasis.opendocument.spreadsheet"
    return {"mimetype": kind, "content.xml": body.encode(errors="replace")}


FAR_CELLS = (b"XFD1048576", b"ZZZ9999999", b"A0", b"A99999999999", b"1A")


def _workbook(rng: Random, changes: Changes) -> Files:
    suffix, parts_of = rng.choice(((".xlsx", _xlsx), (".xlsx", _xlsx), (".ods", _ods)))
    parts = parts_of(_table(rng, changes))
    way = rng.random()
    if way < 0.5:
        name = rng.choice([*parts])
        changes.append(name)
        parts[name] = mutated_bytes(rng, parts[name], parts[name], changes, text=True)
    elif way < 0.6 and suffix == ".xlsx":
        name, cell = "xl/worksheets/sheet1.xml", rng.choice(FAR_CELLS)
        old = b"C" + str(rng.randrange(1, SAMPLES_IN_TABLE)).encode()
        parts[name] = parts[name].replace(b'"' + old + b'"', b'"' + cell + b'"')
        changes.append(f"cell at {cell.decode()}")
    data = _archive(parts, rng.random() < 0.7)
    return {f"record{suffix}": data if way < 0.7 else _damaged(rng, data, changes)}


def _arrays(table: Table) -> dict[str, Any]:
    """Return the columns of a table as arrays: of numbers where they are, else of objects."""
    import numpy as np

    arrays = {}
    for at, (name, column) in enumerate(zip(table.names, table.columns, strict=True)):
        values = [math.nan if x is None else x for x in column]
        numbers = all(isinstance(x, float) for x in values)
        array = np.array(values, np.float64) if numbers else np.array(list(map(str, values)))
        key = name if name.isidentifier() and name.isascii() and len(name) < 31 else f"c{at}"
        arrays[key] = array
    return arrays


def _odd_array(rng: Random, array: Any) -> tuple[str, Any]:
    """Return a column in a form that a record's column does not have."""
    import numpy as np

    matrix = np.outer(array, [1.0, 2.0]) if array.dtype.kind == "f" else array
    ways: Mapping[str, Callable[[], Any]] = {
        "complex": lambda: matrix + 1j,
        "struct": lambda: {"time": array, "signals": {"values": array, "label": "vt"}},
        "matrix": lambda: matrix,
        "cube": lambda: matrix[None, :, :],
        "cell": lambda: np.array([array, "text"], dtype=object),
        "empty": lambda: array[:0],
        "logical": lambda: array > 1.0,
        "integers": lambda: (1000.0 * array).astype(np.int16),
        "text": lambda: "text",
        "column": lambda: array[:, None],
    }
    name = rng.choice([*ways])
    try:
        return name, ways[name]()
    except (TypeError, ValueError, IndexError):  # of text
        return "text", "text"


def _mat(rng: Random, changes: Changes) -> Files:
    import warnings

    import numpy as np
    from scipy.io import savemat

    arrays = _arrays(_table(rng, changes))
    if rng.random() < 0.3:
        name = rng.choice([*arrays])
        with np.errstate(all="ignore"):
            form, arrays[name] = _odd_array(rng, arrays[name])
        changes.append(f"{name}: {form}")
    version = rng.choice(("4", "5", "5"))
    buffer = io.BytesIO()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            savemat(buffer, arrays, format=version, do_compression=rng.random() < 0.3)
        except (TypeError, ValueError):  # of what a version cannot hold
            changes.append("whole")
            buffer = io.BytesIO()
            savemat(buffer, _arrays(recorded()), format="5")
    data = buffer.getvalue()
    if data.startswith(b"MATLAB"):  # its head names the time of writing
        data = b"MATLAB 5.0 MAT-file".ljust(116) + data[116:]
    return {"record.mat": _damaged(rng, data, changes)}


@cache
def _arrow_types() -> tuple[Any, ...]:
    """Return types that columns of a Parquet file may have, few of them those of a record."""
    import pyarrow as pa

    simple = ["float32", "float16", "int64", "date32", "bool_", "string", "binary", "null"]
    return (
        *(getattr(pa, name)() for name in simple),
        pa.timestamp("ns"),
        pa.time64("us"),
        pa.duration("s"),
        pa.decimal128(38, 9),
        pa.list_(pa.float64()),
        pa.struct([("x", pa.float64())]),
    )


def _parquet(rng: Random, changes: Changes) -> Files:
    import pyarrow as pa
    from pyarrow import parquet

    table = _table(rng, changes)
    columns = []
    for column in table.columns:
        numbers = all(x is None or isinstance(x, float) for x in column)
        columns.append(pa.array(column if numbers else [_cell(x) for x in column]))
    if rng.random() < 0.3:
        at = rng.randrange(len(columns))
        kind = rng.choice(_arrow_types())
        changes.append(f"column {at}: {kind}")
        try:
            columns[at] = columns[at].cast(kind, safe=False)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, pa.ArrowTypeError):
            columns[at] = pa.nulls(len(columns[at]), kind)
    longest = max(map(len, columns))
    columns = [pa.concat_arrays([c, pa.nulls(longest - len(c), c.type)]) for c in columns]
    fields = [
        pa.field(name.encode(errors="replace").decode(), column.type)
        for name, column in zip(table.names, columns, strict=True)
    ]
    if table.units:
        fields = [
            f.with_metadata({"unit": unit.encode(errors="replace")})
            for f, unit in zip(fields, table.units, strict=False)
        ]
    buffer = io.BytesIO()
    compression = rng.choice(("snappy", "none", "gzip", "zstd"))
    parquet.write_table(
        pa.Table.from_arrays(columns, schema=pa.schema(fields)), buffer, compression=compression
    )
    return {"record.parquet": _damaged(rng, buffer.getvalue(), changes)}


def _raw(value: Any, scale: float, limit: int) -> int:
    if not isinstance(value, float) or not math.isfinite(value):
        return -limit - 1
    raw = value / scale if scale else 0.0
    return round(max(-limit, min(limit, raw)))


def _comtrade(rng: Random, changes: Changes) -> Files:
    """Return a record as IEEE Std C37.111 has it, of two files or one."""
    import struct

    table = _table(rng, changes)
    form = rng.choice(("ASCII", "ASCII", "BINARY", "BINARY32", "FLOAT32"))
    names, columns = table.names[1:], table.columns[1:]
    scale = rng.choice((1e-4, 1e-4, 1e-4, 0.0, 1e300, -1e-4))
    units = (table.units or ["s"] * (len(names) + 1))[1:]
    lines = ["Plant,DFR,2013", f"{len(names)},{len(names)}A,0D"]
    lines += [
        f"{k + 1},{name},A,,{unit},{scale:g},0,0,-32767,32767,1,1,P"
        for k, (name, unit) in enumerate(zip(names, units, strict=False))
    ]
    count = len(table.columns[0])
    stamp = "20/09/2015,10:51:42.859893"
    lines += ["50", "1", f"40,{count}", stamp, stamp, form, "1", "0,0", "0,0"]
    samples = []
    for k in range(count):
        at = table.columns[0][k]
        tick = _raw(at, 1e-6, 2**31 - 1) if isinstance(at, float) else 0
        values = [column[k] if k < len(column) else None for column in columns]
        if form == "ASCII":
            cells = [_cell(x) if isinstance(x, str) else _raw(x, scale, 99_998) for x in values]
            samples.append(",".join(map(str, [k + 1, tick, *cells])).encode(errors="replace"))
            samples.append(b"\r\n")
            continue
        code = {"BINARY": "h", "BINARY32": "i", "FLOAT32": "f"}[form]
        limit = 32767 if form == "BINARY" else 2**31 - 1
        packed = [
            float(x) if isinstance(x, float) and abs(x) < 3e38 else math.nan for x in values
        ] if form == "FLOAT32" else [_raw(x, scale, limit) for x in values]  # fmt: skip
        samples.append(struct.pack(f"<II{len(names)}{code}", k + 1, tick % 2**32, *packed))
    text = ("\r\n".join(lines) + "\r\n").encode(errors="replace")
    data = b"".join(samples)
    if rng.random() < 0.25:
        head = f"--- file type: DAT {form}: {len(data)} ---\r\n".encode()
        whole = b"--- file type: CFG ---\r\n" + text + head + data
        return {"record.cff": _damaged(rng, whole, changes, text=form == "ASCII")}
    if rng.random() < 0.6:
        text = _damaged(rng, text, changes, text=True)
    else:
        data = _damaged(rng, data, changes, text=form == "ASCII")
    return {"record.cfg": text, "record.dat": data}


# ---- planners' files, and tables of tests

UNITS = b"""/ two units
101 'GENROU' 1 6.0 0.035 0.5 0.077 3.25 0.0 1.8 1.7 0.3 0.55 0.25 0.2 0.12 0.4 /
101 'ESAC8B' 1 0.0 84.0 5.0 10.0 0.1 1.0 0.0 35.0 -35.0 1.3 1.0 6.5 0.3 9.0 3.0 /
101 'PSS2A' 1 1 0 3 0 5 1 10 10 0 10 0 10 7 1 0.5 0.1 8 0.2 0.02 0.2 0.02 0.1 -0.1 /
7 'GENSAL' 'G2' 5.0 0.05 0.06 3.0 0.0 1.1 0.7 0.25 0.2 0.15 0.11 0.4 /
7 'SEXS' 'G2' 0.1 10.0 100.0 0.1 -5.0 5.0 /
7 'STAB1' 'G2' 20.0 5.0 2.0 0.02 3.0 0.02 0.1 /
"""


def _dyr(rng: Random, changes: Changes) -> Files:
    sources = [(ROOT / "sample_data" / "unit.dyr").read_bytes(), UNITS]
    data = mutated_bytes(rng, rng.choice(sources), rng.choice(sources), changes, text=True)
    return {"unit.dyr": data}


PSLF_UNITS = b"""# two units
models
genrou 101 "G: 1/#" 18.0 "1 " : #9 mva=120.0 6.0 0.035 0.5 0.077 3.25 0.0 /
  1.8 1.7 0.3 0.55 0.25 0.2 0.12 0.4
exac8b 101 "G: 1/#" 18.0 "1 " : #9 0.0 84.0 5.0 10.0 0.1 999 0.0 35.0 -35.0 /
# in between
  1.0 1.3 0.1 0.4 6.5 0.3 9.0 3.0
gensal 7 ! ! "G2" : "tpdo" 5.0 "tppdo" 0.05 "tppqo" 0.06 "h" 3.0 "d" 0.0 "ld" 1.1 /
  "lq" 0.7 "lpd" 0.25 "lppd" 0.2 "ll" 0.15 "s1" 0.11 "s12" 0.4
exac4 7 ! ! "G2" : 0.02 999 -999 1.0 10.0 100.0 0.1 5.0 -5.0 0.0
"""


def _dyd(rng: Random, changes: Changes) -> Files:
    sources = [(ROOT / "sample_data" / "unit.dyd").read_bytes(), PSLF_UNITS]
    data = mutated_bytes(rng, rng.choice(sources), rng.choice(sources), changes, text=True)
    return {"unit.dyd": data}


EVENT = "\n".join(
    f"{k / 60.0:.6f}, {1.0 - 0.02 * (k > 120):.6f}, {60.0 - 0.1 * (k > 120):.6f}"
    for k in range(300)
).encode()
POWER_FLOW = power_flow(buses=(101, 7)).encode()


def _play_in(rng: Random, changes: Changes) -> Files:
    return {"event.plb": mutated_bytes(rng, EVENT, EVENT, changes, text=True)}


TESTS = b"""file,at,step,base,validates
../sample_data/ac1a_up.csv,1.0,0.05,,no
../sample_data/ac1a_down.csv,1.0,-0.05,,yes
"""


def _table_of_tests(rng: Random, changes: Changes) -> Files:
    other = TESTS.replace(b",", b";")
    return {"tests.csv": mutated_bytes(rng, rng.choice((TESTS, other)), other, changes, text=True)}


CASES = b"""bus,id,file,at,step,base,validates,name,about.Plant
101,1,../sample_data/ac1a_up.csv,1.0,0.05,,no,unit,Sample
101,1,../sample_data/ac1a_down.csv,1.0,-0.05,,yes,unit,Sample
7,G2,../sample_data/ac8b_unit1_up.csv,,0.05,,,,
"""


def _table_of_cases(rng: Random, changes: Changes) -> Files:
    return {"cases.csv": _damaged(rng, CASES, changes, text=True), "unit.dyr": UNITS}


KINDS: Mapping[str, Callable[[Random, Changes], Files]] = {
    "case": _case,
    "programme": _programme,
    "parameters": _parameters,
    "result": _result,
    "programme-result": _programme_result,
    "text": _text_record,
    "samples": _fitted_record,
    "workbook": _workbook,
    "mat": _mat,
    "parquet": _parquet,
    "comtrade": _comtrade,
    "dyr": _dyr,
    "dyd": _dyd,
    "play-in": _play_in,
    "tests": _table_of_tests,
    "cases": _table_of_cases,
    "batch": _batch,
    "options": _options,
    "extremes": _extremes,
    "criteria": _criteria,
    "power-flow": _power_flow_file,
    "programme-run": _run_programme,
    "trust": _trust,
}


def mutant(kind: str, seed: int, number: int) -> Mutant:
    """Return a mutant: kind, seed and number determine its bytes."""
    changes: Changes = []
    rng = randomness(kind, seed, number)
    files = KINDS[kind](rng, changes)
    return Mutant(kind, seed, number, files, tuple(changes))
