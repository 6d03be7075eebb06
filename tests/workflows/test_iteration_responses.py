"""The iterations of a fit: the response after each of them, kept, written and drawn."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from cases import local_case
from records import case_of, config, recording, several
from tiers import few_of

from exfit import workflows
from exfit.fitting.experiment import Experiment
from exfit.output import figures as plots
from exfit.output import run_folder
from exfit.results.tables import DIGITS
from exfit.workflows import fit_run, responses


@pytest.fixture(scope="module")
def fitted():
    return workflows.fit(local_case("first_order"))


@pytest.fixture(autouse=True)
def coarse(monkeypatch, tmp_path):
    """Draw with few dots, and remember fits elsewhere."""
    monkeypatch.setattr(plots.style, "DPI", 40)
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))


def columns(path):
    header, *rows = csv.reader(path.read_text().splitlines())
    return dict(zip(header, np.array(rows, float).T, strict=True))


def judged(comparison):
    """Return the samples of the signal that a match is judged by."""
    return comparison.overlays[comparison.judged_by]


def with_many(result, count):
    """Return a fit that took so many iterations more than it did."""
    kept = result.comparison.iteration_responses
    numbers = tuple(range(count))
    many = kept._replace(numbers=numbers, samples=np.tile(kept.samples[:1], (count, 1)))
    return replace(result, comparisons=(replace(result.comparison, iteration_responses=many),))


def test_the_first_response_is_the_start_and_the_last_the_fit(fitted):
    found, overlay = fitted.comparison.iteration_responses, judged(fitted.comparison)
    np.testing.assert_array_equal(found.samples[0], overlay.start)
    # the last line of the history holds the fitted values themselves
    np.testing.assert_array_equal(found.samples[-1], overlay.simulated)


def test_every_response_costs_what_its_iteration_did(fitted):
    found, measured = fitted.comparison.iteration_responses, judged(fitted.comparison).measured
    costs = 0.5 * np.sum((found.samples - measured) ** 2, axis=1)
    lines = {line.number: line.cost for line in fitted.history}
    # the sub-steps are those of the fitted values: what they move is far below a thousandth
    np.testing.assert_allclose(costs, [lines[k] for k in found.numbers], rtol=1e-3)


@pytest.mark.long
def test_every_record_has_its_own_responses(tmp_path):
    case = case_of(several(recording("up"), recording("down")), tmp_path)
    result = workflows.fit(case)
    run_folder.write_fit(result, tmp_path / "run")
    for one in result.comparisons:
        table = columns(tmp_path / "run" / f"{one.name}-iterations.csv")
        assert table["vt_0"] == pytest.approx(judged(one).start, rel=10.0 ** (1 - DIGITS))
    assert not (tmp_path / "run" / "iterations.csv").exists()


@pytest.mark.long
def test_what_is_found_about_a_record_moves_with_the_iterations(tmp_path):
    """The instant of the step is free: the simulations then have no common course."""
    content = config("ac1a_typical")
    content["test"]["vref"][0]["at"] = {"start": 1.1, "min": 0.9, "max": 1.2}
    result = workflows.fit(case_of(content, tmp_path))
    found, overlay = result.comparison.iteration_responses, judged(result.comparison)
    np.testing.assert_array_equal(found.samples[0], overlay.start)
    np.testing.assert_array_equal(found.samples[-1], overlay.simulated)


@pytest.mark.parametrize("count", [1, 2, 40, 41, 1000])
def test_of_many_iterations_some_are_kept_evenly_with_the_first_and_the_last(count):
    kept = responses.chosen(count)
    assert len(kept) == min(count, responses.MOST_RESPONSES)
    assert (kept[0], kept[-1]) == (0, count - 1)
    steps = np.diff(kept)
    assert not len(steps) or 1 <= np.max(steps) <= np.min(steps) + 1


@pytest.mark.long
def test_an_iteration_without_a_response_is_left_out(fitted, monkeypatch, tmp_path):
    whole = Experiment.samples_of_many
    lost = fitted.history[1].values["k"]

    def samples_of_many(self, sets):
        samples, parts = whole(self, sets)
        samples[[values["k"] == lost for values in sets]] = np.nan  # as where there is no rest
        return samples, parts

    result_of = fit_run.with_iteration_responses

    def failing(*given):
        monkeypatch.setattr(Experiment, "samples_of_many", samples_of_many)
        return result_of(*given)

    monkeypatch.setattr(fit_run, "with_iteration_responses", failing)
    result = workflows.fit(local_case("first_order"))
    assert 1 not in result.comparison.iteration_responses.numbers
    assert len(result.comparison.iteration_responses.numbers) == len(result.history) - 1
    run_folder.write_fit(result, tmp_path / "run").draw()
    assert "vt_1" not in columns(tmp_path / "run" / "iterations.csv")


def test_an_interruption_keeps_the_iterations_until_then():
    def stop(line):
        if line.number == 2:
            raise KeyboardInterrupt

    result = workflows.fit(local_case("first_order"), progress=stop)
    assert result.interrupted
    assert result.comparison.iteration_responses.numbers == (0, 1, 2)


@pytest.mark.long
def test_a_large_record_leaves_no_responses_and_says_so(fitted, monkeypatch, tmp_path):
    run_folder.write_fit(fitted, tmp_path / "run").draw()
    monkeypatch.setattr(responses, "MOST_SAMPLES", 100)
    result = workflows.fit(local_case("first_order"))
    assert result.comparison.iteration_responses is None
    assert any("up to 100" in note for note in result.notes)
    run_folder.write_fit(result, tmp_path / "run").draw()  # over the former ones
    assert not list((tmp_path / "run").glob("*iterations*"))


def test_without_figures_the_table_is_written_on_the_record_s_clock(fitted, tmp_path):
    run_folder.write_fit(fitted, tmp_path / "run")
    table = columns(tmp_path / "run" / "iterations.csv")
    np.testing.assert_array_equal(table["t"], fitted.comparison.time)
    assert list(table)[1:] == [f"vt_{line.number}" for line in fitted.history]
    assert not (tmp_path / "run" / "iterations.png").exists()


@pytest.mark.parametrize("count", few_of([1, 2, 13, 40], 2))
def test_a_line_is_drawn_for_every_response_and_the_bar_names_first_and_last(fitted, count):
    figure = plots.iterations(with_many(fitted, count))
    assert plots.png(figure)
    lines, errors, *bar = figure.axes
    assert len(lines.lines) == count + 1  # and the record
    assert len(errors.lines) == count + 1  # and zero
    colours = [line.get_color() for line in lines.lines[1:]]
    assert len(set(colours)) == count
    assert errors.get_xlabel() == "time (s)"
    if count == 1:
        assert not bar
    else:
        labels = [label.get_text() for label in bar[0].get_yticklabels()]
        assert (labels[0], labels[-1]) == ("0", str(count - 1))


def test_a_fit_without_responses_has_an_empty_figure(fitted):
    bare = replace(fitted, comparisons=(replace(fitted.comparison, iteration_responses=None),))
    assert plots.iterations(bare).axes == []
