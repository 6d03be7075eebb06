"""The schema of the case file, section by section; pydantic checks it.

Here is the whole of the file. The descriptions reach editors through
the JSON Schema, and the documentation of the keys.
"""

from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator

from exfit.case.schema.estimate import Estimate, Parameters, SimulationSection
from exfit.case.schema.plants import (
    ExternalPlant,
    FmuPlant,
    FurtherUnitSection,
    Governor,
    Limiter,
    Plant,
    SaturationName,
    Stabiliser,
)
from exfit.case.schema.records import (
    SINGLE,
    ChannelSection,
    CurrentPhasor,
    PhasesSection,
    PhasorsSection,
    RecordFile,
    Recording,
    SineSection,
    StatusSection,
    VoltagePhasor,
)
from exfit.case.schema.tests import (
    MOST_ROWS,
    AngleTable,
    BumpTest,
    FindableStep,
    Reference,
    ReferenceFile,
    ReferenceTable,
    StepSection,
    Switch,
)
from exfit.case.schema.values import (
    Bus,
    Fact,
    Filter,
    FreeSection,
    Frozen,
    GivenAs,
    Later,
    MachineId,
    MedianSection,
    Number,
    Positive,
    Section,
    Text,
    Time,
    TimeColumn,
    Unknown,
    Value,
    nothing,
    refusal,
    start_value,
)
from exfit.signals import COMPARED
from exfit.util.vocabulary import QUANTITIES, QuantityName

__all__ = [
    "MOST_ROWS",
    "SINGLE",
    "AngleTable",
    "AsFoundSection",
    "BumpTest",
    "CaseDocument",
    "ChannelSection",
    "CriteriaSection",
    "CurrentPhasor",
    "Estimate",
    "ExternalPlant",
    "Filter",
    "FindableStep",
    "FmuPlant",
    "FreeSection",
    "FurtherUnitSection",
    "Governor",
    "Limiter",
    "MedianSection",
    "Parameters",
    "PhasesSection",
    "PhasorsSection",
    "Plant",
    "RecordFile",
    "Recording",
    "Reference",
    "ReferenceFile",
    "ReferenceTable",
    "SaturationName",
    "SimulationSection",
    "SineSection",
    "Stabiliser",
    "StatusSection",
    "StepSection",
    "Switch",
    "Time",
    "TimeColumn",
    "Unknown",
    "Value",
    "VoltagePhasor",
    "start_value",
]


class AsFoundSection(Section):
    """The model in the planner's base before the test; the report compares it with the fitted."""

    source: Text | None = Field(
        default=None, description="Its source, such as unit3.dyr, bus 101, machine 1."
    )
    bus: Bus | None = Field(
        default=None,
        description="Bus of the unit in that file, by which the export finds its records.",
    )
    id: MachineId | None = Field(
        default=None, description='Machine id of the unit in that file, such as "1".'
    )
    file: Text | None = Field(
        default=None,
        description="Planner's file it was taken from: path, relative to the case file.",
    )
    model: Text | None = Field(
        default=None, description="Name of its exciter in the catalogue; default: that of the case."
    )
    parameters: Frozen[Number] = Field(
        default_factory=nothing,
        description="Its values: KA of the exciter, machine.H, stabiliser.KS. Default: as in the "
        "case; for another exciter its typical value.",
    )
    unused: Frozen[Number] = Field(
        default_factory=nothing,
        description="Values in its records that the planner's program ignores, such as TA of ST3C "
        "in PSS/E: 0 in the case; and those of a governor that its model lacks, such as Rup of "
        "GGOV1. The export writes them back.",
    )


if TYPE_CHECKING:
    SignalName = str
else:
    SignalName = Literal[tuple(COMPARED)]


class CriterionSection(Section):
    """The largest difference of a quantity, simulated less recorded, that is accepted."""

    quantity: QuantityName = Field(
        description="What is compared: of samples rms, largest, mean, mean_absolute; of a step of "
        "the reference the others: rise_time from 10 to 90 %, delay to 10 %, settling_time to 2 %; "
        "after any event damping_ratio, that of two successive swings about the final value.",
    )
    signals: tuple[SignalName, ...] = Field(
        default=(),
        min_length=1,
        description="Default: vt, or the first compared; of a grid event P and Q.",
    )
    limit: Positive | None = Field(
        default=None,
        description="Limit: pu, s, or % of the change for the overshoot.",
    )
    percent: Positive | None = Field(
        default=None,
        description="Limit in % of the recorded change (the step of vt, else the range), or of the "
        "recorded time, overshoot or damping ratio; of both limits the larger counts.",
    )
    begin: Number | None = Field(
        default=None,
        alias="from",
        description="Begin of its part of the record, s after the event; only rms, largest, mean, "
        "mean_absolute.",
    )
    end: Number | None = Field(
        default=None,
        alias="to",
        description="End of that part, s after the event.",
    )

    @model_validator(mode="after")
    def _has_a_limit(self) -> "CriterionSection":
        if self.limit is None and self.percent is None:
            raise refusal("has no limit: give limit, percent or both")
        if not QUANTITIES[self.quantity].of_samples:
            if self.begin is not None:
                raise refusal(f"from: not with {self.quantity}, which begins with the event")
            if self.end is not None and self.end <= 0.0:
                raise refusal(f"to: {self.end:g} s is not after the event")
        if self.begin is not None and self.end is not None and self.begin >= self.end:
            raise refusal(f"from: {self.begin:g} s is not below to: {self.end:g} s")
        return self


