"""What a case of a grid event has otherwise than the unit is the first cause of its misfit."""

import numpy as np
import pytest
from faulty_events import KINDS, NOISE, drawn
from grid_events import TRUTH
from tiers import examples_of, few_of

from exfit.case.load import load_case
from exfit.fitting.build import build_experiments
from exfit.workflows import fit


@pytest.mark.long
@pytest.mark.parametrize("kind", examples_of(KINDS, 4))
def test_what_the_unit_has_otherwise_is_the_first_cause(kind, tmp_path):
    verdict = fit(load_case(drawn(kind, 2, tmp_path).faulty), search="local").verdict
    assert verdict.verdict in ("misses the record", "no match")
    assert KINDS[kind][2] in verdict.causes[0].sentence


@pytest.mark.long
@pytest.mark.parametrize("kind", examples_of(KINDS, 4))
def test_a_unit_as_its_case_has_it_is_not_accused(kind, tmp_path):
    verdict = fit(load_case(drawn(kind, 2, tmp_path).sound), search="local").verdict
    assert verdict.verdict in ("good", "matches, not all determined")
    assert not [cause for cause in verdict.causes if "typical" not in cause.cause]


@pytest.mark.parametrize("kind", few_of(KINDS, 1))
def test_a_sound_record_without_noise_is_the_response_of_its_case(kind, monkeypatch, tmp_path):
    """To a twentieth of the noise: ten times less than corners between its samples would add."""
    noise = {**NOISE}
    for name in noise:
        monkeypatch.setitem(NOISE, name, 0.0)
    case = load_case(drawn(kind, 2, tmp_path).sound)
    (setup,) = build_experiments(case)
    samples, _ = setup.experiment.samples({**case.values(), **TRUTH})
    for simulated, name in zip(samples.T, setup.experiment.signals, strict=True):
        off = simulated - setup.record.signals[name]
        assert np.sqrt(np.mean(off**2)) < 0.05 * noise[name], name
