"""The search for the causes of a misfit shows how far it is, and Ctrl-C in it keeps the fit."""

import json

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH

from exfit.output import live


@pytest.fixture
def late(empty_folder):
    """Return a case whose step is later than that of its record."""
    np.savetxt("bump.csv", np.column_stack([TIME, TRUTH]), delimiter=",", header="t,vt")
    content = FIRST_ORDER | {
        "test": {"vt0": 0.0, "vref": [{"at": 0.7, "step": 1.0}]},
        "record": {"file": "bump.csv", "time": "t", "channels": {"vt": "vt"}},
    }
    path = empty_folder / "late.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def test_a_pipe_has_a_line_where_the_causes_begin_and_one_where_they_end(run, late):
    lines = [line for line in run("fit", late, "--no-plots").out.splitlines() if "tried" in line]
    first, last = (line.split(", ")[0] for line in (lines[0], lines[-1]))
    total = last.split()[1]
    assert (first, last) == (f"causes: 0 of {total} tried", f"causes: {total} of {total} tried")


@pytest.mark.long
def test_ctrl_c_among_the_causes_keeps_the_fit_and_says_what_was_not_tried(run, late, monkeypatch):
    whole = run("fit", late, "--no-plots", "--json")

    class Interrupting(live.LiveIterations):
        def starts(self, progress):
            if progress.stage == "causes":
                raise KeyboardInterrupt

    monkeypatch.setattr(live, "LiveIterations", Interrupting)
    interrupted = run("fit", late, "--no-plots", "-o", "folder", "--verbose")
    assert (whole.code, interrupted.code) == (3, 3)
    assert "note: not tried as causes (interrupted): " in interrupted.out
    written = (late.parent / "folder" / "result.json").read_text(encoding="utf-8")
    kept, result = json.loads(whole.out), json.loads(written)
    assert result["interrupted"]
    assert result["verdict"]["verdict"] == kept["verdict"]["verdict"] == "misses the record"
    assert result["parameters"] == kept["parameters"]
