"""Settings under which a machine computes as another would, and how to see that they took effect.

``python tests/support/settings.py oldest`` runs the numerical part of the tests under one of
them, ``... oldest tests/cli`` other tests; further arguments go to pytest. Of each law every third
example runs; those of models run over the others: so many need no second look at the few.
"""

import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

OPENBLAS, NUMPY, EXFIT = "OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "EXFIT_CPU"
CALLED = {"Katmai": "Prescott"}  # OpenBLAS has one kernel for both, and names it by the elder
DISPATCHED = [name for name in __cpu_dispatch__ if __cpu_features__[name]]

# each is a set of environment variables; the last is a processor without anything of the others
SETTINGS: dict[str, dict[str, str]] = {
    **{core.lower(): {OPENBLAS: core} for core in ("Haswell", "Prescott")},
    **({"skylakex": {OPENBLAS: "SkylakeX"}} if __cpu_features__.get("X86_V4") else {}),
    "numpy": {NUMPY: " ".join(DISPATCHED)},
    "x86-64": {EXFIT: "x86-64"},
}
SETTINGS["oldest"] = {**SETTINGS["prescott"], **SETTINGS["numpy"], **SETTINGS["x86-64"]}

# folders whose tests compute by more than the models themselves
LINEAR_ALGEBRA = (
    *("simulation", "dsp", "estimate", "inference", "fitting", "results/intervals", "verdict"),
    *("workflows", "features/events", "features/translate", "features/design"),
    *("features/programme", "features/compare", "features/rank", "features/external"),
)


def faults(environment: Mapping[str, str]) -> Iterator[str]:
    """Yield which of the settings of an environment did not take effect in this process."""
    if core := environment.get(OPENBLAS):
        used = openblas_cores()
        if used != {core}:
            yield f"OpenBLAS computes by {used}, not by {core}"
    for name in environment.get(NUMPY, "").split():
        if __cpu_features__[name]:
            yield f"NumPy uses {name}"
    if cpu := environment.get(EXFIT):
        from exfit.engine.kernel import target

        if target() != (cpu, ""):
            yield f"machine code is made for {target()[0]}, not for {cpu}"


def openblas_cores() -> set[str]:
    """Return the processors that the OpenBLAS of NumPy and that of SciPy compute for."""
    import scipy.linalg  # noqa: F401, loads its own OpenBLAS
    from threadpoolctl import threadpool_info

    pools = [pool for pool in threadpool_info() if pool["internal_api"] == "openblas"]
    return {CALLED.get(pool["architecture"], pool["architecture"]) for pool in pools}


def run(name: str, arguments: list[str]) -> None:
    """Become pytest over the tests whose numbers a setting may change, or over those given."""
    given = any(Path(argument).exists() for argument in arguments)
    which = () if given else (str(Path(__file__).parents[1]), "--models=numerical")
    command = [sys.executable, "-m", "pytest", *which, *arguments]
    os.execve(sys.executable, command, {**os.environ, **SETTINGS[name]})


if __name__ == "__main__":
    run(sys.argv[1], sys.argv[2:])
