"""A planner's files of units whose data are known, and the grid events that PMUs recorded of them.

Each unit stands behind its own transformer and line to a source whose voltage and angle an event
moves: not the plant that fits the record. What the PMUs show is filtered and sampled as theirs.
"""

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from coverage_cases import about_given
from event_sets import driven
from pmu_records import degrees, stamps, write_table
from power_flow_files import HIGH_KV, power_flow

from exfit.case.case import Case
from exfit.case.given_errors import TRANSFORMER
from exfit.case.load import load_case
from exfit.case.other_model import free_of
from exfit.errors import ExfitError, SimulationError
from exfit.features.planner.import_case import imported_case
from exfit.features.planner.psse import record_text
from exfit.features.planner.records import contradictions, definition_of
from exfit.features.planner.units import read_unit
from exfit.fitting.experiment import with_enough_substeps

SEED, FIRST_BUS = 3301, 201
EVENTS = 12
F0, REST = 60.0, 3.0  # Hz; s before an event
FINE = 480.0  # samples a second, before a PMU filters them
STEP = 1.0 / 960.0  # s
EXCITERS = (
    "ESST1A", "EXST1", "ESAC1A", "ESST4B", "SEXS", "AC8B", "ESDC2A", "EXPIC1", "EXAC1", "REXSYS",
    "AC7B", "IEEEX1", "ESST3A", "ESAC5A", "SCRX", "EXDC2", "ESAC6A", "IEEET1", "ESAC2A", "ESAC8B",
)  # fmt: skip
STABILISED = ("ESST1A", "EXST1", "ESST4B", "SEXS", "AC8B", "EXPIC1", "AC7B", "ESST3A")
STABILISERS = ("PSS2A", "IEEEST", "PSS1A", None)
GOVERNORS = ("TGOV1", "IEEEG1", "HYGOV", "GGOV1", None)
MACHINES = ("GENROU", "GENSAL", "GENROU", "GENROE", "GENSAE")
OFF_EVERY = 3  # of the units one has an exciter of other data than the planner's file says
FIXED_OFF_EVERY = 13  # and one has another inertia, which no import frees
NOISE = (1e-4, 5e-4)  # pu and rad of each magnitude and angle, by the unit
KV, MVA = (13.8, 18.0, 22.0), (60.0, 400.0)
X_TO_R = 40.0  # of a transformer


@dataclass(frozen=True)
class EventFleet:
    """The files, and what is true: by bus the values of each record, (record, parameter).

    ``off`` are the buses of which the exciter's data in the file are wrong, ``inertia`` those of
    which H is.
    """

    dyr: Path
    raw: Path
    table: Path
    truth: dict[int, dict[tuple[str, str], float]]
    off: frozenset[int]
    inertia: frozenset[int]


@dataclass(frozen=True)
class GridEvent:
    """What the grid does from REST on, as a unit near it sees it; angles in degrees."""

    seconds: float
    swing: float  # Hz
    damping: float  # 1/s
    size: float
    fall: float = 0.0  # Hz, of the frequency
    trip: float = 0.0  # degrees, of the angle for good
    dip: float = 0.0  # pu, of the voltage while a fault lasts
    fault: float = 0.0  # s
    sag: float = 0.0  # pu, of the voltage for good

    def moves(self, time, share):
        """Return by how much the source's voltage (pu) and angle (rad) move, each (M,)."""
        after = np.maximum(time - REST, 0.0)
        edge = smooth_step(after, 0.03)
        swing = edge * np.exp(-self.damping * after) * np.sin(2.0 * np.pi * self.swing * after)
        lost = after - 2.0 * (1.0 - np.exp(-after / 2.0))  # integrals of the two exponentials
        regained = after - 12.0 * (1.0 - np.exp(-after / 12.0))
        angle = 360.0 * self.fall * (0.8 * regained - lost)
        angle = angle + share * (self.size * swing - self.trip * edge)
        faulted = edge - smooth_step(np.maximum(after - self.fault, 0.0), 0.03)
        voltage = -share * (self.dip * faulted + self.sag * edge - 0.02 * swing)
        return voltage, np.radians(angle)


def smooth_step(after, seconds):
    """Return a step from 0 to 1 in so many seconds, without a corner."""
    way = (after / seconds).clip(0.0, 1.0)
    return way**3 * (10.0 - 15.0 * way + 6.0 * way**2)


