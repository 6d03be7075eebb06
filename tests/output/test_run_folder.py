"""Files: each is written whole or not at all, and says the same as the result."""

import csv
import json
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from cases import FILES_OF_A_FIT
from places import ROOT
from records import case_of, config

from exfit import workflows
from exfit.case.load import load_case
from exfit.errors import CaseError, ExfitError
from exfit.features.report.page import html
from exfit.output import figure_files, run_folder
from exfit.output import figures as plots
from exfit.results import io
from exfit.results.io import load_result
from exfit.results.tables import DIGITS, parameter_file, table
from exfit.util.files import write
from exfit.util.text import to_json
from exfit.workflows.given_values import read_parameters

CASE = ROOT / "configs" / "first_order.yaml"


@pytest.fixture(scope="module")
def fitted():
    return workflows.fit(CASE, search="local")


@pytest.fixture
def folder(fitted, tmp_path, monkeypatch):
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    run_folder.write_fit(fitted, tmp_path / "run")
    return tmp_path / "run"


def columns(path):
    header, *rows = csv.reader(path.read_text().splitlines())
    return {name: [row[k] for row in rows] for k, name in enumerate(header)}


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_a_fit_leaves_these_files_and_no_others(fitted, tmp_path, monkeypatch):
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    run_folder.write_fit(fitted, tmp_path / "run").draw()
    assert names(tmp_path / "run") == FILES_OF_A_FIT


def test_without_figures_there_are_only_tables(folder):
    assert names(folder) == {name for name in FILES_OF_A_FIT if not name.endswith(".png")}


def parts_alike(wanted, content):
    """Return of a content what another has: its keys, at every depth."""
    if isinstance(wanted, dict):
        return {key: parts_alike(wanted[key], content[key]) for key in wanted}
    if isinstance(wanted, list):
        return [parts_alike(*pair) for pair in zip(wanted, content, strict=True)]
    return content


def test_the_result_holds_what_json_prints_and_the_history(fitted, folder):
    stored = json.loads((folder / "result.json").read_text())
    printed = json.loads(to_json(fitted.to_dict()))
    assert parts_alike(printed, stored) == printed
    assert len(stored["history"]) == fitted.nit + 1


def test_numbers_that_are_not_finite_become_null_in_json():
    text = to_json({"a": [float("nan"), 1.0], "b": {"c": (float("inf"),)}})
    assert json.loads(text, parse_constant=pytest.fail) == {"a": [None, 1.0], "b": {"c": [None]}}


def test_the_history_has_a_line_per_iteration_from_the_start_on(fitted, folder):
    history = columns(folder / "history.csv")
    assert [int(number) for number in history["iteration"]] == list(range(fitted.nit + 1))
    assert float(history["f"][0]) == pytest.approx(fitted.start_cost, rel=10.0**-DIGITS)
    assert float(history["f"][-1]) == pytest.approx(
        fitted.comparison.cost, rel=10.0 ** (1 - DIGITS)
    )
    for name, one in fitted.parameters.items():
        assert float(history[name][0]) == one.start
        assert float(history[name][-1]) == pytest.approx(one.value, rel=10.0 ** (1 - DIGITS))


def test_the_response_holds_measured_start_fitted_and_residual_on_the_record_s_clock(
    fitted, folder
):
    response = {
        name: np.array(column, float) for name, column in columns(folder / "response.csv").items()
    }
    assert list(response) == ["t", "vt_measured", "vt_start", "vt_simulated", "vt_residual"]
    np.testing.assert_array_equal(response["t"], fitted.comparison.time)
    overlay = fitted.comparison.overlays["vt"]
    np.testing.assert_array_equal(response["vt_measured"], overlay.measured)
    # the digits that are printed, of a number up to 2
    difference = response["vt_simulated"] - response["vt_measured"]
    np.testing.assert_allclose(response["vt_residual"], difference, rtol=0, atol=1e-8)
    cost = 0.5 * np.sum(response["vt_residual"] ** 2)
    assert cost == pytest.approx(fitted.comparison.cost, rel=1e-4)


