"""The schema of the case file, section by section; pydantic checks it.

The descriptions reach editors through the JSON Schema, and the documentation of the keys.
"""

from exfit.case.schema.document import CaseDocument
from exfit.case.schema.estimate import Estimate, Limit, Parameters, SimulationSection
from exfit.case.schema.plants import InfiniteBus, OpenCircuit, Plant, SaturationName, Stabiliser
from exfit.case.schema.records import (
    SINGLE,
    ChannelSection,
    Filter,
    MedianSection,
    PhasesSection,
    RecordFile,
    Recording,
    TimeColumn,
)
from exfit.case.schema.tests import (
    SIGNALS_OF_A_TEST,
    BumpTest,
    FindableStep,
    Reference,
    ReferenceTable,
    StepSection,
    Switch,
)
from exfit.case.schema.values import FreeSection, Unknown, Value, start_value

__all__ = [
    "SIGNALS_OF_A_TEST",
    "SINGLE",
    "BumpTest",
    "CaseDocument",
    "ChannelSection",
    "Estimate",
    "Filter",
    "FindableStep",
    "FreeSection",
    "InfiniteBus",
    "Limit",
    "MedianSection",
    "OpenCircuit",
    "Parameters",
    "PhasesSection",
    "Plant",
    "RecordFile",
    "Recording",
    "Reference",
    "ReferenceTable",
    "SaturationName",
    "SimulationSection",
    "Stabiliser",
    "StepSection",
    "Switch",
    "TimeColumn",
    "Unknown",
    "Value",
    "start_value",
]
