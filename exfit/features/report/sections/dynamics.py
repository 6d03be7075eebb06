"""The fit as PSS/E dynamics records."""

from collections.abc import Iterator

from exfit.errors import ExfitError
from exfit.features.planner.export import export, place_of
from exfit.results.model import FitResult
from exfit.show.blocks import Block, Note, Verbatim, remarks


def dynamics(result: FitResult) -> Iterator[Block]:
    """Yield the records at the place of the unit, or why there are none.

    The place is bus 1 and machine 1 where the case does not say it.
    """
    try:
        bus, machine_id = place_of(result)
        records = export(result, bus, machine_id)
    except ExfitError as fault:
        yield from remarks("", [str(fault)], "", "warning")
        yield Note("There is no record.", mark="faint")
        return
    found = result.as_found is not None and result.as_found.bus is not None
    are = "are those of the planner's file" if found else "stand for those of the unit"
    yield Note(
        f"Bus {bus} and machine {machine_id} {are}; `exfit export --bus --id` writes others."
    )
    yield from remarks("", records.warnings, "", "warning")
    yield Verbatim(records.text)
