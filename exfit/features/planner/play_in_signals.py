"""What of a record of a grid event drove a unit, as another program plays it in."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.build import build_experiment
from exfit.fitting.setup import ExperimentSetup
from exfit.simulation.inputs import SplinedInput

Array = NDArray[np.float64]

TURN = 2.0 * np.pi


class PlayIn(NamedTuple):
    """What drives a unit in a grid event: voltage (M,), pu, and frequency (M,), Hz, at times, s.

    ``f0`` is the rated frequency.
    """

    time: Array
    vt: Array
    frequency: Array
    f0: float


def played_in(case: Case) -> dict[str, PlayIn]:
    """Return what the record of each grid event of a case plays into the unit, by its name.

    Raises CaseError for a case of another plant, ExfitError for a record that cannot be used.
    """
    if not case.kind.finds_rest:
        raise CaseError([f"{case.path}: plant {case.kind.name} is not driven by a grid event"])
    f0 = case.plant.given["f0"]
    setups = (build_experiment(case, own, case.values()) for own in case.recordings)
    return {setup.name: play_in_of(setup, f0) for setup in setups}


def play_in_of(setup: ExperimentSetup, f0: float) -> PlayIn:
    """Return what of a record of an event drives a unit: the rest before it is at ``f0``, Hz."""
    time, angle = setup.record.time, setup.experiment.simulator.inputs.recorded["angle"]
    assert isinstance(angle, SplinedInput)
    turning = angle.slope(time) / TURN
    return PlayIn(time - time[0], setup.record.signals["vt"], f0 + turning, f0)
