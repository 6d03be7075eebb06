"""A periodic disturbance: found where it stands out of white residuals, and left out elsewhere."""

import numpy as np
import pytest
from records import NOISE, TEST, TIME, UNIT, found_in, one

import exfit
from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiments
from exfit.fitting.nuisances import names_of
from exfit.fitting.problem import problem_of, residuals_of

FREE = ("KA", "KF", "TE", "TF", "TA")
SWAY = 3.0 * NOISE
AUTO = {"frequency": {"start": "auto"}}
NAMES = ["vt.sine.frequency", "vt.sine.cosine", "vt.sine.sine"]


@pytest.fixture(scope="module")
def response():
    """Return vt of the AC1A after a step of 5 %."""
    content = {**one(TEST), "test": {**TEST, "duration": 6.0}, "estimate": {"search": "local"}}
    del content["record"]
    simulated = exfit.simulate(exfit.Case.from_dict(content)).response
    return np.interp(TIME, simulated.time, simulated.signals["vt"])


def white(rng):
    return NOISE * rng.standard_normal(len(TIME))


def coloured(rng, memory=0.95):
    errors = rng.standard_normal(len(TIME))
    for k in range(1, len(errors)):
        errors[k] = memory * errors[k - 1] + np.sqrt(1.0 - memory**2) * errors[k]
    return NOISE * errors


def sway(rng, frequency=1.03):
    return SWAY * np.cos(2 * np.pi * frequency * TIME + rng.uniform(0.0, 2 * np.pi))


def case(vt, sine, free=FREE, **sections):
    channels = {"vt": {"column": "vt", **({} if sine is None else {"sine": sine})}}
    content = {**one(TEST, channels, free), "estimate": {"search": "local"}, **sections}
    for key in ("file", "time"):
        del content["record"][key]
    return exfit.Case.from_dict(content, exfit.Record.from_arrays(TIME, {"vt": vt}))


def error(result):
    """Return the root mean square error of the parameters of the unit, as a share."""
    shares = [np.log(result.parameters[name].value / UNIT[name]) for name in FREE]
    return float(np.sqrt(np.mean(np.square(shares))))


def of_record(result):
    return {name: each for name, each in result.parameters.items() if each.of_record}


@pytest.mark.long
def test_a_sway_is_found_and_its_parameters_are_far_nearer_the_truth(response):
    rng = np.random.default_rng(8)
    errors = {"without": [], "with": []}
    for _ in range(3):
        vt = response + white(rng) + sway(rng)
        plain, fitted = (exfit.fit(case(vt, sine)) for sine in (None, AUTO))
        assert [*of_record(fitted)] == NAMES
        low, high = fitted.parameters["vt.sine.frequency"].interval
        # of nine such intervals of 95 % one may miss; twice their width does not
        assert 2 * low - high < 1.03 < 2 * high - low
        amplitude = np.hypot(*(fitted.parameters[name].value for name in NAMES[1:]))
        assert amplitude == pytest.approx(SWAY, abs=5 * NOISE * np.sqrt(2 / len(TIME)))
        assert any("Hz and" in note and "a sine is fitted" in note for note in fitted.notes)
        errors["without"].append(error(plain))
        errors["with"].append(error(fitted))
    # measured over 20 records: 2.9 times
    assert np.mean(errors["without"]) > 1.5 * np.mean(errors["with"])


@pytest.mark.long
def test_white_residuals_have_no_line_and_coloured_ones_none_that_is_fitted(response):
    rng = np.random.default_rng(2)
    reasons = {"does not stand out": white(rng), "are not white": coloured(rng)}
    for words, noise in reasons.items():
        plain, fitted = (exfit.fit(case(response + noise, sine)) for sine in (None, AUTO))
        assert not of_record(fitted)
        assert fitted.cost == plain.cost
        (note,) = [note for note in fitted.notes if "no sine is fitted" in note]
        assert note.startswith("vt: ")
        assert words in note


@pytest.mark.long
def test_a_line_is_found_within_the_range_that_the_case_gives(response):
    rng = np.random.default_rng(9)
    vt = response + white(rng) + sway(rng) + 2.0 * sway(rng, 7.1)
    elsewhere = {"frequency": {"start": "auto", "min": 2.0, "max": 9.0}}
    # beside the one, the other is no white noise
    assert not of_record(exfit.fit(case(vt, elsewhere)))
    vt = response + white(rng) + sway(rng)
    assert not of_record(exfit.fit(case(vt, elsewhere)))
    near = {"frequency": {"start": "auto", "min": 0.8, "max": 1.3}}
    assert [*of_record(exfit.fit(case(vt, near)))] == NAMES


