"""The report of a unit that was verified from a grid event, as its reviewer reads it."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from grid_events import event_case, recorded
from pages import Page

from exfit.features.report.behaviour import usability
from exfit.features.report.page import html
from exfit.output.terminal import GuardedConsole, show
from exfit.output.validations import comparisons
from exfit.results.io import load_result, result_text
from exfit.simulation.small_signal import Pole
from exfit.workflows import fit

# of all machine data, so that no typical value is looked into
REST_OF_MACHINE = {"Tpq0": 0.5, "D": 0.0, "Xd": 1.8, "Xq": 1.7, "Xpd": 0.3, "Xpq": 0.55}
MASK = [[9.0, 9.5]]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """Fit one event, and validate on another one."""
    folder = tmp_path_factory.mktemp("event")
    recorded(folder / "trip.csv", noise=1e-4)
    recorded(folder / "night.csv", noise=1e-4, seed=2, P=0.5, Q=-0.1, vt0=1.02)
    path = event_case(folder, "trip", validate=["night"], about={"Recorder": "PMU, 230 kV side"})
    content = yaml.safe_load(path.read_text())
    content["plant"]["parameters"] |= {**REST_OF_MACHINE, "Xppd": 0.25}
    content["record"]["mask"] = MASK
    content["record"]["channels"]["q"] = {"column": "q", "filter": {"lowpass": 8}}
    del content["parameters"]["free"]["TE"]
    content["parameters"]["fixed"]["TE"] = 0.06
    path.write_text(yaml.safe_dump(content))
    return fit(path)


@pytest.fixture(scope="module")
def page(result, tmp_path_factory):
    return Page(html(result, tmp_path_factory.mktemp("page")))


def test_the_form_says_which_disturbances_were_played_in_and_how_large_they_were(page):
    form = page.tables["What a verification report states (cf.: clauses of NERC MOD-026-1)"]
    rows = {row[1]: row[2] for row in form[1:]}
    text = rows["Model response beside a recorded response"]
    assert "measured system disturbances, played in: fit, night" in text
    assert rows["Turbine governor and load control"].startswith("none in the model")
    assert rows["Recorded disturbances, from rest"].startswith("fit: vt ")
    assert "Hz at 2.8" in rows["Recorded disturbances, from rest"]
    assert rows["Recorder"] == "PMU, 230 kV side"


def test_unit_and_test_say_from_which_rest_and_what_is_left_out(page):
    (_, fitted, validated) = page.tables["Tests and their records"]
    done = fitted[4]
    assert done.startswith("recorded vt and angle played in; at rest until 2 s with vt 1 pu, p 0.8")
    assert "equations of PSS/E: Pm is a power" in done
    assert "left out of the comparison: 9 ... 9.5 s" in done
    assert done.endswith("q below 8 Hz")
    assert "p 0.5 pu, q -0.1 pu" in validated[4]


def test_p_and_q_are_judged_and_shown_below_what_was_played_in(page):
    labels = [row[2] for row in page.tables["Criteria: simulated minus recorded"][1:]]
    assert labels == ["rms of the difference, p", "rms of the difference, q"] * 2
    for name in ("fit", "night"):
        title = f"Simulated minus recorded, and the largest departures of both from rest: {name}"
        assert [row[0] for row in page.tables[title][1:]] == ["vt", "frequency", "p", "q"]
    assert {"played-0", "played-1"} <= set(page.ids)
    assert "in p, in q by the same rule" in page.text
    assert page.text.count("simulated, not compared") == 1  # of the record with a mask


def test_there_is_no_word_of_steps_or_of_a_closed_loop(page):
    assert "Features of the first step" not in page.text
    assert "step features" not in page.text.lower()
    assert "closed loop" not in page.text.lower()


def test_what_was_played_in_is_kept_in_the_file_of_the_fit(result, tmp_path):
    (tmp_path / "result.json").write_text(result_text(result))
    saved = load_result(tmp_path)
    for before, after in zip(result.comparisons, saved.comparisons, strict=True):
        assert after.played.begins == before.played.begins
        assert after.played.errors == before.played.errors
        assert after.played.left_out.keys() == {"p", "q"}
        for name, signal in before.played.driving.items():
            np.testing.assert_allclose(
                after.played.driving[name].samples, signal.samples, rtol=1e-8, atol=1e-12
            )


def test_the_terminal_has_room_for_the_errors_of_events(result, capsys):
    """80 columns, without a line that is broken."""
    matches = [*result.comparisons, *result.validation]
    show(GuardedConsole(width=80), comparisons(matches))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    (heads,) = [line for line in lines if line.startswith("record")]
    assert heads.split()[:3] == ["record", "signal", "rms"]
    rows = lines[lines.index(heads) + 1 :]
    assert [row.split()[:2] for row in rows if row] == [
        ["fit", "p"], ["fit", "q"], ["night", "p"], ["night", "q"]
    ]  # fmt: skip


def test_what_integrates_a_recorded_voltage_is_no_mode_that_fails_to_decay(result):
    """The integrator of a PID regulator: its loop is open while the record drives."""
    (of_tests, *_) = result.behaviour.small_signal
    for value, passed in ((0.0, True), (0.01, False)):
        pole = Pole(complex(value), -float(value > 0.0), 0.0, ("VI",))
        view = of_tests.view._replace(poles=(pole, *of_tests.view.poles))
        behaviour = result.behaviour._replace(small_signal=(of_tests._replace(view=view),))
        damping = usability(replace(result, behaviour=behaviour))[2]
        assert damping.passed is passed
