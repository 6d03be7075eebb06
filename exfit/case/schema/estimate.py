"""The sections of the case file about the fit: its parameters, its search, its simulation."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag

from exfit.case.schema.values import (
    STATED,
    STD_ERRORS,
    USABLE,
    Count,
    Finite,
    FreeSection,
    Frozen,
    Given,
    Later,
    NotNegative,
    Positive,
    Section,
    Sources,
    StdErrors,
    Step,
    nothing,
    section_or_number,
)
from exfit.util.vocabulary import (
    DEFAULT_SEARCH,
    DEFAULT_STRATEGY,
    EXPLAINED,
    SEARCHES,
    SEARCHES_EXPLAINED,
    STRATEGIES,
)

if TYPE_CHECKING:
    Strategy = str
    SearchKind = str
else:
    Strategy = Literal[tuple(STRATEGIES)]
    SearchKind = Literal[tuple(SEARCHES)]

MOST_ITERATIONS = 100  # of a phase, by default
MOST_DIFFERENCE = 0.1  # a tenth of a parameter: beyond it no difference is a derivative
FURTHER_STARTS = 8  # of these two thirds by way of the linear phase
MOST_STARTS = 1_000_000  # a day of simulations; their points alone fill 100 MB


class Parameters(Section):
    """The parameters of the exciter; one that is neither fixed nor free has its typical value."""

    fixed: Frozen[Given] = Field(
        default_factory=nothing,
        description="Values that are fixed or tied to others: numbers or formulas such as =-VAMAX.",
    )
    free: Frozen[Later[FreeSection]] = Field(
        default_factory=nothing, description="Parameters that are fitted."
    )
    sources: Sources = STATED
    std_errors: StdErrors = STD_ERRORS


class Tolerance(Section):
    """Limits at which the search has converged."""

    gradient: NotNegative = Field(
        default=1e-8, description="Limit on the norm of the gradient, relative to its first one."
    )
    gradient_absolute: NotNegative | None = Field(
        default=None,
        description="Ends the search where the norm of the gradient is below gradient times its "
        "first one plus this value, even if a step still promises a lower cost; default: not used.",
    )
    step: NotNegative = Field(default=1e-10, description="Limit on the relative step.")


class Limit(Section):
    """A limit on the difference between simulated and measured signals."""

    rmse: Positive = Field(description="Root mean square error, pu.")


class DgnSection(Section):
    """Settings of damped Gauss-Newton."""

    step: Literal["capped", "full"] = Field(
        default="capped",
        description="First trial: the best step within a trust region that limits the change of "
        "each parameter, or the full Gauss-Newton step.",
    )
    cut: Literal["parabola", "half"] = Field(
        default="parabola",
        description="How a step that fails Armijo's rule is shortened: to the minimum of a "
        "parabola, 0.2 to 0.5 of it, or to its half.",
    )


class LmSection(Section):
    """Settings of Levenberg-Marquardt."""

    update: Literal["radius", "ratio", "armijo"] = Field(
        default="radius",
        description="What the damping follows: the radius of a trust region, or, as in textbooks, "
        "the ratio of achieved to promised decrease; or, with armijo, the norm of the gradient, "
        "and steps are cut in half until Armijo's rule holds.",
    )
    nu_min: Positive = Field(
        default=1e-3,
        description="Least damping after an increase; a lower one counts as 0. update: ratio only.",
    )


class Iterations(Section):
    """Largest number of iterations in each phase."""

    gn: Count = Field(default=MOST_ITERATIONS, description="Gauss-Newton.")
    dgn: Count = Field(default=MOST_ITERATIONS, description="Damped Gauss-Newton.")
    lm: Count = Field(default=MOST_ITERATIONS, description="Levenberg-Marquardt.")


IterationLimit = Annotated[
    Annotated[Count, Tag("[number]")] | Annotated[Later[Iterations], Tag("[section]")],
    Discriminator(section_or_number),
]


class Estimate(Section):
    """How the free parameters are estimated."""

    strategy: Strategy = Field(
        default=DEFAULT_STRATEGY,
        description=f"Method of the run from the start of the case. {EXPLAINED}.",
    )
    jacobian: Literal["exact", "central", "forward", "backward"] = Field(
        default="exact", description="Derivatives: exact, or by differences."
    )
    difference_step: Annotated[Finite, Field(gt=0, le=MOST_DIFFERENCE), USABLE] | None = Field(
        default=None,
        description="Step h of the differences, in scaled parameters: on the log scale a share of "
        "the parameter, on the linear scale of the width of its bounds; default: 6.1e-6, and "
        "1.5e-8 for forward and backward.",
    )
    differences: Literal["absolute", "relative"] = Field(
        default="absolute",
        description="Whether h is the step itself or, on any scale, a share of the parameter's "
        "value; where that is 0, h is the step.",
    )
    iterations: IterationLimit = Field(
        default=MOST_ITERATIONS,
        description="Largest number of iterations in each phase of the strategy: one number, or "
        "one for each phase, such as {lm: 20, dgn: 20}. More than 100 raise the budget of profiles "
        "in proportion.",
    )
    tolerance: Later[Tolerance] = Field(
        default_factory=Tolerance, description="Limits at which the search has converged."
    )
    stop: Later[Limit] | None = Field(
        default=None,
        description="Ends the search, even before a minimum, where the weighted error of no "
        "channel of any record exceeds this; the weight of vt is 1. Default: never.",
    )
    armijo: Annotated[Finite, Field(gt=0, lt=0.5), USABLE] = Field(
        default=1e-4,
        description="Share of the promised decrease of the cost that a trial must achieve: "
        "Armijo's constant of dgn; lm uses it, too, unless with update: ratio.",
    )
    dgn: Later[DgnSection] = Field(
        default_factory=DgnSection, description="Settings of damped Gauss-Newton."
    )
    lm: Later[LmSection] = Field(
        default_factory=LmSection, description="Settings of Levenberg-Marquardt."
    )
    good_enough: Later[Limit] | None = Field(
        default=None,
        description="Error below which strategy auto accepts a match. Default: as long as the "
        "residuals are white and no larger than the noise of the record.",
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
    weights: Literal["given", "balanced"] = Field(
        default="given",
        description="Weights of the channels: those given with them; or balanced, the inverse of "
        "the scatter of each channel's residuals, by repeated weighting and fitting.",
    )
    search: SearchKind = Field(
        default=DEFAULT_SEARCH, description=f"Extent of the search. {SEARCHES_EXPLAINED}."
    )
    starts: Annotated[Count, Field(le=MOST_STARTS)] = Field(
        default=FURTHER_STARTS,
        description="Number of further starts of the global search.",
    )
    causes: NotNegative | None = Field(
        default=None,
        description="Limit of processor time, s, for the search for causes of a misfit. Default: "
        "30, or the time of the fit if that is more.",
    )

    @property
    def most_iterations(self) -> int | Mapping[str, int]:
        """The largest number of iterations in each phase: one for all, or by phase."""
        limit = self.iterations
        return limit if isinstance(limit, int) else limit.model_dump(exclude_unset=True)

    def to_the_minimum(self) -> Self:
        """Return the same settings, under which no search ends before it reaches a minimum."""
        tolerance = self.tolerance.model_copy(update={"gradient_absolute": None})
        return self.model_copy(update={"stop": None, "tolerance": tolerance})


class SimulationSection(Section):
    """The grid of the simulation."""

    step: Step = Field(
        default="auto",
        description="Step of the integration by Runge-Kutta, s; auto: one by which the compared "
        "signals are accurate enough, with crossings of limits located.",
    )
    accuracy: float = Field(
        default=1e-6,
        ge=1e-9,
        le=1e-3,
        description="Largest error of the compared signals by the steps, pu, where step is auto; "
        "others may err more, such as efd (1.4e-4) where a limiter takes over and vt is compared.",
    )
    output_step: Positive = Field(
        default=0.005, description="Spacing of the output if there is no record, s."
    )
    memory: Positive = Field(
        default=2.0,
        description="Memory that a command may take for simulations, GB; it is worked out before "
        "them.",
    )
