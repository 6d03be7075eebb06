"""Nonlinear least squares within bounds: Gauss-Newton, Levenberg-Marquardt and strategies of both.

Arrays in, result out: minimise f(x) = 1/2 sum(fun(x)^2) over low <= x <= high.

One loop (`solver`) serves all methods. In each iteration a *search* (`searches`) tries points that
the linear model fun(x + d) = fun(x) + J d proposes (`linear`). That linear problem is itself solved
within the bounds, by an active set that starts afresh every time: a variable rests on a bound
exactly as long as the model wants it there. Directions that J does not see at all are left alone;
those it sees weakly are taken in full, but no variable moves farther than recent steps have proved
good, unless a search takes the full step.

A search is a generator, which yields what it asks for and is sent the answer (`problem`); so many
are advanced in lock-step (`lockstep`), and one alone is a stack of one. Based on it are the search
from many starts (`multistart`) and the profiles of single parameters (`profile`).

Sources: Levenberg 1944; Marquardt 1963; Armijo 1966; Moré 1978 (the Levenberg-Marquardt
algorithm: implementation and theory); Dennis & Schnabel 1983, chapters 6 and 10; Kelley 1999,
Iterative methods for optimization, chapters 2 and 3.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from exfit.estimate.problem import (
    AT_TOLERANCE,
    STATUS,
    Functions,
    OneByOne,
    Progress,
    Result,
    SolverIteration,
    Stop,
    half_square,
)

if TYPE_CHECKING:
    from exfit.estimate.profiling import CostProfile, LowerMinimum, ProfileEnd, profile, profiles
    from exfit.estimate.searches import (
        ArmijoDamping,
        LineSearch,
        RatioDamping,
        Searches,
        TrustRegion,
        to_half,
        to_parabola,
    )
    from exfit.estimate.solver import Descent, least_squares
    from exfit.estimate.starts import LocalMinimum, MultistartResult, multistart, spread

__all__ = [
    "AT_TOLERANCE",
    "STATUS",
    "ArmijoDamping",
    "CostProfile",
    "Descent",
    "Functions",
    "LineSearch",
    "LocalMinimum",
    "LowerMinimum",
    "MultistartResult",
    "OneByOne",
    "ProfileEnd",
    "Progress",
    "RatioDamping",
    "Result",
    "Searches",
    "SolverIteration",
    "Stop",
    "TrustRegion",
    "half_square",
    "least_squares",
    "multistart",
    "profile",
    "profiles",
    "spread",
    "to_half",
    "to_parabola",
]


def __getattr__(name: str) -> Any:
    if name in __all__:  # what a check or many a fit does without
        for place in ("searches", "solver", "starts", "profiling"):
            module = import_module(f"{__name__}.{place}")
            if hasattr(module, name):
                return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
