"""What can be wrong with a user's input; anything else that fails is our own mistake."""

from collections.abc import Iterable

from exfit.util.text import first_texts


class ExfitError(Exception):
    """Input that cannot be used; the message names the place, the value and the limit."""


class FileError(ExfitError):
    """A fault of a file, or several together: the message has the first, ``faults`` all."""

    def __init__(self, faults: str | Iterable[str]) -> None:
        self.faults = (faults,) if isinstance(faults, str) else tuple(faults)
        super().__init__("\n".join(first_texts(self.faults)))


class CaseError(FileError):
    """A case that cannot be used."""


class DynamicsError(FileError):
    """A planner's dynamics file that cannot be used."""


class RecordError(ExfitError):
    """A record that cannot be read or does not fit its case."""


class ModelError(ExfitError):
    """A model that does not exist or is not one."""


class SimulationError(ExfitError):
    """A simulation that cannot start or cannot be kept stable."""
