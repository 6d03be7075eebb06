"""What ``import exfit`` offers: light to import, typed, and the same functions as the commands."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT

import exfit

CASE = ROOT / "configs" / "first_order.yaml"
HEAVY = {"numpy", "scipy", "pydantic", "yaml", "matplotlib", "rich", "click", "llvmlite"}


@pytest.fixture(scope="module")
def result():
    return exfit.fit(CASE)


def test_importing_exfit_loads_nothing_heavy():
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    code = "import exfit, sys; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert "exfit" in done.stdout.split()
    assert not HEAVY & set(done.stdout.split())


@pytest.mark.parametrize("name", exfit.__all__)
def test_every_public_name_can_be_used_and_is_listed(name):
    assert getattr(exfit, name) is not None
    assert name in dir(exfit)


@pytest.mark.parametrize("name", sorted({*exfit.__all__} - {"__version__"}))
def test_every_public_name_is_documented(name):
    assert getattr(exfit, name).__doc__


def test_another_name_is_no_attribute():
    with pytest.raises(AttributeError, match="module 'exfit' has no attribute 'fitt'"):
        exfit.fitt  # noqa: B018


@pytest.mark.parametrize("given", [str, Path, exfit.load_case])
def test_a_case_may_be_given_as_such_or_by_its_path(given, result):
    assert exfit.fit(given(CASE)).values == result.values


def test_input_that_cannot_be_used_raises_an_exfit_error(tmp_path):
    with pytest.raises(exfit.CaseError, match="cannot be read"):
        exfit.load_case(tmp_path / "nowhere.yaml")
    assert issubclass(exfit.CaseError, exfit.ExfitError)


def test_the_callback_of_a_fit_is_called_with_every_iteration():
    iterations = []
    result = exfit.fit(CASE, progress=iterations.append)
    assert tuple(iterations) == result.history
    assert [iteration.number for iteration in iterations] == list(range(len(iterations)))


def test_an_interruption_in_the_callback_keeps_the_best_point():
    def interrupt(iteration):
        if iteration.number == 3:
            raise KeyboardInterrupt

    result = exfit.fit(CASE, progress=interrupt)
    assert result.interrupted
    assert not result.success
    assert result.cost == min(iteration.cost for iteration in result.history) < result.start_cost


def test_a_result_stands_for_its_values(result):
    """Those of a fit lead to its response: the same simulation, so the same cost."""
    fitted, *_ = exfit.validate(CASE, result)
    assert fitted.cost == result.comparison.cost
    simulated = exfit.simulate(CASE, result)
    assert simulated.comparison.cost == result.comparison.cost
    assert exfit.simulate(CASE, result.values).comparison.cost == result.comparison.cost
    assert exfit.simulate(CASE).comparison.cost > result.comparison.cost


def test_a_profile_encloses_the_fitted_value(result):
    stages = []
    (profile,) = exfit.profile(CASE, ["k"], progress=stages.append).profiles
    assert profile.low < result.parameters["k"].value < profile.high
    assert stages


def test_more_noise_leaves_larger_errors():
    """Standard errors of the linear theory are proportional to the noise."""
    errors = [
        exfit.identify(CASE, {"vt": noise}).own.confidence.parameters["k"].std_error
        for noise in (1e-4, 1e-3)
    ]
    assert errors[1] == pytest.approx(10.0 * errors[0], rel=1e-9)


def test_a_check_takes_a_path():
    assert exfit.check(str(CASE)).agrees
