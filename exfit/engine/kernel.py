"""Machine code for a system: compiled, kept on disk by content, called from several threads."""

import hashlib
import os
import threading
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np
from numpy.typing import NDArray

from exfit.engine.sampling import (
    ALONG,
    AT_REST,
    Courses,
    Sampler,
    Sizes,
    address,
    function,
)
from exfit.engine.system import System, trace, traced_for
from exfit.util.arrays import Array
from exfit.util.cache import keep_private, private_cache, read_private

SIDE_BY_SIDE = 16  # parameter sets: two vectors of 512 bits hide each other's waiting
DIRECTIONS = 8  # of differentiation in one run
FORM = "2"  # of a file of code: in its key, as one of another form is none
DIGEST = hashlib.sha256().digest_size

_lock = threading.Lock()
# code must outlive the functions that point into it; and the engines share one description of the
# processor, which the first of them to go would take along. Each takes three of the 65,530 areas of
# memory that Linux gives a process, beyond which new code is a segmentation fault: so code that is
# loaded serves all whose trace is the same
_loaded: dict[str, Any] = {}


class Start(NamedTuple):
    """A system at rest, for W parameter sets: setpoints r (nr, W) and states x (nx, W)."""

    r: Array
    x: Array


class Span(NamedTuple):
    """A segment of a run: inputs u (n + 1, nu) at its grid points, linear between, and the step.

    ``step`` is in seconds; each of the n steps is taken in ``parts`` equal sub-steps.
    """

    u: Array
    step: float
    parts: int


def target() -> tuple[str, str]:
    """Name the processor that code is made for, and its features: this one, or EXFIT_CPU's.

    ``EXFIT_CPU=x86-64`` gives the code that every processor of 64 bits runs, as a check that no
    result depends on the machine; any name that LLVM knows will do. Such code is made in a quarter
    of the time and is slower.
    """
    chosen = os.environ.get("EXFIT_CPU")
    if chosen:
        return chosen, ""
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


@cache
def _machine(cpu: str, features: str) -> tuple[Any, str]:
    """Return LLVM's idea of a processor, and what distinguishes it from others."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    platform = llvm.Target.from_default_triple()
    machine = platform.create_target_machine(
        cpu=cpu,
        features=features,
        opt=0 if os.environ.get("EXFIT_CPU") else 3,
        reloc="pic",
        codemodel="jitdefault",
        jit=True,
    )
    return machine, " ".join((str(llvm.llvm_version_info), platform.triple, cpu, features))


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


def _digest(path: Path, code: bytes) -> bytes:
    """Return the digest of code that is kept at a path: under another name it is none of that."""
    return hashlib.sha256(f"{path.name}\n".encode() + code).digest()


def _cached(path: Path) -> bytes | None:
    """Return the code kept at path; None where there is none, or it is damaged or of others.

    The digest shows damage, and a file under a name that is not its own. It protects from nobody
    who can write there: that is for the owner and the mode of the file.
    """
    content = read_private(path)
    if content is None:
        return None
    digest, code = content[:DIGEST], content[DIGEST:]
    return code if _digest(path, code) == digest else None


def _keep(path: Path, code: bytes) -> None:
    keep_private(path, _digest(path, code) + code)


@cache
def _sources() -> str:
    """Return the hash of the modules that write the IR of a trace."""
    files = sorted(Path(__file__).parent.glob("*.py*"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def _key(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:32]


def _code(traced: str, write_ir: Callable[[], str], machine: Any, name: str) -> bytes:
    """Return machine code, built or from the cache, where it lies under the key of its IR.

    Which IR a trace leads to is kept as well: to write it takes longer than to load the code.
    """
    folder = private_cache()
    if folder is None:
        return _build(write_ir(), machine)
    place = folder / "traces" / _key(name, _sources(), traced)
    key = _cached(place)
    code = None if key is None else _cached(folder / f"{key.decode()}.code")
    if code is None:
        ir = write_ir()
        path = folder / f"{_key(FORM, name, ir)}.code"
        code = _cached(path)
        if code is None:
            code = _build(ir, machine)
            _keep(path, code)
        _keep(place, path.stem.encode())
    return code


def compiled(traced: str, write_ir: Callable[[], str]) -> Any:
    """Load the machine code of an IR, once in a process, and return LLVM's engine that holds it.

    ``traced`` is a text that the IR follows from, with these modules.
    """
    with _lock:
        machine, name = _machine(*target())
        key = _key(name, traced)
        if key not in _loaded:
            code = _code(traced, write_ir, machine, name)
            engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
            engine.add_object_file(llvm.ObjectFileRef.from_data(code))
            engine.finalize_object()
            _loaded[key] = engine
        return _loaded[key]


@cache
def text_of(system: System, outputs: tuple[str, ...]) -> str:
    """Return the trace of a system as text: several of its kernels have the same.

    It is traced anew for the IR, which is seldom written: to differentiate a trace adds to it.
    """
    return traced_for(system, outputs).text


class Kernel:
    """Simulates ``lanes`` parameter sets side by side."""

    def __init__(self, system: System, outputs: Sequence[str], lanes: int = 1) -> None:
        self.lanes, self.system, self.outputs = lanes, system, tuple(outputs)

        def ir() -> str:
            from exfit.engine.emit import simulation

            return simulation(trace(system, self.outputs), lanes)

        engine = compiled(f"simulation {lanes} {text_of(system, self.outputs)}", ir)
        self._rest = function(engine, "rest", "pppp")
        self._run = function(engine, "run", "pppppdii")
        sizes = Sizes(len(system.setpoints), len(system.states), len(self.outputs), lanes)
        self._sampled = Sampler(engine, sizes)

    def start(self, p: Array) -> Start:
        """Return the rest of parameter sets p (np, lanes)."""
        r = np.empty((len(self.system.setpoints), self.lanes))
        x = np.empty((len(self.system.states), self.lanes))
        self._rest(address(p), address(r), address(x), None)
        return Start(r, x)

    def run(self, p: Array, start: Start, spans: Sequence[Span]) -> list[Array]:
        """Return the outputs of each span, (n + 1, outputs, lanes); ``start.x`` moves along."""
        results = []
        for span in spans:
            out = np.empty((len(span.u), len(self.outputs), self.lanes))
            arrays = (p, start.r, start.x, out, span.u)
            self._run(*map(address, arrays), span.step / span.parts, len(span.u) - 1, span.parts)
            results.append(out)
        return results

    def samples(self, p: Array, courses: Courses) -> Array:
        """Return the outputs (K, M, ny) of parameter sets p (K, np), each in its course.

        The sets that run side by side must have the same inputs; those with equal sub-steps do.
        """
        sets = side_by_side(courses.parts, self.lanes)
        together = np.ascontiguousarray(p[sets].transpose(0, 2, 1))
        return self._sampled(together, courses, sets)[0]


def side_by_side(parts: NDArray[np.int64], lanes: int) -> NDArray[np.intp]:
    """Return the numbers of sets (jobs, lanes) that run together: those with equal sub-steps.

    Lanes that are left are filled with the last set once more.
    """
    if lanes == 1:
        return np.arange(len(parts))[:, None]
    order = np.argsort(parts, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(parts[order])) + 1)
    padded = [np.pad(group, (0, -len(group) % lanes), mode="edge") for group in groups]
    return np.concatenate(padded).reshape(-1, lanes)


class AtRest(NamedTuple):
    """K systems at rest: states x (K, nx), their slopes there, the slopes' Jacobian (K, nx, nx)."""

    x: Array
    slopes: Array
    jacobian: Array


