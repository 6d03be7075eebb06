"""A signal at any moment of a fit leaves the former result or the new one, whole."""

import os
import random
import signal

import pytest
from interrupted_runs import CASE, TEMPORARY, fit, fit_before, met_by

pytestmark = pytest.mark.long  # fits as processes, one after the other

RUNS = 1  # of each kind; tests/studies/interrupts.py does hundreds
SEED = 7


@pytest.fixture(scope="module")
def before(tmp_path_factory):
    """Return a folder with a former fit, and how long that took, s."""
    return fit_before(tmp_path_factory.mktemp("before"))


@pytest.mark.skipif(os.name == "nt", reason="sends a signal of POSIX")
@pytest.mark.parametrize("while_writing", [False, True])
def test_an_interruption_leaves_a_whole_result_and_no_temporary_file(
    before, tmp_path, while_writing
):
    folder, seconds = before
    rng = random.Random(SEED)
    for run in range(RUNS):
        moment = rng.uniform(0.0, 0.02 if while_writing else seconds)
        outcome = met_by(
            signal.SIGINT, moment, folder, tmp_path / str(run), while_writing=while_writing
        )
        assert outcome.result in ("old", "new"), outcome
        assert outcome.together, outcome
        assert outcome.temporary == 0, outcome


@pytest.mark.skipif(os.name == "nt", reason="sends a signal of POSIX")
@pytest.mark.parametrize("while_writing", [False, True])
def test_a_kill_leaves_a_whole_result_and_the_next_fit_removes_the_rest(
    before, tmp_path, while_writing
):
    folder, seconds = before
    rng = random.Random(SEED)
    for run in range(RUNS):
        moment = rng.uniform(0.0, 0.02 if while_writing else seconds)
        outcome = met_by(
            signal.SIGKILL, moment, folder, tmp_path / str(run), while_writing=while_writing
        )
        assert outcome.result in ("old", "new"), outcome
        if outcome.temporary:
            fit(CASE, tmp_path / str(run)).communicate()
            assert not any((tmp_path / str(run)).glob(TEMPORARY))
