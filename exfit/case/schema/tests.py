"""The sections of the case file about a test: what was done to the unit."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import pi
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from exfit.case.schema.values import (
    Filter,
    Findable,
    Later,
    NotNegative,
    Number,
    Positive,
    Section,
    Text,
    Time,
    not_zero,
    start_value,
)
from exfit.plants import REFERENCES

MOST_ROWS = 1000  # of a table; a longer one is a file
RADIANS = {"rad": 1.0, "deg": pi / 180.0}  # in each unit of an angle
AngleUnit = Literal["rad", "deg"]
Rows = tuple[tuple[Number, Number], ...]
NOT_ZERO = not_zero("0 is not a step")


def _moves(rows: Rows) -> Iterator[tuple[float, float, float | None]]:
    """Yield the lines of a table that rise or fall: when, by how much, how long if no step."""
    for (at, value), (end, then) in pairwise(rows):
        if then != value:
            yield at, then - value, end - at if end > at else None


class StepSection(Section):
    """A step of a signal."""

    at: Number = Field(description="Time, s.")
    step: Annotated[Number, NOT_ZERO] = Field(description="Change, pu; not zero.")


class FindableStep(Section):
    """A step or ramp of a signal, whose time and size may be fitted."""

    at: Findable = Field(description="Time, s; or {start, min, max} to fit it.")
    step: Annotated[Findable, NOT_ZERO] = Field(
        description="Change, pu, not zero; or {start, min, max} to fit it."
    )
    ramp: Positive | None = Field(
        default=None,
        description="Duration of a linear ramp, s; default: it is a step.",
    )


class ReferenceTable(Section):
    """A signal as a table: lines between its rows."""

    table: Rows = Field(
        min_length=2,
        max_length=MOST_ROWS,
        description="Rows [time in s, value in pu], from the start of the test to its end or "
        "beyond; a time that is given twice is a step. Only changes from the first value act.",
    )

    @property
    def events(self) -> tuple[FindableStep, ...]:
        """Its steps and ramps in order of time."""
        return tuple(
            FindableStep(at=at, step=step, ramp=ramp) for at, step, ramp in _moves(self.table)
        )


class ReferenceFile(Section):
    """A signal from a file in any format of a record, on the clock of the record.

    It is taken like a recorded one; where its rows are more than 0.1 s apart, as a table.
    """

    file: Text = Field(description="Path, relative to the case file.")
    sheet: Text | None = Field(
        default=None, description="Sheet of a workbook; default: the only one with a table."
    )
    memory: Positive | None = Field(
        default=None,
        description="Memory that reading the file may take, GB, given like record.memory.",
    )
    time: Time = Field(description="Column with the time, given like record.time.")
    column: Text = Field(
        description="Name of the column; column / base * scale is in pu, of which only changes act."
    )
    unit: Text | None = Field(default=None, description="Unit of the column, such as kV, pu or %.")
    base: Positive | None = Field(default=None, description="Value of 1 pu in that unit.")
    scale: Annotated[Number, not_zero("must not be 0")] = Field(
        default=1.0, description="Factor; not zero."
    )
    filter: Filter | None = Field(
        default=None,
        description="{lowpass: Hz} or {median: samples}, against its noise; its jumps are kept.",
    )


def _kind_of_reference(value: Any) -> str:
    if isinstance(value, str):
        return "[recorded]"
    file = isinstance(value, dict) and bool({"file", "column"} & value.keys())
    if file or isinstance(value, ReferenceFile):
        return "[file]"
    return "[table]" if isinstance(value, dict | ReferenceTable) else "[steps]"


Reference = Annotated[
    Annotated[tuple[Later[FindableStep], ...], Field(min_length=1), Tag("[steps]")]
    | Annotated[Later[ReferenceTable], Tag("[table]")]
    | Annotated[Later[ReferenceFile], Tag("[file]")]
    | Annotated[Literal["recorded"], Tag("[recorded]")],
    Discriminator(_kind_of_reference),
]


class Switch(Section):
    """A switching in the network or of a load, with the values from then on."""

    at: Number = Field(description="Time, s.")
    R: NotNegative | None = Field(default=None, description="Resistance to the source, pu.")
    X: NotNegative | None = Field(default=None, description="Reactance to the source, pu.")
    PL: Number | None = Field(default=None, description="PL of the load, pu.")
    QL: Number | None = Field(default=None, description="Its QL.")
    YP: Number | None = Field(default=None, description="Its YP.")
    YQ: Number | None = Field(default=None, description="Its YQ.")
    E: Positive | None = Field(
        default=None, description="Voltage of the source, pu; only if plant.network gives E."
    )


class FaultSection(Section):
    """A fault at the terminals through an impedance to ground, until it is cleared."""

    at: Number = Field(description="Time of the fault, s.")
    cleared: Number = Field(description="Time at which it is cleared, s.")
    R: NotNegative = Field(default=0.0, description="Resistance of the fault, pu.")
    X: NotNegative = Field(
        default=0.0, description="Reactance of the fault, pu; it or R must be above zero."
    )

    @property
    def admittance(self) -> tuple[float, float]:
        """G and B of its impedance, pu."""
        square = self.R * self.R + self.X * self.X
        return self.R / square, -self.X / square


class AngleStep(Section):
    """A step or ramp of the angle of the source."""

    at: Number = Field(description="Time, s.")
    step: Annotated[Number, NOT_ZERO] = Field(
        description="Change, not zero. Positive: the source advances; the unit gives less power."
    )
    unit: AngleUnit = Field(description="Unit of the change.")
    ramp: Positive | None = Field(
        default=None,
        description="Duration of a linear ramp, s; default: it is a step.",
    )

    @property
    def radians(self) -> float:
        """By how much the angle changes, rad."""
        return self.step * RADIANS[self.unit]


class AngleTable(Section):
    """The angle of the source as a table: lines between its rows."""

    table: Rows = Field(
        min_length=2,
        max_length=MOST_ROWS,
        description="Rows [time in s, angle], given like those of vref.",
    )
    unit: AngleUnit = Field(description="Unit of the angles.")

    @property
    def events(self) -> tuple[AngleStep, ...]:
        """Its steps and ramps in order of time."""
        return tuple(
            AngleStep(at=at, step=step, unit=self.unit, ramp=ramp)
            for at, step, ramp in _moves(self.table)
        )


SourceAngle = Annotated[
    Annotated[tuple[Later[AngleStep], ...], Field(min_length=1), Tag("[steps]")]
    | Annotated[Later[AngleTable], Tag("[table]")],
    Discriminator(lambda given: "[table]" if isinstance(given, dict | AngleTable) else "[steps]"),
]


class BreakerSection(Section):
    """The opening of the breaker of a unit on load: a load rejection, or a current interruption."""

    opens: Findable = Field(
        description="Time at which the stator current becomes zero, s; or {start: auto} to fit it "
        "between the two samples between which vt, or else another signal, jumps; or {start, min, "
        "max}."
    )
    speed: Literal["recorded", "simulated"] | None = Field(
        default=None,
        description="Speed that vt follows from then on. recorded: the channel speed of the "
        "record; simulated: that at constant mechanical power, valid for some 0.2 s; the channel "
        "is compared. Default: recorded where the record has the channel.",
    )


class BumpTest(Section):
    """The test: what was done to the unit."""

    vt0: Findable | None = Field(
        default=None,
        description="Terminal voltage before the first step, pu, or {start, min, max} to fit it; "
        "{start: auto} starts at the mean of the record there. Default: that mean, as if exact.",
    )
    begin: Number | None = Field(
        default=None,
        description="Time at which the simulation starts in steady state, s; default: the start of "
        "the record. Give an earlier time if steps were made before the record; vt0 is then the "
        "voltage from this time on.",
    )
    steady_until: Number | None = Field(
        default=None,
        description="End of the steady state in the record, s; default: the first step, or the "
        "first move of a recorded reference.",
    )
    frequency_offset: Findable | None = Field(
        default=None,
        description="Added to the frequency of the grid, less its mean at rest, Hz; or {start, "
        "min, max} to fit it; grid-playback only. Default: none.",
    )
    speed: Findable | None = Field(
        default=None,
        description="Speed at the start, pu, or {start, min, max}; open-circuit only.",
    )
    speed_change: Findable | None = Field(
        default=None,
        description="Its even change until the end of the record, pu, or {start, min, max}.",
    )
    vref: Reference = Field(
        default=(),
        description="The reference: steps and ramps in order of time; a table; a file; or "
        "recorded: the channel vref of the record.",
    )
    vs: Reference = Field(
        default=(),
        description="The signal at the stabiliser's input of the exciter, given like vref; in a "
        "playback the channel vs of the record drives it.",
    )
    pref: Reference = Field(
        default=(),
        description="The reference of the governor, given like vref: a power, or with TGOV1, "
        "HYGOV and GGOV1 a speed, the droop times a power.",
    )
    fs: Reference = Field(
        default=(),
        description="Added to the speed that the governor measures, pu, given like vref.",
    )
    E: tuple[Later[StepSection], ...] = Field(
        default=(),
        min_length=1,
        description="Steps of the voltage of the source; infinite-bus only.",
    )
    angle: SourceAngle = Field(
        default=(),
        description="The angle of the source: steps and ramps in order of time, or a table; "
        "infinite-bus only. Where a line trips it changes with E, R and X.",
    )
    network: tuple[Later[Switch], ...] = Field(
        default=(), min_length=1, description="Switchings of R, X and E, or a load."
    )
    fault: tuple[Later[FaultSection], ...] = Field(
        default=(),
        min_length=1,
        description="Faults at the terminals, each cleared before the next; infinite-bus only.",
    )
    breaker: Later[BreakerSection] | None = Field(
        default=None,
        description="The breaker opens; infinite-bus and machine-on-load only.",
    )
    duration: Positive | None = Field(
        default=None, description="Length of the simulation, s; only if there is no record."
    )

    def events(self, signal: str) -> tuple[FindableStep, ...]:
        """Return the steps and ramps of a reference in order of time; none of a recorded one."""
        given = self.reference(signal)
        if isinstance(given, ReferenceTable):
            return given.events
        return given if isinstance(given, tuple) else ()

    def reference(self, signal: str) -> Reference:
        """Give vref, vs, pref or fs as the case has it."""
        given: Reference = getattr(self, signal)
        return given

    @property
    def angle_steps(self) -> tuple[AngleStep, ...]:
        """The steps and ramps of the angle of the source in order of time."""
        return self.angle.events if isinstance(self.angle, AngleTable) else self.angle

    @property
    def tables(self) -> Mapping[str, Rows]:
        """The rows of its tables, by signal."""
        return {
            name: given.table
            for name in (*REFERENCES, "angle")
            if isinstance(given := getattr(self, name), ReferenceTable | AngleTable)
        }

    @property
    def files(self) -> tuple[str, ...]:
        """The files of its signals, as the case names them."""
        given = map(self.reference, REFERENCES)
        return tuple(reference.file for reference in given if isinstance(reference, ReferenceFile))

    @property
    def instants(self) -> tuple[float, ...]:
        """The times of all events that are given as numbers, s, in order."""
        events = (event for signal in REFERENCES for event in self.events(signal))
        instants = {start_value(event.at) for event in events}
        instants |= {event.at for event in self.E} | {switch.at for switch in self.network}
        instants |= {event.at for event in self.angle_steps}
        instants |= {at for fault in self.fault for at in (fault.at, fault.cleared)}
        if self.breaker is not None:
            instants.add(start_value(self.breaker.opens))
        return tuple(sorted(at for at in instants if at is not None))

    @property
    def steady(self) -> float | None:
        """The end of the steady state, s; None where the case does not give it."""
        if self.steady_until is not None:
            return self.steady_until
        return self.instants[0] if self.instants else None
