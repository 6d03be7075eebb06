"""Combinations that a record does not see, and which parameters to fix, against closed forms."""

import json
from dataclasses import replace

import numpy as np
import pytest
from linearised import autoregressive, decay, linearised, std_errors
from scipy.linalg import qr

from exfit.inference.confidence import confidence
from exfit.inference.identifiability import WEAK, identifiability
from exfit.inference.linear import PriorRow, ResidualBlock, pivots
from exfit.util.text import digits, listed
from exfit.util.typed import plain

SAMPLES = 300
T = np.linspace(0.0, 2.0, SAMPLES)


def analysed(lin):
    """Return what a fit knows and what it does not."""
    known = confidence(lin)
    return known, identifiability(lin, known)


def noise(seed, count=SAMPLES):
    """Return errors of a root mean square that makes the estimated noise exactly one."""
    errors = np.random.default_rng(seed).standard_normal(count)
    return errors / np.sqrt(np.mean(errors**2))


def with_directions(seed, singular, logarithmic=False, **changes):
    """Return a linearisation whose relative Jacobian has given singular values, and its V'."""
    rng = np.random.default_rng(seed)
    count = len(singular)
    left = np.linalg.qr(rng.standard_normal((SAMPLES, count)))[0]
    right = np.linalg.qr(rng.standard_normal((count, count)))[0].T
    values = rng.uniform(1.0, 900.0, count)
    rows = left * np.asarray(singular) @ right / values
    errors = noise(seed) * np.sqrt(1.0 - count / SAMPLES)
    scale = np.full(count, logarithmic)
    return linearised(values, errors, rows, logarithmic=scale, **changes), right


def names_of(one):
    return [name for name, _ in one.moves]


def test_the_singular_values_are_those_of_relative_changes_in_units_of_noise():
    lin, right = with_directions(1, [900.0, 80.0, 2.0])
    _, found = analysed(lin)
    assert found.singular_values == pytest.approx([900.0, 80.0, 2.0])
    assert np.abs(np.sum(found.directions * right, axis=1)) == pytest.approx(np.ones(3))
    assert found.condition == pytest.approx(450.0)
    assert found.names == lin.names


def test_a_singular_value_is_one_over_the_error_where_noise_is_not_white_too():
    errors = autoregressive(np.random.default_rng(21), 0.9, SAMPLES)
    lin = linearised([2.0], errors, np.linspace(0.0, 1.0, SAMPLES)[:, None])
    known, found = analysed(lin)
    (error,) = (one.relative_error for one in known.parameters.values())
    assert known.noise[0].inflation > 2.0
    assert 1.0 / found.singular_values[0] == pytest.approx(error)


def test_a_weak_combination_moves_by_one_standard_error():
    lin, right = with_directions(2, [900.0, 80.0, 5.0])
    known, found = analysed(lin)
    (one,) = found.unseen
    assert not one.exact
    assert one.error == pytest.approx(0.2)
    step = dict(one.moves)
    assert [step[name] for name in lin.names] == pytest.approx(
        np.sign(step["a"] * right[2, 0]) * right[2] / 5.0
    )
    assert list(np.abs(list(step.values()))) == sorted(np.abs(list(step.values())), reverse=True)
    # what is one standard error to all samples together is 1 / sqrt(M) to each
    assert one.changes[0].noises == pytest.approx(1.0 / np.sqrt(SAMPLES))
    assert one.changes[0].rms == pytest.approx(known.noise[0].std / np.sqrt(SAMPLES))
    effect = f"vt changes by {digits(one.changes[0].rms)} pu rms, 0.058 of its noise"
    steps = ", ".join(
        f"{name} {lin.move_in_words(lin.names.index(name), share)}" for name, share in one.moves
    )
    assert one.sentence == f"{listed(names_of(one))} can move together ({steps}): {effect}"


def test_the_weight_of_a_channel_does_not_count_as_a_change_of_its_signal():
    lin, _ = with_directions(2, [900.0, 80.0, 5.0])
    heavy = replace(
        lin,
        errors=8.0 * lin.errors,
        influence=8.0 * lin.influence,
        jacobian=8.0 * lin.jacobian,
        channels=(ResidualBlock("vt", slice(0, SAMPLES), weight=8.0),),
    )
    assert analysed(heavy)[1].unseen[0].sentence == analysed(lin)[1].unseen[0].sentence


