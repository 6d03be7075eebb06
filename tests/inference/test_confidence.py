"""Standard errors and intervals against certified values, SciPy, and what repetition shows."""

import json
from dataclasses import replace

import numpy as np
import pytest
from known_minima import CERTIFIED, random_problem
from linearised import autoregressive, decay, linearised, std_errors
from scipy.optimize import curve_fit, least_squares
from scipy.stats import chi2, kstest
from scipy.stats import t as student

from exfit.dsp.rounding import noise_before_rounding, rounding_waves
from exfit.inference.confidence import confidence, partners_on_bounds, rises
from exfit.inference.linear import PriorRow, ResidualBlock, Rounding, factored
from exfit.inference.noise import LAGS, effective_samples, whiteness
from exfit.util import typed

PROBLEMS = 400
# three standard deviations of a binomial count
LIKELY = 0.95 + 3.0 * np.sqrt(0.95 * 0.05 / PROBLEMS) * np.array([-1.0, 1.0])
T = np.linspace(0.0, 1.0, 200)
LINE = np.column_stack([np.ones_like(T), T])
TRUTH = np.array([2.0, 5.0])


def is_covered(known, truth=TRUTH, wider=1.0):
    """Return for each parameter whether its interval, made wider, holds the truth."""
    intervals = np.array([one.interval for one in known.parameters.values()])
    middle, half = intervals.mean(axis=1), 0.5 * np.diff(intervals, axis=1)[:, 0]
    return np.abs(truth - middle) <= wider * half


def lines(noise):
    """Yield the linearised fit of a straight line to each series of noise (K, M)."""
    for one in noise:
        fitted = np.linalg.lstsq(LINE, LINE @ TRUTH + one, rcond=None)[0]
        yield linearised(fitted, LINE @ (fitted - TRUTH) - one, LINE)


@pytest.mark.parametrize("logarithmic", [True, False])
@pytest.mark.parametrize("name", [name for name in CERTIFIED if name != "Lanczos1"])
def test_standard_errors_are_those_that_nist_certifies(name, logarithmic):
    case = CERTIFIED[name]
    x = np.array(case.minimum)
    scale = np.full(len(x), logarithmic)
    lin = linearised(x, case.fun(x), case.jac(x), logarithmic=scale)
    # NIST takes all residuals for white; eleven digits of the minimum leave about five, and none
    # of Lanczos1, whose data have no noise
    factors = factored(lin, lin.free)
    (noise,) = confidence(lin).noise
    white = noise._replace(std=noise.estimated, inflation=1.0, partial_autocorrelations=())
    got = np.sqrt(np.diag(factors.covariance((white,)))) * lin.size
    assert got == pytest.approx(case.deviations, rel=1e-5)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("absolute", [True, False])
def test_the_covariance_is_that_of_curve_fit(seed, absolute):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 80)
    truth = rng.uniform([1.0, 0.2], [2.0, 1.0])
    sigma = 0.01 * rng.uniform(0.5, 2.0, len(t))
    measured = decay(t, *truth)[0] + sigma * rng.standard_normal(len(t))
    found, covariance = curve_fit(
        lambda t, a, c: decay(t, a, c)[0],
        t,
        measured,
        p0=truth,
        sigma=sigma,
        absolute_sigma=absolute,
        jac=lambda t, a, c: decay(t, a, c)[1],
        xtol=1e-12,
        ftol=1e-12,
    )
    response, slopes = decay(t, *found)
    channel = ResidualBlock("vt", slice(0, len(t)), noise=1.0 if absolute else None)
    lin = linearised(
        found, (response - measured) / sigma, slopes / sigma[:, None], channels=(channel,)
    )
    assert confidence(lin).covariance == pytest.approx(covariance, rel=1e-6)


