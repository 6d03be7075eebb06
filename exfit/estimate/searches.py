"""The searches that the strategies are made of."""

from dataclasses import dataclass, field

from exfit.estimate.damping_armijo import ArmijoDamping
from exfit.estimate.damping_ratio import RatioDamping
from exfit.estimate.gauss_newton import FullStep, LineSearch
from exfit.estimate.trust_region import TrustRegion


@dataclass(frozen=True)
class Searches:
    """One search for each phase, with its settings."""

    gn: FullStep = field(default_factory=lambda: FullStep(retries=True))
    dgn: LineSearch = field(default_factory=LineSearch)
    lm: TrustRegion | RatioDamping | ArmijoDamping = field(default_factory=TrustRegion)


USUAL = Searches()
BENDING = Searches(lm=TrustRegion(bends=True))  # smooth residuals, of which nothing is known
