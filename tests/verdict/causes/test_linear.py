"""What a disturbance would explain, by linear theory."""

import numpy as np
import pytest

from exfit.verdict.causes.trials import LinearFit

RNG = np.random.default_rng(8)
BASIS, _ = np.linalg.qr(RNG.standard_normal((200, 3)))
COLUMNS = RNG.standard_normal((200, 2))


def test_errors_of_columns_and_parameters_are_explained_by_both():
    errors = BASIS @ [1.0, -2.0, 0.5] - COLUMNS @ [0.3, 0.7]
    explained = LinearFit(errors, BASIS).with_columns(COLUMNS)
    assert explained.cost == pytest.approx(0.0, abs=1e-20)
    assert explained.coefficients == pytest.approx([0.3, 0.7], abs=1e-12)


def test_a_column_that_the_parameters_can_move_explains_nothing_more():
    errors = RNG.standard_normal(200)
    linear = LinearFit(errors, BASIS)
    left = errors - BASIS @ (BASIS.T @ errors)
    own = linear.with_columns(BASIS[:, :1] + 1e-12 * COLUMNS[:, :1]).cost
    assert own == pytest.approx(0.5 * float(left @ left), rel=1e-2)