def test_well_determined_parameters_leave_nothing_to_say():
    _, found = analysed(with_directions(3, [900.0, 80.0, 50.0])[0])
    assert found.unseen == ()
    assert found.suggestion == ()
    assert found.sentences == ()


def product(values=(2.0, 3.0, 0.8), **changes):
    """Return the fit of a b exp(-c t), in which only a b is seen."""
    a, b, c = values
    slopes = decay(T, a * b, c)[1]
    rows = np.column_stack([b * slopes[:, 0], a * slopes[:, 0], slopes[:, 1]])
    return linearised(values, 0.01 * noise(4), rows, **changes)


def test_an_exact_redundancy_is_named_and_keeps_the_signal():
    lin = product(logarithmic=np.ones(3, dtype=bool))
    _, found = analysed(lin)
    (one,) = found.unseen
    assert one.exact
    assert dict(one.moves) == pytest.approx({"a": 0.1, "b": -0.1})
    told = "a and b can move together (a +10 %, b -10 %) without any change of vt: fix one of them"
    assert one.sentence == told
    assert found.singular_values[-1] == 0.0
    assert np.isinf(found.condition)


def test_fixing_one_of_two_redundant_parameters_gives_the_other():
    lin = product()
    _, found = analysed(lin)
    (one,) = found.suggestion
    assert one.names in {("a",), ("b",)}
    (other,) = {"a", "b"} - set(one.names)
    held = tuple("min" if name in one.names else None for name in lin.names)
    expected = confidence(replace(lin, held=held)).parameters[other].relative_error
    assert one.errors[other] == (np.inf, pytest.approx(expected))
    assert one.sentence == f"with {one.names[0]} fixed, {other} is known to {100 * expected:.2g} %"


def test_redundancies_that_have_nothing_to_do_with_each_other_are_distinguished():
    rng = np.random.default_rng(5)
    first, second, third = rng.standard_normal((3, SAMPLES))
    rows = np.column_stack([first, second, -first, 5.0 * second, third])
    _, found = analysed(linearised(np.ones(5), 0.01 * noise(5), rows))
    assert {tuple(sorted(names_of(one))) for one in found.unseen} == {("a", "c"), ("b", "d")}
    relative = rows * 1.0
    for one in found.unseen:
        moved = relative @ [dict(one.moves).get(name, 0.0) for name in "abcde"]
        assert np.abs(moved).max() < 1e-12
        assert max(abs(share) for _, share in one.moves) == pytest.approx(0.1)
    assert len(found.suggestion[-1].names) == 2


def test_an_exact_redundancy_hides_no_weak_combination():
    lin, right = with_directions(6, [900.0, 80.0, 4.0])
    doubled = linearised(
        np.append(lin.values, 7.0),
        lin.errors,
        np.column_stack([lin.jacobian, lin.jacobian[:, 0] * lin.values[0] / 7.0]),
    )
    _, found = analysed(doubled)
    assert [one.exact for one in found.unseen] == [True, False]
    assert sorted(names_of(found.unseen[0])) == ["a", "d"]
    assert found.singular_values[-1] == 0.0
    assert abs(right[2] @ right[2]) == pytest.approx(1.0)


def test_on_a_bound_a_parameter_is_still_named_where_it_is_redundant():
    _, found = analysed(product(held=("max", None, None)))
    assert sorted(names_of(found.unseen[0])) == ["a", "b"]
    assert found.names == ("b", "c")
    assert found.suggestion == ()


def test_what_has_no_effect_is_to_be_fixed():
    lin = linearised([2.0, 5.0], 0.01 * noise(7), np.column_stack([np.ones(SAMPLES), 0.0 * T]))
    _, found = analysed(lin)
    assert [one.sentence for one in found.unseen] == ["b has no effect on vt: fix it"]
    assert found.names == ("a",)