def drawn_events(random, count=EVENTS):
    """Return events of four kinds in turn: lost generation, a line, a fault, a swing."""
    events = []
    for number in range(count):
        common = GridEvent(
            seconds=14.0, swing=random.uniform(0.4, 1.5), damping=random.uniform(0.15, 0.5),
            size=random.uniform(1.5, 5.0),
        )  # fmt: skip
        sag = random.uniform(0.005, 0.02)
        kinds = (
            {"fall": random.uniform(0.02, 0.06), "seconds": 20.0, "sag": sag},
            {"trip": random.uniform(2.0, 6.0), "sag": sag},
            {"dip": random.uniform(0.05, 0.15), "fault": random.uniform(0.07, 0.12)},
            {},
        )
        events.append(replace(common, **kinds[number % len(kinds)]))
    return events


def event_fleet(folder, units=40, seed=SEED, given_drawn=False):
    """Write .dyr, .raw, records and their table; return them with the truth.

    With ``given_drawn`` every true value lies about that of the files by its default error.
    """
    random = np.random.default_rng(seed)
    events = drawn_events(random)
    buses = [FIRST_BUS + number for number in range(units)]
    truth, text, raw, rows = {}, [], {}, []
    off, inertia = set(), set()
    (folder / "records").mkdir()
    for number, bus in enumerate(buses):
        unit = drawn_unit(number, bus, events, random, folder, given_drawn)
        truth[bus] = {
            (part.record.name, symbol): values[symbol]
            for part, values in unit.true
            for symbol in part.symbols
        }
        wrong = {}
        if number % OFF_EVERY == 0:
            off.add(bus)
            exciter, values = unit.parts[1]
            wrong[exciter] = wrong_values(exciter.model, values, random)
        elif number % FIXED_OFF_EVERY == 1 and not given_drawn:
            inertia.add(bus)
            machine, values = unit.parts[0]
            wrong[machine] = {"H": float(f"{1.25 * values['H']:.4g}")}
        text += [
            record_text(part, {**values, **wrong.get(part, {})}, bus, "1")
            for part, values in unit.parts
        ]
        raw[bus] = (unit.kv, unit.mva, unit.x / X_TO_R, unit.x)
        rows += [[bus, 1, name] for name in unit.files]
    (folder / "units.dyr").write_text("\n".join(text) + "\n")
    (folder / "net.raw").write_text(power_flow(33, units=raw))
    with (folder / "records" / "table.csv").open("w", newline="") as table:
        csv.writer(table).writerows([["bus", "id", "file"], *rows])
    return EventFleet(folder / "units.dyr", folder / "net.raw", folder / "records" / "table.csv",
                      truth, frozenset(off), frozenset(inertia))  # fmt: skip


@dataclass(frozen=True)
class DrawnUnit:
    """A unit with its records in the planner's order, its ratings, and its files of events.

    ``true`` are the records that its events are of, x is as the planner has it.
    """

    parts: tuple
    true: tuple
    kv: float
    mva: float
    x: float
    files: tuple[str, ...]


def near(value, random, spread):
    """Return a value within a factor of another, in four digits."""
    return float(f"{value * spread ** random.uniform(-1.0, 1.0):.4g}")


def typical_values(part):
    """Return typical data of a record; of a saturation the lower voltage first, as in a file."""
    values = {row.symbol: row.typical for row in part.model.sheet} | dict(part.record.held)
    if values.get("E1", 0.0) > values.get("E2", 0.0):
        order = {"E1": "E2", "E2": "E1", "SE1": "SE2", "SE2": "SE1"}
        values |= {symbol: values[other] for symbol, other in order.items()}
    return values


def drawn_values(part, random, spread, symbols):
    """Return typical data with some values drawn about them, none of which contradict."""
    values = typical_values(part)
    while True:
        drawn = {symbol: near(values[symbol], random, spread) for symbol in symbols}
        if not [*contradictions(part.model, {**values, **drawn})]:
            return {**values, **drawn}


def wrong_values(model, values, random):
    """Return other values of what an import frees, up to 1.6 times off."""
    free = [row.symbol for row in free_of(model, values)]
    while True:
        wrong = {symbol: near(values[symbol], random, 1.6) for symbol in free}
        if not [*contradictions(model, {**values, **wrong})]:
            return wrong


