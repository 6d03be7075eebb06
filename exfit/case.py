"""Case: one study as its YAML file describes it, checked, with the models it names.

pydantic lives only here. The classes are the schema of the file; their descriptions reach editors
through the JSON Schema.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PrivateAttr,
    Strict,
    ValidationError,
    WrapSerializer,
)

from exfit.case_faults import contradictions, resolved
from exfit.case_form import form_faults, near, show
from exfit.errors import CaseError, ModelError, RecordError
from exfit.models import find
from exfit.models.machines import MACHINES, Machine
from exfit.models.sheet import Model, Sheet
from exfit.record import Record, read_record
from exfit.yaml_lines import Fault, Place, read_text, read_yaml

DIALECT = "https://json-schema.org/draft/2020-12/schema"
FILE_NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"

Value = TypeVar("Value")
Signal = Literal["vt", "efd", "ifd"]


def _nothing() -> Mapping[str, Any]:
    return MappingProxyType({})


def _thawed(values: Mapping[str, Any], serialize: Callable[[Any], Any]) -> Any:
    return serialize(dict(values))


def _channel(value: Any) -> Any:
    return {"column": value} if isinstance(value, str) else value


Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Count = Annotated[int, Strict(), Field(ge=1)]
Text = Annotated[str, Strict(), Field(min_length=1)]
Frozen = Annotated[Mapping[str, Value], AfterValidator(MappingProxyType), WrapSerializer(_thawed)]


class Section(BaseModel):
    """A part of the case file: unknown keys are refused, values never change."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        defer_build=True,
        field_title_generator=lambda name, _: name,
    )


class OpenCircuit(Section):
    """A machine whose breaker is open, at rated speed."""

    type: Literal["open-circuit"] = Field(description="What surrounds the exciter.")
    machine: Text = Field(description="Machine model: GENROU or ONE_AXIS.")
    parameters: Frozen[Number] = Field(
        default_factory=_nothing,
        description="Machine data; what is missing takes its typical value.",
    )


class NoPlant(Section):
    """The model alone: its output is vt."""

    type: Literal["none"] = Field(description="What surrounds the model: nothing.")


class Step(Section):
    """A step of the reference."""

    at: Number = Field(description="Instant, s.")
    step: Number = Field(description="Change of the reference, pu; not zero.")


class BumpTest(Section):
    """What was done to the unit."""

    vt0: Number | None = Field(
        default=None,
        description="Voltage before the first step, pu; default: mean of the record there.",
    )
    begin: Number | None = Field(
        default=None,
        description="Where the simulation starts at rest, s; default: with the record. Earlier "
        "than the record, for steps that were made before it; then vt0 holds from here on.",
    )
    vref: tuple[Step, ...] = Field(
        min_length=1, description="Steps of the reference, in the order of time."
    )
    duration: Positive | None = Field(
        default=None, description="Length of the simulation, s; only where there is no record."
    )


class Channel(Section):
    """Where a signal stands and how it becomes per unit: column * scale + offset."""

    column: Text = Field(description="Name of the column.")
    scale: Number = Field(default=1.0, description="Factor on the column's numbers.")
    offset: Number = Field(default=0.0, description="What is added after scaling, pu.")
    weight: Positive = Field(default=1.0, description="Weight of the signal in the fit.")


class RecordFile(Section):
    """A measured record: a CSV file with a row of column names."""

    file: Text = Field(description="Path, relative to the case file.")
    time: Text = Field(description="Column with the time, s.")
    channels: Annotated[
        Mapping[
            Signal,
            Annotated[Channel, BeforeValidator(_channel, json_schema_input_type=Text | Channel)],
        ],
        Field(min_length=1),
        AfterValidator(MappingProxyType),
        WrapSerializer(_thawed),
    ] = Field(description="Measured signals, each a column or {column, scale, offset, weight}.")
    window: tuple[Number, Number] | None = Field(
        default=None, description="First and last instant used, s; default: the whole record."
    )


class Free(Section):
    """A parameter that the fit may change."""

    start: Number = Field(description="Value from which the fit starts.")
    min: Number = Field(description="Lower bound.")
    max: Number = Field(description="Upper bound.")
    scale: Literal["log", "linear"] = Field(
        default="log", description="Scale on which the fit moves it; log needs min > 0."
    )


class Parameters(Section):
    """The exciter's parameters; what is neither fixed nor free takes its typical value."""

    fixed: Frozen[Number] = Field(default_factory=_nothing, description="Values that stay.")
    free: Frozen[Free] = Field(default_factory=_nothing, description="Values that are fitted.")


