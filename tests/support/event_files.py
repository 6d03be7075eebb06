"""Files of grid events with a known truth: those in which something is wrong, and sound ones."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pmu_records import F0, KV, MVA, Course, degrees, phasors_of, stamps, write_table
from unit_events import MACHINE, REST, case_of, content, simulated

TIME, V, A, FREQUENCY, P, Q, STATUS = (
    "Time (UTC)", "GEN.V1 Mag (kV)", "GEN.V1 Ang (deg)", "GEN.Freq (Hz)", "GEN.P (MW)",
    "GEN.Q (Mvar)", "GEN.Status",
)  # fmt: skip
NOISE = {"vt": 1e-4, "angle": 2e-4, "p": 2e-4, "q": 2e-4}  # pu, rad
FREE = {
    "KPR": {"start": 60.0, "min": 8.0, "max": 800.0},
    "KIR": {"start": 4.0, "min": 0.5, "max": 50.0},
}


@dataclass
class EventFile:
    """Columns of a file, and the section of the record that reads them."""

    columns: dict
    record: dict
    case: dict = field(default_factory=dict)

    def written(self, folder: Path):
        """Write the file and return its case."""
        path = write_table(folder / "event.csv", self.columns)
        record = {"file": str(path), **self.record}
        given = {"parameters": {"free": FREE}, **self.case}
        return case_of(content(record, **given), folder)


def noisy(course: Course, seed=1, size=1.0):
    """Return a course with the noise of a good instrument."""
    rng = np.random.default_rng(seed)
    return course.with_(
        **{
            name: getattr(course, name) + rng.normal(0.0, size * deviation, len(course.time))
            for name, deviation in NOISE.items()
        }
    )


def sound_file(course: Course, slip=0.05):
    """Return the file of a course as a PMU with meters of P and Q writes it."""
    turning = course.with_(angle=course.angle + 2.0 * np.pi * slip * course.time)
    voltage, _ = phasors_of(turning)
    columns = {
        TIME: stamps(course.time),
        V: np.abs(voltage),
        A: degrees(voltage),
        FREQUENCY: turning.frequency,
        P: course.p * MVA,
        Q: course.q * MVA,
        STATUS: ["0"] * len(course.time),
    }
    return EventFile(
        columns,
        {
            "time": TIME,
            "phasors": {
                "voltage": {
                    "magnitude": V,
                    "angle": A,
                    "unit": "kV",
                    "angle_unit": "deg",
                    "connection": "phase-to-ground",
                },
                "kV": KV,
            },
            "status": {"column": STATUS},
            "channels": {
                "vt": "phasors.vt",
                "angle": "phasors.angle",
                "p": {"column": P, "unit": "MW", "base": MVA},
                "q": {"column": Q, "unit": "Mvar", "base": MVA},
            },
        },
    )


# --- what may be wrong ----------------------------------------------------------------------------


def _without(rows):
    def spoil(file):
        kept = np.ones(len(file.columns[V]), bool)
        kept[rows] = False
        for name, column in file.columns.items():
            file.columns[name] = [cell for cell, keep in zip(column, kept, strict=True) if keep]

    return spoil


def _every(count):
    def spoil(file):
        for name, column in file.columns.items():
            file.columns[name] = column[::count]

    return spoil


def _blank(rows):
    def spoil(file):
        cells = [f"{value:.9g}" for value in file.columns[V]]
        for row in range(*rows.indices(len(cells))):
            cells[row] = ""
        file.columns[V] = cells

    return spoil


def _changed(name, change):
    def spoil(file):
        file.columns[name] = change(np.array(file.columns[name], dtype=float))

    return spoil


def _stamped(change):
    def spoil(file):
        file.columns[TIME] = change(list(file.columns[TIME]))

    return spoil


def _swapped(cells):
    cells[300], cells[301] = cells[301], cells[300]
    return cells


def _repeated(cells):
    cells[300] = cells[299]
    return cells


def _back(cells):
    return [*cells[:400], *cells[340:-60]]


def _milliseconds(file):
    file.columns = {"t": 1e3 * np.arange(len(file.columns[V])) / 60.0, **file.columns}
    file.record["time"] = "t"


def _phasor(**changes):
    def spoil(file):
        file.record["phasors"]["voltage"] |= changes

    return spoil


def _radians(file):
    del file.columns[A]
    file.columns["angle"] = np.radians(degrees(np.exp(1j * file.true.angle)))
    file.record["phasors"]["voltage"] |= {"angle": "angle"}


def _degrees(file):
    file.columns["angle"] = np.degrees(file.true.angle)
    file.record["phasors"]["voltage"] |= {"angle": "angle", "angle_unit": "rad"}


def _smoothed(file):
    _rotating(0.4)(file)
    wrapped = np.array(file.columns[A])
    file.columns[A] = np.convolve(np.pad(wrapped, 2, mode="edge"), np.ones(5) / 5.0, "valid")


def _rotating(slip):
    def spoil(file):
        time = file.true.time
        angle = np.degrees(file.true.angle + 2.0 * np.pi * slip * time)
        file.columns[A] = (angle + 180.0) % 360.0 - 180.0

    return spoil


def _elsewhere(file):
    after = np.maximum(file.true.time - REST, 0.0)
    swing = 0.15 * np.exp(-0.2 * after) * np.sin(2.0 * np.pi * 0.45 * after)
    file.columns[A] = np.degrees(0.3 + swing)


def _power(factor, signals="pq"):
    def spoil(file):
        for name in (P if "p" in signals else None, Q if "q" in signals else None):
            if name is not None:
                file.columns[name] = factor * np.array(file.columns[name])

    return spoil


def _exchanged(file):
    file.columns[P], file.columns[Q] = file.columns[Q], file.columns[P]


def _flagged(word):
    def spoil(file):
        file.columns[STATUS][400:430] = [word] * 30

    return spoil


def _held(name, first, last):
    def hold(column):
        column[first:last] = column[first]
        return column

    return _changed(name, hold)


def _dropout(name, *rows):
    def drop(column):
        column[list(rows)] = 0.0
        return column

    return _changed(name, drop)


def _sampled(period):
    def sample(column):
        return np.repeat(column[::period], period)[: len(column)]

    def spoil(file):
        for name in (P, Q):
            file.columns[name] = sample(np.array(file.columns[name]))

    return spoil


def _late(samples):
    def delay(column):
        return np.concatenate([np.full(samples, column[0]), column[:-samples]])

    def spoil(file):
        for name in (P, Q):
            file.columns[name] = delay(np.array(file.columns[name]))

    return spoil


def _millihertz(file):
    file.columns["dF"] = 1e3 * (np.array(file.columns[FREQUENCY]) - F0)
    del file.record["channels"]["angle"]
    file.record["channels"]["frequency"] = {"column": "dF", "unit": "Hz"}


def _jump(degrees_):
    def jump(angle):
        angle[480:] += degrees_
        return angle

    return _changed(A, jump)


# what is wrong -> how it comes about, and a word that a message must have
BAD: dict[str, tuple[Callable, str]] = {
    "a gap of half a second": (_without(slice(200, 230)), "clock jumps"),
    "a gap of two seconds": (_without(slice(400, 520)), "clock jumps"),
    "empty cells": (_blank(slice(300, 320)), "empty cell"),
    "a repeated timestamp": (_stamped(_repeated), "repeats"),
    "two timestamps out of order": (_stamped(_swapped), "goes back"),
    "a clock that was set back": (_stamped(_back), "goes back"),
    "a time in ms taken for s": (_milliseconds, "apart"),
    "one sample a second": (_every(60), "apart"),
    "an angle that turns too fast": (_rotating(20.0), "degrees"),
    "an angle smoothed over its wraps": (_smoothed, "angle jumps"),
    "degrees taken for radians": (_degrees, "degrees"),
    "radians taken for degrees": (_radians, "angle"),
    "an angle with the other sign": (_changed(A, np.negative), "angle"),
    "an angle of another place": (_elsewhere, "angle"),
    "an angle whose clock jumps": (_jump(40.0), "angle"),
    "powers per unit of a fourth of the rating": (_power(4.0), "base of p"),
    "powers per unit of four times the rating": (_power(0.25), "base of"),
    "kW taken for MW": (_power(1e3), "base of p"),
    "powers that count what is taken": (_power(-1.0), "scale: -1"),
    "q with the other sign": (_power(-1.0, "q"), "signs of q"),
    "p and q exchanged": (_exchanged, "exchanged"),
    "phase to ground taken for phase to phase": (
        _phasor(connection="phase-to-phase"), "phase to ground",
    ),
    "phase to phase taken for phase to ground": (
        _changed(V, lambda v: v * np.sqrt(3.0)), "phase to phase",
    ),
    "a voltage of another base": (_changed(V, lambda v: 1.3 * v), "base"),
    "V taken for kV": (_changed(V, lambda v: 1e3 * v), "vt"),
    "rows with a data error": (_flagged("0x8000"), "data error"),
    "a voltage that was held": (_held(V, 160, 220), "does not change"),
    "a voltage that dropped out": (_dropout(V, 300, 301), "measurement was lost"),
    "powers every two seconds": (_sampled(120), "does not change"),
    "powers half a second late": (_late(30), "later"),
}  # fmt: skip


def bad_file(name, course):
    """Return the file of a course in which that is wrong."""
    file = sound_file(noisy(course))
    file.true = course
    spoil, _ = BAD[name]
    spoil(file)
    return file


# --- what is right --------------------------------------------------------------------------------

TYPICAL = {"H": 3.25, "Xd": 1.8, "Xq": 1.7, "Xpd": 0.3, "Xpq": 0.55, "Xppd": 0.25, "Xl": 0.2}


def _model(model, **changes):
    return {"model": model, "start": {"model": model, "parameters": None, **changes}}


# what it is -> the unit that makes it, how it is written, the case that reads it
GOOD: dict[str, dict] = {
    "as it is": {},
    "without noise": {"noise": 0.0},
    "five times the noise": {"noise": 5.0},
    "30 samples a second": {"course": {"rate": 30}},
    "25 samples a second": {"course": {"rate": 25}},
    "50 samples a second": {"course": {"rate": 50}},
    "120 samples a second": {"course": {"rate": 120}},
    "a small event": {"course": {"size": 0.3}},
    "a large event": {"course": {"size": 2.5}},
    "a long record": {"course": {"seconds": 40.0}},
    "no turning": {"slip": 0.0},
    "turning the other way": {"slip": -0.3},
    "powers of phasors": {"write": "phasors"},
    "angle in radians": {"write": "radians"},
    "all in V, kW and kvar": {"write": "small"},
    "seconds of the epoch": {"write": "epoch"},
    "SOC and FRACSEC": {"write": "soc"},
    "rounded to 10 V, 0.01 degrees and 0.1 MW": {"write": "rounded"},
    "driven by its frequency": {"write": "frequency"},
    "a trigger": {"write": "trigger"},
    "from phase to phase": {"write": "line"},
    "KPR and KIR twice too small": {"free": 0.5},
    "KPR and KIR twice too large": {"free": 2.0},
    "typical data of the machine": {"machine": {**MACHINE, **TYPICAL}},
    "H 40 % too large": {"machine": {**MACHINE, "H": 1.4 * MACHINE["H"]}},
    "an AC1A": _model("AC1A"),
    "an ST1A": _model("ST1A"),
    "an EXST1": _model("EXST1"),
    "a SEXS": _model("SEXS"),
    "an AC7B": _model("AC7B"),
}


def good_file(name, folder):
    """Return the file of an event in which nothing is wrong."""
    given = GOOD[name]
    course = simulated(folder, given.get("model", "AC8B"), **given.get("course", {}))
    measured = noisy(course, seed=2, size=given.get("noise", 1.0))
    file = sound_file(measured, given.get("slip", 0.05))
    file.true = measured
    WRITTEN.get(given.get("write"), lambda _: None)(file)
    factor = given.get("free", 1.0)
    free = {key: {**FREE[key], "start": factor * v} for key, v in (("KPR", 80.0), ("KIR", 5.0))}
    file.case = {"parameters": {"free": free}, **given.get("start", {})}
    if "machine" in given:
        file.case["machine"] = given["machine"]
    return file


def _as_phasors(file):
    _, current = phasors_of(file.true.with_(angle=np.radians(file.columns[A])))
    file.columns |= {"GEN.I1 Mag (A)": np.abs(current), "GEN.I1 Ang (deg)": degrees(current)}
    phasors = file.record["phasors"]
    phasors |= {"MVA": MVA, "current": {
        "magnitude": "GEN.I1 Mag (A)", "angle": "GEN.I1 Ang (deg)", "unit": "A",
        "angle_unit": "deg",
    }}  # fmt: skip
    file.record["channels"] |= {"p": "phasors.p", "q": "phasors.q"}


def _in_radians(file):
    file.columns["GEN.V1 Ang (rad)"] = np.radians(file.columns.pop(A))
    _phasor(angle="GEN.V1 Ang (rad)", angle_unit="rad")(file)


def _in_small_units(file):
    columns, channels = file.columns, file.record["channels"]
    columns["V (V)"], columns["P (kW)"] = 1e3 * columns.pop(V), 1e3 * columns.pop(P)
    columns["Q (kvar)"] = 1e3 * columns.pop(Q)
    _phasor(magnitude="V (V)", unit="V")(file)
    channels["p"] = {"column": "P (kW)", "unit": "kW", "base": 1e3 * MVA}
    channels["q"] = {"column": "Q (kvar)", "unit": "kvar", "base": 1e3 * MVA}


def _by_epoch(file):
    file.columns = {"time": [f"{1.7e9 + at:.6f}" for at in file.true.time], **file.columns}
    file.record["time"] = "time"


def _by_soc(file):
    seconds = np.floor(file.true.time + 0.4)
    counts = np.round((file.true.time + 0.4 - seconds) * 1e6)
    soc = {"SOC": [f"{1_700_000_000 + s:.0f}" for s in seconds], "FRACSEC": counts}
    file.columns = {**soc, **file.columns}
    file.record["time"] = ["SOC", "FRACSEC"]


def _rounded(file):
    for name, digits in ((V, 2), (A, 2), (P, 1), (Q, 1)):
        file.columns[name] = np.round(file.columns[name], digits)


def _by_frequency(file):
    file.columns[FREQUENCY] = np.round(file.true.with_(angle=file.true.angle).frequency, 4)
    del file.record["channels"]["angle"]
    file.record["channels"]["frequency"] = {"column": FREQUENCY, "unit": "Hz"}


def _with_trigger(file):
    file.columns[STATUS][150:400] = ["0x0811"] * 250


def _of_lines(file):
    file.columns[V] = np.sqrt(3.0) * np.array(file.columns[V])
    _phasor(connection="phase-to-phase")(file)


WRITTEN: dict[str | None, Callable] = {
    "phasors": _as_phasors, "radians": _in_radians, "small": _in_small_units, "epoch": _by_epoch,
    "soc": _by_soc, "rounded": _rounded, "frequency": _by_frequency, "trigger": _with_trigger,
    "line": _of_lines,
}  # fmt: skip
