"""Which models records refute: laws of the criterion, with errors whose truth is known."""

from dataclasses import replace
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH
from rich.console import Console

import exfit
from exfit.features.rank.ranking import STRONG, Likelihood, ranked, ranking_sentences
from exfit.features.rank.ranking_output import ranking_blocks as blocks_of
from exfit.output import terminal
from exfit.results.comparisons import Overlay
from exfit.results.verdict import NOT_CONVERGED, Verdict

SAMPLES = 2000
NO_SERIES = SimpleNamespace(failed={}, not_run=())


@pytest.fixture(scope="module")
def result():
    """Return a small fit, whose errors are then replaced."""
    rng = np.random.default_rng(5)
    vt = TRUTH + 1e-3 * rng.standard_normal(len(TIME))
    return exfit.fit(exfit.Case.from_dict(FIRST_ORDER, exfit.Record.from_arrays(TIME, {"vt": vt})))


def with_errors(result, errors, unseen=None, more=0, **changes):
    """Return a fit with other errors of its record and of one that it did not see."""

    def beside(errors):
        overlay = Overlay(np.zeros(len(errors)), errors)
        channel = result.comparison.channels["vt"]._replace(rmse=overlay.rmse)
        return replace(result.comparison, channels={"vt": channel}, overlays={"vt": overlay})

    names = [f"extra{k}" for k in range(more)]
    extra = dict.fromkeys(names, result.parameters["k"])
    return replace(
        result,
        comparisons=(beside(errors),),
        validation=() if unseen is None else (beside(unseen),),
        parameters={**result.parameters, **extra},
        **changes,
    )


def white(seed):
    return np.random.default_rng(seed).standard_normal(SAMPLES)


def coloured(rng, memory=0.95):
    steps = rng.standard_normal(SAMPLES)
    errors = np.empty(SAMPLES)
    errors[0] = steps[0] / np.sqrt(1.0 - memory**2)
    for k in range(1, SAMPLES):
        errors[k] = memory * errors[k - 1] + steps[k]
    return errors


def by_name(models):
    return {model.name: model for model in models}


def test_the_criterion_grows_by_the_logarithm_of_the_samples_with_each_parameter(result):
    errors = 1e-3 * white(1)
    fits = {"A": with_errors(result, errors), "B": with_errors(result, errors, more=3)}
    models = by_name(ranked(fits))
    assert models["A"].bic == 0.0
    assert models["B"].bic == pytest.approx(3 * np.log(SAMPLES), rel=1e-12)


def test_a_model_is_not_refuted_for_being_larger_than_another_that_does_as_well(result):
    errors = 1e-3 * white(1)
    fits = {"A": with_errors(result, errors), "B": with_errors(result, errors, more=3)}
    models = ranked(fits)
    assert all(model.possible for model in models)
    assert any("do not distinguish A and B" in text for text in ranking_sentences(models))


def test_a_larger_model_refutes_a_smaller_one_only_beyond_what_its_parameters_cost(result):
    errors = 1e-3 * white(1)
    # beyond what refutes a model, but not so far beyond what three parameters cost
    larger = errors * np.exp((STRONG + 6.0) / (2 * SAMPLES))
    for more, possible in ((0, False), (3, True)):
        fits = {"A": with_errors(result, errors, more=more), "B": with_errors(result, larger)}
        assert by_name(ranked(fits))["B"].possible is possible


def test_what_a_recorder_does_not_resolve_refutes_no_model(result):
    fits = {"A": with_errors(result, 1e-12 * white(1)), "B": with_errors(result, 1e-9 * white(2))}
    assert all(model.possible for model in ranked(fits))


