"""Machine code for a system: compiled, kept on disk by content, called from several threads."""

import ctypes
import hashlib
import os
import threading
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np
from numpy.typing import NDArray

from exfit.engine.emit import linearisation, simulation, simulation_with_tangents
from exfit.engine.system import System, differentiate, trace
from exfit.util.cache import cache_folder
from exfit.util.files import write_whole
from exfit.util.threads import in_threads

if TYPE_CHECKING:
    pass

Array = NDArray[np.float64]

SIDE_BY_SIDE = 16  # parameter sets: two vectors of 512 bits hide each other's waiting
DIRECTIONS = 8  # of differentiation in one run
DIGEST = hashlib.sha256().digest_size

_lock = threading.Lock()
# code must outlive the functions that point into it; and the engines share one description of the
# processor, which the first of them to go would take along
_alive: list[Any] = []


class Start(NamedTuple):
    """A system at rest, for W parameter sets: setpoints r (nr, W) and states x (nx, W)."""

    r: Array
    x: Array


class Span(NamedTuple):
    """A segment of a run: inputs u (n + 1, nu) at its grid points, linear between, and the step.

    ``step`` is in seconds; each of the n steps is taken in ``parts`` equal sub-steps. ``du``
    (n + 1, moving, N) are the tangents of the inputs that move, linear between as well.
    """

    u: Array
    step: float
    parts: int
    du: Array | None = None


class Target(NamedTuple):
    """What machine code is made for: a processor by LLVM's name, and its features."""

    cpu: str
    features: str


def target(long_vectors: bool) -> Target:
    """Return the processor that code is made for: this one, or the one that EXFIT_CPU names.

    ``EXFIT_CPU=x86-64`` gives the code that every processor of 64 bits runs, as a check that no
    result depends on the machine; any name that LLVM knows will do. Without long vectors this
    processor's AVX-512 is left out: single numbers that are chosen by comparison, as limits do,
    take a tenth less time where the choice need not pass through a mask register.
    """
    chosen = os.environ.get("EXFIT_CPU")
    if chosen:
        return Target(chosen, "")
    features: str = llvm.get_host_cpu_features().flatten()
    if not long_vectors:
        features = features.replace("+avx512", "-avx512")
    return Target(llvm.get_host_cpu_name(), features)


@cache
def _machine(made_for: Target) -> tuple[Any, str]:
    """Return LLVM's idea of a processor, and what distinguishes it from others."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    platform = llvm.Target.from_default_triple()
    machine = platform.create_target_machine(
        cpu=made_for.cpu,
        features=made_for.features,
        opt=3,
        reloc="pic",
        codemodel="jitdefault",
        jit=True,
    )
    return machine, " ".join((str(llvm.llvm_version_info), platform.triple, *made_for))


def _build(ir: str, machine: Any) -> bytes:
    """Return the machine code of an IR.

    All that other passes look for, equal values and values that a loop does not change, the trace
    has found; turning short branches into choices is what they must not do.
    """
    parsed = llvm.parse_assembly(ir)
    passes = llvm.create_new_module_pass_manager()
    passes.add_always_inliner_pass()
    passes.add_sroa_pass()
    passes.run(parsed, llvm.create_pass_builder(machine, llvm.PipelineTuningOptions()))
    code: bytes = machine.emit_object(parsed)
    return code


def _cached(path: Path) -> bytes | None:
    """Return the code kept at path; None where there is none, or it is damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, code = content[:DIGEST], content[DIGEST:]
    return code if hashlib.sha256(code).digest() == digest else None


def _keep(path: Path, code: bytes) -> None:
    """Keep code on disk; a folder that cannot be written keeps nothing."""
    with suppress(OSError):
        write_whole(path, hashlib.sha256(code).digest() + code)


def compiled(ir: str, *, long_vectors: bool) -> Any:
    """Return LLVM's engine holding the functions of an IR, built or from the cache."""
    with _lock:
        machine, name = _machine(target(long_vectors))
        key = hashlib.sha256(f"{name}\n{ir}".encode()).hexdigest()[:32]
        path = cache_folder() / f"{key}.code"
        code = _cached(path)
        if code is None:
            code = _build(ir, machine)
            _keep(path, code)
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        _alive.append(engine)
        return engine


def _address(array: Array) -> int:
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise TypeError("the kernel takes C-contiguous arrays of float64")
    address: int = array.__array_interface__["data"][0]  # a third of the time of array.ctypes
    return address


def _function(engine: Any, name: str, arrays: int, extra: Sequence[Any] = ()) -> Any:
    # a call through ctypes releases the interpreter's lock
    prototype = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arrays, *extra)
    return prototype(engine.get_function_address(name))


RUN_ARGUMENTS = (ctypes.c_void_p, ctypes.c_double, ctypes.c_int64, ctypes.c_int64)


class Kernel:
    """Simulates ``lanes`` parameter sets side by side."""

    def __init__(self, system: System, outputs: Sequence[str], lanes: int = 1) -> None:
        self.lanes, self.system, self.outputs = lanes, system, tuple(outputs)
        engine = compiled(simulation(trace(system, outputs), lanes), long_vectors=lanes > 1)
        self._rest = _function(engine, "rest", 4)
        self._run = _function(engine, "run", 4, RUN_ARGUMENTS)

    def start(self, p: Array) -> Start:
        """Return the rest of parameter sets p (np, lanes)."""
        r = np.empty((len(self.system.setpoints), self.lanes))
        x = np.empty((len(self.system.states), self.lanes))
        self._rest(_address(p), _address(r), _address(x), None)
        return Start(r, x)

    def run(self, p: Array, start: Start, spans: Sequence[Span]) -> list[Array]:
        """Return the outputs of each span, (n + 1, outputs, lanes); ``start.x`` moves along."""
        results = []
        for span in spans:
            out = np.empty((len(span.u), len(self.outputs), self.lanes))
            arrays = (p, start.r, start.x, out, span.u)
            self._run(*map(_address, arrays), span.step / span.parts, len(span.u) - 1, span.parts)
            results.append(out)
        return results


