"""What the tests of a case would show, and the best test: of a case, or of its file."""

from collections.abc import Mapping, Sequence
from os import PathLike

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.features.design import experiment_design
from exfit.features.design.designed_test import DesignedTest, designed_test
from exfit.features.design.experiment_design import Design
from exfit.features.design.limits import Limits
from exfit.workflows import loaded


def identify(case: Case | str | PathLike[str], noise: Mapping[str, float] | None = None) -> Design:
    """Foretell the standard errors of free parameters by the tests of a case, at its start values.

    Args:
        case: a case, or the path of its file; it needs no record.
        noise: standard deviation of the noise by signal, per unit; what is missing: the case's
            own, else that of its record, else a typical one.

    Raises ExfitError for input that cannot be used.

    Example:
        >>> exfit.identify("case.yaml", {"vt": 1e-4}).sentences
    """
    case = loaded(case)
    if case.has_no_equations:
        text = "plant.twin: missing; identify needs the equations of a plant of exfit"
        raise CaseError([f"{case.path}: {text}"])
    return experiment_design.identify(case, noise or {})


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
    bounds = Limits.of(limits or {})
    return designed_test(loaded(case), names, bounds, duration, channels, criterion, noise or {})
