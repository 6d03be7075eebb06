"""The machine code of systems, made once in a process, and what their equations depend on."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import Kernel, LinearKernel, TangentKernel
from exfit.engine.system import System, trace
from exfit.engine.trace import in_order


@cache
def kernel(system: System, outputs: tuple[str, ...], lanes: int) -> Kernel:
    """Return the machine code that simulates a system."""
    return Kernel(system, outputs, lanes)


@cache
def tangent_kernel(
    system: System,
    outputs: tuple[str, ...],
    free: tuple[str, ...],
    moving: tuple[str, ...],
    directions: int,
) -> TangentKernel:
    """Return the machine code that simulates a system with its derivatives."""
    return TangentKernel(system, outputs, free, moving, directions)


@cache
def linear_kernel(system: System) -> LinearKernel:
    """Return the machine code that linearises a system."""
    return LinearKernel(system)


@cache
def parameters_used(system: System, outputs: tuple[str, ...] | None = None) -> frozenset[str]:
    """Name parameters on which a response of the system, or of some outputs, can depend."""
    traced = trace(system, system.outputs if outputs is None else outputs)
    targets = [*traced.rest, *traced.slopes, *traced.outputs, *traced.clamped]
    reached = {node.index for node in in_order(targets)}
    pairs = zip(system.parameters, traced.p, strict=True)
    return frozenset(name for name, node in pairs if node.index in reached)


@cache
def time_constants(system: System) -> tuple[str, ...]:
    """Return the parameters in seconds that matter to the response."""
    used = parameters_used(system)
    return tuple(name for name in system.time_constants if name in used)


@cache
def places_of_time_constants(system: System) -> NDArray[np.intp]:
    """Places of the time constants among the parameters."""
    places = [system.parameters.index(name) for name in time_constants(system)]
    return np.array(places, dtype=np.intp)
