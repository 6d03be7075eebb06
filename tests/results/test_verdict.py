"""The verdict of a fit: what all tests of its residuals say together."""

import numpy as np
import pytest

from exfit.results.verdict import GOOD, REJECTED, ResidualTests, Verdict


@pytest.mark.parametrize("channels", [1, 4])
def test_noise_is_refuted_once_in_a_hundred_fits_however_many_tests_there_are(channels):
    """A share of 4,000 fits is known to 0.0016; four of it."""
    rng, fits = np.random.default_rng(5), 4_000
    refuted = 0
    for probabilities in rng.uniform(size=(fits, channels, 3)):
        tests = tuple(
            ResidualTests("event", f"signal{k}", *own, 1e-4, 1.0, 0.0, 0.0)
            for k, own in enumerate(probabilities.tolist())
        )
        refuted += bool(Verdict(GOOD, residuals=tests).refuted)
    assert refuted / fits == pytest.approx(REJECTED, abs=0.0063)


def test_residuals_far_from_noise_are_refuted_beside_any_number_of_others():
    noise = ResidualTests("event", "p", 0.5, 0.5, 0.5, 1e-4, 1.0, 0.0, 0.0)
    wrong = ResidualTests("event", "q", 1e-6, 0.5, 0.5, 1e-4, 1.0, 0.0, 0.0)
    assert Verdict(GOOD, residuals=(*[noise] * 50, wrong)).refuted == (wrong,)
