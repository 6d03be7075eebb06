"""The same records under several models: which are fitted, from where, and what is kept."""

from dataclasses import replace

import pytest
from cases import local_case
from places import CONFIGS

import exfit
from exfit import workflows
from exfit.errors import CaseError, ModelError, SimulationError
from exfit.features.rank.ranked_cases import planned_models, rank
from exfit.models.families import family_of


@pytest.fixture(scope="module")
def case():
    return local_case("ac8b_unit1")


def names(plan):
    return [fit.name for fit in plan]


def test_the_fits_try_no_causes_unless_the_case_says_how_long(case):
    assert {fit.case.estimate.causes for fit in planned_models(case)} == {0.0}
    stated = replace(case, estimate=case.estimate.model_copy(update={"causes": 60.0}))
    assert {fit.case.estimate.causes for fit in planned_models(stated)} == {60.0}


def test_without_names_the_models_are_those_of_the_same_type(case):
    own, *others = names(planned_models(case))
    assert own == "AC8B"
    assert "ESAC8B" in others
    assert {family_of(name) for name in others} == {"AC"}


def test_all_is_the_whole_catalogue_of_exciters(case):
    every = names(planned_models(case, "all"))
    assert every[0] == "AC8B"
    assert {"SEXS", "DC1A", "ST6B"} < {*every}
    assert "FIRST_ORDER" not in every


def test_a_type_is_all_of_its_models_and_may_stand_beside_names(case):
    plan = names(planned_models(case, ["st", "AC8B"]))
    assert {"ST1A", "SEXS", "AC8B"} < {*plan}
    assert {family_of(name) for name in plan if name != "AC8B"} == {"ST"}


def test_a_form_of_another_edition_is_ranked_where_it_is_named(case):
    for models in ((), "all", ["AC"]):
        assert "AC8C" not in names(planned_models(case, models))
    plan = planned_models(case, ["AC8B", "AC8C"])
    assert names(plan) == ["AC8B", "AC8C"]
    later = plan[1].case
    assert "AC8B" not in names(planned_models(later))
    assert {"AC8C", "EXAC1"} < {*names(planned_models(later, "all"))}


def test_an_alias_is_the_model_that_it_stands_for(case):
    assert names(planned_models(case, ["esac1a", "ac8b"])) == ["AC1A", "AC8B"]


def test_models_that_cannot_be_planned_are_refused(case):
    with pytest.raises(ModelError, match="AC88 is not in the catalogue"):
        planned_models(case, ["AC88"])
    with pytest.raises(CaseError, match="models: esac1a: given more than once"):
        planned_models(case, ["AC1A", "esac1a"])
    for name in ("machine_playback", "first_order"):
        with pytest.raises(CaseError, match="has no exciter to rank"):
            planned_models(exfit.load_case(CONFIGS / f"{name}.yaml"))


@pytest.mark.long
def test_the_models_of_a_record_are_ranked_and_the_true_one_is_found(case):
    """The record is one of AC8B: SEXS is the simplest of all, and another one in its place."""
    plain = replace(case, validations=())
    ranking = rank(plain, ["SEXS", "AC8B"], search="local")
    best, other = ranking.models
    assert (best.name, best.refuted_by, best.typical) == ("AC8B", (), {})
    assert (other.name, other.refuted_by) == ("SEXS", ("fit",))
    assert {*other.typical} == {"EMIN", "EMAX"}
    assert best.bic == 0.0 < other.bic
    assert best.validation_rmse is None
    # the case's own model is fitted as it is alone
    assert ranking.results["AC8B"].cost == exfit.fit(plain).cost
    assert ranking.complete
    assert ranking.sentences[0] == "the records reject all of these models but AC8B"
    assert "add a record under `validate`" in ranking.sentences[1]


def test_a_model_that_cannot_be_simulated_keeps_no_other_from_its_fit(case, monkeypatch):
    fit = workflows.fit

    def failing(given, *arguments, **options):
        if given.subject == "SEXS":
            raise SimulationError("no start at rest")
        return fit(given, *arguments, **options)

    monkeypatch.setattr(workflows, "fit", failing)
    ranking = rank(case, ["SEXS", "ESAC8B"], search="local")
    assert [model.name for model in ranking.models] == ["ESAC8B"]
    assert ranking.series.failed == {"SEXS": "no start at rest"}
    assert not ranking.complete


@pytest.mark.long
def test_an_interruption_keeps_the_models_that_are_done(case):
    def interrupt(fit, _):
        if fit.name == "AC1A":
            raise KeyboardInterrupt

    ranking = rank(case, ["ESAC8B", "AC1A", "SEXS"], interrupt, search="local")
    assert ranking.series.interrupted
    assert ranking.series.not_run == ("SEXS",)
    assert [(model.name, model.refuted_by) for model in ranking.models] == [
        ("ESAC8B", ()),
        ("AC1A", None),
    ]
    assert not ranking.complete