def _block(tangents: Array, first: int) -> Array:
    """Return DIRECTIONS of the tangents (..., N) from the first on; what is missing is zero."""
    given = tangents[..., first : first + DIRECTIONS]
    block = np.zeros((*tangents.shape[:-1], DIRECTIONS))
    block[..., : given.shape[-1]] = given
    return block


class TangentKernel:
    """Simulates one parameter set with its exact derivatives in any directions.

    A direction may move the parameters that are ``free`` and the inputs that are ``moving``.
    """

    def __init__(
        self,
        system: System,
        outputs: Sequence[str],
        free: Sequence[str],
        moving: Sequence[str] = (),
    ) -> None:
        self.system, self.outputs = system, tuple(outputs)
        self.free, self.moving = tuple(free), tuple(moving)
        traced = trace(system, outputs)
        derived = differentiate(traced, system, free, moving)
        engine = compiled(simulation_with_tangents(traced, derived, DIRECTIONS), long_vectors=True)
        inputs = (ctypes.c_void_p,) if self.moving else ()
        self._rest = _function(engine, "rest", 8)
        self._run = _function(engine, "run", 8, (*inputs, *RUN_ARGUMENTS))

    def run(self, p: Array, dp: Array, spans: Sequence[Span]) -> tuple[list[Array], list[Array]]:
        """Return, for each span, outputs (n + 1, ny) and their derivatives (n + 1, ny, N).

        ``p`` is (np,), and ``dp`` (np, N) its tangents in N directions, zero but where parameters
        are free; inputs that move have theirs in the spans. The derivative of the starting state
        is part of the result.
        """
        directions = dp.shape[1]
        firsts = range(0, max(directions, 1), DIRECTIONS)
        blocks = list(in_threads(lambda first: self._directions(p, dp, spans, first), firsts))
        values, slopes = blocks[0]
        if len(blocks) > 1:
            pairs = zip(*(block[1] for block in blocks), strict=True)
            slopes = [np.concatenate(parts, axis=2) for parts in pairs]
        return values, [slope[:, :, :directions] for slope in slopes]

    def _directions(
        self, p: Array, tangents: Array, spans: Sequence[Span], first: int
    ) -> tuple[list[Array], list[Array]]:
        dp = _block(tangents, first)
        shapes = (len(self.system.setpoints), len(self.system.states))
        r, x = (np.empty(rows) for rows in shapes)
        dr, dx = (np.empty((rows, DIRECTIONS)) for rows in shapes)
        starting = (_address(p), _address(r), _address(x), None)
        self._rest(*starting, _address(dp), _address(dr), _address(dx), None)
        values, slopes = [], []
        for span in spans:
            out = np.empty((len(span.u), len(self.outputs)))
            dout = np.empty((*out.shape, DIRECTIONS))
            du = () if span.du is None else (_block(span.du, first),)
            arrays = (p, r, x, out, dp, dr, dx, dout, span.u, *du)
            self._run(*map(_address, arrays), span.step / span.parts, len(span.u) - 1, span.parts)
            values.append(out)
            slopes.append(dout)
        return values, slopes


class LinearKernel:
    """Linearises a system: its slopes at given states, and their exact Jacobian."""

    def __init__(self, system: System) -> None:
        self.system = system
        traced = trace(system, ())
        derived = differentiate(traced, system, ())
        engine = compiled(linearisation(traced, derived, DIRECTIONS), long_vectors=False)
        self._rest = _function(engine, "rest", 8)
        self._motion = _function(engine, "motion", 9)
        sizes = (len(system.parameters), len(system.setpoints), len(system.states))
        states = sizes[-1]
        self._still = [np.zeros((rows, DIRECTIONS)) for rows in sizes]
        self._fixed = [_address(zeros) for zeros in self._still[:2]]
        whole = -(-states // DIRECTIONS) * DIRECTIONS
        columns = np.split(np.eye(states, whole), whole // DIRECTIONS, axis=1)
        self._blocks = [np.ascontiguousarray(block) for block in columns]

    def rest(self, p: Array) -> Start:
        """Return the rest of one parameter set (np,): setpoints (nr,) and states (nx,)."""
        r, x = np.empty(len(self.system.setpoints)), np.empty(len(self.system.states))
        # its tangents are zero, written over with zero
        still = (*self._fixed, _address(self._still[2]), None)
        self._rest(_address(p), _address(r), _address(x), None, *still)
        return Start(r, x)

    def motion(self, p: Array, r: Array, x: Array, u: Array) -> tuple[Array, Array]:
        """Return the slopes (nx,) at states x and inputs u, and their Jacobian (nx, nx)."""
        slopes, columns = np.empty(len(x)), []
        for block in self._blocks:
            column = np.empty((len(x), DIRECTIONS))
            given = (*map(_address, (p, r, x, slopes)), *self._fixed)
            self._motion(*given, _address(block), _address(column), _address(u))
            columns.append(column)
        return slopes, np.hstack(columns)[:, : len(x)]
