"""Made-up recorder's files: names, units, clocks and faults as plants have them; truth is known.

A file is described by its columns, each made of a signal of a simulated unit or of something else,
and by how the recorder writes it. Twenty are described here; `drawn_file` draws others from the
words of `recorder_words`. None resembles the sample data.
"""

from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import recorder_words as words
from step_records import response_of_unit

RATED_KV, RATED_MVA = 13.8, 95.0
AIR_GAP_V, AIR_GAP_A = 92.0, 610.0  # field voltage and current on the air-gap line
SIGNALS = ("vt", "vref", "efd", "ifd", "p", "q", "it", "speed")
NETWORK = {"f0": 50, "R": 0.0, "X": 0.25, "P": 0.6, "Q": 0.12}
NOISE = 2e-4  # of the base: of every channel that says nothing else
BEGAN = datetime(2023, 3, 14, 9, 26, 53, 589_000)
MAINS = 50.0  # Hz


@dataclass(frozen=True)
class Column:
    """A column: what it is ``of``, what 1 pu is in its numbers, and the unit that the file gives.

    ``of`` is a signal or a word of `OTHERS`' values; ``ripple`` is in pu, at 50 Hz.
    """

    header: str
    of: str
    base: float = 1.0
    unit: str = ""
    sign: float = 1.0
    noise: float = NOISE
    ripple: float = 0.0


@dataclass(frozen=True)
class RecorderFile:
    """A file: its columns, the test that it holds, and how it is written."""

    name: str
    columns: tuple[Column, ...]
    model: str = "ST1A"
    size: float = 0.05
    at: float = 2.0
    rate: float = 100.0
    length: float = 10.0
    loaded: bool = False
    suffix: str = ".csv"
    clock: str = "s"  # s, ms, stamps, date and time
    clock_header: str = "Time (s)"
    separator: str = ","
    decimal: str = "."
    head: tuple[str, ...] = ()
    unit_row: bool = False
    encoding: str = "utf-8"
    seed: int = 1

    @property
    def rippled(self) -> tuple[Column, ...]:
        """The columns with a ripple of the mains."""
        return tuple(column for column in self.columns if column.ripple)