class Tolerance(Section):
    """When the estimator stops as converged."""

    gradient: NotNegative = Field(default=1e-8, description="Limit on the scaled gradient.")
    step: NotNegative = Field(default=1e-10, description="Limit on the relative step.")


class Limit(Section):
    """A limit on how far simulated and measured signals may differ."""

    rmse: Positive = Field(description="Root mean square error, pu.")


class Estimate(Section):
    """How the free parameters are found."""

    strategy: Literal["gn", "dgn", "lm", "lm-then-dgn", "auto", "robust"] = Field(
        default="lm-then-dgn",
        description="Gauss-Newton, damped Gauss-Newton, Levenberg-Marquardt, or several of them.",
    )
    jacobian: Literal["exact", "central", "forward", "backward"] = Field(
        default="exact", description="Derivatives: exact, or by differences."
    )
    iterations: Count = Field(
        default=100, description="Most iterations of each phase of the strategy."
    )
    tolerance: Tolerance = Field(default_factory=Tolerance, description="When to stop.")
    good_enough: Limit = Field(
        default_factory=lambda: Limit(rmse=2e-4),
        description="What strategy auto calls a match; default: rmse 2e-4.",
    )


class Simulation(Section):
    """The grid of the simulation."""

    step: Positive = Field(default=0.001, description="Step of the integration, s.")
    output_step: Positive = Field(
        default=0.005, description="Spacing of the output where there is no record, s."
    )


class Validation(Section):
    """A record the fit never sees, on which its result is tried."""

    name: str = Field(
        pattern=FILE_NAME,
        max_length=100,
        description="Name, of letters, digits, - _ and .; files are named after it.",
    )
    test: BumpTest = Field(description="What was done to the unit.")
    record: RecordFile = Field(description="What was measured.")


class Case(Section):
    """A study of exfit: a model, its plant, a test, its record, and what is to be found."""

    model: Text = Field(
        description="Model of the catalogue, in upper or lower case, or path of a .py file."
    )
    saturation: Literal["quadratic", "exponential", "exponential-se"] = Field(
        default="quadratic", description="Form of the exciter's saturation curve."
    )
    plant: Annotated[OpenCircuit | NoPlant, Field(discriminator="type")] = Field(
        description="What surrounds the exciter."
    )
    test: BumpTest = Field(description="What was done to the unit.")
    record: RecordFile | None = Field(
        default=None, description="What was measured; a simulation does without."
    )
    parameters: Parameters = Field(
        default_factory=Parameters, description="What is known and what is to be found."
    )
    estimate: Estimate = Field(
        default_factory=Estimate, description="How the free parameters are found."
    )
    simulation: Simulation = Field(
        default_factory=Simulation, description="The grid of the simulation."
    )
    validations: tuple[Validation, ...] = Field(
        default=(), alias="validate", description="Records on which the result is tried."
    )
    accept: Limit | None = Field(
        default=None, description="What a validation must keep to; beyond it the exit code is 3."
    )

    _path: Path = PrivateAttr()
    _exciter: Model = PrivateAttr()
    _machine: Machine | None = PrivateAttr()

    @property
    def path(self) -> Path:
        """The case file."""
        return self._path

    @property
    def folder(self) -> Path:
        """The folder to which the paths in the file are relative."""
        return self._path.parent

    @property
    def exciter(self) -> Model:
        """The model that the file names."""
        return self._exciter

    @property
    def machine(self) -> Machine | None:
        """The machine that the file names, None for a model alone."""
        return self._machine

    def values(self) -> dict[str, float]:
        """Return the exciter's parameters in the order of its sheet: typical, fixed or start."""
        starts = {symbol: free.start for symbol, free in self.parameters.free.items()}
        return resolved(self.exciter.sheet, self.parameters.fixed, starts)

    def machine_values(self) -> dict[str, float]:
        """Return the machine's parameters in the order of its sheet, none for a model alone."""
        if self.machine is None or isinstance(self.plant, NoPlant):
            return {}
        return resolved(self.machine.sheet, self.plant.parameters)

    @property
    def typical_symbols(self) -> tuple[str, ...]:
        """The exciter's parameters that are neither fixed nor free."""
        given = self.parameters.fixed.keys() | self.parameters.free.keys()
        return _others(self.exciter.sheet, given)

    @property
    def typical_machine_symbols(self) -> tuple[str, ...]:
        """The machine's parameters that the file does not give."""
        if self.machine is None or isinstance(self.plant, NoPlant):
            return ()
        return _others(self.machine.sheet, self.plant.parameters.keys())

    def measure(self, test: BumpTest, record: RecordFile) -> Record:
        """Return the record of a test; raises RecordError where its steps lie outside it."""
        channels: dict[str, Channel] = dict(record.channels.items())
        path = self.folder / record.file
        read = read_record(path, record.time, channels, record.window)
        start, end = read.time[0], read.time[-1]
        if test.begin is not None:
            if test.begin > start:
                raise RecordError(
                    f"{path}: begins at {show(start)} s, before {self.path} begins to simulate it "
                    f"at {show(test.begin)} s"
                )
            start = test.begin
        for step in test.vref:
            if not start <= step.at < end:
                raise RecordError(
                    f"{path}: holds {show(start)} ... {show(end)} s, "
                    f"but {self.path} has a step at {show(step.at)} s"
                )
        if test.vt0 is None and not start < test.vref[0].at:
            raise RecordError(
                f"{path}: begins at {show(start)} s, with the first step: nothing before it tells "
                f"vt0, and {self.path} does not give it"
            )
        return read


