"""What the estimator returns: why it stopped, each iteration, the result."""

from dataclasses import dataclass
from enum import Enum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from exfit.estimate.problem import Array


class Stop(Enum):
    """Why an estimation ended."""

    GRADIENT = "the gradient vanished"
    FLOOR = "the cost is at its floor: neither the linear model nor a trial finds a lower one"
    STEP = "the Gauss-Newton step fell below the tolerance"
    KINK = (
        "no trial lowers the cost, which has a kink here: the linear model sees nothing beyond it"
    )
    CREEPING = "ten iterations, all with rejected trials, gained less than a millionth of the cost"
    UNCONFIRMED = "the lowest minimum is in doubt, and no other start led to it"
    ITERATIONS = "the iteration limit was reached"
    EVALUATIONS = "the limit of evaluations was reached"
    INTERRUPTED = "interrupted: this is the best point seen until then"
    JACOBIAN = "the Jacobian is not finite here"
    STALLED = "no trial lowers the cost visibly, although the linear model promises a lower one"
    FULL_STEP = (
        "the full Gauss-Newton step did not lower the cost: "
        "strategy dgn shortens such steps, lm-then-dgn finds a better start first"
    )
    ILL_CONDITIONED = (
        "the Jacobian is too ill-conditioned for full Gauss-Newton steps: "
        "use strategy dgn or lm-then-dgn"
    )
    LOST = (
        "the search ran off to where the residuals depend no longer on one of the variables: "
        "set bounds or x_scale, or begin elsewhere"
    )
    MATCH = "the curves differ by less than the tolerance given: the search went no farther"
    FLAT = "the gradient fell below the tolerance given: the search went no farther"
    TRUSTED = "a full Gauss-Newton step fits the trust region and proved good"  # only inside


STATUS = {
    Stop.GRADIENT: 1,
    Stop.FLOOR: 2,
    Stop.STEP: 3,
    Stop.KINK: 4,
    Stop.CREEPING: 5,
    Stop.MATCH: 6,
    Stop.FLAT: 7,
    Stop.ITERATIONS: 0,
    Stop.EVALUATIONS: -9,
    Stop.INTERRUPTED: -1,
    Stop.JACOBIAN: -2,
    Stop.STALLED: -3,
    Stop.FULL_STEP: -4,
    Stop.ILL_CONDITIONED: -5,
    Stop.TRUSTED: -6,
    Stop.UNCONFIRMED: -7,
    Stop.LOST: -8,
}


@dataclass(frozen=True)
class SolverIteration:
    """One line of the log, announced when the iteration is over.

    number         0 is the start; counts on through the phases, and once where one restarts
    phase          "gn", "dgn" or "lm"
    x              where the iteration ended, shape (N,)
    cost           1/2 sum(fun(x)^2)
    gradient_norm  Euclidean norm of the projected gradient at x
    step_norm      Euclidean norm of the step that led there, 0 if none was accepted
    damping        gn: 1; dgn: the step length lambda; lm: nu; nan at a start
    inner          trials rejected before: reductions of lambda, shrinkings of the trust region
    nfev, njev     calls of fun (those for differences included) and Jacobians, until now
    quality        gain ratio: decrease of the cost over the decrease that the model promised
    capped         whether the step that was tried first was held back: dgn by its cap, lm by its
                   damping; it was then not the full Gauss-Newton step; None at a start
    """

    number: int
    phase: str
    x: Array
    cost: float
    gradient_norm: float
    step_norm: float
    damping: float
    inner: int
    nfev: int
    njev: int
    quality: float
    capped: bool | None = None


@dataclass(frozen=True)
class Result:
    """The best point seen and how it was reached; fun (M,), jac (M, N), grad (N,) belong to x.

    status: 1 gradient, 2 floor, 3 step, 4 kink, 5 creeping (converged); 6 match, 7 flat (ended at
    a tolerance given, perhaps before a minimum); 0 iteration limit; -1 interrupted, -2 Jacobian not
    finite, -3 stalled, -4 full step failed, -5 ill-conditioned, -7 unconfirmed, -8 lost, -9
    evaluation limit (not converged). message is the sentence, stop the member of Stop. optimality
    is the largest component of the projected gradient; promise is the decrease of the cost that the
    linear model at x still promises; active_mask is -1 for a variable at its lower bound, 1 at its
    upper one, else 0. After an interruption jac, grad and promise may be nan.
    """

    x: Array
    cost: float
    fun: Array
    jac: Array
    grad: Array
    optimality: float
    promise: float
    nfev: int
    njev: int
    nit: int
    status: int
    message: str
    success: bool
    history: tuple[SolverIteration, ...]
    stop: Stop
    active_mask: NDArray[np.int_]


@dataclass(frozen=True)
class Progress:
    """How far many searches are, side by side or in turn; ``best`` is the lowest cost so far."""

    stage: Literal["screening", "refining", "profiling", "weighing", "causes"]
    done: int
    total: int
    best: float