FIXED = (
    RecorderFile(
        "planning program, channels by bus",
        (
            Column("ETRM   101[HYDRO1  13.800]1", "vt"),
            Column("EFD    101[HYDRO1  13.800]1", "efd"),
            Column("XADI   101[HYDRO1  13.800]1", "ifd"),
            Column("POWR   101[HYDRO1  13.800]1", "p", RATED_MVA / 100.0),
            Column("VARS   101[HYDRO1  13.800]1", "q", RATED_MVA / 100.0),
            Column("SPD    101[HYDRO1  13.800]1", "deviation"),
            Column("VOLT   200[GRID    220.00]", "bus"),
        ),
        size=0.02, at=1.0, loaded=True,
    ),
    RecorderFile(
        "planning program, variables with units",
        (
            Column("s:ut in p.u.", "vt"),
            Column("s:ve in p.u.", "efd"),
            Column("s:ie in p.u.", "ifd"),
            Column("s:xspeed in p.u.", "speed"),
            Column("m:u:bus1 in p.u.", "bus"),
        ),
        clock_header="b:tnow in s", head=("All calculations,G1,G1,G1,G1,Bus 7",), model="AC8B",
    ),
    RecorderFile(
        "three line voltages, field in volts and amperes",
        (
            Column("GEN VAB (V)", "vt", 115.0),
            Column("GEN VBC (V)", "vt", 115.2),
            Column("GEN VCA (V)", "vt", 114.9),
            Column("FLD VDC", "efd", AIR_GAP_V),
            Column("FLD ADC", "ifd", AIR_GAP_A),
            Column("Freq (Hz)", "frequency"),
        ),
        clock="ms", clock_header="t (ms)", separator="\t",
    ),
    RecorderFile(
        "German regulator, per cent",
        (
            Column("UG", "vt", 100.0, "%"),
            Column("UG Soll", "vref", 100.0, "%"),
            Column("UE", "efd", AIR_GAP_V, "V"),
            Column("IE", "ifd", AIR_GAP_A, "A"),
            Column("Steuersatz", "output", 1.0, "%"),
        ),
        clock="stamps", clock_header="Zeitstempel", separator=";", decimal=",", unit_row=True,
        encoding="cp1252", model="ST1A",
    ),
    RecorderFile(
        "relative quantities of a regulator",
        (
            Column("AVR1.MeasSys.rUgRel", "vt"),
            Column("AVR1.MeasSys.rUfRel", "efd", 0.41),
            Column("AVR1.MeasSys.rIfRel", "ifd", 0.47),
            Column("AVR1.Reg.rUrefRel", "vref"),
            Column("AVR1.MeasSys.rPRel", "p"),
        ),
        separator=";", head=("Trend log 7", "Unit;2", ""), rate=200.0,
    ),
    RecorderFile(
        "digital controller, average voltage",
        (
            Column("Vavg", "vt", 1e3 * RATED_KV, "V"),
            Column("Iavg", "noise", 1.0, "A"),
            Column("Vfd", "efd", AIR_GAP_V, "V"),
            Column("Ifd", "ifd", AIR_GAP_A, "A"),
            Column("AVR Out", "output", 1.0, "%"),
            Column("Freq", "frequency", 1.0, "Hz"),
        ),
        unit_row=True, model="AC8B",
    ),
    RecorderFile(
        "names with underscores",
        (
            Column("Gen_Term_Volts_kV", "vt", RATED_KV),
            Column("Exc_Fld_Volts", "efd", AIR_GAP_V),
            Column("Exc_Fld_Amps", "ifd", AIR_GAP_A),
            Column("AVR_Setpt_pu", "vref"),
            Column("Brg_Temp", "temperature"),
        ),
        rate=50.0, size=-0.03,
    ),
    RecorderFile(
        "abbreviations that could be an error",
        (
            Column("U_Gen", "vt", RATED_KV, "kV"),
            Column("U_Err", "efd", AIR_GAP_V, "V"),
            Column("I_Err", "ifd", AIR_GAP_A, "A"),
            Column("X_w", "error"),
        ),
        unit_row=True, separator=";", decimal=",",
    ),
    RecorderFile(
        "Portuguese",
        (
            Column("Tensão terminal (kV)", "vt", RATED_KV),
            Column("Tensão de campo (V)", "efd", AIR_GAP_V),
            Column("Corrente de campo (A)", "ifd", AIR_GAP_A),
            Column("Potência ativa (MW)", "p", RATED_MVA),
            Column("Potência reativa (Mvar)", "q", RATED_MVA),
            Column("Frequência (Hz)", "frequency"),
        ),
        clock_header="Tempo (s)", separator=";", decimal=",", encoding="cp1252", size=0.02,
        loaded=True,
    ),
    RecorderFile(
        "French",
        (
            Column("Tension stator (kV)", "vt", RATED_KV),
            Column("Tension rotor (V)", "efd", AIR_GAP_V),
            Column("Courant rotor (A)", "ifd", AIR_GAP_A),
            Column("Consigne tension (%)", "vref", 100.0),
            Column("Tension réseau (kV)", "bus", 225.0),
        ),
        clock_header="Temps (s)", separator=";", decimal=",",
    ),
    RecorderFile(
        "Spanish, workbook",
        (
            Column("Tensión terminal [kV]", "vt", RATED_KV),
            Column("Tensión de campo [V]", "efd", AIR_GAP_V),
            Column("Corriente de campo [A]", "ifd", AIR_GAP_A),
            Column("Velocidad [rpm]", "speed", 300.0),
        ),
        clock_header="Tiempo [s]", suffix=".xlsx", head=("Central, unidad 3", "Escalón +5 %"),
        model="AC8B",
    ),
    RecorderFile(
        "brushless unit, the field of the exciter alone",
        (
            Column("Generator Voltage (kV)", "vt", RATED_KV),
            Column("Exciter Field Voltage (V)", "pilot", 20.0),
            Column("Exciter Field Current (A)", "exciter", 3.2),
            Column("AVR output (%)", "output"),
        ),
        model="AC8B", rate=200.0,
    ),
    RecorderFile(
        "inverted field current",
        (
            Column("GEN_KV", "vt", RATED_KV),
            Column("EXC FLD AMPS", "ifd", AIR_GAP_A, sign=-1.0),
            Column("EXC FLD VOLTS", "efd", AIR_GAP_V),
        ),
        clock="date and time", clock_header="Date,Time", head=("DFR-9 export",),
    ),
    RecorderFile(
        "relative field voltage without a unit",
        (Column("Vt", "vt"), Column("Efd", "efd", 0.46), Column("Vref", "vref")),
        size=-0.05, model="AC8B",
    ),
    RecorderFile(
        "ripple of the mains",
        (
            Column("U12 [kV]", "vt", RATED_KV, ripple=1.5e-3),
            Column("Uf [V]", "efd", AIR_GAP_V, noise=2e-3),
            Column("If [A]", "ifd", AIR_GAP_A),
        ),
        rate=1000.0, length=6.0,
    ),
    RecorderFile(
        "all in per cent of rated",
        (
            Column("Ug [%]", "vt", 100.0),
            Column("Uf [%]", "efd", 38.0),
            Column("If [%]", "ifd", 44.0),
            Column("n [%]", "speed", 100.0),
        ),
        head=tuple(f"# parameter {k}: {k * 7}" for k in range(25)), separator="\t",
    ),
    RecorderFile(
        "two voltages, one of the bus",
        (
            Column("U1 (kV)", "vt", RATED_KV),
            Column("U2 (kV)", "bus", 220.0),
            Column("MW", "p", RATED_MVA, noise=2e-3),
            Column("MVAR", "q", RATED_MVA, noise=2e-3),
        ),
        size=0.02, loaded=True,
    ),
    RecorderFile(
        "one letter each",
        (
            Column("V", "efd", AIR_GAP_V),
            Column("I", "ifd", AIR_GAP_A),
            Column("U", "vt", RATED_KV),
        ),
    ),
    RecorderFile(
        "waveforms in a fault recorder",
        (
            Column("UL1", "phase 0", RATED_KV, "kV"),
            Column("UL2", "phase 1", RATED_KV, "kV"),
            Column("UL3", "phase 2", RATED_KV, "kV"),
            Column("Field V", "efd", AIR_GAP_V, "V"),
            Column("Field I", "ifd", AIR_GAP_A, "A"),
        ),
        suffix=".cfg", rate=1000.0, length=6.0,
    ),
    RecorderFile(
        "per unit of the field current without load",
        (
            Column("V_term_pu", "vt"),
            Column("I_fd_pu", "ifd", 1.0 / 1.12),
            Column("V_fd_pu", "efd", 1.0 / 1.12),
        ),
        suffix=".parquet", model="AC8B",
    ),
)  # fmt: skip


