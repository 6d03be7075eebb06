"""Steps that are chosen by their accuracy err by less, whatever limits a response meets."""

import sys

import numpy as np
import pytest
from places import ROOT
from step_scenarios import KINDS, models_of, scenarios
from tiers import few_of

sys.path.append(str(ROOT / "tests" / "studies"))

from located_steps import ACCURACY, chosen, error_of

# a third of them: the study has all
EVERY = [(kind, model) for kind in KINDS for model in models_of(kind)][::3]


@pytest.mark.parametrize(("kind", "model"), few_of(EVERY, 12))
def test_the_step_that_an_accuracy_chooses_keeps_it_where_limits_are_met(kind, model):
    wide, *_, narrowed = scenarios(model, kind)
    for scenario in (wide, narrowed):
        error, step, _ = error_of(scenario)
        assert error <= ACCURACY, f"{scenario.name} at {step:g} s"


@pytest.mark.parametrize(("kind", "model"), few_of(EVERY, 6))
def test_a_smaller_accuracy_never_takes_a_longer_step(kind, model):
    scenario = scenarios(model, kind)[-1]
    steps = [chosen(scenario, accuracy).step for accuracy in (1e-5, 1e-6, 1e-8)]
    assert steps == sorted(steps, reverse=True)
    assert np.isfinite(steps).all()