def test_a_simulation_leaves_every_sample_that_was_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr("exfit.results.tables.MOST_ROWS", 100)  # of the tables of a fit
    monkeypatch.setattr("exfit.results.tables.ROWS_AT_ONCE", 300)
    content = {
        **yaml.safe_load((ROOT / "configs" / "models" / "sexs.yaml").read_text("utf-8")),
        "simulation": {"output_step": 0.01},
    }
    case = tmp_path / "case.yaml"
    case.write_text(yaml.safe_dump(content))
    simulation = workflows.simulate(load_case(case))
    run_folder.write_simulation(simulation, "case", tmp_path)
    response = columns(tmp_path / "response.csv")
    time = np.array(response["t"], float)
    np.testing.assert_allclose(np.diff(time), 0.01, rtol=1e-6)  # of the digits that are printed
    assert time[-1] == content["test"]["duration"]
    np.testing.assert_allclose(
        np.array(response["vt"], float),
        simulation.response.signals["vt"],
        rtol=10.0 ** (1 - DIGITS),
    )


def test_parameters_read_back_are_exactly_those_found(fitted, folder):
    assert read_parameters(load_case(CASE), folder / "parameters.yaml") == fitted.values


@pytest.mark.parametrize("begin", [0.0, -0.5, 45_000.0, 1.6e9])
def test_instants_are_distinguished_whenever_the_clock_began(begin):
    time = begin + np.linspace(0.0, 3.0, 3001)
    rows = table(["t", "y"], [time, np.zeros(3001)]).splitlines()[1:]
    shown = np.array([float(row.split(",")[0]) for row in rows])
    # nine digits of three seconds, or as many as a double has
    np.testing.assert_allclose(shown, time, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("value", [1e-05, 1.0, 1e16, 123456.789, 2.5e-07, 1e300])
def test_every_yaml_reader_takes_a_parameter_for_the_same_number(fitted, value):
    one = replace(fitted.parameters["k"], value=value)
    text = parameter_file(replace(fitted, parameters={**fitted.parameters, "k": one}))
    assert yaml.safe_load(text)["parameters"]["k"] == value


def test_parameters_say_where_each_value_is_from(fitted):
    one = replace(fitted.parameters["k"], at_bound="max")
    text = parameter_file(
        replace(
            fitted,
            parameters={"k": one},
            fixed={"a": 2.0, "b": 3.0},
            sources={"a": "not stated", "b": "typical", "k": "fitted"},
            interrupted=True,
        )
    )
    lines = text.splitlines()
    assert lines[0].endswith("; interrupted")
    assert yaml.safe_load(text)["sources"] == {"b": "typical", "k": "fitted"}
    assert any(line.startswith("  k:") and line.endswith("# on its max") for line in lines)


def test_a_table_keeps_its_digits():
    text = table(["t", "x"], [np.array([0.0, 1.0]), np.array([1.0 / 3.0, 1e-7 / 3.0])])
    assert text == "t,x\n0,0.333333333\n1,3.33333333e-08\n"


def test_a_file_that_cannot_be_renamed_leaves_the_old_one_and_nothing_beside(tmp_path, monkeypatch):
    path = tmp_path / "table.csv"
    write(path, "old")

    def full(self, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(ExfitError, match=r"table\.csv: cannot be written: No space left"):
        write(path, "new")
    assert path.read_text() == "old"
    assert names(tmp_path) == {"table.csv"}


def test_a_place_below_a_file_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "taken").write_text("mine")
    for place in (tmp_path / "taken", tmp_path / "taken" / "below" / "it"):
        with pytest.raises(ExfitError, match="taken is not a folder"):
            run_folder.refuse_unwritable(place)
        with pytest.raises(ExfitError, match="cannot be written"):
            write(place / "table.csv", "new")
    assert (tmp_path / "taken").read_text() == "mine"


def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder.os, "access", lambda place, mode: False)
    with pytest.raises(ExfitError, match=f"no permission in {tmp_path}"):
        run_folder.refuse_unwritable(tmp_path / "run")


def test_a_folder_that_does_not_exist_yet_is_fine(tmp_path):
    run_folder.refuse_unwritable(tmp_path / "a" / "b")
    assert names(tmp_path) == set()


def test_the_last_fit_of_a_case_is_found_by_any_of_its_paths(fitted, folder, monkeypatch):
    monkeypatch.chdir(ROOT)
    found = run_folder.last_fit(Path("configs/../configs/first_order.yaml"))
    assert run_folder.last_fit(CASE) == found
    assert read_parameters(load_case(CASE), found) == fitted.values


