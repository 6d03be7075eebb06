"""The design of a test of a case, or of its file."""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

from exfit.case.case import Case
from exfit.case.load import load_case
from exfit.features.design.designed_test import DesignedTest, designed_test
from exfit.features.design.limits import Limits


def design_test(
    case: Case | str | PathLike[str],
    of: Sequence[str] = (),
    *,
    limits: Mapping[str, float] | None = None,
    duration: float | None = None,
    channels: Sequence[str] = (),
    criterion: str = "A",
    noise: Mapping[str, float] | None = None,
) -> DesignedTest:
    """Return the steps of the reference that make parameters of a case best known.

    Args:
        case: a case, or the path of its file; it needs no record.
        of: the parameters to be known best, all free ones by default; the others stay free.
        limits: how far vt and vref may deviate from their start (default 0.05), the largest efd
            and the least, efd_min; per unit.
        duration: of the test, s; by default that of the case.
        channels: what can be recorded, of which up to three are chosen; by default all signals.
        criterion: what is made least: "A" the mean square of the relative standard errors, "D" the
            volume of their confidence ellipsoid.
        noise: as in `identify`.

    The errors are those of linear theory at the values of the case. Raises ExfitError for input
    that cannot be used.

    Example:
        >>> exfit.design_test("case.yaml", ["KA"], limits={"vt": 0.05, "efd": 4}).best.steps
    """
    names = [of] if isinstance(of, str) else of
    loaded = case if isinstance(case, Case) else load_case(Path(case))
    bounds = Limits.of(limits or {})
    return designed_test(loaded, names, bounds, duration, channels, criterion, noise or {})