@pytest.mark.long
def test_the_interval_holds_the_truth_in_nineteen_of_twenty_records_with_white_noise():
    rng = np.random.default_rng(1)
    covered = [is_covered(confidence(lin)) for lin in lines(rng.standard_normal((PROBLEMS, 200)))]
    share = np.mean(covered, axis=0)
    assert np.all((share > LIKELY[0]) & (share < LIKELY[1]))


@pytest.mark.long
def test_few_samples_ask_for_students_t():
    rng = np.random.default_rng(2)
    covered = []
    for noise in rng.standard_normal((PROBLEMS, 4)):
        rows = LINE[::60]
        fitted = np.linalg.lstsq(rows, rows @ TRUTH + noise, rcond=None)[0]
        lin = linearised(fitted, rows @ (fitted - TRUTH) - noise, rows, width=np.full(2, 1e4))
        covered.append(is_covered(confidence(lin)))
    share = np.mean(covered, axis=0)
    assert np.all((share > LIKELY[0]) & (share < LIKELY[1]))


@pytest.mark.long
def test_a_logarithmic_interval_holds_the_truth_as_often():
    rng = np.random.default_rng(3)
    t = np.linspace(0.0, 3.0, 60)
    truth = np.array([2.0, 0.7])
    covered = []
    for noise in 0.1 * rng.standard_normal((PROBLEMS, len(t))):
        measured = decay(t, *truth)[0] + noise
        fun = lambda x, measured=measured: decay(t, *x)[0] - measured  # noqa: E731
        found = least_squares(fun, truth, jac=lambda x: decay(t, *x)[1], method="lm")
        lin = linearised(found.x, found.fun, found.jac, logarithmic=np.ones(2, dtype=bool))
        low, high = np.array([one.interval for one in confidence(lin).parameters.values()]).T
        assert np.sqrt(low * high) == pytest.approx(found.x)
        covered.append((low <= truth) & (truth <= high))
    share = np.mean(covered, axis=0)
    assert np.all((share > LIKELY[0]) & (share < LIKELY[1]))


@pytest.mark.long
def test_intervals_are_widened_for_noise_that_is_not_white():
    noise = 0.3 * autoregressive(np.random.default_rng(4), 0.7, (PROBLEMS, 200))
    known = [confidence(lin) for lin in lines(noise)]
    widened = np.mean([is_covered(intervals) for intervals in known], axis=0)
    assert np.all((widened > LIKELY[0]) & (widened < LIKELY[1]))
    plain = [
        is_covered(intervals, wider=intervals.noise[0].inflation ** -0.5) for intervals in known
    ]
    assert np.all(np.mean(plain, axis=0) < 0.75)
    text = known[0].sentences[0]
    assert text.startswith("the residuals of vt are not white (Ljung-Box p")
    effective = known[0].noise[0].effective
    assert f"200 samples count as {effective:.0f}, and the intervals allow for it" in text


def test_what_no_autoregression_describes_widens_by_one_factor():
    hum = 0.3 * np.sin(np.linspace(0.0, 150.0, len(T)))
    noise = 0.01 * np.random.default_rng(20).standard_normal(len(T))
    (lin,) = lines([hum * np.linspace(1.0, 0.0, len(T)) ** 4 + noise])
    (described,) = confidence(lin).noise
    assert described.partial_autocorrelations == ()
    assert described.effective == pytest.approx(effective_samples(lin.errors))