def test_a_last_fit_outlives_its_folder_and_another_case_that_takes_it(fitted, folder, tmp_path):
    """Two cases of one name write to one folder: each keeps its own values."""
    other = tmp_path / "first_order.yaml"
    values = {name: replace(one, value=7.0) for name, one in fitted.parameters.items()}
    run_folder.write_fit(replace(fitted, case=other, parameters=values), folder)
    assert read_parameters(load_case(CASE), run_folder.last_fit(CASE)) == fitted.values
    assert set(read_parameters(load_case(CASE), run_folder.last_fit(other)).values()) == {7.0}
    shutil.rmtree(folder)
    assert read_parameters(load_case(CASE), run_folder.last_fit(CASE)) == fitted.values


@pytest.mark.long
def test_a_fit_leaves_no_figure_or_table_of_a_former_one(fitted, tmp_path, monkeypatch):
    """A former fit of three records, drawn, whose records have other names but for one."""
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    others = [replace(fitted.comparison, name=name) for name in ("first", "second")]
    former = replace(fitted, comparisons=tuple(others))
    run_folder.write_fit(former, tmp_path / "run").draw()
    (tmp_path / "run" / "notes.csv").write_text("the user's own")
    assert {"first.csv", "second.png", "first-iterations.csv"} <= names(tmp_path / "run")
    run_folder.write_fit(fitted, tmp_path / "run")
    tables = {name for name in FILES_OF_A_FIT if not name.endswith(".png")}
    assert names(tmp_path / "run") == tables | {"notes.csv"}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"[]",
        b"null",
        b'{"records": 1}',
        b'{"records": [1]}',
        b'{"records": [{"name": "../outside/it"}, {"name": ""}]}',
    ],
)
def test_a_result_that_is_no_fit_s_takes_nothing_along(fitted, tmp_path, monkeypatch, content):
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    for name in ("outside/it.csv", "run/.csv"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text("mine")
    (tmp_path / "run" / "result.json").write_bytes(content)
    run_folder.write_fit(fitted, tmp_path / "run")
    assert (tmp_path / "outside" / "it.csv").read_text() == "mine"
    assert (tmp_path / "run" / ".csv").read_text() == "mine"
    assert json.loads((tmp_path / "run" / "result.json").read_text())["success"]


@pytest.mark.long
def test_a_validation_leaves_no_table_or_overlay_of_a_former_one(fitted, tmp_path):
    (match,) = fitted.validation
    result = replace(workflows.validation_result(CASE, fitted), matches=(match,))
    former = replace(result, matches=(match, replace(match, name="former")))
    run_folder.write_validation(former, tmp_path).draw()
    assert {"former.csv", "former.png"} <= names(tmp_path)
    run_folder.write_validation(result, tmp_path)
    assert names(tmp_path) == {"down-step.csv", "validation.json"}


@pytest.fixture
def twice(fitted, folder):
    """Return a folder with a former fit, and a fit to write there that has another value."""
    other = replace(fitted.parameters["k"], value=7.0)
    return replace(fitted, parameters={**fitted.parameters, "k": other}), folder


def value_in(folder):
    return json.loads((folder / "result.json").read_text())["parameters"]["k"]["value"]


@pytest.mark.long
def test_a_figure_that_fails_is_reported_and_all_else_stands(twice, monkeypatch):
    result, folder = twice

    def broken(result):
        raise ZeroDivisionError("of its own")

    monkeypatch.setattr(plots, "trajectories", broken)
    (missing,) = run_folder.write_fit(result, folder).draw()
    assert missing == f"{folder / 'trajectories.png'}: not drawn: ZeroDivisionError: of its own"
    assert names(folder) == FILES_OF_A_FIT - {"trajectories.png"}
    assert value_in(folder) == 7.0


@pytest.mark.long
def test_a_disk_that_fills_up_while_drawing_costs_figures_alone(twice, monkeypatch):
    result, folder = twice

    def full(path, content):
        if path.suffix == ".png":
            raise ExfitError(f"{path}: cannot be written: No space left on device")

    monkeypatch.setattr(figure_files, "write", full)
    missing = run_folder.write_fit(result, folder).draw()
    assert len(missing) == sum(name.endswith(".png") for name in FILES_OF_A_FIT)
    assert all("No space left" in text for text in missing)
    assert value_in(folder) == 7.0


@pytest.mark.long
def test_an_interruption_while_drawing_leaves_the_numbers_and_nothing_half(twice, monkeypatch):
    result, folder = twice

    def interrupted(result):
        raise KeyboardInterrupt

    monkeypatch.setattr(plots, "trajectories", interrupted)
    with pytest.raises(KeyboardInterrupt, match="all numbers are written, figures are missing"):
        run_folder.write_fit(result, folder).draw()
    assert names(folder) < FILES_OF_A_FIT
    assert value_in(folder) == 7.0
    assert run_folder.last_fit(CASE).read_bytes() == (folder / "parameters.yaml").read_bytes()


def test_an_interruption_while_the_numbers_are_made_waits_for_all_of_them(twice, monkeypatch):
    result, folder = twice
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    make = io.history_table

    def interrupted(result):
        signal.raise_signal(signal.SIGINT)
        return make(result)

    monkeypatch.setattr(io, "history_table", interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            run_folder.write_fit(result, folder).draw()
    finally:
        signal.signal(signal.SIGINT, former)
    assert names(folder) == {name for name in FILES_OF_A_FIT if not name.endswith(".png")}
    assert value_in(folder) == 7.0


@pytest.mark.long
def test_figures_do_not_come_beside_the_numbers_of_another_run(fitted, twice, monkeypatch):
    """Two runs write to one folder: the second puts its numbers there while the first draws."""
    result, folder = twice
    draw = plots.trajectories

    def meanwhile(drawn):
        run_folder.write_fit(result, folder)
        return draw(drawn)

    monkeypatch.setattr(plots, "trajectories", meanwhile)
    (missing,) = run_folder.write_fit(fitted, folder).draw()
    assert "another run writes there" in missing
    assert value_in(folder) == 7.0
    assert not [name for name in names(folder) if name.endswith(".png")]


def test_a_result_that_is_a_folder_is_refused(tmp_path):
    (tmp_path / "result.json").mkdir()
    with pytest.raises(ExfitError, match=r"result\.json: cannot be written: it is a folder"):
        run_folder.refuse_unwritable(tmp_path, run_folder.OF_FIT)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"a\0b", b"elsewhere"])
