"""A record that the values of a fit have no response to."""

from math import nan

from exfit.errors import SimulationError
from exfit.fitting.experiment import ExperimentSetup
from exfit.results.comparisons import Comparison, Match, StepFeatures


def without_response(setup: ExperimentSetup, fault: SimulationError) -> Comparison:
    """Return a validation that is not accepted, as the values have no response there.

    Values that one record was fitted with need not have a state of rest in another.
    """
    return Comparison(
        name=setup.name,
        record=setup.record.source.name,
        cost=nan,
        accepted=False,
        channels={channel.signal: Match(nan, nan, nan) for channel in setup.channels},
        features=StepFeatures(None, None),
        reason=str(fault).removeprefix(f"{setup.case}: "),
        validation=True,
        sha256=setup.record.sha256,
    )
