"""What drove the fit of a grid event, written as a play-in file and played back."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from grid_events import event_case, recorded
from places import ROOT

CORNERS = 0.02  # of what a signal moves: at the angle's corners, where its frequency jumps, 0.006


@pytest.fixture
def event(empty_folder):
    """Return the columns of the record of an event, and its case."""
    columns = recorded(Path("a.csv"))
    return columns, event_case(Path(), "a")


def simulated(run, content, name):
    Path(f"{name}.yaml").write_text(yaml.safe_dump(content))
    code, _, err = run("simulate", f"{name}.yaml", "-o", name, "--no-plots")
    assert (code, err) == (0, ""), err
    return np.genfromtxt(Path(name, "response.csv"), delimiter=",", names=True)


@pytest.mark.long
def test_a_play_in_file_drives_what_its_record_drove(run, event):
    """The frequency is the angle's slope, and is integrated again."""
    _, case = event
    assert run("fit", case, "-o", "run", "--no-plots", "-q")[0] == 0
    code, out, _ = run("export", "run", "--plb", "event.plb")
    assert code == 0
    assert "PLBVFU1" in out
    content = yaml.safe_load(case.read_text())
    truth = {name: 60.0 if name == "K" else 0.08 for name in content["parameters"].pop("free")}
    content["parameters"]["fixed"] |= truth
    content["plant"]["network"] |= {"P": 0.8, "Q": 0.1}
    of_record = simulated(run, content, "of_record")
    channels = {"vt": "vt", "frequency": "frequency"}
    content["record"] = {"file": "event.plb", "time": "t", "channels": channels}
    of_file = simulated(run, content, "of_file")
    for signal in ("p", "q", "efd"):
        difference = np.abs(of_file[signal] - of_record[signal])
        assert difference.max() < CORNERS * np.ptp(of_record[signal]), signal
        assert difference[-1] < 1e-5, signal


def test_a_play_in_file_is_inspected_as_one_and_makes_no_new_case(run, empty_folder):
    times = (number / 60.0 for number in range(300))
    rows = (f"{t:.4f}, {1.0 - 0.02 * (t > 2.0):.4f}, {60.0 - 0.1 * (t > 2.0):.4f}" for t in times)
    Path("event.plb").write_text("\n".join(rows))
    code, out, _ = run("inspect", "event.plb", "--no-plots")
    assert code == 0
    assert "a play-in file holds what drives a unit" in out
    assert "type: grid-playback" in out
    assert "frequency: {column: frequency, unit: Hz}" in out
    assert "vref" not in out
    code, _, err = run("new", "--model", "SEXS", "--record", "event.plb", "-o", "case.yaml")
    assert code == 1
    assert "a play-in file has no P and Q to fit" in err


@pytest.mark.long
def test_a_file_of_another_name_and_other_options_are_refused(run, event):
    _, case = event
    assert run("fit", case, "-o", "run", "--no-plots", "-q")[0] == 0
    code, _, err = run("export", "run", "--plb", "event.csv")
    assert (code, "event.csv: the name of a play-in file ends with .plb" in err) == (1, True)
    code, _, err = run("export", "run", "--plb", "event.plb", "-o", "x.dyr")
    assert (code, "--plb: only --force is allowed with it" in err) == (2, True)
    Path("event.plb").write_text("")
    assert run("export", "run", "--plb", "event.plb")[0] == 1


@pytest.mark.long
def test_a_fit_of_a_bump_test_was_driven_by_no_event(run, empty_folder):
    case = yaml.safe_load((ROOT / "configs" / "ac1a_typical.yaml").read_text())
    case["record"]["file"] = str(ROOT / "sample_data" / "ac1a_up.csv")
    case |= {"validate": [], "estimate": {"search": "local", "iterations": 1}}
    Path("bump.yaml").write_text(yaml.safe_dump(case))
    run("fit", "bump.yaml", "-o", "bump", "--no-plots", "-q")
    code, _, err = run("export", "bump", "--plb", "event.plb")
    assert code == 1
    assert "plant open-circuit is not driven by a grid event" in err
