"""exfit rank: tables, files, exit codes, completion."""

import csv
import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from places import CONFIGS

from exfit import workflows
from exfit.cli.completion import several_exciters
from exfit.output import figures as plots

CASE = CONFIGS / "ac8b_unit1.yaml"
TWO = ("--models", "AC8B,sexs", "--search", "local")
WIDTH = 80


@pytest.fixture(autouse=True)
def workplace(empty_folder, monkeypatch):
    """Draw little."""
    for name in ("overlay", "iterations", "convergence", "trajectories", "sensitivity"):
        monkeypatch.setattr(plots, name, lambda *_: Figure(figsize=(1, 1)))
    return empty_folder


@pytest.mark.pixels
@pytest.mark.long
def test_the_table_the_files_and_the_figure_are_of_all_models(run, monkeypatch):
    monkeypatch.setattr(plots.style, "DPI", 40)
    ran = run("rank", CASE, *TWO)
    assert (ran.code, ran.err) == (0, "")
    assert max(map(len, ran.out.splitlines())) <= WIDTH
    for words in ("AC8B*", "unseen", "reject all of these models but AC8B", "rank.png"):
        assert words in ran.out
    folder = Path("runs/ac8b_unit1-rank")
    assert {path.name for path in folder.iterdir()} == {
        "AC8B", "SEXS", "rank.csv", "rank.json", "rank.png",
    }  # fmt: skip
    first, second = csv.DictReader((folder / "rank.csv").read_text().splitlines())
    assert (first["name"], first["refuted_by"], first["typical"]) == ("AC8B", "", "")
    assert (second["name"], second["refuted_by"]) == ("SEXS", "fit validation")
    assert second["typical"] == "EMIN EMAX"
    stored = json.loads((folder / "rank.json").read_text())
    for model, row in zip(stored["models"], (first, second), strict=True):
        own = json.loads((folder / model["name"] / "result.json").read_text())
        assert model["rmse"] == pytest.approx(own["rmse"], rel=1e-12)
        assert float(row["validation_rmse"]) == pytest.approx(own["validation"][0]["rmse"])
    assert (folder / "SEXS" / "overlay.png").is_file()


@pytest.mark.long
def test_json_is_one_document(run):
    ran = run("rank", CASE, *TWO, "--json", "--no-plots", "-o", "out")
    assert ran.code == 0
    assert json.loads(ran.out) == json.loads(Path("out/rank.json").read_text())
    assert not [*Path("out").rglob("*.png")]


def test_a_first_model_that_does_not_match_ends_with_exit_code_3(run):
    ran = run("rank", CASE, "--models", "ESAC8B", "--search", "local", "--quiet", "--no-plots")
    assert ran[:2] == (3, "")


@pytest.mark.parametrize("models", ["AC88", "AC8B,ac8b", ""])
def test_models_that_do_not_exist_or_repeat_are_refused(run, models):
    ran = run("rank", CASE, "--models", models)
    assert (ran.code, ran.out) == (1, "")
    assert not Path("runs").exists()


def test_an_interruption_before_the_first_fit_is_done_leaves_nothing(run, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(workflows, "fit", interrupted)
    assert run("rank", CASE, *TWO).code == 130
    assert not Path("runs").exists()


def test_names_are_completed_behind_those_that_are_given():
    def completed(text):
        return several_exciters(None, None, text)

    assert "AC7B" in completed("ac")
    assert "AC8B,AC7B" in completed("AC8B,a")
    assert "AC8B,AC8B" not in completed("AC8B,A")