@pytest.mark.long
def test_a_prior_that_is_right_narrows_the_interval_and_keeps_its_promise():
    rng = np.random.default_rng(5)
    sigma, std = 0.2, 0.02
    taken = 2.0 * sigma  # the fit thinks that the noise is larger than it is
    covered, errors = [], []
    for noise in sigma * rng.standard_normal((PROBLEMS, 200)):
        mean = TRUTH[1] + std * rng.standard_normal()
        rows = np.vstack([LINE, [0.0, taken / std]])
        goal = np.append(LINE @ TRUTH + noise, taken * mean / std)
        fitted = np.linalg.lstsq(rows, goal, rcond=None)[0]
        known = confidence(
            linearised(
                fitted,
                LINE @ (fitted - TRUTH) - noise,
                LINE,
                priors=(PriorRow(1, mean, std, taken),),
            )
        )
        covered.append(is_covered(known))
        errors.append((fitted - TRUTH, std_errors(known)))
    share = np.mean(covered, axis=0)
    assert np.all((share > LIKELY[0]) & (share < LIKELY[1]))
    missed, told = np.array(errors).transpose(1, 0, 2)
    # the spread of 400 is known to 3.5 %
    assert np.sqrt(np.mean(missed**2, axis=0)) == pytest.approx(told.mean(axis=0), rel=0.11)
    alone = confidence(next(lines(sigma * rng.standard_normal((1, 200)))))
    assert np.all(told.mean(axis=0) < 0.9 * std_errors(alone))


def test_where_the_record_is_silent_the_prior_speaks():
    rows = np.column_stack([np.ones(50), np.zeros(50)])
    errors = np.random.default_rng(6).standard_normal(50)
    known = confidence(linearised(TRUTH, errors, rows, priors=(PriorRow(1, 5.0, 0.3, 1.0),)))
    assert std_errors(known)[1] == pytest.approx(0.3)


@pytest.mark.long
def test_each_channel_brings_its_own_noise():
    rng = np.random.default_rng(7)
    levels = np.repeat([1.0, 0.05], 100)
    rows = np.column_stack([np.ones(200), np.concatenate([T[:100], 3.0 - T[:100]])])
    channels = (ResidualBlock("vt", slice(0, 100)), ResidualBlock("efd", slice(100, 200)))
    missed, told = [], []
    for noise in levels * rng.standard_normal((PROBLEMS, 200)):
        fitted = np.linalg.lstsq(rows, rows @ TRUTH + noise, rcond=None)[0]
        errors = rows @ (fitted - TRUTH) - noise
        known = confidence(linearised(fitted, errors, rows, channels=channels))
        missed.append(fitted - TRUTH)
        told.append(std_errors(known))
    spread = np.std(missed, axis=0)
    # the spread of 400 is known to 3.5 %; the exact one is of White 1980
    assert np.mean(told, axis=0) == pytest.approx(spread, rel=0.11)
    inverse = np.linalg.inv(rows.T @ rows)
    exact = inverse @ (rows.T * levels**2) @ rows @ inverse
    assert np.mean(told, axis=0) == pytest.approx(np.sqrt(np.diag(exact)), rel=0.03)
    assert [one.std for one in known.noise] == pytest.approx([1.0, 0.05], rel=0.3)


@pytest.mark.long
def test_a_robust_fit_knows_how_well_it_does_on_outliers():
    rng = np.random.default_rng(8)
    limit = 1.345
    rows = LINE[::2]
    noise = rng.standard_normal((PROBLEMS, 100))
    noise *= np.where(rng.random(noise.shape) < 0.1, 10.0, 1.0)
    missed, told = [], []
    for one in noise:
        goal = rows @ TRUTH + one
        fitted = least_squares(
            lambda x, goal=goal: rows @ x - goal,
            TRUTH,
            jac=lambda x: rows,
            loss="huber",
            f_scale=limit,
        ).x
        errors = rows @ fitted - goal
        lin = linearised(
            fitted,
            errors,
            rows,
            influence=np.clip(errors, -limit, limit),
            curvature=(np.abs(errors) <= limit).astype(float),
        )
        known = confidence(lin)
        missed.append(fitted - TRUTH)
        told.append(std_errors(known))
    # as Huber 1981 has it for one channel
    square = np.sum(lin.influence**2) / (100 - 2) / np.mean(lin.curvature) ** 2
    exact = square * known.noise[0].inflation * np.linalg.inv(rows.T @ rows)
    assert known.covariance == pytest.approx(exact, rel=1e-9)
    assert np.mean(told, axis=0) == pytest.approx(np.std(missed, axis=0), rel=0.15)
    least = std_errors(confidence(next(lines(np.repeat(noise[:1], 2, axis=1)))))
    assert np.all(np.mean(told, axis=0) < least)


