"""The coarse form of residuals: a grid of longer steps, whose minimum is the same for a search."""

import numpy as np
import pytest
from places import ROOT
from records import case_of, config

from exfit.case.case import Case
from exfit.fitting.further_starts import COARSENESS, coarse_form, linear_form
from exfit.fitting.search import fitted

KNOWN = {
    "ac1a_typical": {
        "KA": 332.83, "KF": 0.0444, "TE": 1.5238, "TF": 1.5754, "TA": 0.0545, "KC": 0.5111,
        "KD": 0.2477,
    },
    "ac1a_ramp": {},
}  # fmt: skip
MOST_MOVED = 0.25  # standard errors: the case with the ramp has 0.19


def residuals(name):
    content = {**config(name), "simulation": {"step": 0.001}}
    _, problem = fitted(Case.from_dict(content, folder=ROOT / "configs"))
    return problem.residuals


def gauss_newton_step(given, x):
    """Return the step that leads from x to the minimum of the linear model there."""
    return -np.linalg.lstsq(given.exact(x), given(x), rcond=None)[0]


@pytest.mark.parametrize("name", KNOWN)
def test_its_minimum_is_a_fraction_of_a_standard_error_away(name):
    whole = residuals(name)
    x = np.array([free.scaled(KNOWN[name].get(free.name, free.start)) for free in whole.free])
    coarse = coarse_form(whole)
    errors = whole(x)
    noise = np.sqrt(errors @ errors / (len(errors) - len(x)))
    apart = gauss_newton_step(coarse, x) - gauss_newton_step(whole, x)
    assert 0.0 < np.linalg.norm(whole.exact(x) @ apart) < MOST_MOVED * noise


def test_the_rule_of_sub_steps_holds_on_it(tmp_path):
    content = config("ac1a_typical")
    content["parameters"]["free"]["TA"] = {"start": 0.0012, "min": 0.001, "max": 0.2}
    _, problem = fitted(case_of(content, tmp_path))
    for form in (coarse_form(problem.residuals), linear_form(coarse_form(problem.residuals))):
        (experiment,) = form.experiments
        values = experiment.parameters(form.values(form.start))
        assert experiment.simulator.step == COARSENESS * 0.001
        assert experiment.simulator.substeps(values) >= COARSENESS * 0.001 / 0.0012
        assert np.isfinite(form(form.start)).all()
