"""How many simulations a fit takes."""

from threading import Lock


class SimulationCounter:
    """Counts simulations, in whatever threads they run, and the most sub-steps of any of them."""

    def __init__(self) -> None:
        self.simulations, self.substeps = 0, 1
        self._lock = Lock()

    def add(self, simulations: int, substeps: int = 1) -> None:
        """Add simulations, with the sub-steps that they took where these are known."""
        with self._lock:
            self.simulations += simulations
            self.substeps = max(self.substeps, substeps)
