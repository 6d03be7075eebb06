"""What a page asks for: the same numbers as the commands, drafts that lose nothing, refusals."""

import json
import random
import shutil
from pathlib import Path

import numpy as np
import pytest
from page_messages import GOOD, mutant, odd, outcome
from places import ROOT

import exfit
from exfit.case.load import load_case
from exfit.errors import ExfitError
from exfit.features.app.messages import read_message
from exfit.features.app.session import Session
from exfit.util.interrupts import interrupted


@pytest.fixture
def case(empty_folder):
    shutil.copytree(ROOT / "configs", empty_folder / "configs")
    shutil.copytree(ROOT / "sample_data", empty_folder / "sample_data")
    return Path("configs/ac1a_good.yaml")


@pytest.fixture
def session(case):
    made = Session(case)
    made.read()
    yield made
    made.close()


def ask(session, **message):
    return session.answer(read_message(json.dumps(message)), lambda _: None)


def test_a_slider_shows_the_response_that_simulate_gives(session, case):
    values = {"KA": 777.0, "TE": 0.9}
    said = ask(session, do="try", values=values)
    simulated = exfit.simulate(case, values).comparison
    (signal,) = said["records"][0]["signals"]
    np.testing.assert_array_equal(signal["current"], simulated.overlays["vt"].simulated)
    assert said["cost"] == simulated.cost
    moving = ask(session, do="try", values=values, moving=True)
    (roughly,) = moving["records"][0]["signals"]
    np.testing.assert_allclose(roughly["current"], signal["current"], rtol=0.0, atol=1e-6)


def test_a_change_is_in_the_draft_with_its_comments_and_the_case_stays(session, case):
    before = case.read_text()
    said = ask(session, **GOOD["store"])
    draft = case.with_name(said["draft"])
    assert said["command"] == f"exfit fit {draft}"
    assert draft.read_text().splitlines()[0] == before.splitlines()[0]
    assert exfit.load_case(draft).values()["KA"] == 500.0
    assert case.read_text() == before
    ask(session, **GOOD["bound"])
    assert exfit.load_case(draft).free()["KA"].max == 900.0


def test_a_held_value_is_fixed_and_free_again_within_its_bounds(session, case):
    ask(session, **GOOD["lock"])
    assert "KC" not in session.case.free()
    assert session.case.values()["KC"] == 0.5
    ask(session, do="free", name="KC")
    free = session.case.free()["KC"]
    assert (free.start, free.min, free.max) == (0.5, 0.0486, 4.86)


def test_the_draft_is_what_the_next_page_begins_with_until_it_is_saved(session, case):
    text = ask(session, **GOOD["store"]) and session.draft.read_text()
    other = Session(case)
    assert other.read()["draft"] == session.draft.name
    other.close()
    ask(session, do="save case")
    assert case.read_text() == text
    assert not session.draft.exists()


def test_a_discarded_draft_leaves_the_case(session, case):
    before = case.read_text()
    ask(session, **GOOD["store"])
    assert ask(session, do="discard")["draft"] is False
    assert (case.read_text(), session.draft.exists()) == (before, False)


@pytest.mark.parametrize("file", ["case", "draft"])
def test_what_another_page_or_an_editor_has_changed_is_not_written_over(session, case, file):
    ask(session, **GOOD["store"])
    path = case if file == "case" else session.draft
    path.write_text(path.read_text() + "# mine\n")
    for name in ("store", "lock", "save"):
        with pytest.raises(ExfitError, match="was changed by another page or program"):
            ask(session, **GOOD[name])
    assert path.read_text().endswith("# mine\n")
    ask(session, do="open")
    ask(session, **GOOD["store"])


def test_no_draft_is_written_through_a_link(session, empty_folder):
    outside = empty_folder / "outside.yaml"
    outside.write_text("mine")
    session.draft.symlink_to(outside)
    with pytest.raises(ExfitError):
        ask(session, do="open") and ask(session, **GOOD["store"])
    assert outside.read_text() == "mine"


@pytest.mark.parametrize(
    "message",
    [
        {"do": "try", "values": {"KX": 1.0}},
        {"do": "store", "values": {"KA": 1e9}},
        {"do": "bound", "name": "KA", "low": 900.0, "high": 10.0},
        {"do": "free", "name": "KA"},
        {"do": "free", "name": "nothing"},
        {"do": "lock", "name": "VRMAX", "value": 1.0},
        {"do": "save result"},
        {"do": "apply", "cause": 1},
    ],
)
def test_what_cannot_be_is_refused_and_leaves_no_file(session, case, message):
    files = {*Path().rglob("*")}
    with pytest.raises(ExfitError):
        ask(session, **message)
    assert {*Path().rglob("*")} == files


