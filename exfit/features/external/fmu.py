"""A functional mock-up unit (FMU): what its file says of itself, and the program that runs it.

That is a separate process, which the machine code of an FMU may end or hang: a line of JSON asks
it, a line is its answer.
"""

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from exfit.util.arrays import Array, median_step

Interface = Literal["co-simulation", "model-exchange"]
Use = Literal["parameter", "input", "output"]  # set before the start, set at any time, read

PACKAGE_MISSING = 'needs the package FMPy: pip install "exfit[fmu]"'
VERSIONS = ("2.", "3.")  # of FMI
NUMBERS = ("Real", "Float64", "Float32", "Integer", "Int8", "Int16", "Int32", "Int64", "UInt8",
           "UInt16", "UInt32", "UInt64", "Boolean", "Enumeration")  # fmt: skip


class FmuError(Exception):
    """A file that is no FMU, or none that can be run here."""


class FmuVariable(NamedTuple):
    """A variable of an FMU: what it is by its description, and how it can be used."""

    kind: str
    uses: tuple[Use, ...]


class FmuDescription(NamedTuple):
    """What an FMU says of itself: its interfaces, its variables by name."""

    interfaces: tuple[Interface, ...]
    variables: Mapping[str, FmuVariable]

    def usable_as(self, use: Use) -> list[str]:
        """Return the names of the variables that can be used so."""
        return [name for name, variable in self.variables.items() if use in variable.uses]


def fmu_description(path: Path) -> FmuDescription:
    """Return the description in an FMU, or in the folder with its content.

    Raises FmuError for a file that is none, one of another version of FMI, one without machine
    code for this system, and where FMPy is missing.
    """
    try:
        import fmpy
    except ImportError:
        raise FmuError(PACKAGE_MISSING) from None
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        platforms = fmpy.supported_platforms(str(path))
    except OSError as fault:
        raise FmuError(f"cannot be read: {fault.strerror or fault}") from None
    except Exception as fault:  # damaged files make the package fail in many ways
        what = str(fault).partition("\n")[0] or type(fault).__name__
        raise FmuError(f"is not an FMU, or damaged: {what}") from None
    version = str(description.fmiVersion)
    if not version.startswith(VERSIONS):
        raise FmuError(f"is of FMI {version}; must be of FMI 2 or 3")
    interfaces: dict[Interface, Any] = {
        "co-simulation": description.coSimulation,
        "model-exchange": description.modelExchange,
    }
    present = tuple(name for name, interface in interfaces.items() if interface is not None)
    if not present:
        raise FmuError("is neither for co-simulation nor for model exchange")
    here = str(fmpy.platform)
    if here not in platforms:
        raise FmuError(f"has no machine code for {here}; has {', '.join(platforms) or 'none'}")
    return FmuDescription(present, variables_of(description))


def variables_of(description: Any) -> dict[str, FmuVariable]:
    """Return the variables of a description that FMPy has read."""
    variables = {}
    for each in description.modelVariables:
        uses: list[Use] = []
        if each.type in NUMBERS and not each.shape:
            is_output = each.causality in ("local", "output")
            starts = each.causality == "parameter" or (is_output and each.initial == "exact")
            uses += ["output"] if is_output else []
            uses += ["parameter"] if starts and each.variability != "constant" else []
            if each.causality == "input" or each.variability == "tunable":
                uses.append("input")
        kind = f"{each.variability} {each.causality}, {each.type}"
        variables[str(each.name)] = FmuVariable(kind, tuple(uses))
    return variables


