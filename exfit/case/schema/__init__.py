"""The schema of the case file, section by section; pydantic checks it.

Here is the whole of the file, and what its report judges by. The descriptions reach editors through
the JSON Schema, and the documentation of the keys.
"""

from typing import Annotated

from pydantic import Field

from exfit.case.schema.estimate import Estimate, Limit, Parameters, SimulationSection
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
    start_value,
)
from exfit.util.vocabulary import Criteria

__all__ = [
    "MOST_ROWS",
    "SINGLE",
    "AngleTable",
    "AsFoundSection",
    "BumpTest",
    "CaseDocument",
    "ChannelSection",
    "CurrentPhasor",
    "Estimate",
    "ExternalPlant",
    "Filter",
    "FindableStep",
    "FmuPlant",
    "FreeSection",
    "FurtherUnitSection",
    "Governor",
    "Limit",
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
    "ReportRequest",
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

DEFAULTS = Criteria()


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
        "in PSS/E: 0 in the case; the export writes them back.",
    )


class CriteriaSection(Section):
    """Limits of the differences between simulated and recorded response."""

    rmse: Positive = Field(
        default=DEFAULTS.rmse,
        description="Limit for the rms of the difference, % of the recorded change.",
    )
    final_value: Positive = Field(
        default=DEFAULTS.final_value, description="Limit for the final value, % of that change."
    )
    overshoot: Positive = Field(
        default=DEFAULTS.overshoot, description="Limit for the overshoot, % of that change."
    )
    rise_time: Positive = Field(
        default=DEFAULTS.rise_time, description="Limit for the rise time, % of the recorded one."
    )
    peak_time: Positive = Field(
        default=DEFAULTS.peak_time, description="Limit for the peak time, % of the recorded one."
    )
    settling_time: Positive = Field(
        default=DEFAULTS.settling_time,
        description="Limit for the settling time, % of the recorded one.",
    )
    time: Positive = Field(
        default=DEFAULTS.time,
        description="A time within this of the recorded one meets its criterion, s.",
    )


class ReportRequest(Section):
    """Acceptance criteria of the report."""

    criteria: CriteriaSection = Field(
        default_factory=CriteriaSection,
        description="Criteria for the match of a response with its record.",
    )


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
        "plant machine-playback or machine-on-load.",
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
    plant: Annotated[Plant, Field(discriminator="type")] = Field(
        description="The plant: what surrounds the exciter during the test."
    )
    stabiliser: Stabiliser | None = Field(
        default=None, description="A power system stabiliser; it acts on load only."
    )
    governor: Governor | None = Field(
        default=None,
        description="A turbine with its governor; it acts where the speed follows from the power. "
        "Default: the power of the turbine is constant.",
    )
    limiters: tuple[Limiter, ...] = Field(
        default=(),
        description="Limiters of over- and underexcitation, at most one of each kind; on open "
        "circuit only limiters of the field current act.",
    )
    further_units: tuple[FurtherUnitSection, ...] = Field(
        default=(),
        min_length=1,
        description="Further units behind the same PMU, with parameters unit2.KA, unit3.KA ...: p, "
        "q and it are the sums of all; grid-playback only.",
    )
    test: BumpTest | None = Field(
        default=None,
        description="The test; with records, each of them has its own.",
    )
    record: RecordFile | None = Field(
        default=None, description="The measured signals; not required by simulate."
    )
    records: tuple[Recording, ...] = Field(
        default=(),
        min_length=1,
        description="Several tests with their records, fitted together; replaces test and record.",
    )
    parameters: Parameters = Field(
        default_factory=Parameters, description="Fixed and free parameters of the exciter."
    )
    given: GivenAs = Field(
        default="uncertain",
        description="How given values count: uncertain, each with its standard error, by default "
        "that of its kind and source; or exact, but for standard errors of the case.",
    )
    estimate: Estimate = Field(
        default_factory=Estimate, description="How the free parameters are estimated."
    )
    simulation: SimulationSection = Field(
        default_factory=SimulationSection, description="The grid of the simulation."
    )
    validations: tuple[Recording, ...] = Field(
        default=(),
        alias="validate",
        description="Records on which the result is validated; they are not used in the fit.",
    )
    accept: Limit | None = Field(
        default=None,
        description="Limit of the error on records that were not fitted; beyond it the exit code "
        "is 3. Default: better than a constant, with an rmse of at most 3 times that of the fit, "
        "or 3 times the noise of the record if that is larger.",
    )
    as_found: AsFoundSection | None = Field(
        default=None,
        description="The model in the planner's base before the test; default: the start values.",
    )
    report: ReportRequest = Field(
        default_factory=ReportRequest, description="Acceptance criteria of the report."
    )