@pytest.mark.parametrize("seed", range(8))
def test_with_the_suggested_parameters_fixed_every_other_one_is_known(seed):
    rng = np.random.default_rng(seed)
    lin, _ = with_directions(seed, np.sort(10.0 ** rng.uniform(-1.0, 3.0, 6))[::-1])
    known, found = analysed(lin)
    relative = std_errors(known) / lin.values
    assert bool(found.suggestion) == bool(np.any(relative > WEAK))
    for one in found.suggestion:
        held = tuple("min" if name in one.names else None for name in lin.names)
        then = confidence(replace(lin, held=held))
        # the noise is that of the whole fit: fixing a parameter frees a degree of freedom
        widened = known.noise[0].std / then.noise[0].std
        for name, (before, after) in one.errors.items():
            k = lin.names.index(name)
            assert before == pytest.approx(relative[k])
            assert after == pytest.approx(then.parameters[name].relative_error * widened)
    if found.suggestion:
        last = found.suggestion[-1]
        assert len(last.names) == len(found.suggestion)
        settled = all(after <= WEAK for _, after in last.errors.values())
        assert settled or len(last.names) == len(lin.names) - 1


def test_what_moves_most_in_the_weak_direction_is_fixed_first():
    for seed in range(8):
        lin, right = with_directions(seed, [900.0, 700.0, 500.0, 2.0])
        _, found = analysed(lin)
        assert found.suggestion[0].names == (lin.names[np.argmax(np.abs(right[3]))],)
        assert len(found.suggestion) == 1


def test_of_several_weak_directions_the_pivot_of_all_is_fixed_first():
    for seed in range(8):
        lin, right = with_directions(seed, [900.0, 700.0, 3.0, 2.0])
        _, found = analysed(lin)
        first = np.argmax(np.linalg.norm(right[2:], axis=0))
        assert found.suggestion[0].names == (lin.names[first],)
        assert len(found.suggestion) == 2


def test_a_nuisance_is_never_fixed():
    for seed in range(4):
        lin, right = with_directions(seed, [900.0, 700.0, 500.0, 2.0], logarithmic=True)
        most = int(np.argmax(np.abs(right[3])))
        nuisances = tuple(k == most for k in range(4))
        _, found = analysed(replace(lin, nuisances=nuisances))
        assert found.suggestion
        for one in found.suggestion:
            assert lin.names[most] not in one.names
            assert lin.names[most] not in one.errors


def test_for_a_nuisance_that_is_hardly_known_nothing_is_fixed():
    rows = np.linalg.qr(np.random.default_rng(22).standard_normal((SAMPLES, 3)))[0]
    lin = linearised(
        [1.0, 1.0, 1.0],
        noise(22),
        rows * [1e3, 1e3, 1.0],
        width=np.ones(3),
        nuisances=(False, False, True),
    )
    known, found = analysed(lin)
    assert list(std_errors(known) > WEAK) == [False, False, True]
    assert found.suggestion == ()


def test_what_a_prior_says_is_seen():
    lin, right = with_directions(9, [900.0, 80.0, 2.0])
    k = int(np.argmax(np.abs(right[2])))
    priors = (PriorRow(k, float(lin.values[k]), 0.001 * float(lin.values[k]), 1.0),)
    _, found = analysed(replace(lin, priors=priors))
    assert found.unseen == ()
    assert len(found.singular_values) == 3


def test_each_signal_says_how_it_changes():
    lin, _ = with_directions(10, [900.0, 80.0, 2.0])
    half = SAMPLES // 2
    channels = (
        ResidualBlock("up vt", slice(0, half)),
        ResidualBlock("up efd", slice(half, SAMPLES), weight=0.1),
    )
    known, found = analysed(replace(lin, channels=channels))
    (one,) = found.unseen
    assert [change.signal for change in one.changes] == ["up vt", "up efd"]
    for change, level, weight in zip(one.changes, known.noise, (1.0, 0.1), strict=True):
        assert change.rms * weight == pytest.approx(change.noises * level.std)
    first, second = one.changes
    assert one.sentence.endswith(
        f": up vt changes by {digits(first.rms)} pu rms, {digits(first.noises)} of its noise; "
        f"up efd by {digits(second.rms)} pu, {digits(second.noises)}"
    )
    squares = sum(half * change.noises**2 for change in one.changes)
    assert squares == pytest.approx(1.0)