@contextmanager
def laid_out(path: Path) -> Iterator[Path]:
    """Provide a folder with the content of an FMU; it is removed afterwards.

    Raises FmuError for a file that is none.
    """
    with TemporaryDirectory(prefix="exfit-fmu-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        try:
            with ZipFile(path) as archive:
                archive.extractall(folder)
        except OSError as fault:
            raise FmuError(f"cannot be read: {fault.strerror or fault}") from None
        except Exception as fault:  # damaged files: of zip, of what is packed in it
            raise FmuError(f"is not an FMU, or damaged: {fault}") from None
        yield folder


def worker_command(settings: str) -> list[str]:
    """Return the command of the program that simulates an FMU, with its settings as JSON.

    It imports exfit and FMPy from where this process did, and nothing from its folder.
    """
    places = [str(Path(place).absolute()) for place in sys.path]
    return [sys.executable, "-P", "-c", _PROGRAM.format(places=places), settings]


_PROGRAM = (
    "import sys; sys.path[:] = {places!r}; from exfit.features.external.fmu import main; main()"
)


LONGEST_STEP = 1e-3  # s: of communication
TOLERANCE = 1e-8  # relative, of the integration
ROUNDING = 1e-6  # of a step


class Grid(NamedTuple):
    """The times of communication, evenly from the first to the last one, s."""

    start: float
    step: float
    end: float


class LoadedFmu:
    """An FMU whose content lies in a folder; its machine code is loaded once.

    ``inputs`` and ``outputs`` are names of variables by the signals of exfit.
    """

    def __init__(
        self,
        folder: str,
        interface: Interface,
        inputs: Mapping[str, str],
        outputs: Mapping[str, str],
    ) -> None:
        from fmpy import read_model_description

        self.folder, self.inputs, self.outputs = folder, inputs, outputs
        self.description = read_model_description(folder, validate=False)
        self.kind = "CoSimulation" if interface == "co-simulation" else "ModelExchange"
        variables = variables_of(self.description)
        self.parameters = {name for name, each in variables.items() if "parameter" in each.uses}
        self.starts = {each.name: each.start for each in self.description.modelVariables}
        self._instance: Any = None

    def signals(self, request: Mapping[str, Any]) -> dict[str, list[float]]:
        """Return the signals of a request at its times; raises Exception where there are none."""
        from fmpy import simulate_fmu

        times = np.array(request["times"])
        grid = grid_of(times, request["steps"], self._own_step)
        names = {signal: self.outputs.get(signal, signal) for signal in request["signals"]}
        values = request["values"]
        instance, self._instance = self._ready(), None  # it is used no more where this fails
        result = simulate_fmu(
            self.folder,
            model_description=self.description,
            fmu_instance=instance,
            fmi_type=self.kind,
            start_time=0.0,
            stop_time=grid.end - grid.start,
            output_interval=grid.step,
            relative_tolerance=TOLERANCE,
            start_values={name: values[name] for name in self.parameters & values.keys()},
            input=self._input(request["steps"], grid),
            output=[*names.values()],
        )
        self._instance = instance
        reached = grid.start + result["time"]
        if reached[-1] < times[-1] - grid.step:
            raise RuntimeError(f"the FMU ends its run at {reached[-1]:g} s")
        return {
            signal: np.interp(times, reached, result[name]).tolist()
            for signal, name in names.items()
        }

    @property
    def _own_step(self) -> float | None:
        """The step of communication of an FMU that cannot change it, s."""
        interface, experiment = self.description.coSimulation, self.description.defaultExperiment
        if self.kind != "CoSimulation" or interface.canHandleVariableCommunicationStepSize:
            return None
        advised = None if experiment is None else experiment.stepSize
        return float(interface.fixedInternalStepSize or advised or LONGEST_STEP)

    def _ready(self) -> Any:
        """Return an instance that was not initialised."""
        from fmpy import instantiate_fmu

        if self._instance is not None:
            try:
                self._instance.reset()
                return self._instance
            except Exception:  # not all FMUs can, though they should
                self._instance = None
        arguments = (self.folder, self.description, self.kind)
        return instantiate_fmu(*arguments, require_functions=False)

    def _input(self, steps: Sequence[Mapping[str, Any]], grid: Grid) -> Any:
        """Return the table of the inputs that change, each from its start value on.

        In a co-simulation they are held over each step, with the value that a ramp has in its
        middle.
        """
        if not steps:
            return None
        by_name = [(self.inputs.get(step["signal"], step["signal"]), step) for step in steps]
        ahead = 0.5 * grid.step if self.kind == "CoSimulation" else 0.0
        instants, after = corners(steps, grid, ahead)
        fields = [("time", float), *((name, float) for name in dict(by_name))]
        table = np.zeros(len(instants), fields)
        table["time"] = instants
        for name in dict(by_name):
            table[name] = float(self.starts[name] or 0.0)
        for name, step in by_name:
            table[name] += step["step"] * share(step, grid, ahead, instants, after)
        return table


def grid_of(
    times: Array, steps: Sequence[Mapping[str, Any]], own_step: float | None = None
) -> Grid:
    """Return a grid that has samples of a test, evenly spaced as most of them are.

    That of an FMU with a fixed step has the first step of the test.
    """
    begins = [step["at"] for step in steps]
    first = min([float(times[0]), *begins])
    anchor = min(begins, default=first)
    step = own_step
    if step is None:
        spacing = median_step(times) if len(times) > 1 else 0.0
        parts = max(1, int(np.ceil(spacing / LONGEST_STEP - ROUNDING)))
        step = spacing / parts if spacing > 0.0 else LONGEST_STEP
        anchor = float(times[len(times) // 2])
    start = anchor - step * (np.ceil((anchor - first) / step) + 1.0)
    count = np.ceil((times[-1] - start) / step - ROUNDING)
    return Grid(float(start), float(step), float(start + count * step))


def corners(
    steps: Sequence[Mapping[str, Any]], grid: Grid, ahead: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Return the times of a table from the start, two where a step is, the other one after it.

    Between them inputs are lines; ramps are so much ``ahead``, s.
    """
    jumps = {step["at"] - grid.start for step in steps if not step["ramp"]}
    ramps = [step for step in steps if step["ramp"]]
    ends = {at - grid.start - ahead for r in ramps for at in (r["at"], r["at"] + r["ramp"])}
    instants = sorted({0.0, grid.end - grid.start, *jumps, *ends})
    rows = [
        (at, after) for at in instants for after in ((False, True) if at in jumps else (False,))
    ]
    times, later = zip(*rows, strict=True)
    return np.array(times), np.array(later)


def share(
    step: Mapping[str, Any], grid: Grid, ahead: float, instants: Array, after: NDArray[np.bool_]
) -> Array:
    """Share of a step, or ramp, that is complete at the times of a table."""
    begin = step["at"] - grid.start
    if step["ramp"]:
        complete: Array = (instants - begin + ahead) / step["ramp"]
        return complete.clip(0.0, 1.0)
    return np.where((instants > begin) | ((instants == begin) & after), 1.0, 0.0)


def apply_inputs_inside_steps() -> None:
    """Let FMPy's solver set the inputs wherever it asks for derivatives.

    Its own holds a ramp over each of its steps.
    """
    import fmpy.sundials

    class Solver(fmpy.sundials.CVodeSolver):  # type: ignore[misc]
        def f(self, t: float, y: Any, ydot: Any, user_data: Any) -> int:
            self.input.apply(t)
            return int(super().f(t, y, ydot, user_data))

    fmpy.sundials.CVodeSolver = Solver


def main() -> None:
    """Answer each line of the standard input; the last argument has the settings."""
    # what an FMU prints goes to the standard error
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    apply_inputs_inside_steps()
    fmu = LoadedFmu(**json.loads(sys.argv[-1]))
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = {"id": request["id"], "signals": fmu.signals(request)}
        except Exception as fault:
            answer = {"id": request["id"], "error": f"{type(fault).__name__}: {fault}"}
        print(json.dumps(answer), file=answers, flush=True)
