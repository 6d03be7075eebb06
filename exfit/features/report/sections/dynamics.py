"""The fit as PSS/E dynamics records."""

from dataclasses import dataclass

from exfit.errors import ExfitError
from exfit.features.planner.export import export, place_of
from exfit.results.model import FitResult


@dataclass(frozen=True)
class UnitRecords:
    """The records of a unit with what must be known of them; without a text, why there is none.

    ``found``: their bus and machine id are those of the planner's file, else they stand for them.
    """

    text: str
    warnings: tuple[str, ...]
    bus: int = 1
    machine_id: str = "1"
    found: bool = False


def dynamics(result: FitResult) -> UnitRecords:
    """The records at the place of the unit, bus 1 and machine 1 where the case does not say it."""
    try:
        bus, machine_id = place_of(result)
        records = export(result, bus, machine_id)
    except ExfitError as fault:
        return UnitRecords("", (str(fault),))
    found = result.as_found is not None and result.as_found.bus is not None
    return UnitRecords(records.text, records.warnings, bus, machine_id, found)
