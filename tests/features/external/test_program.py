"""Runs of another program: what is an answer, what is remembered."""

import sys
from contextlib import closing

import pytest

from exfit.features.external.program import ExternalProgram, run_of

REQUEST = {"values": {"K": 2.0}, "steps": [], "times": [0.0, 1.0], "signals": ["vt"]}
CODE = """
import json, sys
with open('runs', 'a') as runs:
    for line in sys.stdin:
        asked = json.loads(line)
        runs.write('.'); runs.flush()
        vt = [asked['values']['K'] * at for at in asked['times']]
        print(json.dumps({'id': asked['id'], 'signals': {'vt': vt}}), flush=True)
"""


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ({"error": "no convergence"}, "it reports: no convergence"),
        ({}, "the answer has neither signals nor error"),
        ({"signals": {"efd": [1.0, 1.0]}}, "signals.vt: missing in the answer"),
        ({"signals": {"vt": [1.0]}}, "signals.vt: 1 samples, not 2"),
        ({"signals": {"vt": [1.0, float("nan")]}}, "signals.vt: 1 of 2 samples are not finite"),
        ({"signals": {"vt": "high"}}, "signals.vt: 'high' is not a list"),
    ],
)
def test_an_answer_that_is_no_run_has_a_reason(answer, reason):
    assert run_of(answer, ["vt"], 2).failure == reason


def test_no_run_is_asked_for_twice(tmp_path):
    requests = [{**REQUEST, "values": {"K": float(k)}} for k in (1, 2, 3)]
    with closing(ExternalProgram([sys.executable, "-c", CODE], tmp_path, 2, 20.0)) as program:
        first = program.runs(requests)
        again = program.runs([*reversed(requests), requests[0]])
        assert [run.signals["vt"][1] for run in first] == [1.0, 2.0, 3.0]
        assert [run.signals["vt"][1] for run in again] == [3.0, 2.0, 1.0, 1.0]
        assert program.counts == (3, 0, 0)
    assert (tmp_path / "runs").read_text() == "..."


FAILING = """
import json, sys
for number, line in enumerate(sys.stdin, 1):
    asked = json.loads(line)
    fails = asked['values']['K'] == 1.0 or number == 2
    signals = {'signals': {'vt': asked['times']}}
    print(json.dumps({'id': asked['id'], **({'error': 'none'} if fails else signals)}), flush=True)
"""


def test_a_run_that_fails_is_made_once_again(tmp_path):
    requests = [{**REQUEST, "values": {"K": k}} for k in (3.0, 2.0, 1.0)]
    with closing(ExternalProgram([sys.executable, "-c", FAILING], tmp_path, 1, 20.0)) as program:
        for _ in range(2):
            runs = program.runs(requests)
            assert [run.failure for run in runs] == ["", "", "it reports: none"]
            assert program.counts == (5, 3, 0)