def test_large_changes_are_factors_and_those_near_zero_absolute():
    lin = linearised(
        [4.0, 4.0, 0.01],
        noise(11),
        np.ones((SAMPLES, 3)),
        logarithmic=np.array([True, False, False]),
        width=np.array([40.0, 40.0, 5.0]),
    )
    assert lin.move_in_words(0, 1.5) == "times 4.5"
    assert lin.move_in_words(0, -1.5) == "times 0.22"
    assert lin.move_in_words(0, 8.0) == "by orders of magnitude"
    assert lin.move_in_words(0, -0.5) == "-50 %"
    assert lin.move_in_words(1, 1.5) == "+150 %"
    assert lin.move_in_words(2, 0.5) == "+0.25 pu"


@pytest.mark.parametrize(
    ("number", "text"),
    [(3.14e-6, "3.1e-6"), (0.097, "0.097"), (100.0, "100"), (1234.0, "1200"), (2e5, "2e5")],
)
def test_numbers_have_two_digits(number, text):
    assert digits(number) == text


def test_lists_end_with_and():
    assert listed(["a"]) == "a"
    assert listed(["a", "b"]) == "a and b"
    assert listed(["a", "b", "c"]) == "a, b and c"


def test_the_content_survives_json():
    known, found = analysed(product())
    content = json.loads(json.dumps(plain(found), allow_nan=False))
    assert content["condition"] is None
    assert content["unseen"][0]["exact"] is True
    (step,) = content["suggestion"]
    (errors,) = [one for name, one in step["errors"].items() if name != "c"]
    assert errors["before"] is None
    assert step["errors"]["c"]["before"] == pytest.approx(known.parameters["c"].relative_error)


def test_a_fit_without_any_error_is_all_seen():
    lin, _ = with_directions(12, [900.0, 80.0, 2.0])
    flat = np.zeros(SAMPLES)
    _, found = analysed(replace(lin, errors=flat, influence=flat))
    assert found.unseen == ()
    assert found.suggestion == ()


def test_fewer_samples_than_parameters_leave_exact_redundancies():
    lin, _ = with_directions(13, [900.0, 80.0, 50.0])
    few = linearised(lin.values, np.zeros(2), lin.jacobian[:2])
    _, found = analysed(few)
    assert [one.exact for one in found.unseen] == [True]
    assert len(found.singular_values) == 3


def test_nothing_free_leaves_nothing_to_say():
    lin, _ = with_directions(14, [900.0, 80.0])
    known, found = analysed(replace(lin, held=("min", "max")))
    assert found.names == ()
    assert found.sentences == ()
    assert all(one.std_error is None for one in known.parameters.values())


@pytest.mark.parametrize("seed", range(20))
def test_columns_are_picked_as_by_qr_with_pivoting(seed):
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((rng.integers(1, 5), 7)) * rng.uniform(0.1, 10.0, 7)
    assert pivots(rows) == qr(rows, mode="r", pivoting=True)[1][: len(rows)].tolist()


@pytest.mark.parametrize("logarithmic", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_what_leads_out_of_an_interval_is_not_said(seed, logarithmic):
    lin, _ = with_directions(seed, [900.0, 4.0, 2.0], logarithmic)
    _, found = analysed(lin)
    assert len(found.unseen) == 2
    values, sizes = (
        dict(zip(lin.names, numbers, strict=True)) for numbers in (lin.values, lin.size)
    )
    for each in found.unseen:
        for name, share in each.moves:
            value, size = values[name], sizes[name]
            moved = value * np.exp(share) if logarithmic else value + share * size
            assert each.reached[name] == pytest.approx(moved)
    assert found.within({}).sentences == found.sentences
    for each in found.unseen:
        for name, reached in each.reached.items():
            low, high = sorted((values[name], reached))
            assert each in found.within({name: (low, high)}).unseen
            middle = 0.5 * (low + high)
            limits = (low, middle) if reached == high else (middle, high)
            kept = found.within({name: limits})
            assert each not in kept.unseen
            for fixing in kept.suggestion:
                assert not fixing.concerned & each.reached.keys()