def test_the_probability_of_whiteness_is_uniform_for_white_noise():
    rng = np.random.default_rng(9)
    found = [whiteness(errors) for errors in rng.standard_normal((PROBLEMS, 500))]
    assert kstest(found, "uniform").pvalue > 0.01


def test_whiteness_is_the_statistic_of_ljung_and_box():
    errors = autoregressive(np.random.default_rng(10), 0.1, 300)
    rho = [errors[:-k] @ errors[k:] / (errors @ errors) for k in range(1, LAGS + 1)]
    terms = [one**2 / (300 - k) for k, one in enumerate(rho, start=1)]
    assert whiteness(errors) == pytest.approx(chi2.sf(300 * 302 * sum(terms), LAGS), rel=1e-9)


@pytest.mark.parametrize("phi", [0.3, 0.6, 0.9])
def test_correlated_samples_count_as_so_many_independent_ones(phi):
    counts = [
        effective_samples(errors)
        for errors in autoregressive(np.random.default_rng(11), phi, (20, 4000))
    ]
    assert np.mean(counts) == pytest.approx(4000 * (1.0 - phi) / (1.0 + phi), rel=0.2)


def test_alternating_samples_count_as_no_more_than_there_are():
    errors = autoregressive(np.random.default_rng(12), -0.8, 1000)
    assert effective_samples(errors) == 1000
    known = confidence(linearised([1.0], errors, np.ones((1000, 1))))
    assert known.noise[0].inflation == 1.0
    assert known.sentences[0].endswith("but alternate: the intervals are no wider for it")


def test_an_offset_that_no_parameter_takes_up_is_not_noise():
    errors = 0.5 + 0.1 * np.random.default_rng(13).standard_normal(400)
    assert confidence(linearised([1.0], errors, T[:1] + np.ones((400, 1)))).noise[0].effective < 4


@pytest.mark.parametrize(
    ("given", "counts", "times"), [(1.0, 1.0, None), (0.5, 1.0, "2"), (3.0, 3.0, "0.33")]
)
def test_a_given_noise_counts_unless_the_residuals_speak_against_it(given, counts, times):
    errors = np.random.default_rng(14).standard_normal(2000)
    errors /= np.sqrt(np.mean(errors**2))
    channel = ResidualBlock("vt", slice(0, 2000), noise=given)
    known = confidence(linearised([5.0], errors, np.ones((2000, 1)), channels=(channel,)))
    assert known.noise[0].std == pytest.approx(counts, rel=1e-3)
    assert bool(known.sentences) == (times is not None)
    if times is None:
        assert np.isinf(known.dof)
        low, high = known.parameters["a"].interval
        assert high - low == pytest.approx(2 * 1.959963985 / np.sqrt(2000))
    else:
        assert known.sentences[0].startswith(
            f"the residuals of vt are {times} times the noise given"
        )


def test_what_is_exactly_redundant_has_no_standard_error_and_spoils_no_other():
    response, slopes = decay(T, 6.0, 0.8)
    errors = 0.1 * np.random.default_rng(15).standard_normal(len(T))
    rows = np.column_stack([slopes[:, 0] * 3.0, slopes[:, 0] * 2.0, slopes[:, 1]])
    known = confidence(linearised([2.0, 3.0, 0.8], errors, rows))
    held = confidence(linearised([2.0, 3.0, 0.8], errors, rows, held=("min", None, None)))
    assert known.parameters["a"].std_error is None
    assert known.parameters["a"].why == "cannot be distinguished from b"
    assert known.parameters["b"].why == "cannot be distinguished from a"
    assert known.parameters["c"].interval == pytest.approx(held.parameters["c"].interval)
    assert known.dof == len(T) - 2 == pytest.approx(held.dof)
    assert np.isnan(known.correlation.matrix[0]).all()
    assert response == pytest.approx(rows[:, 0] * 2.0)