class CriteriaSection(Section):
    """Acceptance criteria, or the file that has them."""

    file: Text | None = Field(
        default=None,
        description="YAML file with source and limits, relative to the case.",
    )
    source: Text | None = Field(default=None, description="Who set the limits, and where.")
    limits: tuple[Later[CriterionSection], ...] = Field(
        default=(),
        min_length=1,
        description="The criteria. Without any the report alone judges, by rms 5 %, final value "
        "2 %, overshoot 5 %, rise and peak time 10 %, settling time 20 % or 0.02 s.",
    )

    @model_validator(mode="after")
    def _has_limits(self) -> "CriteriaSection":
        if self.file is not None and (self.limits or self.source is not None):
            raise refusal("file: not with source or limits, which stand in it")
        if self.file is None and not self.limits:
            raise refusal("has no limits: name a file, or give limits")
        return self


ABOUT = Field(
    default_factory=nothing,
    description="Facts about unit and test for the report, under any names, such as Plant, Unit, "
    "Rated, Test date, Tested by.",
)


class CaseDocument(Section):
    """A model, its plant, a test, its record, and the parameters to be fitted."""

    about: Frozen[Fact] = ABOUT
    model: Text | None = Field(
        default=None,
        description="Name of a model, in upper or lower case, or path of a .py file; none with "
        "plant machine-playback, governor-playback or machine-on-load.",
    )
    saturation: SaturationName = Field(
        default="quadratic",
        description="Form of the exciter's saturation curve, given by E1, SE1, E2, SE2 or, if "
        "it is exponential, by AEX and BEX.",
    )
    efd_times_speed: bool = Field(
        default=False,
        description="Whether the exciter's output is multiplied by the speed of the machine, as "
        "spdmlt in PSLF; it acts where the speed is simulated or recorded.",
    )
    plant: Plant = Field(description="The plant: what surrounds the exciter during the test.")
    stabiliser: Later[Stabiliser] | None = Field(
        default=None, description="A power system stabiliser; it acts on load only."
    )
    governor: Later[Governor] | None = Field(
        default=None,
        description="A turbine with its governor; it acts where the speed follows from the power. "
        "Default: the power of the turbine is constant.",
    )
    limiters: tuple[Later[Limiter], ...] = Field(
        default=(),
        description="Limiters of over- and underexcitation, at most one of each kind; on open "
        "circuit only limiters of the field current act.",
    )
    further_units: tuple[Later[FurtherUnitSection], ...] = Field(
        default=(),
        min_length=1,
        description="Further units behind the same PMU, with parameters unit2.KA, unit3.KA ...: p, "
        "q and it are the sums of all; grid-playback only.",
    )
    test: Later[BumpTest] | None = Field(
        default=None,
        description="The test; with records, each of them has its own.",
    )
    record: Later[RecordFile] | None = Field(
        default=None, description="The measured signals; not required by simulate."
    )
    records: tuple[Later[Recording], ...] = Field(
        default=(),
        min_length=1,
        description="Several tests with their records, fitted together; replaces test and record.",
    )
    parameters: Later[Parameters] = Field(
        default_factory=Parameters, description="Fixed and free parameters of the exciter."
    )
    given: GivenAs = Field(
        default="uncertain",
        description="How given values count: uncertain, each with its standard error, by default "
        "that of its kind and source; or exact, but for standard errors of the case.",
    )
    estimate: Later[Estimate] = Field(
        default_factory=Estimate, description="How the free parameters are estimated."
    )
    simulation: Later[SimulationSection] = Field(
        default_factory=SimulationSection, description="The grid of the simulation."
    )
    validations: tuple[Later[Recording], ...] = Field(
        default=(),
        alias="validate",
        description="Records on which the result is validated; they are not used in the fit.",
    )
    criteria: Later[CriteriaSection] | None = Field(
        default=None,
        description="Acceptance criteria of all records; where one is not met, the exit code is 3.",
    )
    as_found: Later[AsFoundSection] | None = Field(
        default=None,
        description="The model in the planner's base before the test; default: the start values.",
    )
