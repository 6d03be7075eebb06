"""A planner's file of many units, and records of some of them whose truth is known."""

from dataclasses import dataclass
from math import exp, log
from pathlib import Path

import numpy as np
from event_fleets import true_parts, typical_values
from loose_records import loose, sound
from programme_files import FREE

from exfit.case.load import parse_case
from exfit.features.planner.import_case import imported_case
from exfit.features.planner.records import alternatives, contradictions, definition_of, definitions
from exfit.features.planner.units import read_unit
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.workflows import simulate

SEED = 1601
FIRST_BUS = 101
SPREAD = 1.5  # of the planner's value to the true one: a factor
NOISE = 1e-4  # pu, of vt and efd
STEP, INTERVAL, LENGTH = 0.05, 0.01, 12.0  # pu, s
AT = 2.0035  # s: between two samples, since efd may jump there
OWN = [each for each in definitions() if definition_of(each.record.name) == each]
OTHERS = (
    "{bus} 'IEEEG1', 1 0 0 0.050   0.10 /   governor, as of 1999\n",
    "{bus} TGOV1 1 .05 .49 1.0 0.0 2.1 7.0 0. /\n",
    "// {bus}: a limiter that exfit does not know\n{bus} 'MAXEX2' 1 1.0 1.05 2*60.0\n   3*0.0 /\n",
    "{bus}, 'USRMDL', '1 ', 'OWNGOV', 5, 0, 1, 2*3.50, ,/ it's a user's\n",
    "",
)


@dataclass(frozen=True)
class PlannerFile:
    """A planner's file and a folder of records; ``truth`` are the true values of units, by bus.

    ``pieces`` is the text of each unit by its bus.
    """

    dyr: Path
    records: Path
    truth: dict[int, dict[str, float]]
    pieces: dict[int, str]


def planner_file(folder, units=200, recorded=40, seed=SEED, given_drawn=False):
    """Write a planner's file of so many units and records of some; return what they are.

    With ``given_drawn`` every true value lies about that of the file by its default error.

    Units that are recorded are of six models with values near to typical ones; the others are of
    every kind of record that exfit knows, with any values. All are in an odd layout.
    """
    random = np.random.default_rng(seed)
    buses = [FIRST_BUS + 2 * number for number in range(units)]
    tested = {*random.choice(buses, recorded, replace=False).tolist()}
    models = [*FREE]
    pieces, truth = {}, {}
    (folder / "records").mkdir()
    for number, bus in enumerate(buses):
        if bus in tested:
            model = models[len(truth) % len(models)]
            own, true = recorded_unit(model, random, given_drawn)
            truth[bus] = {symbol: value for _, values in true for symbol, value in values.items()}
            write_record(folder / "records", bus, true, random)
        else:
            own = any_unit(number, random)
        other = OTHERS[number % len(OTHERS)].format(bus=bus)
        pieces[bus] = "".join(loose(*part, random, bus=bus) for part in own) + other
    text = "// Netz Süd, 380 kV\r\n\r\n" + "".join(pieces.values()) + "/ the end"
    (folder / "units.dyr").write_bytes(text.encode("latin-1"))
    return PlannerFile(folder / "units.dyr", folder / "records", truth, pieces)


def any_unit(number, random):
    """Return the records of a unit: (definition, values); every kind of record in turn."""
    chosen = []
    for kind in ("machine", "exciter", "stabiliser"):
        of_kind = [each for each in OWN if each.kind == kind]
        if kind != "stabiliser" or number % 3 == 0:
            chosen.append(of_kind[number % len(of_kind)])
    return [(definition, sound(definition, random)) for definition in chosen]


def recorded_unit(model, random, given_drawn):
    """Return the records of a unit (definition, values) as the file has them, and the true ones."""
    exciter = alternatives(MODELS[model])[0]
    machine = alternatives(MACHINES["GENROU"])[0]
    rows = {row.symbol: row for row in exciter.model.sheet}
    values = typical_values(exciter)
    values |= {symbol: drawn(values[symbol], rows[symbol], random, 1.3) for symbol in FREE[model]}
    off = {symbol: drawn(values[symbol], rows[symbol], random, SPREAD) for symbol in FREE[model]}
    assert not [*contradictions(exciter.model, {**values, **off})]
    true = ((machine, typical_values(machine)), (exciter, values))
    stated = (true[0], (exciter, {**values, **off}))
    return stated, true_parts(true, random) if given_drawn else true


def drawn(value, row, random, spread):
    """Return a value within a factor of another and the range of its sheet, in four digits."""
    other = value * exp(random.uniform(-log(spread), log(spread)))
    return float(f"{min(max(other, row.low), row.high):.4g}")


def write_record(folder, bus, unit, random):
    """Write the record of a step of a unit with its true values."""
    text = "".join(loose(*part, random, bus=bus) for part in unit)
    case = imported_case(read_unit(text, "true.dyr"), "true.dyr").text
    case = case.replace("{at: 1.0, step: 0.05}", f"{{at: {AT}, step: {STEP}}}")
    case = case.replace("duration: 10.0", f"duration: {LENGTH}")
    case += "simulation: {output_step: 0.0005}\n"
    response = simulate(parse_case(case, Path("true.yaml"))).response
    time = np.arange(0.0, LENGTH, INTERVAL)
    columns = [time]
    for signal in ("vt", "efd"):
        samples = np.interp(time, response.time, response.signals[signal])
        columns.append(samples + NOISE * random.standard_normal(len(time)))
    rows = "\n".join(
        ",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True)
    )
    (folder / f"{bus}_1.csv").write_text(f"t,vt,efd\n{rows}\n")