def test_a_given_frequency_leaves_the_amplitudes_which_are_linear(response):
    rng = np.random.default_rng(4)
    vt = response + white(rng) + sway(rng)
    fitted = exfit.fit(case(vt, {"frequency": 1.03}))
    assert [*of_record(fitted)] == NAMES[1:]
    automatic = exfit.fit(case(vt, AUTO))
    # the frequency is known to a few thousandths, which moves no parameter by much of its error
    assert error(fitted) == pytest.approx(error(automatic), rel=0.2)


@pytest.mark.long
def test_a_global_search_and_profiles_find_the_same(response):
    rng = np.random.default_rng(4)
    given = case(response + white(rng) + sway(rng), AUTO, free=("KA", "TE"))
    local = exfit.fit(given)
    everywhere = exfit.fit(given, search="global")
    for name, parameter in local.parameters.items():
        # both end where the gradient is 1e-8 of the first
        scale = parameter.stderr
        assert everywhere.parameters[name].value == pytest.approx(parameter.value, abs=0.01 * scale)
    (profile,) = exfit.profile(given, "vt.sine.frequency").profiles
    assert (profile.low, profile.high) == pytest.approx(
        local.parameters["vt.sine.frequency"].interval, abs=2e-4
    )


@pytest.mark.long
def test_a_record_that_was_not_fitted_has_a_sine_of_its_own_or_none(response):
    rng = np.random.default_rng(6)
    vt = {"column": "vt", "sine": AUTO}
    names = ("swaying", "quiet")
    unseen = [{"name": name, "test": TEST, "record": {"channels": {"vt": vt}}} for name in names]
    content = {**one(TEST, {"vt": vt}, ("KA", "TE")), "estimate": {"search": "local"}}
    for key in ("file", "time"):
        del content["record"][key]
    content["validate"] = unseen
    records = {
        "fit": response + white(rng) + sway(rng),
        "swaying": response + white(rng) + sway(rng, 0.71),
        "quiet": response + white(rng),
    }
    given = exfit.Case.from_dict(
        content, {name: exfit.Record.from_arrays(TIME, {"vt": vt}) for name, vt in records.items()}
    )
    result = exfit.fit(given)
    swaying, quiet = result.validation
    assert swaying.of_record["swaying.vt.sine.frequency"] == pytest.approx(0.71, abs=0.02)
    assert quiet.of_record == {}
    for match in result.validation:
        assert match.accepted
        assert match.rmse == pytest.approx(NOISE, rel=0.15)
    # the values of the fit bring its sine along, those of the unit alone do not
    again = exfit.validate(given, result)[0]
    assert again.rmse == pytest.approx(result.rmse, rel=1e-6)
    assert exfit.validate(given, result.own_values)[0].rmse > 2.0 * result.rmse


def test_before_a_fit_an_automatic_sine_is_none(response):
    given = case(response + white(np.random.default_rng(1)), AUTO)
    (setup,) = build_experiments(given)
    assert setup.free == ()
    assert setup.automatic_sines == {"vt": (0.0, np.inf)}
    assert list(names_of(given.recordings[0])) == NAMES
    assert exfit.simulate(given).comparison.rmse < 2.0 * NOISE


def test_a_record_with_a_sine_is_not_compressed(response):
    """A sine is no polynomial between two points of the grid."""
    given = case(response + white(np.random.default_rng(1)), {"frequency": 1.0})
    residuals = residuals_of(given, build_experiments(given))
    problem = problem_of(residuals)
    assert problem.compressed is problem.residuals


@pytest.mark.parametrize("frequency", [0.1, 51.0, found_in(20.0, 10.0, 60.0)])
def test_a_frequency_that_the_record_cannot_show_is_refused(response, frequency):
    with pytest.raises(RecordError, match=r"vt\.sine\.frequency: .* Hz: a record of this length"):
        exfit.fit(case(response, {"frequency": frequency}))


@pytest.mark.parametrize(
    ("frequency", "fault"),
    [
        (-1.0, "frequency: -1 Hz must be above 0"),
        ({"start": 1.0, "min": 0.0, "max": 2.0}, "frequency.min: 0 Hz must be above 0"),
        ({"start": 1.0}, "frequency.min: is missing"),
        ({"start": 3.0, "min": 1.0, "max": 2.0}, "frequency.start: 3"),
        ({"start": "now"}, "frequency.start"),
    ],
)
def test_a_frequency_that_contradicts_itself_is_refused(response, frequency, fault):
    with pytest.raises(CaseError) as refused:
        case(response, {"frequency": frequency})
    assert fault in str(refused.value)
