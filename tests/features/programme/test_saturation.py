"""The saturation test: what curves with known numbers give, and what is said of their limits."""

import numpy as np
import pytest
from saturation_curves import drawn_curve, hits_of, shares
from tiers import few_of

from exfit.errors import ExfitError
from exfit.features.programme.result import SaturationResult
from exfit.features.programme.saturation import EXCESS, FieldWinding, directions, saturation_curve
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH
from exfit.util.typed import plain
from exfit.util.typed_reading import read

FORMS = tuple(EXCESS)
BASE, S10, S12 = 850.0, 0.12, 0.42
UP, DOWN = np.linspace(0.2, 1.2, 9), np.linspace(1.1, 0.2, 7)
NOISE = 2e-3


def curve(form, vt, direction=0.0, loop=0.02):
    """Return the field current of a machine with a loop of constant width."""
    return BASE * (vt + EXCESS[form](vt, S10, S12) + 0.5 * loop * direction)


def noisy_loop(form="quadratic", top=1.2, seed=0):
    """Return vt and ifd of points on both branches, each reading with noise."""
    random = np.random.default_rng(seed)
    up, down = ([vt for vt in branch if vt < top + 0.01] for branch in (UP, DOWN))
    vt = np.concatenate([up, down])
    direction = np.repeat([1.0, -1.0], [len(up), len(down)])
    ifd = curve(form, vt, direction) + BASE * NOISE * random.standard_normal(len(vt))
    return vt + NOISE * random.standard_normal(len(vt)), ifd


@pytest.mark.parametrize("form", FORMS)
def test_points_without_noise_give_back_the_curve_that_they_are_on(form):
    vt = np.concatenate([UP, DOWN])
    direction = np.repeat([1.0, -1.0], [len(UP), len(DOWN)])
    result = saturation_curve(vt, curve(form, vt, direction), form)
    fitted = result.curve
    assert result.curves[0] is fitted
    assert [other.refuted for other in result.curves] == [False, True, True]
    values = (fitted.ifd_base.value, fitted.S10.value, fitted.S12.value, fitted.hysteresis.value)
    # the search ends where the cost is rounding: 1e-6 is a thousand times farther
    assert values == pytest.approx((BASE, S10, S12, 0.02), rel=1e-6)
    assert fitted.offset.value == pytest.approx(0.0, abs=1e-6)


def test_the_intervals_hold_the_numbers_of_a_noisy_loop():
    result = saturation_curve(*noisy_loop())
    fitted = result.curve
    for value, truth in ((fitted.ifd_base, BASE), (fitted.S10, S10), (fitted.S12, S12)):
        low, high = value.interval
        assert low < truth < high
    assert result.form == "quadratic"
    assert result.notes == ()


def test_one_branch_shows_no_hysteresis_and_says_so():
    vt, ifd = noisy_loop()
    result = saturation_curve(vt[: len(UP)], ifd[: len(UP)])
    assert result.curve.hysteresis is None
    assert any("rising voltage" in note for note in result.notes)


def test_saturation_beyond_the_points_holds_what_the_other_forms_have_there():
    result = saturation_curve(*noisy_loop("exponential", top=1.0, seed=2), "exponential")
    fitting = [fitted for fitted in result.curves if not fitted.refuted]
    assert len(fitting) > 1
    low, high = result.curve.S12.interval
    assert all(low <= fitted.S12.value <= high for fitted in fitting)
    assert result.curve.extrapolated == (1.0, 1.2)
    assert any("S(1.2) is extrapolated" in note for note in result.notes)


def test_points_without_field_current_are_the_residual_voltage():
    vt, ifd = noisy_loop()
    with_zero = saturation_curve(np.append(vt, 0.015), np.append(ifd, 0.0))
    assert with_zero.residual == pytest.approx(0.015)
    assert with_zero.left_out == (len(vt),)
    assert with_zero.curve.S10 == saturation_curve(vt, ifd).curve.S10


def test_the_voltage_turns_where_it_goes_back_by_more_than_a_reading_scatters():
    rising = [0.2, 0.5, 0.498, 0.8, 1.1, 1.105, 1.1]
    assert directions(np.array([*rising, 0.9, 0.4])).tolist() == [1.0] * 7 + [-1.0] * 2
    assert directions(np.array([1.2, 0.9, 0.4])).tolist() == [-1.0] * 3
    assert directions(np.array([0.3, 0.9, 0.4, 0.8])).tolist() == [1.0, 1.0, -1.0, 1.0]


