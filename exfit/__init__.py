"""exfit: the parameters of a generator's excitation system from a recorded bump test.

    >>> import exfit
    >>> result = exfit.fit("case.yaml")
    >>> result.parameters["KA"].value

Everything here is imported when it is first used: ``import exfit`` alone loads nothing heavy.
"""

from typing import TYPE_CHECKING

from exfit.errors import (
    CaseError,
    DynamicsError,
    ExfitError,
    FileError,
    ModelError,
    RecordError,
    SimulationError,
)
from exfit.util.lazy import names_of

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.features.design.design import design_test
    from exfit.features.fleet.batch import batch
    from exfit.features.fleet.folder import read_fleet
    from exfit.features.planner.table_cases import cases_of_table
    from exfit.features.programme.run import run
    from exfit.features.programme.steady.saturation import saturation_curve
    from exfit.features.rank.ranked_cases import rank
    from exfit.features.translate.translate import translate
    from exfit.records.record import Record
    from exfit.results.io import load_result
    from exfit.results.model import FitResult
    from exfit.runs.fits import fit_all
    from exfit.workflows import (
        check,
        fit,
        identify,
        load_case,
        profile,
        read_record,
        simulate,
        validate,
    )

__version__ = "0.1.0"

__all__ = [
    "Case",
    "CaseError",
    "DynamicsError",
    "ExfitError",
    "FileError",
    "FitResult",
    "ModelError",
    "Record",
    "RecordError",
    "SimulationError",
    "__version__",
    "batch",
    "cases_of_table",
    "check",
    "design_test",
    "fit",
    "fit_all",
    "identify",
    "load_case",
    "load_result",
    "profile",
    "rank",
    "read_fleet",
    "read_record",
    "run",
    "saturation_curve",
    "simulate",
    "translate",
    "validate",
]

_MODULES = {
    "Case": "exfit.case.case",
    "FitResult": "exfit.results.model",
    "Record": "exfit.records.record",
    "batch": "exfit.features.fleet.batch",
    "cases_of_table": "exfit.features.planner.table_cases",
    "check": "exfit.workflows",
    "design_test": "exfit.features.design.design",
    "fit": "exfit.workflows",
    "fit_all": "exfit.runs.fits",
    "identify": "exfit.workflows",
    "load_case": "exfit.workflows",
    "load_result": "exfit.results.io",
    "profile": "exfit.workflows",
    "rank": "exfit.features.rank.ranked_cases",
    "read_fleet": "exfit.features.fleet.folder",
    "read_record": "exfit.workflows",
    "run": "exfit.features.programme.run",
    "saturation_curve": "exfit.features.programme.steady.saturation",
    "simulate": "exfit.workflows",
    "translate": "exfit.features.translate.translate",
    "validate": "exfit.workflows",
}


__getattr__ = names_of(__name__, _MODULES)


def __dir__() -> list[str]:
    """Return the names of the module, those not yet imported too."""
    return sorted({*globals(), *__all__})
