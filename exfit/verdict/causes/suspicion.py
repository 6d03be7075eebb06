"""How much a cause explains: the likelihood of the record with it, by which causes are ordered."""

from collections.abc import Callable, Iterator
from math import inf, log
from typing import NamedTuple

from exfit.results.verdict import Cause
from exfit.verdict.causes.evidence import Evidence

LEAST_GAIN = 10.0  # of the log-likelihood: chi-square 20, beyond what any of twenty trials gains
LEAST_SHARE = 0.25  # of the error beyond the noise: a cause that explains less is not named
TINY_COST = 1e-300  # a record without noise may be matched exactly


class Suspicion(NamedTuple):
    """A cause, and the logarithm of the likelihood of the record with it.

    It is that of white noise of unknown size, -M/2 log(cost), less log(M)/2 for each number that
    is found with it (Schwarz 1978).
    """

    cause: Cause
    likelihood: float


Recogniser = Callable[[Evidence], Iterator[Suspicion]]  # yields the causes of one kind

CERTAIN, LAST = inf, -inf  # likelihoods of what needs no comparison


def likelihood(evidence: Evidence, cost: float, numbers: int = 0) -> float:
    """Return the log-likelihood of the record at a cost, with so many more numbers found."""
    samples = max(1, evidence.residuals.samples)
    return -0.5 * samples * log(max(cost, TINY_COST)) - 0.5 * numbers * log(samples)


def suspected(
    evidence: Evidence, cost: float, numbers: int, cause: Cause, prior: float = 0.0
) -> Iterator[Suspicion]:
    """Yield a cause if the ``cost`` with it is so much lower that it is worth naming.

    ``prior`` is the logarithm of how much likelier it is than others, before any record.
    """
    gained = likelihood(evidence, cost, numbers) - likelihood(evidence, evidence.cost)
    share = (evidence.cost - cost) / max(evidence.cost - evidence.noise_cost, TINY_COST)
    beyond_noise = evidence.cost > evidence.noise_cost
    if gained > LEAST_GAIN and (share > LEAST_SHARE or not beyond_noise):
        yield Suspicion(cause, likelihood(evidence, cost, numbers) + prior)
