"""The sections of the case file about a test: what was done to the unit."""

from pydantic import Field

from exfit.case.schema.values import (
    Findable,
    NotNegative,
    Number,
    Positive,
    Section,
    start_value,
)


class StepSection(Section):
    """A step of a signal."""

    at: Number = Field(description="Time, s.")
    step: Number = Field(description="Change, pu; not zero.")


class FindableStep(Section):
    """A step of a signal, whose time and size may be fitted."""

    at: Findable = Field(description="Time, s; or {start, min, max} to fit it.")
    step: Findable = Field(description="Change, pu, not zero; or {start, min, max} to fit it.")


class Switch(Section):
    """A switching in the network, with the values from then on."""

    at: Number = Field(description="Time, s.")
    R: NotNegative | None = Field(default=None, description="Resistance to the source, pu.")
    X: NotNegative | None = Field(default=None, description="Reactance to the source, pu.")
    E: Positive | None = Field(
        default=None, description="Voltage of the source, pu; only if plant.network gives E."
    )


class BumpTest(Section):
    """The test: the steps that were made."""

    vt0: Findable | None = Field(
        default=None,
        description="Terminal voltage before the first step, pu, or {start, min, max} to fit it; "
        "default: mean of the record there.",
    )
    begin: Number | None = Field(
        default=None,
        description="Time at which the simulation starts in steady state, s; default: the start of "
        "the record. Give an earlier time if steps were made before the record; vt0 is then the "
        "voltage from this time on.",
    )
    steady_until: Number | None = Field(
        default=None,
        description="End of the steady state in the record, s; default: the first step.",
    )
    vref: tuple[FindableStep, ...] = Field(
        default=(), min_length=1, description="Steps of the reference, in order of time."
    )
    vs: tuple[FindableStep, ...] = Field(
        default=(), min_length=1, description="Steps of the stabiliser's signal, in order of time."
    )
    E: tuple[StepSection, ...] = Field(
        default=(),
        min_length=1,
        description="Steps of the voltage of the source; infinite-bus only.",
    )
    network: tuple[Switch, ...] = Field(
        default=(), min_length=1, description="Switchings of R, X and E; infinite-bus only."
    )
    duration: Positive | None = Field(
        default=None, description="Length of the simulation, s; only if there is no record."
    )

    @property
    def instants(self) -> tuple[float, ...]:
        """The times of all events that are given as numbers, s, in order."""
        instants = {start_value(step.at) for step in (*self.vref, *self.vs)}
        instants |= {event.at for event in self.E} | {switch.at for switch in self.network}
        return tuple(sorted(at for at in instants if at is not None))

    @property
    def steady(self) -> float | None:
        """The end of the steady state, s; None where the case does not give it."""
        if self.steady_until is not None:
            return self.steady_until
        return self.instants[0] if self.instants else None
