"""The sections of the case file about its report: what was known before, and when a fit passes."""

from pydantic import Field

from exfit.case.schema.values import (
    Bus,
    Frozen,
    MachineId,
    Number,
    Positive,
    Section,
    Text,
    nothing,
)
from exfit.util.criteria import Criteria

DEFAULTS = Criteria()


class AsFoundSection(Section):
    """The model in the planner's base before the test; the report compares it with the fitted."""

    source: Text | None = Field(
        default=None, description="Where it is from, such as unit3.dyr, bus 101, machine 1."
    )
    bus: Bus | None = Field(
        default=None, description="Bus of the unit there; an export finds its records by it."
    )
    id: MachineId | None = Field(
        default=None, description='Machine id of the unit there, such as "1".'
    )
    file: Text | None = Field(
        default=None,
        description="The planner's file that it is from; path, relative to the case file.",
    )
    model: Text | None = Field(
        default=None, description="Name of its exciter in the catalogue; default: that of the case."
    )
    parameters: Frozen[Number] = Field(
        default_factory=nothing,
        description="Its values: KA of the exciter, machine.H, stabiliser.KS. What is missing is "
        "as in the case; of another exciter it has its typical value.",
    )
    unused: Frozen[Number] = Field(
        default_factory=nothing,
        description="Values of its records that the planner's program reads and does without, such "
        "as TA of ST3C in PSS/E: 0 in the case; an export writes them back.",
    )


class CriteriaSection(Section):
    """Limits of the differences between simulated and recorded response."""

    rmse: Positive = Field(
        default=DEFAULTS.rmse,
        description="Of the rms of the difference, in % of the change that was recorded.",
    )
    final_value: Positive = Field(
        default=DEFAULTS.final_value, description="Of the final value, in % of that change."
    )
    overshoot: Positive = Field(
        default=DEFAULTS.overshoot, description="Of the overshoot, in % of that change."
    )
    rise_time: Positive = Field(
        default=DEFAULTS.rise_time, description="Of the rise time, in % of the recorded one."
    )
    peak_time: Positive = Field(
        default=DEFAULTS.peak_time, description="Of the peak time, in % of the recorded one."
    )
    settling_time: Positive = Field(
        default=DEFAULTS.settling_time,
        description="Of the settling time, in % of the recorded one.",
    )
    time: Positive = Field(
        default=DEFAULTS.time, description="s; a time that differs by no more meets its criterion."
    )


class ReportRequest(Section):
    """What the report judges by."""

    criteria: CriteriaSection = Field(
        default_factory=CriteriaSection, description="When a response matches its record."
    )