def test_a_damaged_memory_of_the_last_fit_is_refused(folder, tmp_path, content):
    (kept,) = (tmp_path / "cache" / "last-fit").iterdir()
    kept.write_bytes(content)
    with pytest.raises(CaseError):
        read_parameters(load_case(CASE), run_folder.last_fit(CASE))


def test_a_fit_is_written_even_where_it_cannot_be_remembered(fitted, tmp_path, monkeypatch):
    (tmp_path / "cache").write_text("a file in its place")
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    run_folder.write_fit(fitted, tmp_path / "run")
    assert "result.json" in names(tmp_path / "run")
    assert run_folder.last_fit(CASE) is None


@pytest.mark.long
def test_files_with_percent_signs_in_their_names_are_as_any_and_several_have_an_overlay(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    home = tmp_path / "100 %d%20"
    home.mkdir()
    content, records = config("ac8b_unit2_both"), {}
    for section, name in zip(content["records"], ("up5%d", "down%20%s"), strict=True):
        file = home / f"{name} %(x)s.csv"
        file.write_bytes(Path(section["record"]["file"]).read_bytes())
        section["name"], section["record"]["file"] = name, file.name
        records[name] = file.name
    path = case_of(content, home).path.rename(home / "unit %s.yaml")
    result = workflows.fit(path)
    assert {match.name: match.record for match in result.comparisons} == records
    run = home / "run %d"
    drawn = run_folder.write_fit(result, run).draw()
    assert drawn == ()
    written = {file.name for file in run.iterdir()}
    assert {"overlay.png", "result.json"} <= written
    for name in records:
        assert {f"{name}.csv", f"{name}.png", f"{name}-lm.png"} <= written
        assert len(columns(run / f"{name}.csv")["t"]) == 1001
    page = html(load_result(run), run)
    assert all(f">{name}" in page and file in page for name, file in records.items())
