"""The sections of the case file about the fit: its parameters, its search, its simulation."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from exfit.case.schema.values import (
    Count,
    FreeSection,
    Frozen,
    Given,
    NotNegative,
    Positive,
    Section,
    nothing,
)
from exfit.util.strategies import DEFAULT_STRATEGY, EXPLAINED, STRATEGIES

if TYPE_CHECKING:
    Strategy = str
else:
    Strategy = Literal[tuple(STRATEGIES)]

MOST_STARTS = 1_000_000  # a day of simulations; their points alone fill 100 MB


class Parameters(Section):
    """The parameters of the exciter; one that is neither fixed nor free has its typical value."""

    fixed: Frozen[Given] = Field(
        default_factory=nothing,
        description="Values that are fixed or tied to others: numbers or formulas such as =-VAMAX.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=nothing, description="Parameters that are fitted."
    )


class Tolerance(Section):
    """Limits at which the search has converged."""

    gradient: NotNegative = Field(default=1e-8, description="Limit on the scaled gradient.")
    step: NotNegative = Field(default=1e-10, description="Limit on the relative step.")


class Limit(Section):
    """A limit on the difference between simulated and measured signals."""

    rmse: Positive = Field(description="Root mean square error, pu.")


class Estimate(Section):
    """How the free parameters are estimated."""

    strategy: Strategy = Field(
        default=DEFAULT_STRATEGY, description=f"Method of the search. {EXPLAINED}."
    )
    jacobian: Literal["exact", "central", "forward", "backward"] = Field(
        default="exact", description="Derivatives: exact, or by differences."
    )
    iterations: Count = Field(
        default=100, description="Largest number of iterations in each phase of the strategy."
    )
    tolerance: Tolerance = Field(
        default_factory=Tolerance, description="Limits at which the search has converged."
    )
    good_enough: Limit = Field(
        default_factory=lambda: Limit(rmse=2e-4),
        description="Error below which strategy auto accepts a match; default: rmse 2e-4.",
    )
    loss: Literal["least-squares", "huber", "soft-l1"] = Field(
        default="least-squares",
        description="Cost of a residual; huber and soft-l1 tolerate spikes.",
    )
    loss_scale: Positive = Field(
        default=1.345,
        description="Size of a residual, in standard deviations of the noise, from which huber and "
        "soft-l1 count it less than its square.",
    )
    starts: Annotated[Count, Field(le=MOST_STARTS)] = Field(
        default=1,
        description="Number of starts, distributed over the bounds; the first is that of the case.",
    )
    refine: Count | None = Field(
        default=None, description="Number of the best starts that are fitted; default: all."
    )


class SimulationSection(Section):
    """The grid of the simulation."""

    step: Positive = Field(default=0.001, description="Step of the integration, s.")
    output_step: Positive = Field(
        default=0.005, description="Spacing of the output if there is no record, s."
    )
