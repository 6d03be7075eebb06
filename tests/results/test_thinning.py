"""The samples of a file: as many digits as it prints."""

import numpy as np
import pytest

from exfit.results.thinning import rounded

RNG = np.random.default_rng(5)
SAMPLES = {
    "near one": RNG.standard_normal(20_000),
    "of every size": RNG.choice([-1.0, 1.0], 20_000) * 10.0 ** RNG.uniform(-320.0, 308.0, 20_000),
    "in the middle between two texts": np.round(RNG.standard_normal(20_000), 8) + 5e-9,
    "a clock": np.arange(20_000) * 1e-3,
    "special": np.array([0.0, -0.0, 1e3, 1e22, 1e23, 5e-324, 999999999.5, np.nan, np.inf, -np.inf]),
}


@pytest.mark.long
@pytest.mark.parametrize("digits", [3, 9, 12, 17])
@pytest.mark.parametrize("samples", SAMPLES.values(), ids=[*SAMPLES])
def test_a_rounded_sample_is_what_its_text_reads_back_as(samples, digits):
    texts = [float(f"{sample:.{digits}g}") for sample in samples]
    assert np.array_equal(rounded(samples, digits), texts, equal_nan=True)
    assert np.array_equal(np.signbit(rounded(samples, digits)), np.signbit(texts))
