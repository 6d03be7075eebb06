"""The schema of the case file, section by section; pydantic checks it.

The descriptions reach editors through the JSON Schema, and the documentation of the keys.
"""

from exfit.case.schema.columns import Filter, MedianSection, Time, TimeColumn
from exfit.case.schema.document import AsFoundSection, CaseDocument, CriteriaSection, ReportRequest
from exfit.case.schema.estimate import Estimate, Limit, Parameters, SimulationSection
from exfit.case.schema.plants import (
    ExternalPlant,
    FmuPlant,
    Governor,
    InfiniteBus,
    Limiter,
    OpenCircuit,
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
    AngleStep,
    AngleTable,
    BumpTest,
    FindableStep,
    Reference,
    ReferenceFile,
    ReferenceTable,
    StepSection,
    Switch,
)
from exfit.case.schema.values import FreeSection, Unknown, Value, start_value

__all__ = [
    "MOST_ROWS",
    "SINGLE",
    "AngleStep",
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
    "Governor",
    "InfiniteBus",
    "Limit",
    "Limiter",
    "MedianSection",
    "OpenCircuit",
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
