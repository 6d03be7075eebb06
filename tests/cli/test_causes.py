"""The search for the causes of a misfit shows how far it is, and Ctrl-C in it keeps the fit."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH

from exfit.features.report.form import command_of
from exfit.output import live
from exfit.results.io import load_result


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


def command_for(word, printed):
    """Return the printed command that applies a cause, as a shell takes it apart."""
    (command,) = re.findall(f"`exfit (fit late.yaml --apply {word}[^`]*)`", printed)
    return shlex.split(command)


@pytest.mark.parametrize("output", [(), ("-o", "first one")])
def test_the_command_of_a_cause_is_pasted_and_lowers_the_cost(run, late, output):
    text = late.read_text(encoding="utf-8") + "# the end\n"
    late.write_text(text, encoding="utf-8")
    first = run("fit", "late.yaml", "--no-plots", *output)
    pasted = command_for("delay", first.out)
    applied = run(*pasted, "--no-plots")
    assert (first.code, applied.code) == (3, 0)
    folder = Path(*output[1:]) if output else Path("runs") / "late-fit"
    other = Path("first one-delay") if output else Path("runs") / "late-delay-fit"
    before, after = load_result(folder), load_result(other)
    assert after.cost < 1e-3 * before.cost
    assert after.case == late.with_name("late-delay.yaml").relative_to(late.parent)
    written = after.case.read_text(encoding="utf-8")
    assert written.startswith(text[:20])
    assert written.endswith("# the end\n")
    assert late.read_text(encoding="utf-8") == text
    assert run(*pasted, "--no-plots").code == 0  # the same file again
    after.case.write_text("# mine\n", encoding="utf-8")
    assert "exists with another content" in run(*pasted).err
    late.write_text(f"# changed\n{text}", encoding="utf-8")
    assert "has changed since its fit" in run(*pasted).err


def test_a_cause_that_no_fit_has_named_is_refused(run, late):
    assert "runs/late-fit: not there: fit late.yaml first" in run(
        "fit", "late.yaml", "--apply", "1"
    ).err.replace("\\", "/")
    run("fit", "late.yaml", "--no-plots")
    refused = run("fit", "late.yaml", "--apply", "averages")
    assert refused.code == 1
    assert "--apply averages: is no cause that can be applied; there are 1 (" in refused.err
    assert run("fit", "late.yaml", "late.yaml", "--apply", "1").code == 2


def test_a_freed_value_is_fitted_and_the_report_repeats_it(run, late):
    content = yaml.safe_load(late.read_text(encoding="utf-8"))
    start = content["parameters"]["free"].pop("a")["start"]
    content["parameters"]["fixed"] = {"a": start}
    content["test"]["vref"][0]["at"] = 0.5
    late.write_text(yaml.safe_dump(content), encoding="utf-8")
    fixed = run("fit", "late.yaml", "--no-plots", "-o", "fixed")
    freed = run("fit", "late.yaml", "--no-plots", "-o", "freed", "--free", "a")
    assert freed.code == 0, fixed.out
    before, after = load_result("fixed"), load_result("freed")
    assert after.cost < before.cost
    assert (*after.parameters,) == (*before.parameters, "a")
    assert "the fit finds a, which the case gives, by --free" in after.notes
    assert command_of(after).endswith(" --free a")
