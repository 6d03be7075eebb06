"""The levels of a record at its start: where its signals are at rest."""

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import BumpTest, start_value
from exfit.errors import RecordError
from exfit.plants import DRIVING_SCALE, VT0
from exfit.plants.parts import initial
from exfit.records.record import Record
from exfit.util.text import show

Array = NDArray[np.float64]

POSSIBLE_VOLTAGES = (0.1, 2.0)  # pu: voltages beyond are those of another unit or base


def levels_of(case: Case, test: BumpTest, record: Record) -> dict[str, float]:
    """Parameters that a record gives: the levels of its signals at the start."""
    kind, vt0 = case.kind, initial_voltage(test, record)
    if kind.per_unit and (kind.has_machine or not kind.levels):
        _refuse_impossible(vt0, record)
    levels = {
        initial(signal): initial_level(test, record, signal)
        for signal in kind.levels
        if signal in record.signals
    }
    given = {initial(name): v for name, v in case.plant.given.items() if name in kind.driving}
    scales = {DRIVING_SCALE: 1.0} if kind.scaled else {}
    rated = {initial("speed"): 1.0} if "speed" in kind.levels else {}
    return {**rated, **levels, VT0: vt0, **scales, **given}


def _refuse_impossible(vt0: float, record: Record) -> None:
    """Raise a RecordError where a voltage is none that a machine is at rest with."""
    low, high = POSSIBLE_VOLTAGES
    if not low <= vt0 <= high:
        raise RecordError(
            f"{record.source}: vt rests at {vt0:.4g} pu, outside {low:g} ... {high:g}: its unit, "
            "base or scale is another"
        )


def deviation(test: BumpTest, record: Record, signal: str) -> Array:
    """Deviation of a recorded signal (M,) from its start."""
    if signal == "vt":
        return record.signals[signal] - initial_voltage(test, record)
    return record.signals[signal] - initial_level(test, record, signal)


def initial_level(test: BumpTest, record: Record, signal: str) -> float:
    """Return the mean of a recorded signal while the unit is still at rest.

    Raises RecordError where it has no sample there.
    """
    until = np.inf if test.steady is None else test.steady
    rest = record.signals[signal][record.time < until]
    rest = rest[np.isfinite(rest)]
    if not len(rest):
        raise RecordError(
            f"{record.source}: {signal}: no sample before {show(until)} s: its start is unknown"
        )
    return float(np.mean(rest))


def initial_voltage(test: BumpTest, record: Record) -> float:
    """Return the voltage before the first step: as the test gives it, else the record's mean."""
    vt0 = start_value(test.vt0)
    return initial_level(test, record, "vt") if vt0 is None else vt0