def drawn_file(seed: int) -> RecorderFile:
    """Return a file whose names, units, clock and faults are drawn."""
    rng = np.random.default_rng([15, seed])

    def any_of(choices):
        return choices[int(rng.integers(len(choices)))]

    loaded = bool(rng.random() < 0.3)
    style = any_of(["engineering", "engineering", "per unit", "relative"])
    unit_row, bracket = bool(rng.random() < 0.3), any_of(["()", "[]"])

    def column(header, of, base, unit, **others):
        if unit_row or not unit or unit.casefold() in header.casefold().split("_")[-1].split():
            return Column(header, of, base, unit if unit_row else "", **others)
        return Column(f"{header} {bracket[0]}{unit}{bracket[1]}", of, base, **others)

    relative = float(rng.uniform(0.3, 0.6))
    field = {
        "engineering": ((AIR_GAP_V, "V"), (AIR_GAP_A, "A")),
        "per unit": ((1.0, "pu"), (1.0, "pu")),
        "relative": ((relative, any_of(["", "pu"])), (1.1 * relative, any_of(["", "pu"]))),
    }[style]
    vt = any_of([(RATED_KV, "kV"), (1e3 * RATED_KV, "V"), (1.0, "pu"), (100.0, "%")])
    columns = [
        column(any_of(words.TERMINAL_VOLTAGE), "vt", *vt),
        column(
            any_of(words.FIELD_VOLTAGE), "efd", *field[0],
            sign=float(any_of([1.0, 1.0, 1.0, -1.0])), noise=any_of([NOISE, 3e-3]),
        ),
        column(any_of(words.FIELD_CURRENT), "ifd", *field[1]),
    ]  # fmt: skip
    if rng.random() < 0.3:
        columns.append(
            column(any_of(words.REFERENCE), "vref", *any_of([(1.0, "pu"), (100.0, "%")]))
        )
    if loaded:
        columns.append(column(any_of(words.ACTIVE_POWER), "p", RATED_MVA, "MW"))
        columns.append(column(any_of(words.REACTIVE_POWER), "q", RATED_MVA, "Mvar"))
    for k in rng.choice(len(words.OTHERS), int(rng.integers(1, 4)), replace=False):
        header = list(words.OTHERS)[k]
        columns.append(Column(header, words.OTHERS[header]))
    rippled = bool(rng.random() < 0.15)
    if rippled:
        columns[0] = replace(columns[0], ripple=1.5e-3)
    order = rng.permutation(len(columns))
    clock = any_of(["s", "s", "ms", "stamps", "date and time"])
    separator, decimal = any_of([(",", "."), (";", ","), ("\t", "."), (";", ".")])
    headers = {"s": "Time (s)", "ms": "t [ms]", "stamps": "Timestamp"}
    return RecorderFile(
        f"drawn {seed}",
        tuple(columns[k] for k in order),
        model=any_of(["AC8B", "ST1A"]),
        size=float(any_of([0.02, -0.02]) if loaded else any_of([0.05, -0.05, 0.03])),
        at=round(float(rng.uniform(1.5, 3.0)), 2),
        rate=500.0 if rippled else float(any_of([50.0, 100.0, 200.0])),
        loaded=loaded,
        clock=clock,
        clock_header=headers.get(clock, separator.join(["Date", "Time"])),
        separator=separator,
        decimal=decimal,
        head=tuple(f"Recorder line {k}" for k in range(int(rng.integers(4)))),
        unit_row=unit_row,
        encoding=any_of(["utf-8", "cp1252", "utf-16"]),
        seed=seed + 100,
    )