def test_who_moves_little_in_a_redundancy_takes_part_in_it_too():
    first, second, third = np.random.default_rng(21).standard_normal((3, 80, 1))
    weak = 1e-3 * second
    for rows in (
        np.hstack([first, 1e-3 * first, third]),  # b has little influence
        np.hstack([first, weak, first + weak, third]),  # b and the share of c that it makes up for
    ):
        known = confidence(linearised(np.ones(rows.shape[1]), 1e-3 * third[:, 0], rows))
        *joined, last = known.parameters.values()
        assert all(one.why.startswith("cannot be distinguished from") for one in joined)
        assert last.std_error is not None


def test_redundancies_that_have_nothing_to_do_with_each_other_are_distinguished():
    rng = np.random.default_rng(16)
    first, second = rng.standard_normal((2, 50, 1))
    rows = np.hstack([first, second, 3.0 * first, -second, rng.standard_normal((50, 1))])
    known = confidence(linearised(np.ones(5), rng.standard_normal(50), rows))
    why = [one.why for one in known.parameters.values()]
    assert why[:2] == ["cannot be distinguished from c", "cannot be distinguished from d"]
    assert known.parameters["e"].std_error is not None


@pytest.mark.parametrize(
    ("column", "leaning"),
    [
        ("first + second", True),  # correlation 0.7
        ("0.05 * first + second", False),  # 0.05
        ("second", False),
        ("2.0 * first", True),  # cannot be distinguished from it
    ],
)
def test_a_parameter_leans_on_a_bound_if_letting_go_of_it_would_move_the_estimate(column, leaning):
    rng = np.random.default_rng(18)
    first, second, third = np.linalg.qr(rng.standard_normal((60, 3)))[0].T
    other = {
        "first + second": first + second,
        "0.05 * first + second": 0.05 * first + second,
        "second": second,
        "2.0 * first": 2.0 * first,
    }[column]
    rows, errors = np.column_stack([first, other, third]), 0.1 * rng.standard_normal(60)
    held = linearised(np.ones(3), errors, rows, held=("max", None, None))
    partners = partners_on_bounds(held, confidence(held).noise)
    assert partners == ({"b": ("a",)} if leaning else {})
    free = linearised(np.ones(3), errors, rows)
    assert partners_on_bounds(free, confidence(free).noise) == {}


def test_on_a_bound_the_bound_decides_and_the_others_hold_for_it():
    rng = np.random.default_rng(17)
    rows, errors = rng.standard_normal((60, 3)), 0.1 * rng.standard_normal(60)
    known = confidence(linearised([0.0356, 2.0, 3.0], errors, rows, held=("min", None, None)))
    without = confidence(linearised([2.0, 3.0], errors, rows[:, 1:]))
    assert known.parameters["a"].interval is None
    assert known.parameters["a"].why == (
        "lies on its min 0.0356: the bound decides, not the record"
    )
    assert std_errors(known)[1:] == pytest.approx(std_errors(without))
    assert known.dof == pytest.approx(58)


def test_what_has_no_effect_is_said_to_have_none():
    rows = np.column_stack([np.ones(40), 1e-14 * T[:40]])
    known = confidence(linearised(TRUTH, np.random.default_rng(18).standard_normal(40), rows))
    assert known.parameters["b"].why == "has no effect on the record"
    assert known.parameters["b"].std_error is None


