"""Which causes are worth a line."""

from exfit.results.cause import Cause
from exfit.verdict.causes import FAR_LESS_LIKELY, Suspicion, likely
from exfit.verdict.causes.evidence import CERTAIN, LAST


def suspicions(*likelihoods):
    return [Suspicion(Cause(f"{number}", ""), at) for number, at in enumerate(likelihoods)]


def test_what_is_nearly_as_likely_as_the_first_stays():
    near = suspicions(100.0, 90.0, 100.0 - FAR_LESS_LIKELY)
    assert likely(near) == near


def test_of_what_is_far_less_likely_only_the_second_stays():
    far = suspicions(1000.0, 10.0, 5.0, 0.0)
    assert likely(far) == far[:2]
    near = suspicions(1000.0, 999.0, 5.0, 0.0)
    assert likely(near) == near[:2]


def test_what_needs_no_comparison_stays():
    certain = suspicions(CERTAIN, 1000.0, 10.0, 5.0, LAST)
    assert likely(certain) == [*certain[:3], certain[4]]
    assert likely(suspicions(CERTAIN, LAST)) == suspicions(CERTAIN, LAST)
    assert likely([]) == []
