"""The cases that come with exfit: each runs as it stands, and each model has one."""

from dataclasses import replace

import numpy as np
import pytest
from places import CONFIGS

from exfit.case.criteria import criteria_of
from exfit.case.load import load_case
from exfit.case.schema import CriteriaSection
from exfit.fitting.recordings import record_of
from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.workflows import fit, simulate, validate

CASES = sorted(CONFIGS.glob("*.yaml"))
QUICK = ("ac1a_typical", "first_order")  # of each part of the tests
MANY = 64  # starts, that find the lowest cost


@pytest.mark.each_model
def test_a_model_has_a_case_of_its_typical_data(model):
    """All values stand in the file, so that nobody has to look for them."""
    case = load_case(CONFIGS / "models" / f"{model.lower()}.yaml")
    assert case.parts.exciter is MODELS[model]
    assert dict(case.parameters.fixed) == typical(MODELS[model].sheet)
    signals = simulate(case, {}).response.signals
    assert signals["vt"][0] == pytest.approx(case.test.vt0, abs=1e-9)
    assert np.ptp(signals["vt"]) > 0.01
    assert np.isfinite(signals["vt"]).all()


def test_no_case_is_left_of_a_model_that_is_gone():
    assert {path.stem.upper() for path in (CONFIGS / "models").iterdir()} == set(MODELS)


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_case_reads_and_its_records_are_there(path):
    case = load_case(path)
    assert case.recordings
    for one in (*case.recordings, *case.validations):
        assert record_of(case, one).time.size > 100


@pytest.mark.parametrize(
    "name",
    [
        path.stem if path.stem in QUICK else pytest.param(path.stem, marks=pytest.mark.long)
        for path in CASES
    ],
)
def test_a_case_is_fitted_well_and_its_validations_hold(name):
    result = fit(CONFIGS / f"{name}.yaml")
    assert result.holds, result.verdict
    assert all(match.accepted for match in result.validation)


@pytest.mark.long
@pytest.mark.parametrize("name", ["ac1a_typical", "ac1a_low", "ac8b_unit1", "ac8b_on_line"])
def test_a_case_is_fitted_at_its_lowest_cost(name):
    case = load_case(CONFIGS / f"{name}.yaml")
    result = fit(replace(case, validations=()))
    many = case.estimate.model_copy(update={"starts": MANY})
    lowest = fit(replace(case, estimate=many, validations=())).cost
    assert result.cost <= 1.005 * lowest


@pytest.mark.parametrize(
    "file", sorted((CONFIGS / "criteria").glob("*.yaml")), ids=lambda f: f.stem
)
def test_published_criteria_judge_a_case_that_names_their_file(file):
    case = load_case(CONFIGS / "ac1a_typical.yaml")
    section = CriteriaSection(file=file.name)
    criteria = criteria_of(section, file.parent)
    assert criteria.given
    assert criteria.source.startswith("RTE, Documentation technique de référence, fiche I16")
    match = validate(replace(case, criteria=criteria), {"KA": 333.0})[0]
    outcomes = {each.outcome for each in match.criteria}
    assert outcomes <= {"met", "not met"}
    assert bool(match.criteria) is (file.stem == "rte_setpoint")
