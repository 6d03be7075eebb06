"""A test of a case beside its record, set up to be simulated."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.case.schema import BumpTest
from exfit.errors import SimulationError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.recorded.switchings import Switching
from exfit.records.record import Record
from exfit.simulation.simulator import Response, Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]
Simulated = TypeVar("Simulated", Simulator, Experiment)


def with_enough_substeps(simulated: Simulated, values: Values, case: Path) -> Simulated:
    """Return a simulator, or what has one, with sub-steps enough all along the response to values.

    Raises SimulationError, naming the case, where they have no start or no finite response.
    """
    try:
        return simulated.with_enough_substeps(values)
    except SimulationError as fault:
        raise SimulationError(f"{case}: {fault}") from fault


@dataclass(frozen=True)
class ExperimentSetup:
    """A test of a case beside its record, ready to be simulated.

    ``test`` has a number for everything; ``free`` are those of its values that a fit finds,
    ``references`` the files of the test's signals beside the record, by signal;
    ``driving`` are the signals of the record that drive it in place of a plant;
    ``automatic_sines`` are the signals of which residuals may show a periodic disturbance, with
    the range of its frequency, Hz; ``switchings`` those about which it is not compared, ``whole``
    the record with what its masks leave out.
    """

    case: Path
    test: BumpTest
    record: Record
    experiment: Experiment
    free: tuple[FreeParameter, ...]
    references: Mapping[str, Record] = field(default_factory=dict)
    driving: tuple[str, ...] = ()
    automatic_sines: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    switchings: tuple[Switching, ...] = ()
    whole: Record | None = None

    @property
    def name(self) -> str:
        """The name of the record."""
        return self.experiment.name

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Signals to compare."""
        return self.experiment.channels

    def with_start_values(self, values: Values) -> dict[str, float]:
        """Return the values with a start for what the fit finds about this record."""
        return {**{parameter.name: parameter.start for parameter in self.free}, **values}

    def with_enough_substeps(self, values: Values) -> "ExperimentSetup":
        """Return the setup with sub-steps enough all along the response to the values."""
        experiment = with_enough_substeps(
            self.experiment, self.with_start_values(values), self.case
        )
        return replace(self, experiment=experiment)

    def response(self, values: Values) -> Response:
        """Return everything that the simulation gives, on the clock of the record."""
        at = self.with_start_values(values)
        return self.experiment.with_inputs(at).response(self.experiment.parameters(at))


def compared(channel: Channel, samples: Array) -> Array:
    """Return samples (M,) as they are compared, nan where they are left out."""
    if channel.filtering is None:
        return samples
    filtered = np.full(len(samples), np.nan)
    filtered[channel.kept] = channel.filtered(samples)
    return filtered
