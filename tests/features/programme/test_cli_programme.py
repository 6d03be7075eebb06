"""exfit run: the folder of a programme, its table, its exit codes."""

import json
from pathlib import Path

import pytest
from programmes import OF_MACHINE, programme_content, written

from exfit.features.programme import folder as programme_folder
from exfit.features.programme.folder import load_summary

STEPS = ["saturation", "v-curve", OF_MACHINE, "fit"]
OUT = ("--no-plots", "-o", "out")
BLANK = 5000  # bytes: an empty picture of this size has fewer


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("programmes")


@pytest.fixture
def place(folder, monkeypatch):
    """Work in a folder that all tests of this module share: what is kept there is not run again."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "80")
    return written(programme_content(), folder)


def test_a_programme_leaves_a_folder_for_each_test_and_one_report(run, place):
    ran = run("run", place, *OUT)
    assert (ran.code, ran.err) == (0, "")
    names = {path.name for path in Path("out").iterdir()}
    assert names == {*STEPS, "programme.json", "report.html"}
    for name in STEPS:
        assert (Path("out") / name / "result.json").is_file()
    assert (
        (Path("out") / "saturation" / "points.csv").read_text().startswith("vt,ifd_A,direction\n")
    )
    assert (Path("out") / "fit" / "parameters.yaml").is_file()
    report = Path("out/report.html").read_text(encoding="utf-8")
    for heading in ("Test programme", "Saturation test saturation", "Points on load v-curve",
                    f"Test {OF_MACHINE}: parameters", "Fitted records"):  # fmt: skip
        assert heading in report


@pytest.mark.long
@pytest.mark.pixels
def test_each_figure_of_a_programme_is_drawn(run, place):
    assert run("run", place, "-o", "drawn").code == 0
    figures = [*Path("drawn").rglob("*.png")]
    assert {path.parent.name for path in figures} == {*STEPS}
    assert all(path.stat().st_size > BLANK for path in figures)


@pytest.mark.long
@pytest.mark.parametrize("columns", [80, 60])
def test_its_table_has_a_line_for_each_test_and_fits_the_terminal(run, place, columns, monkeypatch):
    run("run", place, *OUT)
    monkeypatch.setenv("COLUMNS", f"{columns}")
    ran = run("run", place, *OUT)
    lines = ran.out.splitlines()
    assert [line.split()[0] for line in lines[:7]] == ["test", *STEPS, "up", "down"]
    assert [line.split()[-1] for line in lines[1:5]] == ["kept"] * 4
    assert max(map(len, lines)) <= columns
    for words in ("values passed on to later tests", "machine.S10", "written to out"):
        assert words in ran.out


@pytest.mark.long
def test_json_is_one_document_and_quiet_is_silent(run, place):
    run("run", place, *OUT)
    ran = run("run", place, *OUT, "--json")
    content = json.loads(ran.out)
    assert [test["name"] for test in content["tests"]] == STEPS
    assert {"S10", "S12"} <= {value["name"].partition(".")[2] for value in content["values"]}
    assert run("run", place, *OUT, "--quiet")[:2] == (0, "")


@pytest.mark.long
def test_only_the_figures_that_are_missing_are_drawn(run, place, folder):
    run("run", place, *OUT)
    result = load_summary(Path("out"))
    planned = programme_folder.figures_of(result, Path("out"))["fit"].planned()
    (Path("out") / "fit" / "up.png").write_bytes(b"")
    left = programme_folder.figures_of(result, Path("out"))["fit"].planned()
    assert {*planned} - {*left} == {"up.png"}


@pytest.mark.long
def test_the_report_can_be_made_again(run, place):
    run("run", place, *OUT)
    report = Path("out/report.html")
    before = report.read_bytes()
    report.unlink()
    assert run("report", "out").code == 0
    assert report.read_bytes() == before


def test_a_test_that_is_not_matched_gives_exit_code_3(run, place, tmp_path):
    content = programme_content()
    content["tests"] = content["tests"][:2]
    content["tests"][1]["accept"] = {"rmse": 1e-9}
    ran = run("run", written(content, tmp_path), "--no-plots", "-o", tmp_path / "out")
    assert ran.code == 3
    assert "verdict: no match" in " ".join(ran.out.split())
    assert (tmp_path / "out" / "report.html").is_file()


def test_a_fault_of_the_file_gives_exit_code_1_and_leaves_nothing(run, place, tmp_path):
    content = programme_content()
    content["tests"][1]["kind"] = "stedy"
    ran = run("run", written(content, tmp_path), "-o", tmp_path / "out")
    assert ran.code == 1
    assert "tests[1].kind: 'stedy' is not possible; did you mean steady?" in ran.err
    assert not (tmp_path / "out").exists()


def test_the_other_commands_name_the_one_for_programmes(run, place):
    ran = run("fit", place)
    assert ran.code == 1
    assert "exfit run runs it" in ran.err


@pytest.mark.long
def test_a_programme_is_checked_with_what_its_tests_at_rest_give(run, place):
    ran = run("check", place)
    assert ran.code == 0
    for words in ("saturation (saturation)", "v-curve (steady)", f"{OF_MACHINE} (rejection)",
                  "fit of up, down (bump)"):  # fmt: skip
        assert words in ran.out
    assert ran.out.count("derivatives agree") == 2


@pytest.mark.long
def test_the_report_says_how_the_programme_is_run_again(run, place):
    run("run", place, *OUT)
    report = Path("out/report.html").read_text(encoding="utf-8")
    assert f"exfit run {place} -o out" in report
    assert "--set" not in report.partition('id="reproduction"')[2]