def drawn_parts(number, random):
    """Return the records of a unit with their true values: machine, exciter, and what is added."""
    exciter = definition_of(EXCITERS[number % len(EXCITERS)])
    machine = definition_of(MACHINES[number % len(MACHINES)])
    of_machine = drawn_values(machine, random, 1.1, [
        symbol for symbol in machine.symbols if symbol not in ("D", "S10", "S12")
    ])  # fmt: skip
    of_machine |= {"H": near(4.0, random, 1.5), "S10": near(0.12, random, 1.3), "S12": 0.45}
    free = [row.symbol for row in free_of(exciter.model)]
    parts = [(machine, of_machine), (exciter, drawn_values(exciter, random, 1.3, free))]
    stabiliser = STABILISERS[number % len(STABILISERS)]
    if stabiliser and exciter.record.name in STABILISED:
        part = definition_of(stabiliser)
        gain = {"PSS2A": "KS1", "IEEEST": "KS", "PSS1A": "KS"}[stabiliser]
        values = drawn_values(part, random, 1.2, [gain])
        if stabiliser == "PSS2A":
            values["KS2"] = float(f"{values['T7'] / (2.0 * of_machine['H']):.4g}")
        parts.append((part, values))
    governor = GOVERNORS[number % len(GOVERNORS)]
    if governor:
        part = definition_of(governor)
        droop = "K" if governor == "IEEEG1" else "R"
        parts.append((part, drawn_values(part, random, 1.2, [droop])))
    return tuple(parts)


def true_parts(parts, random):
    """Return records whose values lie about these by their default errors; none contradicts."""
    case = Case.from_dict(content_of(parts))
    while True:
        drawn, true = about_given(case, random), []
        for part, values in parts:
            names = {symbol: part.prefix + symbol for symbol in part.symbols}
            own = {symbol: drawn[name] for symbol, name in names.items() if name in drawn}
            true.append((part, {**values, **own}))
        if not any([*contradictions(part.model, values)] for part, values in true):
            return tuple(true)


def content_of(parts):
    """Return the content of the case of a unit with these records."""
    text = "\n".join(record_text(part, values, 1, "1") for part, values in parts)
    given = yaml.safe_load(imported_case(read_unit(text, "true.dyr"), "true.dyr").text)
    del given["as_found"]
    return given


def drawn_unit(number, bus, events, random, folder, given_drawn=False):
    """Draw a unit that settles after its events, and write their records."""
    kv, mva = float(random.choice(KV)), float(round(random.uniform(*MVA)))
    x = stated_x = round(random.uniform(0.08, 0.14), 4)  # of the transformer, on the machine's base
    if given_drawn:
        x = stated_x * (1.0 + TRANSFORMER.other * random.standard_normal())
    seen = sorted(random.choice(len(events), 2 + (number % 4 == 0), replace=False).tolist())
    pmu = Pmu(
        rate=(30.0, 30.0, 60.0, 30.0)[number % 4], kind=number % 3, high=number % 5 == 4,
        noise=float(np.exp(random.uniform(*np.log(NOISE)))), kv=kv, mva=mva, x=x,
    )  # fmt: skip
    for _ in range(50):
        parts = drawn_parts(number, random)
        true = true_parts(parts, random) if given_drawn else parts
        courses = [response(true, events[k], x, random, folder) for k in seen]
        if all(course is not None for course in courses):
            break
    else:
        raise AssertionError(f"no stable unit of {EXCITERS[number % len(EXCITERS)]}")
    files = []
    for k, course in zip(seen, courses, strict=True):
        files.append(f"event-{k + 1:02d}-{bus}.csv")
        pmu.record(folder / "records" / files[-1], *course, random)
    return DrawnUnit(parts, true, kv, mva, stated_x, tuple(files))


