"""Tails and quantiles against SciPy's."""

import numpy as np
import pytest
from scipy import special

from exfit.inference.quantiles import chi_square_tail, student_quantile

ROUNDING = 1e-12  # of either library; 2e-13 was the largest difference


@pytest.mark.parametrize("dof", range(1, 25))
def test_the_tail_of_chi_square_is_scipys(dof):
    statistics = np.geomspace(1e-6, 1200.0, 60)
    tails = [chi_square_tail(statistic, dof) for statistic in statistics]
    assert tails == pytest.approx(special.chdtrc(dof, statistics), rel=ROUNDING, abs=1e-300)


@pytest.mark.parametrize("dof", [1, 1.3, 2, 3.5, 10, 30.7, 99.9, 100, 101, 999.3, 1e6, 1e9, np.inf])
def test_the_quantile_of_students_t_is_scipys(dof):
    probabilities = (0.55, 0.9, 0.975, 0.995)
    quantiles = [student_quantile(dof, probability) for probability in probabilities]
    assert quantiles == pytest.approx(special.stdtrit(dof, probabilities), rel=ROUNDING)
