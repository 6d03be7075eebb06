"""The table of signals: all that a plant puts out or takes, and what a record may hold of it.

A new signal is a row here and an output of a plant: figures, reports, comparisons, completion, the
recognition of columns and the case file take it from this table.
"""

from collections.abc import Mapping
from typing import NamedTuple


class SignalRow(NamedTuple):
    """A signal: its symbol, what it is called, and its unit in a simulation.

    ``noise`` is the standard deviation that a recorder's channel typically has, in that unit; a
    signal without one is never compared with a record. ``jumps`` says that it follows a step of
    the reference at once, ``positive`` that it is above zero at rest. The rest serves the
    recognition of a recorder's columns: the ``quantity`` of the column's unit and the ``place``
    where it is measured, in whatever words of the vocabulary; the ``words`` that are its own, the
    surest first, and the ``vague_words`` that may be something else; whether the unit alone is
    enough, and the ``turn`` in which it takes its column. ``base`` says what 1 pu is; a signal
    whose unit is not pu has none. A signal without words is in no record.
    """

    symbol: str
    name: str
    unit: str = "pu"
    noise: float | None = None
    jumps: bool = False
    positive: bool = False
    quantity: str = ""
    place: str = ""
    words: tuple[str, ...] = ()
    vague_words: tuple[str, ...] = ()
    unit_suffices: bool = False
    turn: int = 0
    base: str = ""

    @property
    def label(self) -> str:
        """The label of an axis."""
        named = self.symbol in self.name.split()
        return f"{self.name}{'' if named else f' {self.symbol}'} ({self.unit})"


RATED_VOLTAGE, AIR_GAP_LINE, RATED_POWER = "rated, line to line", "air-gap line", "rated MVA"

ROWS = (
    SignalRow(
        "vt", "terminal voltage", noise=1e-4, positive=True, quantity="voltage", turn=7,
        base=RATED_VOLTAGE, place="stator",
        words=("vt", "ut", "ug", "vg", "eterm", "etrm"),
        vague_words=("u12", "uab", "vab", "u1", "v1"),
    ),
    SignalRow(
        "vref", "reference", quantity="voltage", turn=1, base=RATED_VOLTAGE, place="reference",
        words=("vref", "uref"),
    ),
    SignalRow(
        "efd", "field voltage", noise=5e-3, jumps=True, positive=True, quantity="voltage", turn=2,
        base=AIR_GAP_LINE, place="field",
        words=("efd", "vfd", "ufd", "vf", "uf"),
        vague_words=("ue",),
    ),
    SignalRow(
        "ifd", "field current", noise=5e-3, positive=True, quantity="current", turn=3,
        base=AIR_GAP_LINE, place="field",
        words=("ifd", "if", "lad ifd", "ladifd", "xadifd", "xadi"),
        vague_words=("ie",),
    ),
    SignalRow(
        "p", "active power", noise=1e-3, quantity="power", turn=5, base=RATED_POWER,
        words=("p", "pe", "pg"),
        unit_suffices=True,
    ),
    SignalRow(
        "q", "reactive power", noise=1e-3, quantity="reactive", turn=4, base=RATED_POWER,
        words=("q", "qe", "qg"),
        unit_suffices=True,
    ),
    SignalRow(
        "it", "stator current", noise=1e-3, positive=True, quantity="current", turn=6,
        base="rated current", place="stator",
        words=("it", "ig"),
    ),
    SignalRow("delta", "rotor angle", "rad"),
    SignalRow(
        "speed", "speed", noise=1e-4, positive=True, turn=9, base="rated speed",
        words=("speed", "rotor speed", "shaft speed", "turbine speed", "drehzahl", "rpm"),
    ),
    SignalRow(
        "vs", "stabiliser signal", turn=8,
        words=("vpss", "upss", "pss output", "pss", "stabiliser", "stabilizer", "vs"),
    ),
    SignalRow(
        "angle", "angle of the voltage", "rad", quantity="angle", turn=10,
        words=("angle", "voltage angle", "vt angle", "v angle", "theta", "vang", "phasor angle"),
    ),
    SignalRow(
        "frequency", "frequency", "Hz", quantity="frequency", turn=11,
        words=("frequency", "f"),
    ),
    SignalRow(
        "pref", "load reference", turn=12, words=("pref", "load reference", "load setpoint"),
    ),
    SignalRow("fs", "signal added to the speed that the governor measures", turn=13, words=("fs",)),
    SignalRow(
        "gate", "gate or valve", noise=1e-3, turn=14, base="fully open",
        words=(
            "gate", "gate position", "wicket gate", "guide vane", "guide vane opening",
            "leitapparat", "leitschaufel", "vannage", "directrices", "distribuidor", "distributore",
        ),
    ),
    SignalRow("vc1", "measured voltage"),
    SignalRow("breaker", "breaker open", ""),
    SignalRow("E", "source voltage"),
    SignalRow("R", "resistance to the source"),
    SignalRow("X", "reactance to the source"),
    SignalRow("fault_G", "conductance of a fault"),
    SignalRow("fault_B", "susceptance of a fault"),
)  # fmt: skip

SIGNALS: Mapping[str, SignalRow] = {row.symbol: row for row in ROWS}
RECORDED = tuple(row.symbol for row in ROWS if row.words)
COMPARED = tuple(row.symbol for row in ROWS if row.noise is not None)
OF_EVENT = ("angle", "frequency")  # what drives a unit beside vt, and is in no bump test
RESTING = ("vt", "frequency", "p", "q")  # what shows the rest before an event
OF_VOLTAGE_PHASOR = ("vt", "angle")  # signals that a voltage phasor gives
OF_CURRENT_PHASOR = ("p", "q", "it")  # and those that one of the current adds
OF_PHASORS = (*OF_VOLTAGE_PHASOR, *OF_CURRENT_PHASOR)
PHASOR_COLUMNS = "phasors."  # how the columns begin that are computed of phasors
COMPARED_IN_EVENT = ("p", "q", "efd", "ifd", "speed")  # what a record of an event mostly holds
OF_STEP = ("vt", "efd", "p", "q")  # by which steps are short enough where nothing is compared
OF_FLAT_RUN = ("efd", "p", "q")  # what shows whether a unit rests where nothing is compared
OF_GOVERNOR = ("speed", "p", "gate")  # what shows the droop and the gate curve of a unit
OF_BUMP_TEST = ("vt", "efd", "ifd")  # what a record of a bump test mostly holds
TERMINALS, FIELDS = ("p", "q", "vt"), ("ifd", "efd")  # what is read of a unit at rest on load
POSITIVE_AT_REST = tuple(row.symbol for row in ROWS if row.positive)
NOISE: Mapping[str, float] = {row.symbol: row.noise for row in ROWS if row.noise is not None}


def label_of(symbol: str) -> str:
    """Return the label of an axis: of a signal, or of a state of a model, which is in pu."""
    return SIGNALS[symbol].label if symbol in SIGNALS else f"{symbol} (pu)"


def unit_of_signal(symbol: str) -> str:
    """Return the unit of a signal, or of a state of a model, which is in pu."""
    return SIGNALS[symbol].unit if symbol in SIGNALS else "pu"
