"""Points on load beside the machine's model: what a fit of them finds, and what they leave open."""

import numpy as np
import pytest
from tiers import few_of

from exfit.errors import ModelError
from exfit.features.programme.v_curve import (
    FieldMeasurement,
    FieldsOnLoad,
    PointsOnLoad,
    field_on_load,
    search_of,
    v_curve,
)
from exfit.fitting.parameters import FreeParameter
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical

BASE, NOISE = 640.0, 0.003  # A; pu
P = np.repeat([0.05, 0.4, 0.8], 5)
Q = np.tile([-0.3, -0.1, 0.1, 0.3, 0.5], 3)
VT = 1.0 + 0.05 * Q
SALIENT = MACHINES["GENSAL"]
TRUTH = typical(SALIENT.sheet) | {"S10": 0.1, "S12": 0.4}


def points(base=BASE, seed=1, noise=NOISE, rows=slice(None), **reading):
    p, q, vt = P[rows], Q[rows], VT[rows]
    ifd = field_on_load(SALIENT, TRUTH, p, q, vt)
    ifd = ifd + np.random.default_rng(seed).normal(0.0, noise, len(p))
    return PointsOnLoad(p, q, vt, {"ifd": FieldMeasurement(BASE * ifd, "A", base, **reading)})


def free(name, start, low, high):
    return FreeParameter(name, start, low, high, logarithmic=True)


def test_points_of_the_model_itself_are_matched():
    curve = v_curve(SALIENT, TRUTH, points())
    assert curve.verdict.verdict == "good"
    assert curve.readings["ifd"].rms == pytest.approx(NOISE, rel=0.5)
    assert curve.parameters == {}


def test_wrong_machine_data_are_no_match():
    curve = v_curve(SALIENT, TRUTH | {"Xd": 1.3}, points())
    assert curve.verdict.verdict == "no match"


def test_a_fit_finds_reactances_and_base_within_their_intervals():
    measured = points(base=700.0, free_base=free("ifd.base", 700.0, 200.0, 2000.0))
    start = TRUTH | {"Xd": 1.2, "Xq": 0.6}
    wanted = [free("Xd", 1.2, 0.4, 4.0), free("Xq", 0.6, 0.3, 1.2)]
    curve = v_curve(SALIENT, start, measured, wanted)
    assert curve.verdict.verdict == "good"
    for name, value in {"Xd": TRUTH["Xd"], "Xq": TRUTH["Xq"], "ifd.base": BASE}.items():
        low, high = curve.parameters[name].interval
        assert low < value < high
        assert high - low < 0.1 * value
    assert curve.determined == ("Xd", "Xq")
    assert curve.machine_data["Xd"] == curve.parameters["Xd"].value


@pytest.mark.long
def test_the_intervals_include_the_errors_of_values_and_bases_that_were_given():
    """By what fits with these values off give; 2 % for what curves over a standard error."""
    errors, wanted = {"S12": 0.02, "ifd.base": 5.0}, [free("Xd", 1.2, 0.4, 4.0)]

    def log_xd(s12=0.0, base=0.0):
        data = TRUTH | {"S12": TRUTH["S12"] + s12}
        fitted = v_curve(SALIENT, data, points(BASE + base), wanted)
        return np.log(fitted.parameters["Xd"].value)

    moved = [
        (log_xd(s12=0.02) - log_xd(s12=-0.02)) / 2.0,
        (log_xd(base=5.0) - log_xd(base=-5.0)) / 2.0,
    ]
    alone = v_curve(SALIENT, TRUTH, points(), wanted)
    wider = v_curve(SALIENT, TRUTH, points(), wanted, std_errors=errors)
    value = alone.parameters["Xd"].value
    assert wider.parameters["Xd"].value == value
    sides, widened = (
        np.abs(np.log(np.array(curve.parameters["Xd"].interval) / value))
        for curve in (alone, wider)
    )
    assert widened == pytest.approx(np.hypot(sides, 1.96 * np.hypot(*moved)), rel=0.02)
    assert np.all(widened > 1.5 * sides)
    assert "the intervals include the errors of S12 and ifd.base (given)" in wider.notes
    own = v_curve(SALIENT, TRUTH, points(), wanted, std_errors={"Xd": 0.1, "H": 0.5})
    assert own.parameters["Xd"] == alone.parameters["Xd"]  # free, or without effect at rest
    assert own.notes == alone.notes