def test_a_wide_standard_error_is_reported_but_no_interval():
    errors = np.random.default_rng(19).standard_normal(400)
    known = confidence(linearised([1.0], 8.0 * errors, np.ones((400, 1))))
    one = known.parameters["a"]
    assert one.interval is None
    assert one.relative_error == pytest.approx(8.0 / 20.0, rel=0.1)
    told = f"standard error {100 * one.relative_error:.0f} %; see `exfit profile`"
    assert one.why == f"is not determined by the record: {told}"


@pytest.mark.parametrize("nuisance", [True, False])
def test_near_zero_the_interval_between_the_bounds_is_the_measure(nuisance):
    errors = np.random.default_rng(20).standard_normal(400)
    known = confidence(
        linearised([1e-9], errors, np.ones((400, 1)), width=np.array([2.0]), nuisances=(nuisance,))
    )
    assert known.parameters["a"].interval is not None
    small = confidence(linearised([0.0], errors, np.ones((400, 1)), width=np.array([0.1])))
    assert small.parameters["a"].relative_error is None
    assert small.parameters["a"].why == (
        f"is not determined by the record: standard error "
        f"{small.parameters['a'].std_error:.2g} pu; see `exfit profile`"
    )


def test_an_instant_is_measured_by_its_bounds_not_by_its_value():
    errors = np.random.default_rng(22).standard_normal(400)
    for nuisance in (True, False):  # a standard error of 0.05 s
        lin = linearised(
            [1.0],
            errors,
            np.ones((400, 1)),
            units=("s",),
            width=np.array([0.1]),
            nuisances=(nuisance,),
        )
        one = confidence(lin).parameters["a"]
        assert (one.interval is None) == nuisance
        assert one.relative_error == pytest.approx(0.05, rel=0.1)


def test_a_fit_without_any_error_is_certain():
    known = confidence(linearised(TRUTH, np.zeros(200), LINE))
    assert np.all(std_errors(known) == 0.0)
    assert known.parameters["a"].interval == (2.0, 2.0)
    assert known.noise[0].p_value is None


def test_as_many_samples_as_parameters_leave_nothing_to_judge_by():
    rows = LINE[[0, 100]]
    known = confidence(linearised(TRUTH, np.zeros(2), rows))
    why = "cannot be determined: there are no more samples than free parameters"
    assert {one.why for one in known.parameters.values()} == {why}


