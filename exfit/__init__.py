"""exfit: the parameters of a generator's excitation system from a recorded bump test.

    >>> import exfit
    >>> result = exfit.fit("case.yaml")
    >>> result.parameters["KA"].value

Everything here is imported when it is first used: ``import exfit`` alone loads nothing heavy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from exfit.errors import (
    CaseError,
    DynamicsError,
    ExfitError,
    FileError,
    ModelError,
    RecordError,
    SimulationError,
)

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.features.app.notebook import app
    from exfit.features.compare.agreement import compare
    from exfit.features.design.designed_test import design_test
    from exfit.features.design.experiment_design import identify
    from exfit.features.fleet.batch import batch
    from exfit.features.fleet.folder import read_fleet
    from exfit.features.planner.export import export
    from exfit.features.planner.import_all import cases_of_table, import_units
    from exfit.features.programme.run import run
    from exfit.features.programme.saturation import saturation_curve
    from exfit.features.rank.ranked_cases import rank
    from exfit.features.report.writing import write_report as report
    from exfit.features.start.starting import new
    from exfit.features.translate.translate import translate
    from exfit.output.stored import show
    from exfit.records.record import Record
    from exfit.results.io import load_result
    from exfit.results.model import FitResult
    from exfit.runs.fits import fit_all
    from exfit.workflows import (
        check,
        fit,
        inspect,
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
    "app",
    "batch",
    "cases_of_table",
    "check",
    "compare",
    "design_test",
    "export",
    "fit",
    "fit_all",
    "identify",
    "import_units",
    "inspect",
    "load_case",
    "load_result",
    "new",
    "profile",
    "rank",
    "read_fleet",
    "read_record",
    "report",
    "run",
    "saturation_curve",
    "show",
    "simulate",
    "translate",
    "validate",
]

_MODULES = {
    "Case": "exfit.case.case",
    "FitResult": "exfit.results.model",
    "Record": "exfit.records.record",
    "check": "exfit.workflows",
    "fit": "exfit.workflows",
    "fit_all": "exfit.runs.fits",
    "inspect": "exfit.workflows",
    "load_case": "exfit.workflows",
    "load_result": "exfit.results.io",
    "profile": "exfit.workflows",
    "read_record": "exfit.workflows",
    "show": "exfit.output.stored",
    "simulate": "exfit.workflows",
    "validate": "exfit.workflows",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return getattr(import_module(_MODULES[name]), name)
    if name in __all__:
        from exfit.registry import parts

        if name in parts("PUBLIC"):
            return parts("PUBLIC")[name].load()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the module, those not yet imported too."""
    return sorted({*globals(), *__all__})