def response(parts, event, x, random, folder):
    """Simulate a unit in an event: time (s), terminal voltage and current as phasors (M,).

    None where it cannot rest there, or does not settle.
    """
    share = random.uniform(0.6, 1.2)
    p0, q0, vt0 = random.uniform(0.5, 0.9), random.uniform(-0.05, 0.25), random.uniform(0.98, 1.03)
    line = {"f0": F0, "R": 0.01, "X": x + random.uniform(0.1, 0.35), "P": p0, "Q": q0}
    given = content_of(parts)
    given["plant"] |= {"type": "infinite-bus", "network": line}
    given["test"] = {
        "vt0": vt0, "duration": event.seconds + 1.0,
        "angle": [{"at": 1.0, "step": 1.0, "unit": "deg"}], "E": [{"at": 1.0, "step": 0.01}],
    }  # fmt: skip
    given["simulation"] = {"output_step": 1.0 / FINE, "step": STEP}
    path = folder / "truth.yaml"
    path.write_text(yaml.safe_dump(given))
    try:
        case = load_case(path)
    except ExfitError:  # it cannot give this power
        return None

    def moves(time):
        return dict(zip(("E", "angle"), event.moves(time, share), strict=True))

    simulator, values, moved = driven(case, moves)
    try:
        simulator = with_enough_substeps(simulator, values, path)
    except SimulationError:
        return None
    time, shown = simulator.times, simulator.response(values).signals
    vt, p, q = shown["vt"], shown["p"], shown["q"]
    late = time > event.seconds - 4.0
    first = (time > REST) & (time < REST + 4.0)
    if not np.all(np.isfinite(p)) or np.ptp(p[late]) > 0.4 * np.ptp(p[first]):
        return None
    source = vt - (line["R"] + 1j * line["X"]) * (p - 1j * q) / vt
    voltage = vt * np.exp(1j * (moved["angle"] - np.angle(source) + 0.3))
    return time, voltage, np.conj((p + 1j * q) / voltage)


@dataclass(frozen=True)
class Pmu:
    """A PMU at a unit: its rate (1/s), what its files hold, where it is, its noise (pu, rad)."""

    rate: float
    kind: int
    high: bool
    noise: float
    kv: float
    mva: float
    x: float

    def record(self, path, time, voltage, current, random):
        """Write the file of an event."""
        if self.high:
            voltage = voltage - (1.0 / X_TO_R + 1j) * self.x * current
        voltage, current = (filtered(each, self.rate) for each in (voltage, current))
        keep = (time > 0.5) & (np.arange(len(time)) % round(FINE / self.rate) == 0)
        keep &= time < time[-1] - 0.5
        turned = np.unwrap(np.angle(voltage))
        frequency = (F0 + np.gradient(turned, time) / (2.0 * np.pi))[keep]
        time, voltage, current = time[keep] - time[keep][0], voltage[keep], current[keep]

        def noise(share=1.0):
            return share * self.noise * random.standard_normal(len(time))

        power = voltage * np.conj(current)
        voltage = voltage * (1.0 + noise()) * np.exp(1j * noise())
        current = current * (1.0 + noise()) * np.exp(1j * noise())
        kv = HIGH_KV if self.high else self.kv
        of_phasors = {
            "V Mag (kV)": np.abs(voltage) * kv / np.sqrt(3.0),
            "V Angle (deg)": degrees(voltage),
            "I Mag (A)": np.abs(current) * 1e3 * self.mva / (np.sqrt(3.0) * kv),
            "I Angle (deg)": degrees(current),
            "Freq (Hz)": frequency + noise(),
        }
        powers = {
            "Gen P (MW)": (power.real + noise()) * self.mva,
            "Gen Q (Mvar)": (power.imag + noise()) * self.mva,
        }
        columns = [
            {"Time (UTC)": stamps(time), **of_phasors},
            {
                "Time (s)": time, "Voltage (kV)": np.abs(voltage) * kv,
                "Voltage Angle (deg)": degrees(voltage), **powers,
            },
            {
                "Time (s)": time, "Voltage (kV)": np.abs(voltage) * kv,
                "Frequency (Hz)": frequency + noise(), **powers,
            },
        ]  # fmt: skip
        write_table(path, columns[self.kind])


def filtered(phasor, rate):
    """Return a phasor behind the filter of a PMU of class M: a low-pass, its delay taken out."""
    half = round(2.5 * FINE / rate)
    taps = np.sinc(0.5 * rate / FINE * np.arange(-half, half + 1)) * np.hamming(2 * half + 1)
    taps /= np.sum(taps)
    padded = np.pad(phasor, half, mode="edge")
    return np.convolve(padded, taps, mode="valid")