def test_what_a_prior_determines_takes_no_sample():
    """A slope that its prior holds leaves the noise, and the degrees of freedom, of one fixed."""
    noise = 0.2 * np.random.default_rng(14).standard_normal(10)
    line = LINE[:: len(T) // 10]
    held = linearised(TRUTH, noise, line, priors=(PriorRow(1, TRUTH[1], 1e-9, 0.2),))
    known = confidence(held)
    assert known.dof == pytest.approx(9.0)
    assert known.noise[0].estimated == pytest.approx(np.sqrt(noise @ noise / 9.0))


def test_one_channel_without_a_given_noise_leaves_it_to_be_judged():
    noise = 0.1 * np.random.default_rng(15).standard_normal(len(T))
    half = len(T) // 2
    both = (ResidualBlock("vt", slice(0, half), 0.1), ResidualBlock("efd", slice(half, len(T))))
    known = confidence(linearised(TRUTH, noise, LINE, channels=both))
    assert known.noise[0].accepted
    assert known.dof == pytest.approx(len(T) - 2)


def test_samples_that_repeat_each_other_ask_for_students_t():
    noise = autoregressive(np.random.default_rng(16), 0.9, len(T))
    known = confidence(linearised(10.0 * TRUTH, noise, LINE))
    worth = known.noise[0].effective
    assert worth < 30.0
    widths = [0.5 * np.ptp(one.interval) / one.std_error for one in known.parameters.values()]
    assert widths == pytest.approx([student.ppf(0.975, worth - 2.0)] * 2)


@pytest.mark.long
def test_a_given_noise_is_not_rejected_for_being_correlated():
    noise = autoregressive(np.random.default_rng(17), 0.9, (200, len(T)))
    given = (ResidualBlock("vt", slice(0, len(T)), 1.0),)
    lins = [linearised(TRUTH, one, LINE, channels=given) for one in noise]
    # as many samples, taken for independent, would reject 4 of 10
    assert np.mean([not confidence(one).noise[0].accepted for one in lins]) <= 0.03


def test_for_the_rise_a_parameter_on_a_bound_is_let_go():
    noise, cut = np.random.default_rng(18).standard_normal(len(T)), 50
    noise[:cut] *= 0.1
    both = (ResidualBlock("vt", slice(0, cut), 0.1), ResidualBlock("efd", slice(cut, len(T)), 1.0))
    held = linearised(TRUTH, noise, LINE, channels=both, held=(None, "max"))
    free = linearised(TRUTH, noise, LINE, channels=both)
    known = confidence(held)
    same_noise = replace(confidence(free), noise=known.noise, dof=known.dof)
    assert rises(held, known)["b"] == pytest.approx(rises(free, same_noise)["b"])


def test_the_partners_of_a_redundancy_are_named_beside_what_has_no_effect():
    columns = np.column_stack([np.zeros_like(T), T, np.ones_like(T), T])
    noise = np.random.default_rng(19).standard_normal(len(T))
    known = confidence(linearised(np.full(4, 2.0), noise, columns)).parameters
    assert known["a"].why == "has no effect on the record"
    assert known["b"].why == "cannot be distinguished from d"
    assert known["d"].why == "cannot be distinguished from b"


@pytest.mark.parametrize("seed", range(3))
def test_units_and_weights_do_not_change_what_is_known(seed):
    fun, jac, x, _ = random_problem(seed)
    plain = confidence(linearised(x, fun(x), jac(x)))
    other = confidence(linearised(1e3 * x, 7.0 * fun(x), 7.0 * jac(x) / 1e3))
    assert std_errors(other) == pytest.approx(1e3 * std_errors(plain), rel=1e-9)
    assert other.correlation.matrix == pytest.approx(plain.correlation.matrix, abs=1e-9)


def test_the_content_survives_json():
    fun, jac, x, _ = random_problem(0)
    known = confidence(linearised(x, fun(x), jac(x), held=("min", None, None, None)))
    content = json.loads(json.dumps(typed.plain(known), allow_nan=False))
    assert content["parameters"]["a"]["std_error"] is None
    assert content["parameters"]["b"]["std_error"] == known.parameters["b"].std_error
    assert content["correlation"]["matrix"][0] == [None] * 4
    assert content["noise"][0]["label"] == "vt"


def test_arrays_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match=r"channels: must cover the 200 rows"):
        linearised(TRUTH, np.zeros(199), LINE)
    with pytest.raises(ValueError, match="jacobian: not finite"):
        linearised(TRUTH, np.zeros(200), LINE * np.nan)
    with pytest.raises(ValueError, match="channels: must cover the 200 errors"):
        linearised(TRUTH, np.zeros(200), LINE, channels=(ResidualBlock("vt", slice(0, 100)),))
    with pytest.raises(ValueError, match="held: 1 for 2 parameters"):
        linearised(TRUTH, np.zeros(200), LINE, held=(None,))


@pytest.mark.parametrize("through_zero", [True, False])
def test_a_value_that_the_bounds_keep_from_zero_is_its_own_measure(through_zero):
    errors = np.random.default_rng(20).standard_normal(400)  # a standard error of 0.05
    lin = linearised(
        [0.1], errors, np.ones((400, 1)), width=np.array([10.0]), through_zero=(through_zero,)
    )
    parameter = confidence(lin).parameters["a"]
    assert (parameter.interval is not None) == through_zero
    if not through_zero:
        share = 100.0 * parameter.relative_error
        assert parameter.why == (
            f"is not determined by the record: standard error {share:.0f} %; see `exfit profile`"
        )