DRAWN = tuple(drawn_file(seed) for seed in range(10))
FILES = (*FIXED, *DRAWN)


@dataclass(frozen=True)
class _Samples:
    """The time (M,) of a file and what its columns are made of, each (M,)."""

    time: np.ndarray
    sources: dict = field(default_factory=dict)


def _samples(file: RecorderFile) -> _Samples:
    """Return what the columns of a file are made of: signals in pu, others in their own units."""
    plant = {"type": "infinite-bus", "network": NETWORK} if file.loaded else None
    fine, signals = response_of_unit(file.model, file.size, file.at, file.length, plant)
    time = np.arange(0.0, file.length, 1.0 / file.rate)
    clean = {name: np.interp(time, fine, y) for name, y in signals.items() if name in SIGNALS}
    if not file.loaded:  # the breaker is open
        clean |= {"p": 0.0 * time, "q": 0.0 * time}
    clean["vref"] = np.where(time < file.at, 1.0, 1.0 + file.size)
    crest, turns = np.sqrt(2.0 / 3.0) * clean["vt"], 2.0 * np.pi * MAINS * time
    others = {
        "bus": 1.01 + 0.0 * time,
        "frequency": 50.0 + 0.002 * np.sin(0.7 * time),
        "speed": 1.0 + 0.0 * time,
        "deviation": 1e-5 * np.sin(time),
        "output": 100.0 / (1.0 + clean["efd"]),
        "exciter": np.convolve(clean["efd"], np.full(40, 1.0 / 40.0), "full")[: len(time)],
        "pilot": 1.0 + 0.02 * clean["efd"],
        "temperature": 61.5 + 0.01 * time,
        "gate": 12.0 + 0.0 * time,
        "error": clean["vref"] - clean["vt"],
        "noise": 0.0 * time,
        "closed": np.where(time < file.length, float(file.loaded), 0.0),
        "volts per hertz": clean["vt"],
        "limit": 40.0 + 0.0 * time,
        **{f"phase {k}": crest * np.sin(turns - 2.0 * np.pi * k / 3.0) for k in range(3)},
    }
    others["exciter"][:40] = others["exciter"][40]
    return _Samples(time, others | clean)