@pytest.mark.long
def test_coloured_errors_count_as_the_few_that_they_are(result):
    """The true model, refuted by a rival that fits as much of the noise, by chance alone.

    Both have four parameters that move the response slowly, the rival in other directions.
    """
    rng = np.random.default_rng(11)
    trials, wrong, wrong_if_white = 200, 0, 0
    every = np.full(1, float(SAMPLES))
    for _ in range(trials):
        errors = 1e-3 * coloured(rng)
        fits = []
        for _ in range(2):
            slow = np.cumsum(rng.standard_normal((SAMPLES, 4)), axis=0)
            basis, _ = np.linalg.qr(slow)
            overlay = Overlay(np.zeros(SAMPLES), errors - basis @ (basis.T @ errors))
            fits.append(Likelihood.of([replace(result.comparison, overlays={"vt": overlay})]))
        true, rival = fits
        wrong += rival.gap(true, 0) > STRONG
        wrong_if_white += true.deviance(every) - rival.deviance(every) > STRONG
    # 5 % is what a test may do; counted as if they were white they do it in nearly half
    # of all
    assert wrong <= 0.05 * trials
    assert wrong_if_white >= 0.4 * trials


def test_unseen_records_come_first_and_refute_as_fitted_ones_do(result):
    errors, unseen = 1e-3 * white(1), 1e-3 * white(2)
    fits = {
        "A": with_errors(result, errors, 3.0 * unseen),
        "B": with_errors(result, 1.001 * errors, unseen),
    }
    models = ranked(fits)
    assert [model.name for model in models] == ["B", "A"]
    assert [model.refuted_by for model in models] == [(), ("validation",)]
    assert [*ranking_sentences(models)] == ["the records reject all of these models but B"]


def test_records_that_contradict_each_other_are_reported(result):
    errors, unseen = 1e-3 * white(1), 1e-3 * white(2)
    fits = {
        "A": with_errors(result, errors, 3.0 * unseen),
        "B": with_errors(result, 2.0 * errors, unseen),
    }
    models = ranked(fits)
    assert [model.refuted_by for model in models] == [("fit",), ("validation",)]
    (sentence,) = ranking_sentences(models)
    assert "A is the best on those fitted, B on the others" in sentence


def test_a_search_that_has_not_ended_well_neither_refutes_nor_is_refuted(result):
    errors = 1e-3 * white(1)
    fits = {
        "A": with_errors(result, 1e-2 * errors, verdict=Verdict(NOT_CONVERGED)),
        "B": with_errors(result, errors),
        "C": with_errors(result, 2.0 * errors),
    }
    models = by_name(ranked(fits))
    assert {name: model.refuted_by for name, model in models.items()} == {
        "A": None, "B": (), "C": ("fit",),
    }  # fmt: skip
    assert [*models][-1] == "A"
    assert "A is not judged: not converged" in ranking_sentences([*models.values()])


def test_models_none_of_which_matches_are_reported(result):
    errors = 1e-3 * white(1)
    missed = result.verdict._replace(verdict="misses the record")
    fits = {
        "A": with_errors(result, errors, verdict=missed),
        "B": with_errors(result, 2.0 * errors, verdict=missed),
    }
    models = ranked(fits)
    assert [model.outcome for model in models] == ["misses the record"] * 2
    assert "none of these models matches the records" in ranking_sentences(models)
    fits["A"] = with_errors(result, errors)
    assert "none of these models matches the records" not in ranking_sentences(ranked(fits))


def test_no_model_at_all_is_no_ranking():
    assert ranked({}) == ()
    assert [*ranking_sentences(())] == []


def test_with_typical_data_of_the_machine_no_model_is_called_refuted(result):
    errors = 1e-3 * white(1)
    fits = {"A": with_errors(result, errors), "B": with_errors(result, 2.0 * errors)}
    assert "reject all of these models but A" in " ".join(ranking_sentences(ranked(fits)))
    said = " ".join(ranking_sentences(ranked(fits, ("machine.S10",))))
    assert "reject all" not in said
    assert "the others are not rejected: machine.S10 is typical" in said
    for typical, meaning in (((), "not rejected"), (("machine.S10",), "matches best")):
        page = Console(file=StringIO(), width=80)
        models = ranked(fits, typical)
        ranking = SimpleNamespace(models=models, sentences=(), series=NO_SERIES)
        terminal.show(page, blocks_of(ranking))
        assert f"* {meaning}" in page.file.getvalue()