@pytest.mark.long
def test_the_interval_holds_the_truth_as_often_where_the_recorder_rounds_coarsely():
    """The signal settles within a step of the recorder: one error of its rounding counts most."""
    rng, step, noise, covered, plain = np.random.default_rng(23), 0.5, 0.1, [], []
    rows = np.column_stack([np.ones_like(T), np.exp(-8.0 * T)])
    for _ in range(PROBLEMS):
        zero = step * rng.uniform()
        samples = rows @ TRUTH + noise * rng.standard_normal(len(T))
        readings = zero + step * np.round((samples - zero) / step)
        fitted = np.linalg.lstsq(rows, readings)[0]
        levels = rows @ fitted
        waves = rounding_waves(levels, step, noise_before_rounding(readings, levels, rows, step))
        rounding = Rounding(step, waves, noise**2 + step**2 / 12.0)
        channel = ResidualBlock("vt", slice(0, len(T)), rounding=rounding)
        known = confidence(linearised(fitted, levels - readings, rows, channels=(channel,)))
        covered.append(is_covered(known))
        plain.append(is_covered(confidence(linearised(fitted, levels - readings, rows))))
    share = np.mean(covered, axis=0)
    assert np.all((share > LIKELY[0]) & (share < LIKELY[1]))
    assert np.mean(plain, axis=0)[0] < 0.7
    assert "the recorder rounds vt to 0.5 pu, more than its noise" in known.sentences[0]


def two_channels(noise, conflict=0.0):
    """Return the linearised fit of a line, seen by two channels, to their noise (2, M)."""
    rows = np.vstack([LINE, LINE])
    truth = np.append(LINE @ TRUTH, LINE @ (TRUTH + conflict)) + noise.ravel()
    fitted = np.linalg.lstsq(rows, truth)[0]
    samples = len(T)
    both = (
        ResidualBlock("vt", slice(0, samples)),
        ResidualBlock("efd", slice(samples, 2 * samples)),
    )
    return linearised(fitted, rows @ fitted - truth, rows, channels=both)


@pytest.mark.long
def test_an_error_that_another_channel_causes_is_no_noise_of_a_fine_one():
    rng = np.random.default_rng(24)
    noise = rng.standard_normal((PROBLEMS, 2, len(T))) * np.array([0.01, 1.0])[:, None]
    known = [confidence(two_channels(errors)) for errors in noise]
    fine = [each.noise[0].std for each in known]
    assert np.median(fine) == pytest.approx(0.01, rel=0.02)
    # the test at 1 % takes some for a conflict of the channels
    assert np.mean([each.noise[0].inflation > 1.0 for each in known]) < 0.04
    share = np.mean([is_covered(each) for each in known], axis=0)
    assert np.all((share > LIKELY[0]) & (share < LIKELY[1]))


def test_what_two_channels_contradict_each_other_in_is_noise_of_both():
    noise = np.random.default_rng(25).standard_normal((2, len(T))) * np.array([[0.01], [0.1]])
    known = confidence(two_channels(noise, conflict=0.2))
    assert known.noise[0].inflation > 20.0


def test_a_channel_keeps_its_noise_although_the_scale_of_its_record_moves_it():
    """A record that is scaled, less what the parameters make up for, is noise beside a rest."""
    noise = 0.01 * np.random.default_rng(26).standard_normal((2, len(T)))
    once = two_channels(noise)
    rest = np.sin(9.0 * T)
    little = noise[1] / np.linalg.norm(noise[1]) + rest / np.linalg.norm(rest)
    jacobian = np.column_stack([once.jacobian, np.append(np.cos(9.0 * T), 1e-3 * little)])
    channels = once.channels
    known = confidence(linearised([*once.values, 1.0], once.errors, jacobian, channels=channels))
    for channel in known.noise:
        assert channel.inflation == 1.0
        assert channel.std == pytest.approx(0.01, rel=0.2)