def recorded(file: RecorderFile) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the time (s) and the numbers of each column as the recorder writes them."""
    made, rng = _samples(file), np.random.default_rng(file.seed)
    numbers = {}
    for column in file.columns:
        clean = made.sources[column.of]
        clean = clean + column.ripple * np.sin(2.0 * np.pi * MAINS * made.time)
        noisy = clean + rng.normal(0.0, column.noise, len(made.time))
        exact = column.of in ("closed", "limit", "vref")  # numbers of the program, not measured
        numbers[column.header] = column.sign * column.base * (clean if exact else noisy)
    return made.time, numbers


def write(file: RecorderFile, folder: Path) -> Path:
    """Write a file as its recorder does; return its path."""
    time, numbers = recorded(file)
    path = folder / f"{file.name.replace(' ', '_').replace(',', '')}{file.suffix}"
    writer = {".csv": _text, ".xlsx": _workbook, ".cfg": _comtrade, ".parquet": _parquet}
    writer[file.suffix](file, path, time, numbers)
    return path


def _clock_cells(file: RecorderFile, time: float) -> list[str]:
    at = BEGAN + timedelta(seconds=float(time))
    milliseconds = f"{at.microsecond // 1000:03d}"
    if file.clock == "stamps":
        return [f"{at:%d.%m.%Y %H:%M:%S}.{milliseconds}"]
    if file.clock == "date and time":
        return [f"{at:%Y-%m-%d}", f"{at:%H:%M:%S}.{milliseconds}"]
    scale, places = (1e3, 1) if file.clock == "ms" else (1.0, 4)
    return [f"{scale * time:.{places}f}".replace(".", file.decimal)]


def _text(file, path, time, numbers):
    clock = file.clock_header.split(file.separator if file.clock == "date and time" else "\0")
    if file.clock == "date and time":
        clock = ["Date", "Time"]
    lines = [*file.head, file.separator.join([*clock, *numbers])]
    if file.unit_row:
        lines.append(file.separator.join(["" for _ in clock] + [c.unit for c in file.columns]))
    for k, at in enumerate(time):
        cells = [f"{column[k]:.7g}".replace(".", file.decimal) for column in numbers.values()]
        lines.append(file.separator.join([*_clock_cells(file, at), *cells]))
    path.write_text("\n".join(lines) + "\n", encoding=file.encoding, errors="replace")


def _workbook(file, path, time, numbers):
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    for line in file.head:
        sheet.append([line])
    sheet.append([file.clock_header, *numbers])
    for k, at in enumerate(time):
        sheet.append([float(at), *(float(column[k]) for column in numbers.values())])
    book.save(path)


def _parquet(file, path, time, numbers):
    import pyarrow as pa
    from pyarrow import parquet

    parquet.write_table(pa.table({file.clock_header: time, **numbers}), path)


def _comtrade(file, path, time, numbers):
    channels, columns = [], []
    for k, column in enumerate(file.columns):
        samples = numbers[column.header]
        factor = float(np.max(np.abs(samples))) / 32000.0
        columns.append(np.rint(samples / factor).astype(int))
        channels.append(
            f"{k + 1},{column.header},,,{column.unit},{factor:.9g},0,0,-32767,32767,1,1,P"
        )
    count, stamp = len(time), f"{BEGAN:%d/%m/%Y,%H:%M:%S.%f}"
    lines = [
        "Plant,DFR,1999", f"{len(channels)},{len(channels)}A,0D", *channels, "50", "1",
        f"{file.rate:g},{count}", stamp, stamp, "ASCII", "1",
    ]  # fmt: skip
    path.write_text("\r\n".join(lines) + "\r\n")
    rows = [
        ",".join(map(str, [k + 1, round(1e6 * time[k]), *(column[k] for column in columns)]))
        for k in range(count)
    ]
    path.with_suffix(".dat").write_text("\r\n".join(rows) + "\r\n")
