"""Step features in the digits that their errors allow."""

from exfit.results.comparisons import StepFeatures
from exfit.util.text import rounded


def feature_cells(features: StepFeatures, key: str) -> tuple[str, str, str]:
    """Return a feature measured, half of its 95 % interval, and simulated, as tables print them.

    The simulated one has the digits of the measured one.
    """
    measured, simulated = features.measured, features.simulated
    half = None if measured is None else measured.errors.get(key)
    return (
        "-" if measured is None else rounded(getattr(measured, key), half),
        "-" if half is None else f"{half:.2g}",
        "-" if simulated is None else rounded(getattr(simulated, key), half),
    )