def test_the_base_of_efd_is_the_hot_resistance_times_the_base_of_ifd():
    vt, ifd = noisy_loop()
    measured = saturation_curve(vt, ifd, efd=0.2 * ifd + 2.0)  # 2 V at the brushes
    assert measured.resistance.value == pytest.approx(0.2, rel=1e-9)
    assert measured.efd_base.value == pytest.approx(0.2 * measured.curve.ifd_base.value)
    winding = FieldWinding(resistance=0.2, temperature=20.0, hot=100.0)
    given = saturation_curve(vt, ifd, winding=winding)
    assert given.resistance.value == pytest.approx(0.2 * 334.5 / 254.5)
    low, high = given.efd_base.interval
    assert low < 0.2 * 334.5 / 254.5 * BASE < high


def test_a_brushless_exciter_gives_no_base_of_efd():
    vt, ifd = noisy_loop()
    result = saturation_curve(vt, ifd, winding=FieldWinding(resistance=0.2), exciter=True)
    assert result.efd_base is None
    assert any("brushless" in note for note in result.notes)


def test_points_on_no_curve_of_the_form_that_is_used_are_named():
    result = saturation_curve(*noisy_loop("quadratic"), "exponential-se")
    assert result.curve.refuted
    assert any("not on a curve of form exponential-se" in note for note in result.notes)


def test_a_curve_on_points_that_determine_it_is_good():
    assert saturation_curve(*noisy_loop()).verdict.verdict == GOOD


def test_a_form_that_another_rejects_is_not_good_and_the_verdict_names_both():
    verdict = saturation_curve(*noisy_loop("quadratic"), "exponential-se").verdict
    assert verdict.verdict == MATCHES
    assert "form exponential-se leaves" in verdict.reason
    assert ", quadratic " in verdict.reason


def test_what_is_extrapolated_is_not_good():
    verdict = saturation_curve(*noisy_loop(top=1.1)).verdict
    assert verdict.verdict == MATCHES
    assert "S(1.2) is extrapolated from 1.1" in verdict.reason


@pytest.mark.long
def test_points_that_lie_far_beside_their_curve_do_not_match_it():
    vt, ifd = noisy_loop()
    scattered = ifd * (1.0 + 0.1 * np.resize([1.0, -1.0], len(ifd)))  # five times the limit
    result = saturation_curve(vt, scattered)
    assert result.verdict.verdict == NO_MATCH
    assert "pu rms off a curve of form quadratic, beyond" in result.verdict.reason
    for value in (result.curve.ifd_base, result.curve.S10, result.curve.S12):
        assert (value.interval, value.why) == ((None, None), result.verdict.no_interval)


def test_a_misread_point_is_named():
    vt, ifd = noisy_loop()
    ifd[3] += 0.1 * BASE
    assert any("point 4" in note for note in saturation_curve(vt, ifd).notes)


def test_a_result_is_read_back_from_its_file():
    result = saturation_curve(*noisy_loop())
    stored = plain(result, whole=True)
    assert plain(read(SaturationResult, stored), whole=True) == stored


@pytest.mark.parametrize(
    ("vt", "ifd", "text"),
    [
        ([0.5, 1.0], [500.0, 1100.0], "2 points with field current; at least 6"),
        (15.0 * UP, BASE * UP, "are unit and base of vt right?"),
        (-UP, BASE * UP, "point 1: vt -0.2"),
        (UP[1:], BASE * UP, "8 voltages, but 9 field currents"),
    ],
)
def test_points_that_are_no_curve_are_refused(vt, ifd, text):
    with pytest.raises(ExfitError, match=text.replace("?", r"\?")):
        saturation_curve(np.asarray(vt), np.asarray(ifd))


# MathWorks, Simscape Electrical Specialized Power Systems, Synchronous Machine, default no-load
# saturation curve: field current and voltage, pu; below its first point it is a line through zero
PUBLISHED = (
    (0.6404, 0.7127, 0.8441, 0.9214, 0.9956, 1.082, 1.19, 1.316, 1.457),
    (0.7, 0.7698, 0.8872, 0.9466, 0.9969, 1.046, 1.1, 1.151, 1.201),
)


