"""The fit as PSS/E dynamics records."""

from exfit.errors import ExfitError
from exfit.exchange.export import Exported, export
from exfit.results.model import FitResult

BUS, MACHINE_ID = 1, "1"  # what a dynamics file needs and no case has


def dynamics(result: FitResult) -> Exported:
    """Return the records with what must be known of them; without a text, why there is none."""
    try:
        return export(result, BUS, MACHINE_ID)
    except ExfitError as fault:
        return Exported("", (str(fault),))
