"""Where a phase of the search ends, such as lm before dgn: its values, its responses, its files."""

import numpy as np
import pytest
from places import ROOT

import exfit
from exfit.case.load import load_case
from exfit.features.report.page import html
from exfit.output import run_folder
from exfit.results.io import load_result
from exfit.workflows.given_values import read_parameters

CASE = ROOT / "configs" / "ac1a_low.yaml"


@pytest.fixture(scope="module")
def fit():
    return exfit.fit(CASE, search="local")


def test_the_end_of_lm_is_its_last_iteration_with_the_response_there(fit):
    (end,) = fit.phase_ends
    lines = fit.history
    assert (end.phase, end.next_phase) == ("lm", "dgn")
    assert lines[end.iteration].phase == "lm"
    assert lines[end.iteration + 1].phase == "dgn"
    names = fit.parameters
    assert {name: end.values[name] for name in names} == lines[end.iteration].values
    (match,) = end.comparisons
    assert 0.5 * np.sum(match.overlays["vt"].error ** 2) == pytest.approx(end.cost, rel=1e-6)


@pytest.mark.long
def test_its_files_start_a_fit_where_lm_ended(fit, tmp_path):
    run_folder.write_fit(fit, tmp_path).draw()
    (end,) = fit.phase_ends
    assert (tmp_path / "overlay_lm.png").is_file()
    values = read_parameters(load_case(CASE), tmp_path / "parameters_lm.yaml")
    assert values == end.values
    again = exfit.fit(CASE, "dgn", values=values, search="local")
    assert again.history[0].cost == pytest.approx(end.cost, rel=1e-9)
    assert again.phase_ends == ()
    run_folder.write_fit(again, tmp_path)
    assert not (tmp_path / "overlay_lm.png").exists()
    assert not (tmp_path / "parameters_lm.yaml").exists()


def test_it_is_in_the_result_and_in_the_report(fit, tmp_path):
    run_folder.write_fit(fit, tmp_path)
    back = load_result(tmp_path)
    (end,), (read,) = fit.phase_ends, back.phase_ends
    assert (read.phase, read.iteration, read.values) == (end.phase, end.iteration, end.values)
    assert f"iteration {end.iteration}, cost {end.cost:.4e}" in html(back, tmp_path)