def initial_voltage(test: BumpTest, record: Record) -> float:
    """Return the voltage before the first step: as the test gives it, else the record's mean."""
    if test.vt0 is not None:
        return test.vt0
    return float(record.signals["vt"][record.time < test.vref[0].at].mean())


def load_case(path: Path) -> Case:
    """Return the case of a YAML file.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """Return the case of a YAML text, as if it stood in the file ``path``; raises CaseError."""
    top, faults = read_yaml(text, path)
    exciter, machine = _named(top.value, path.parent, faults)
    case = _checked(top.value, faults)
    taken = {fault.place for fault in faults}
    faults += [
        fault for fault in contradictions(top.value, exciter, machine) if fault.place not in taken
    ]
    if faults or case is None or exciter is None:
        lines = [(fault.line or top.line_of(fault.place), fault) for fault in faults]
        raise CaseError(
            f"{path}:{line}: {dotted(fault.place)}: {fault.text}"
            for line, fault in sorted(lines, key=lambda found: found[0])
        )
    case._path, case._exciter, case._machine = path, exciter, machine
    return case


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of the case file."""
    from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

    class NoNulls(GenerateJsonSchema):
        """A key that may be missing may not be null."""

        def nullable_schema(self, schema: Any) -> JsonSchemaValue:
            return self.generate_inner(schema["schema"])

        def default_schema(self, schema: Any) -> JsonSchemaValue:
            found = super().default_schema(schema)
            return _without(found, "default") if found.get("default", 0) is None else found

    schema = Case.model_json_schema(by_alias=True, schema_generator=NoNulls)
    return {"$schema": DIALECT, **schema, "title": "exfit case"}


def dotted(place: Place) -> str:
    """Return a place as ``test.vref[0].at``."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)[1:]


def _others(rows: Sheet, given: Any) -> tuple[str, ...]:
    return tuple(row.symbol for row in rows if row.symbol not in given)


def _without(mapping: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in mapping.items() if name != key}


def _named(
    data: dict[str, Any], folder: Path, faults: list[Fault]
) -> tuple[Model | None, Machine | None]:
    """Return the models a file names; add a fault for a name that stands for none."""
    exciter = machine = None
    name, plant = data.get("model"), data.get("plant")
    plant = plant if isinstance(plant, dict) else {}
    if isinstance(name, str) and name:
        try:
            exciter = find(name, folder)
        except ModelError as error:
            faults.append(Fault(("model",), str(error)))
    name = plant.get("machine")
    if isinstance(name, str) and name and plant.get("type") == "open-circuit":
        machine = MACHINES.get(name.upper())
        if machine is None:
            hint = near(name, MACHINES)
            faults.append(Fault(("plant", "machine"), f"{name!r} is not a machine model; {hint}"))
    return exciter, machine


def _checked(data: dict[str, Any], faults: list[Fault]) -> Case | None:
    """Return the case if its data has the right form; add a fault for each that has not."""
    try:
        return Case.model_validate(data)
    except ValidationError as error:
        known = {fault.place for fault in faults}
        found = form_faults(error.errors(include_url=False), json_schema())
        faults += [fault for fault in found if fault.place not in known]
        return None