def test_a_published_curve_gives_what_is_read_off_it_by_hand():
    ifd, vt = map(np.array, PUBLISHED)
    base = ifd[0] / vt[0]
    below = np.array([0.1, 0.25, 0.4, 0.55])
    result = saturation_curve(np.concatenate([below, vt]), np.concatenate([base * below, ifd]))
    # If0 / Ifg - 1 and If120 / (1.2 Ifg) - 1, the field currents between the points of the table
    by_hand = {level: np.interp(level, vt, ifd) / (level * base) - 1.0 for level in (1.0, 1.2)}
    assert by_hand == pytest.approx({1.0: 0.0942, 1.2: 0.3246}, abs=1e-4)
    # the table lies on no curve of any form: the intervals of the machine's allow for that
    fitted = result.curve
    assert fitted.refuted
    pairs = ((fitted.ifd_base, base), (fitted.S10, by_hand[1.0]), (fitted.S12, by_hand[1.2]))
    for value, truth in pairs:
        low, high = value.interval
        assert low < truth < high
    # a power of the voltage is within 0.5 % of field current of it, 1 % of a slope at low voltage
    assert result.curves[0].form == "exponential"
    assert result.curves[0].rms < 0.005
    assert result.curves[0].ifd_base.value == pytest.approx(base, rel=0.02)


def test_points_at_high_voltage_alone_leave_the_air_gap_line_open():
    ifd, vt = map(np.array, PUBLISHED)
    result = saturation_curve(vt, ifd)
    low, high = result.curve.ifd_base.interval
    assert low < ifd[0] / vt[0] < high
    assert high - low > 0.05 * ifd[0] / vt[0]
    assert any("no points below 0.6 pu" in note for note in result.notes)


def test_two_points_and_the_line_give_the_ratios_of_field_currents():
    # Ifg 263 A and If0 318 A at 13.8 kV (Fitzgerald, Electric Machinery, 6th ed., example 5.3)
    S10 = 318.0 / 263.0 - 1.0
    for form in FORMS:
        at_rated = 263.0 * (1.0 + EXCESS[form](np.array([1.0]), S10, 3.0 * S10))
        assert at_rated == pytest.approx(318.0)
        at_120 = 263.0 * (1.2 + EXCESS[form](np.array([1.2]), S10, 3.0 * S10))
        assert at_120 / (1.2 * 263.0) - 1.0 == pytest.approx(3.0 * S10)


@pytest.mark.long
def test_intervals_hold_the_truth_about_as_often_as_they_say():
    random = np.random.default_rng(2)
    hits = [hits_of(drawn_curve(form, random)) for form in FORMS for _ in range(4)]
    # 3 of 12 intervals of 95 % miss with a probability of 2 %; the study has 200 of each form
    assert np.all(shares(hits) > 0.7)
    assert np.all(np.isfinite([hit.widths for hit in hits]))


def test_a_machine_without_saturation_has_none_and_a_determined_air_gap_line():
    vt = np.linspace(0.1, 1.2, 12)
    result = saturation_curve(vt, BASE * (vt + 1e-3 * np.cos(7.0 * np.arange(12.0))))
    low, high = result.curve.ifd_base.interval
    assert low < BASE < high
    assert result.curve.S12.interval[0] == 0.0
    assert result.curve.S12.interval[1] < 0.05


def test_six_points_are_too_few_for_two_branches():
    vt = np.array([0.3, 0.7, 1.2, 1.1, 0.6, 0.2])
    with pytest.raises(ExfitError, match="6 points on two branches; at least 7"):
        saturation_curve(vt, BASE * vt)


@pytest.mark.parametrize("top", few_of([0.6, 0.8, 1.0], 1))
def test_points_that_end_early_leave_the_saturation_open_and_do_no_harm(top):
    random = np.random.default_rng(3)
    drawn = drawn_curve("exponential", random)
    low = drawn.vt < top
    result = saturation_curve(drawn.vt[low], drawn.ifd[low], "exponential")
    low_end, high_end = result.curve.S12.interval
    assert result.curve.extrapolated[-1] == 1.2
    assert low_end < drawn.truth[2]
    assert high_end is None or high_end - low_end > 0.5 * drawn.truth[2]
