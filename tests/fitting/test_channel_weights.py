"""Weights of channels by the scatter of their own residuals."""

import numpy as np
import pytest
from channel_records import NOISE, STARTS, three_channels
from records import UNIT

import exfit
from exfit.errors import CaseError
from exfit.fitting.channel_weights import balanced, residual_deviations
from exfit.fitting.search import fitted


def errors_of(result):
    """Return the relative error of each parameter."""
    return np.array([result.parameters[name].value / UNIT[name] - 1.0 for name in STARTS])


def rms(errors):
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("loss", ["least-squares", "huber"])
def test_each_channel_weighs_one_over_the_scatter_of_its_residuals(count, loss):
    _, problem = fitted(three_channels(count=count, weights="balanced", loss=loss))
    residuals = balanced(problem, problem.residuals.start).residuals
    noise = np.array([*NOISE.values()] * count)
    weights = np.array([channel.weight for channel in residuals.channels])
    # 600 samples show a deviation within 3 %; four standard errors
    np.testing.assert_allclose(weights, noise.min() / noise, rtol=0.17)
    assert residuals.noise == pytest.approx(noise.min(), rel=0.12)


def test_balanced_weights_are_those_of_the_minimum_that_they_lead_to():
    case = three_channels(weights="balanced")
    result = exfit.fit(case)
    rmse = {signal: match.rmse for signal, match in result.comparison.channels.items()}
    _, problem = fitted(case)
    residuals = balanced(problem, problem.residuals.start).residuals
    for channel in residuals.channels:
        # weights are taken over until they change by less than 2 %
        assert channel.residual_deviation == pytest.approx(rmse[channel.signal], rel=0.02)


def test_channels_are_balanced_anew_where_a_given_value_is_fitted():
    """T'd0 is 6 s: with 3.6 s vt has six times the residuals that its noise leaves."""
    case = three_channels(weights="balanced")
    result = exfit.fit(case, given="uncertain", values={"machine.Tpd0": 3.6})
    assert result.verdict.reason == "the record contradicts machine.Tpd0 = 3.6"
    for noise in result.knowledge.confidence.noise:  # all are weighted to the finest
        assert noise.estimated == pytest.approx(NOISE["vt"], rel=0.12), noise.label


def test_the_weights_do_not_depend_on_the_first_ones():
    _, problem = fitted(three_channels(weights="balanced"))
    own = balanced(problem, problem.residuals.start).residuals
    other = balanced(
        problem, problem.residuals.start, deviations=np.array([1e-2, 1e-3, 1.0])
    ).residuals
    for first, second in zip(own.channels, other.channels, strict=True):
        assert first.weight == pytest.approx(second.weight, rel=0.04)  # twice their tolerance


@pytest.mark.long
def test_the_noise_of_each_channel_is_reported_as_that_of_its_residuals():
    result = exfit.fit(three_channels(weights="balanced", ripple=0.06))
    for noise in result.knowledge.confidence.noise:
        rmse = result.comparison.channels[noise.label].rmse
        finest = min(match.rmse for match in result.comparison.channels.values())
        # all are weighted to the finest; degrees of freedom and the last reweighting: 2 %
        assert noise.estimated == pytest.approx(finest, rel=0.03), noise.label
        assert noise.given is None
        assert rmse > 0.0


@pytest.mark.long
def test_balanced_weights_lessen_the_errors_of_uneven_channels():
    plain = [rms(errors_of(exfit.fit(three_channels(seed)))) for seed in (1, 2, 3)]
    weighted = [
        rms(errors_of(exfit.fit(three_channels(seed, weights="balanced")))) for seed in (1, 2, 3)
    ]
    assert rms(weighted) < 0.5 * rms(plain)  # about an eighth by the variances


def test_spikes_in_a_channel_do_not_take_its_weight_from_it_under_a_robust_loss():
    case = three_channels(weights="balanced", loss="huber", spikes=10)
    _, problem = fitted(case)
    residuals = balanced(problem, problem.residuals.start).residuals
    (vt, *_) = residuals.channels
    spread = residual_deviations(residuals, residuals.start)
    assert spread[0] > vt.residual_deviation
    # the root mean square of ten spikes of 0.02 pu among 600 samples is 2.6e-3 pu
    assert vt.residual_deviation < 3.0 * NOISE["vt"]


def test_a_fit_says_how_it_weighted_its_channels():
    result = exfit.fit(three_channels(weights="balanced"))
    (note,) = [note for note in result.notes if note.startswith("weights balanced")]
    assert "vt 0.0001" in note or "vt 9." in note


def test_a_single_channel_is_fitted_as_without_balance():
    noise = {"vt": 1e-4}
    plain, weighted = (
        exfit.fit(three_channels(noise=noise, weights=w)) for w in ("given", "balanced")
    )
    for name in STARTS:
        own, other = plain.parameters[name], weighted.parameters[name]
        assert other.value == pytest.approx(own.value, rel=1e-6)
        assert other.std_error == pytest.approx(own.std_error, rel=1e-6)


@pytest.mark.parametrize("key", ["noise", "weight"])
def test_weights_are_either_given_or_balanced(key):
    content = {
        "model": "SEXS",
        "given": "exact",
        "plant": {"type": "open-circuit", "machine": "GENROU"},
        "test": {"vref": [{"at": 1.0, "step": 0.05}]},
        "record": {"file": "a.csv", "time": "t", "channels": {"vt": {"column": "vt", key: 0.1}}},
        "parameters": {"free": {"K": {"start": 20.0, "min": 2.0, "max": 200.0}}},
        "estimate": {"weights": "balanced"},
    }
    with pytest.raises(CaseError, match=f"channels.vt.{key}: not allowed with estimate.weights"):
        exfit.Case.from_dict(content)
