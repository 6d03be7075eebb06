"""Play-in files of PSS/E (.plb): rows of time, voltage and frequency, without a heading.

PSS/E's model PLBVFU1 plays them into a bus. The voltage is per unit, or in V or kV over a scale in
its record; the frequency is in Hz, or per unit of the rated one.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from exfit.errors import RecordError
from exfit.records.formats.table import listed
from exfit.records.formats.text import TextTable, read_text_table

NAMES = ("t", "vt", "frequency")
HERTZ = (10.0, 420.0)  # of a grid's frequency
PER_UNIT = (0.5, 2.0)  # of a frequency or a voltage


def read_play_in(path: Path, memory: float | None = None) -> TextTable:
    """Return the table of a play-in file, with units where the numbers show them.

    Raises RecordError where it has other columns than three of numbers, or a frequency that is
    neither in Hz nor per unit.
    """
    table = read_text_table(path, memory)
    if table.names != ("1", "2", "3"):
        raise RecordError(
            f"{path}: a play-in file has three columns and no heading: time, voltage, frequency; "
            f"this one has {listed(table.names)}"
        )
    voltage, frequency = (float(np.median(own)) for own in table.numbers(table.names[1:]).values())
    hertz, per_unit = (low <= frequency <= high for low, high in (HERTZ, PER_UNIT))
    if not (hertz or per_unit):
        raise RecordError(
            f"{path}: column 3: a frequency of {frequency:.6g} (median) is neither in Hz nor per "
            "unit of the rated one"
        )
    units = {"t": "s", "frequency": "Hz" if hertz else "pu"}
    if PER_UNIT[0] <= voltage <= PER_UNIT[1]:
        units["vt"] = "pu"
    return replace(table, dialect=table.dialect._replace(names=NAMES, units=units))