def test_points_without_power_do_not_determine_the_q_axis():
    curve = v_curve(SALIENT, TRUTH, points(rows=slice(5)), [free("Xq", 0.7, 0.3, 1.2)])
    assert not curve.parameters["Xq"].determined
    assert curve.verdict.verdict == "matches, not all determined"
    sentences = [sentence for sentence in curve.undetermined if "Xq" in sentence]
    assert any("the points do not exclude" in sentence for sentence in sentences), sentences


def test_what_would_match_the_points_is_named_where_the_machine_data_do_not():
    curve = v_curve(SALIENT, TRUTH | {"Xd": 1.3}, points())
    (cause,) = curve.verdict.causes
    assert cause.cause.startswith("the points are matched much better by Xd = 1.07")


@pytest.mark.parametrize(("low", "high"), few_of([(0.3, 1.2), (0.05, 5.0), (0.001, 1000.0)], 2))
def test_what_would_match_is_named_alone_whatever_the_bounds_of_what_is_fitted(low, high):
    curve = v_curve(SALIENT, TRUTH | {"Xd": 1.6}, points(), [free("Xq", 0.7, low, high)])
    (cause,) = curve.verdict.causes
    assert cause.cause.startswith("the points are matched much better by Xd = 1.07")


def test_what_is_fitted_to_points_that_do_not_match_has_no_interval():
    measured = points()
    turned = measured._replace(q=-measured.q)
    curve = v_curve(SALIENT, TRUTH, turned, [free("Xd", 1.2, 0.4, 4.0)])
    assert curve.verdict.verdict == "no match"
    assert curve.determined == ()
    (parameter,) = curve.parameters.values()
    assert (parameter.interval, parameter.why) == (None, curve.verdict.no_interval)


def test_values_lead_back_to_the_saliency_that_is_searched_in_place_of_xq():
    fields = FieldsOnLoad(SALIENT, points())
    problem = fields.problem(TRUTH, [free("Xq", 0.7, 0.3, 1.2)])
    search = search_of(problem)
    assert search.values(search.theta(problem.values(problem.theta(TRUTH))))["Xq"] == pytest.approx(
        TRUTH["Xq"]
    )


def test_a_reactive_power_with_the_other_sign_is_named():
    measured = points()
    curve = v_curve(SALIENT, TRUTH, measured._replace(q=-measured.q))
    assert curve.verdict.verdict == "no match"
    assert "q reversed" in curve.verdict.causes[0].cause


def test_points_that_match_have_no_cause():
    assert v_curve(SALIENT, TRUTH, points()).verdict.causes == ()


def test_a_fit_from_data_that_contradict_each_other_is_refused():
    with pytest.raises(ModelError, match=r"the fit starts from S12: 0\.05"):
        v_curve(SALIENT, TRUTH, points(), [free("S12", 0.05, 0.01, 1.0)])


def test_a_fit_of_points_without_finite_errors_is_refused(monkeypatch):
    monkeypatch.setattr(FieldsOnLoad, "errors", lambda *_: np.full(len(P), np.nan))
    with pytest.raises(ModelError, match="give the points no finite errors"):
        v_curve(SALIENT, TRUTH, points(), [free("Xd", 1.2, 0.4, 4.0)])


def test_the_points_are_grouped_by_their_power():
    curve = v_curve(SALIENT, TRUTH, points())
    assert [level.points for level in curve.levels] == [
        (0, 1, 2, 3, 4),
        (5, 6, 7, 8, 9),
        (10, 11, 12, 13, 14),
    ]
    for level in curve.levels:
        rows = list(level.points)
        assert np.interp(Q[rows], level.q, level.it) == pytest.approx(curve.it[rows], abs=1e-3)


def test_a_round_rotor_leaves_the_upper_limit_of_xq_open():
    """At Xq = Xd the field current is stationary in Xq: it shows little of it near there."""
    machine = MACHINES["GENROU"]
    data = typical(machine.sheet) | {"S10": 0.1, "S12": 0.4}
    ifd = field_on_load(machine, data, P, Q, VT)
    ifd = ifd + np.random.default_rng(1).normal(0.0, NOISE, len(P))
    measured = PointsOnLoad(P, Q, VT, {"ifd": FieldMeasurement(ifd)})
    curve = v_curve(machine, data, measured, [free("Xq", 1.2, 0.6, 5.0), free("Xd", 1.5, 0.5, 5.0)])
    xq = curve.parameters["Xq"]
    assert xq.interval[0] < data["Xq"]
    assert xq.interval[1] is None or xq.interval[1] <= curve.parameters["Xd"].interval[1]