class LinearKernel:
    """Linearises a system: its slopes at given states, and their exact Jacobian."""

    def __init__(self, system: System) -> None:
        self.system = system

        def ir() -> str:
            from exfit.engine.emit import linearisation
            from exfit.engine.tangents import differentiate

            traced = trace(system, ())
            return linearisation(traced, differentiate(traced, system, ()), DIRECTIONS)

        engine = compiled(f"linearisation {DIRECTIONS} {text_of(system, ())}", ir)
        self._rest = function(engine, "rest", 8 * "p")
        self._at_rest = function(engine, "at_rest", "i" + len(AT_REST) * "p")
        self._along = function(engine, "along", "i" + len(ALONG) * "p")
        # tangents of parameters, setpoints and states at rest: zero, and written over with zero
        states = len(system.states)
        sizes = (len(system.parameters), len(system.setpoints), states)
        still = [np.zeros((rows, DIRECTIONS)) for rows in sizes]
        whole_blocks = -(-states // DIRECTIONS) * DIRECTIONS
        columns = np.eye(states, whole_blocks).reshape(states, -1, DIRECTIONS)
        units = np.ascontiguousarray(columns.transpose(1, 0, 2))
        no_input = np.zeros(len(system.inputs))
        self._blocks, self._kept = units.shape, (still, units, no_input)
        *self._still, self._units, self._no_input = map(address, (*still, units, no_input))

    def rest(self, p: Array) -> Start:
        """Return the rest of one parameter set (np,): setpoints (nr,) and states (nx,)."""
        r, x = np.empty(len(self.system.setpoints)), np.empty(len(self.system.states))
        self._rest(address(p), address(r), address(x), None, *self._still, None)
        return Start(r, x)

    def at_rest(self, p: Array) -> AtRest:
        """Return the states at rest of parameter sets p (K, np), and their linearisation there."""
        count, states = len(p), len(self.system.states)
        r = np.empty(len(self.system.setpoints))
        x, slopes = np.empty((count, states)), np.empty((count, states))
        columns = np.empty((count, *self._blocks))
        arrays = map(address, (p, r, x, slopes, columns))
        self._at_rest(count, *arrays, *self._still, self._units, self._no_input)
        return AtRest(x, slopes, self._joined(columns))

    def motion(self, p: Array, r: Array, x: Array, u: Array) -> tuple[Array, Array]:
        """Return the slopes (..., nx) at states x and inputs u (..., nu), and their Jacobians.

        These are (..., nx, nx); p (np,) and r (nr,) are those of one parameter set.
        """
        slopes, columns = np.empty(x.shape), np.empty((*x.shape[:-1], *self._blocks))
        arrays = map(address, (p, r, x, u, slopes, columns))
        self._along(x.size // x.shape[-1], *arrays, *self._still[:2], self._units)
        return slopes, self._joined(columns)

    @staticmethod
    def _joined(columns: Array) -> Array:
        """Return Jacobians (..., nx, nx) of blocks (..., blocks, nx, DIRECTIONS) of columns."""
        rows = columns.swapaxes(-3, -2)
        return rows.reshape(*rows.shape[:-2], -1)[..., : rows.shape[-3]]


# made once in a process
kernel, linear_kernel = cache(Kernel), cache(LinearKernel)