def test_a_fit_shows_its_iterations_and_gives_what_the_command_gives(session, case):
    seen = []
    said = session.answer(read_message('{"do": "fit"}'), seen.append)
    result = exfit.fit(case)
    assert session.view.result.parameters == result.parameters
    assert said["verdict"] == result.verdict.verdict
    numbers = [each["number"] for each in seen if each["of"] == "iteration"]
    assert numbers == [line.number for line in result.history]
    written = ask(session, do="save result")
    assert json.loads((Path(written["words"]) / "result.json").read_text())["cost"] == result.cost


def test_a_fit_that_is_stopped_keeps_its_best_point(session):
    def stop(said):
        if said["of"] == "iteration" and said["number"] == 3:
            session.answer(read_message('{"do": "stop"}'), stop)

    session.answer(read_message('{"do": "fit"}'), stop)
    assert session.view.result.interrupted
    assert not interrupted()


# ---- from a record and a planner's file


@pytest.fixture
def looking(case):
    """Begin a page with no file, in the folder of some."""
    shutil.copy("sample_data/ac1a_up.csv", "up.csv")
    shutil.copy("sample_data/unit.dyr", "unit.dyr")
    made = Session()
    assert ask(made, do="open") == {"of": "start", "command": "exfit app"}
    yield made
    made.close()


def test_the_case_of_a_record_is_that_of_the_command_that_is_shown(looking, run, tmp_path):
    ask(looking, do="look", file="up.csv")
    said = ask(looking, do="make", model="ST1A", step=0.05, kv=None, machine={})
    made = Path("up.yaml").read_text()
    Path("up.yaml").unlink()
    assert run(*said["command"].split()[1:]).code == 0
    assert Path("up.yaml").read_text() == made


def test_a_unit_of_a_planner_s_file_has_its_own_data(looking):
    ask(looking, do="look", file="up.csv")
    (unit,) = ask(looking, do="look", file="unit.dyr")["units"]
    assert unit["exciter"] == "AC1A"
    assert {row["name"]: row["typical"] for row in unit["machine"]}["Tpd0"] == 6.0
    with pytest.raises(ExfitError, match=r"unit: 1: unit\.dyr has 1"):
        ask(looking, do="make", model="", unit=1, step=0.05, kv=None, machine={})
    ask(looking, do="make", model="", step=0.05, kv=None, machine={"Tpd0": 7.0})
    assert looking.case.values()["machine.Tpd0"] == 7.0
    assert looking.case.values()["KA"] == 766.0


def test_a_corrected_channel_is_in_the_case(looking):
    ask(looking, do="look", file="up.csv")
    said = ask(looking, do="correct", column="efd", signal="", unit="")
    assert {each["name"]: each["signal"] for each in said["channels"]}["efd"] == ""
    ask(looking, do="correct", column="ifd", signal="vt", unit="pu")
    said = ask(looking, do="make", model="AC1A", step=0.05, kv=None, machine={})
    assert looking.case.recordings[0].record.channels["vt"].column == "ifd"
    assert said["command"] == "exfit fit up.yaml"


def test_a_file_that_cannot_be_read_leaves_what_is_shown(session):
    Path("bad.yaml").write_text("plant: {type: nothing}\n")
    shown = ask(session, do="open")
    for file in ("bad.yaml", "nothing.csv", "../configs"):
        with pytest.raises(ExfitError):
            ask(session, do="look", file=file)
    assert ask(session, do="open")["name"] == shown["name"]
    ask(session, **GOOD["store"])


# ---- mutants


@pytest.mark.parametrize("seed", range(4))
def test_a_mutant_of_a_message_is_answered_or_refused_in_words(session, seed):
    rng = random.Random(seed)
    for _ in range(100):
        text = mutant(rng)
        assert outcome(session, text), text
    assert load_case(session.path)


@pytest.mark.parametrize("given", [None, "up.csv", "configs/ac1a_good.yaml"])
def test_odd_values_in_the_right_form_are_answered_or_refused_in_words(looking, given):
    session, rng = Session(given and Path(given)), random.Random(str(given))
    session.prepare()
    for _ in range(30):
        text = odd(rng)
        assert outcome(session, text), text
    session.close()
