"""What a fit finds about a record itself: instants, sizes, levels, delay, base of a signal."""

import json
from copy import deepcopy

import numpy as np
import pytest
from records import (
    NOISE,
    SAMPLES,
    STEP,
    TEST,
    TIME,
    case_of,
    config,
    found_in,
    one,
    recording,
    several,
    synthetic,
    write,
)
from tables import read_columns

from exfit.analysis.solution import aligned, validation_of
from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiment, build_experiments
from exfit.fitting.nuisance import names_of
from exfit.fitting.problem import residuals_of
from exfit.plants import VT0
from exfit.results.compare_with_record import compare_with_record
from exfit.results.tables import parameter_file
from exfit.workflows import fit, simulate, validate

REFERENCE = SAMPLES.parent / "tests" / "reference"
NAMES = {"kP": "KPR", "kI": "KIR", "kD": "KDR", "Td": "TDR"}  # as the reference calls them
UNITS = {"ac1a": "ac1a_typical", "ac8b_unit1": "ac8b_unit1", "ac8b_unit2": "ac8b_unit2"}


FREE = {
    "KA": found_in(330.0, 76.6, 7660.0),
    "KD": {**found_in(0.25, 0.0, 3.5), "scale": "linear", "prior": {"mean": 0.3, "std": "50 %"}},
    "TE0": found_in(1.7, 0.13, 13.0),
}


@pytest.fixture
def everything_open(tmp_path):
    """Return residuals of two records with all that can be found about them."""
    rng = np.random.default_rng(4)
    up = read_columns(SAMPLES / "ac1a_up.csv", ["t", "vt", "efd"])
    spikes = rng.choice(len(up["t"]), 12, replace=False)
    up["vt"] = up["vt"].copy()
    up["vt"][spikes] += 0.01 * rng.choice([-1.0, 1.0], 12)
    up["vt"][300:308] = np.nan
    file = write(tmp_path / "up.csv", **up)
    level = {"scale": found_in(1.003, 0.9, 1.1), "offset": found_in(-0.002, -0.1, 0.1)}
    vt = {"column": "vt", **level, "filter": {"lowpass": 8.0}}
    efd = {"column": "efd", **level, "filter": {"median": 5}, "weight": 0.02}
    records = [
        recording(
            "up",
            file,
            # no instant falls on the grid of 1 ms, where derivatives have kinks
            found_in(1.0037, 0.8, 1.2),
            found_in(0.049, 0.02, 0.08),
            {"vt": vt, "efd": efd},
            delay=found_in(0.0123, -0.1, 0.1),
            gaps="skip",
            mask=[[2.105, 2.305]],
            window=[0.2, 4.0],
        ),
        recording("down", at=found_in(0.9967, 0.8, 1.2), window=[0.2, 4.0]),
    ]
    records[0]["test"]["vt0"] = found_in(1.001, 0.9, 1.1)
    records[1]["test"]["vs"] = [
        {"at": found_in(2.5003, 2.0, 3.0), "step": found_in(0.01, 0.001, 0.1)}
    ]
    content = several(*records, free=FREE, estimate={"loss": "huber"})
    content["parameters"]["fixed"] |= {"TE": "=0.9*TE0", "VAMIN": "=-VAMAX", "KF": 0.0444}
    content["parameters"]["fixed"] |= {"TF": 1.5754, "TA": 0.0545, "KC": 0.5111}
    case = case_of(content, tmp_path)
    setups = build_experiments(case)
    return residuals_of(case, [setup.with_enough_substeps(case.values()) for setup in setups])


def test_the_exact_jacobian_is_that_of_differences_with_all_that_can_be_found(everything_open):
    residuals = everything_open
    assert [one.name for one in residuals.free] == [
        *FREE,
        "up.vref.at",
        "up.vref.step",
        "up.vt0",
        "up.delay",
        "up.vt.scale",
        "up.vt.offset",
        "up.efd.scale",
        "up.efd.offset",
        "down.vref.at",
        "down.vs.at",
        "down.vs.step",
    ]
    exact = residuals.exact(residuals.start)
    assert exact.shape == (residuals.count + 1, len(residuals.free))
    differences = residuals.differences(residuals.start, -1e-6, 1e-6)
    size = np.abs(exact).max(axis=0)
    # a sample that passes a kink of the loss or of the median within the step: 1e-6 of a column
    assert (np.abs(differences - exact).max(axis=0) <= 1e-5 * size).all()


def test_differences_of_what_moves_are_those_of_runs_one_by_one(everything_open):
    """An experiment with moving steps cannot be run side by side; the residuals are the same."""
    residuals = everything_open
    points = residuals.start + np.array([[0.0], [1e-3]])
    costs = residuals.costs(points)
    one_by_one = [0.5 * float(np.sum(residuals(point) ** 2)) for point in points]
    assert costs == pytest.approx(one_by_one, rel=1e-12)


@pytest.mark.long
def test_up_and_down_find_their_instants_and_sizes(tmp_path):
    content = several(
        *(
            recording(name, at=found_in(1.05, 0.75, 1.25), step=found_in(0.9 * step, *bounds))
            for name, step, bounds in (("up", 0.05, (0.02, 0.08)), ("down", -0.05, (-0.08, -0.02)))
        ),
        estimate={"iterations": 150},
    )
    # where the instant may lie at its lower bound, little of the record is left to tell vt0
    for entry in content["records"]:
        entry["test"]["vt0"] = 1.0 if entry["name"] == "up" else found_in(1.05, 1.0, 1.1)
    found = fit(case_of(content, tmp_path))
    assert found.success
    for name, step in STEP.items():
        assert found.values[f"{name}.vref.at"] == pytest.approx(1.0, abs=1e-3)
        assert found.values[f"{name}.vref.step"] == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize("direction", STEP)
@pytest.mark.parametrize("unit", UNITS)
def test_auto_starts_where_the_record_shows_the_step(tmp_path, unit, direction):
    content = config(UNITS[unit])
    content["record"]["file"] = str(SAMPLES / f"{unit}_{direction}.csv")
    content["test"] = {"vref": [{"at": {"start": "auto"}, "step": {"start": "auto"}}]}
    at, step = build_experiments(case_of(content, tmp_path))[0].free
    assert (at.name, step.name) == ("vref.at", "vref.step")
    assert at.low < at.start < at.high
    assert step.low < step.start < step.high
    assert at.start == pytest.approx(1.0, abs=0.1)
    # vt of an AC8B settles slowly: in 10 s it is still off by 5 %
    assert step.start == pytest.approx(STEP[direction], rel=0.06)


@pytest.mark.parametrize("direction", STEP)
@pytest.mark.parametrize("unit", UNITS)
def test_auto_ends_where_other_starts_end(tmp_path, unit, direction):
    """Of the unit as it was simulated; the step down of an AC8B began before it had settled."""
    content = {**config(UNITS[unit]), "validate": []}
    truth = json.loads((REFERENCE / f"reference_{unit}.json").read_text())["params_in_effect"]
    known = {NAMES.get(key, key): value for key, value in truth.items()}
    free = content["parameters"].pop("free")
    content["parameters"]["fixed"] |= {name: known[name] for name in [*free, "KA"]}
    content["record"]["file"] = str(SAMPLES / f"{unit}_{direction}.csv")
    size = STEP[direction]
    ends = []
    for at, step in (
        ({"start": "auto"}, {"start": "auto"}),
        (found_in(1.1, 0.7, 1.3), found_in(0.7 * size, *sorted((0.5 * size, 1.5 * size)))),
    ):
        content["test"] = {"vref": [{"at": at, "step": step}], "steady_until": 0.7}
        found = fit(case_of(content, tmp_path))
        ends.append((found.values["vref.at"], found.values["vref.step"] / size))
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)
    if unit == "ac1a" or direction == "up":
        assert ends[0][0] == pytest.approx(1.0, abs=1e-3)
        assert ends[0][1] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("delay", [0.0, found_in(0.0, -0.05, 0.05)])
def test_what_is_shown_of_a_record_has_the_cost_that_the_fit_found(tmp_path, delay):
    """The instant, 40 ms off its start, moves the response once, also when it is read back."""
    synthetic(tmp_path, TEST, TIME)
    test = {"vt0": 1.0, "vref": [{"at": found_in(1.04, 0.9, 1.1), "step": 0.05}]}
    case = case_of(one(test, delay=delay), tmp_path)
    found = fit(case)
    assert found.comparisons[0].cost == pytest.approx(found.cost, rel=1e-9)
    for again in (validate(case, found.values)[0], simulate(case, found.values).comparison):
        assert again.cost == pytest.approx(found.cost, rel=1e-9)


def test_a_late_recorder_is_found(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    # what the recorder shows at t happened 37 ms before: simulated there, not interpolated
    synthetic(tmp_path, TEST, TIME)
    case = case_of(one(TEST, delay=0.037), tmp_path)
    setup = build_experiments(case)[0]
    late = setup.with_enough_substeps(case.values()).response(case.values()).signals["vt"]
    assert np.interp(TIME - 0.037, TIME, shown) == pytest.approx(late, abs=6 * NOISE)
    rng = np.random.default_rng(1)
    write(tmp_path / "record.csv", t=TIME, vt=late + 2e-5 * rng.standard_normal(len(TIME)))
    content = one(TEST, free=["KA"], delay=found_in(0.0, -0.1, 0.1))
    found = fit(case_of(content, tmp_path))
    assert found.values["delay"] == pytest.approx(0.037, abs=1e-4)
    assert found.values["KA"] == pytest.approx(332.83, rel=1e-2)


def test_a_delay_moves_the_features_of_both_signals_alike(tmp_path):
    """They are read off where the record shows the step, not where it was made."""
    synthetic(tmp_path, TEST, TIME, noise=0.0)
    prompt = build_experiments(case_of(one(TEST), tmp_path))[0]
    late = build_experiments(case_of(one(TEST, delay=0.5), tmp_path))[0]
    values = case_of(one(TEST), tmp_path).values()
    peak = compare_with_record(prompt, "prompt", values).features.simulated.peak_time
    assert compare_with_record(late, "late", values).features.simulated.peak_time == pytest.approx(
        peak, abs=1e-3
    )


def test_an_early_recorder_sees_beyond_the_end_of_its_own_clock(tmp_path):
    """At a delay of -0.4 s a record until 1.5 s shows what happens until 1.9 s, still in motion."""
    values = case_of(one(TEST), tmp_path).values()
    synthetic(tmp_path, TEST, TIME, noise=0.0)
    whole = read_columns(tmp_path / "record.csv", ["t", "vt"])
    write(tmp_path / "record.csv", t=TIME[:151], vt=whole["vt"][:151])
    for delay in (-0.4, found_in(-0.4, -0.5, 0.1)):
        setup = build_experiments(case_of(one(TEST, delay=delay), tmp_path))[0]
        early = setup.response(values).signals["vt"]
        # grids of 1 ms that end elsewhere, and a cubic between the samples
        assert early == pytest.approx(whole["vt"][40:191], abs=1e-6)


def test_an_early_recorder_leaves_less_to_tell_the_level(tmp_path):
    """At a delay of -0.4 s the record of a step at 1 s moves from 0.6 s on."""
    synthetic(tmp_path, TEST, TIME, noise=0.0)
    level = {"vref": TEST["vref"]}
    shown = read_columns(tmp_path / "record.csv", ["t", "vt"])
    write(tmp_path / "record.csv", t=TIME, vt=np.interp(TIME + 0.4, shown["t"], shown["vt"]))
    for delay in (-0.4, found_in(0.0, -0.4, 0.1)):
        setup = build_experiments(case_of(one(level, delay=delay), tmp_path))[0]
        assert setup.experiment.own[VT0] == pytest.approx(1.0, abs=1e-9)


def test_the_base_of_a_signal_is_found(tmp_path):
    """A record in kV on a base of 13.8 kV, which the case takes for 1 % more, and shifted."""
    shown = synthetic(tmp_path, TEST, TIME, noise=2e-5)["vt"]
    write(tmp_path / "record.csv", t=TIME, U=13.8 * (shown - 0.004))
    channel = {
        "column": "U",
        "scale": found_in(1 / (1.01 * 13.8), 0.06, 0.09),
        "offset": found_in(0.0, -0.05, 0.05),
    }
    found = fit(case_of(one(TEST, {"vt": channel}), tmp_path))
    assert found.values["vt.scale"] == pytest.approx(1 / 13.8, rel=1e-3)
    assert found.values["vt.offset"] == pytest.approx(0.004, abs=1e-3)


def test_a_scale_or_an_offset_alone_is_found(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME, noise=2e-5)["vt"]
    write(tmp_path / "record.csv", t=TIME, vt=1.01 * shown)
    found = fit(
        case_of(one(TEST, {"vt": {"column": "vt", "scale": found_in(1, 0.9, 1.1)}}), tmp_path)
    )
    assert found.values["vt.scale"] == pytest.approx(1 / 1.01, abs=1e-5)
    write(tmp_path / "record.csv", t=TIME, vt=shown + 0.01)
    found = fit(
        case_of(one(TEST, {"vt": {"column": "vt", "offset": found_in(0, -0.1, 0.1)}}), tmp_path)
    )
    assert found.values["vt.offset"] == pytest.approx(-0.01, abs=1e-5)


def test_the_voltage_at_the_start_is_found(tmp_path):
    synthetic(tmp_path, {**TEST, "vt0": 0.987}, TIME, noise=2e-5)
    found = fit(case_of(one({**TEST, "vt0": found_in(1.0, 0.9, 1.1)}), tmp_path))
    assert found.values["vt0"] == pytest.approx(0.987, abs=1e-5)


def test_a_step_of_the_stabilisers_signal_and_a_second_one_of_the_reference_are_found(tmp_path):
    test = {
        "vt0": 1.0,
        "vref": [{"at": 1.0, "step": 0.05}, {"at": 4.0, "step": -0.02}],
        "vs": [{"at": 2.5, "step": 0.01}],
    }
    synthetic(tmp_path, test, TIME, noise=2e-5)
    asked = deepcopy(test)
    asked["vref"][1] = {"at": found_in(4.05, 3.5, 4.5), "step": found_in(-0.025, -0.05, -0.005)}
    asked["vs"][0] = {"at": found_in(2.45, 2.0, 3.0), "step": found_in(0.02, 0.005, 0.05)}
    case = case_of(one(asked), tmp_path)
    assert names_of(case.recordings[0]) == ("vref2.at", "vref2.step", "vs.at", "vs.step")
    found = fit(case).values
    assert found["vref2.at"] == pytest.approx(4.0, abs=2e-3)
    assert found["vref2.step"] == pytest.approx(-0.02, rel=1e-2)
    assert found["vs.at"] == pytest.approx(2.5, abs=2e-3)
    assert found["vs.step"] == pytest.approx(0.01, rel=1e-2)


@pytest.mark.parametrize(
    "order",
    [
        ("vref.at", "vref2.at", "vs.at"),
        ("vref.at", "vs.at", "vref2.at"),
        ("vs.at", "vref.at", "vref2.at"),
    ],
)
def test_each_name_moves_its_own_step(tmp_path, order):
    write(tmp_path / "record.csv", t=TIME, vt=TIME)
    instants = dict(zip(order, (1.0, 2.0, 3.0), strict=True))
    test = {"vt0": 1.0}
    for signal, names in (("vref", ("vref.at", "vref2.at")), ("vs", ("vs.at",))):
        test[signal] = [
            {"at": found_in(instants[name], 0.5, 5.0), "step": 0.01 * instants[name]}
            for name in names
        ]
    setup = build_experiments(case_of(one(test), tmp_path))[0]
    moved = setup.experiment.with_inputs({name: at + 0.25 for name, at in instants.items()})
    assert {(step.at, round(step.step, 9)) for step in moved.inputs.steps} == {
        (at + 0.25, round(0.01 * at, 9)) for at in instants.values()
    }


def test_the_level_before_an_instant_that_is_found_is_that_before_its_lower_bound(tmp_path):
    vt = np.where(TIME < 0.7, 1.0, 1.0 + 0.01 * (TIME - 0.7))
    write(tmp_path / "record.csv", t=TIME, vt=vt)
    test = {"vref": [{"at": found_in(1.0, 0.7, 1.2), "step": 0.05}]}
    setup = build_experiments(case_of(one(test), tmp_path))[0]
    assert setup.experiment.own[VT0] == 1.0
    assert setup.test.steady == 0.7


def test_auto_finds_the_step_beside_gaps_and_masked_stretches(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    shown[30:40], shown[200:210] = np.nan, 1e3
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    test = {"vref": [{"at": {"start": "auto"}, "step": {"start": "auto"}}]}
    case = case_of(one(test, gaps="skip", mask=[[2.0, 2.1]]), tmp_path)
    at, _ = build_experiments(case)[0].free
    assert at.start == pytest.approx(1.0, abs=0.1)


def test_auto_keeps_the_bounds_that_are_given(tmp_path):
    synthetic(tmp_path, TEST, TIME)
    test = {"vref": [{"at": {"start": "auto", "min": 0.5, "max": 1.5}, "step": 0.05}]}
    (at,) = build_experiments(case_of(one(test), tmp_path))[0].free
    assert (at.low, at.high) == (0.5, 1.5)
    test["vref"][0]["at"] = {"start": "auto", "min": 3.0}
    with pytest.raises(CaseError, match=r"test\.vref\[0\]\.at: the record shows .* outside 3"):
        build_experiments(case_of(one(test), tmp_path))


def test_auto_refuses_a_record_without_a_step_and_one_whose_step_comes_after_the_next(tmp_path):
    write(tmp_path / "record.csv", t=TIME, vt=np.ones_like(TIME))
    auto = {"at": {"start": "auto"}, "step": {"start": "auto"}}
    with pytest.raises(RecordError, match=r"record\.csv: .*test\.vref\[0\] asks for start: auto"):
        build_experiments(case_of(one({"vref": [auto]}), tmp_path))
    synthetic(tmp_path, {**TEST, "vref": [{"at": 3.0, "step": 0.05}]}, TIME)
    test = {"vref": [auto, {"at": 2.0, "step": 0.01}]}
    with pytest.raises(CaseError, match=r"test\.vref\[1\]\.at: 2 s is not after"):
        build_experiments(case_of(one(test), tmp_path))


def test_a_validation_is_aligned_without_moving_the_unit(tmp_path):
    """Its recorder is 30 ms late and 1 % off; the unit stays as the fit left it."""
    shown = read_columns(SAMPLES / "ac1a_down.csv", ["t", "vt"])
    write(tmp_path / "late.csv", t=shown["t"] + 0.03, vt=1.01 * shown["vt"])
    content = config("ac1a_typical")
    plain = fit(case_of(content, tmp_path))
    entry = content["validate"][0]
    entry["test"]["vt0"] = found_in(1.05, 1.0, 1.1)
    entry["record"] = {
        **entry["record"],
        "file": str(tmp_path / "late.csv"),
        "delay": found_in(0.0, -0.1, 0.1),
        "channels": {"vt": {"column": "vt", "scale": found_in(1.0, 0.9, 1.1)}},
    }
    case = case_of(content, tmp_path)
    found = fit(case)
    assert found.values == plain.values
    (before,), (after,) = plain.validation, found.validation
    assert after.rmse == pytest.approx(before.rmse, rel=0.05)
    setup = build_experiment(case, case.validations[0], found.values)
    assert validation_of(case, *aligned(case, setup, found.values)).rmse == after.rmse
    unaligned = compare_with_record(setup.with_enough_substeps(found.values), "start", found.values)
    assert unaligned.rmse > 10 * after.rmse


def test_a_voltage_that_is_found_is_not_held_against_its_start(tmp_path):
    """It starts 2 % off; on a bound it is that which is told, not the number it started from."""
    synthetic(tmp_path, {**TEST, "vt0": 0.987}, TIME, noise=2e-5)
    found = fit(case_of(one({**TEST, "vt0": found_in(1.01, 0.9, 1.1)}), tmp_path))
    assert not [note for note in found.notes if note.startswith("vt0")]


@pytest.mark.parametrize(
    ("at", "step", "drift", "told"),
    [
        (1.0, 0.05, 0.0, False),
        (0.93, 0.05, 0.0, True),
        (1.0, 0.04, 0.0, True),
        (1.0, 0.05, 1e-4, True),
    ],
)
def test_an_error_far_above_the_noise_is_noted(tmp_path, at, step, drift, told):
    """Of a step that the case has 70 ms early or a fifth too small, and of a record that drifts."""
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    write(tmp_path / "record.csv", t=TIME, vt=shown + drift * TIME)
    test = {"vt0": 1.0, "vref": [{"at": at, "step": step}]}
    found = fit(case_of(one(test, free=["KA", "TE", "TA"]), tmp_path))
    assert any("times the scatter" in note for note in found.notes) == told


def test_spikes_that_a_robust_loss_bears_are_no_misfit(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    shown[::40] += 0.02
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    plain = one(TEST, free=["KA", "TE"])
    for content, told in ((plain, True), ({**plain, "estimate": {"loss": "huber"}}, False)):
        found = fit(case_of(content, tmp_path))
        assert any("times the scatter" in note for note in found.notes) == told


def test_how_many_samples_are_left_out_as_outliers_is_noted(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    shown[::60] += 0.02
    shown[30:35] = np.nan
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    channel = {"vt": {"column": "vt", "outliers": 8}}
    found = fit(case_of(one(TEST, channel, free=["KA"], gaps="skip"), tmp_path))
    told = f"10 of {len(TIME) - 5} samples of vt of record.csv are left out as outliers"
    assert told in found.notes


def test_a_median_wider_than_a_tenth_of_the_record_is_refused(tmp_path):
    channels = {"vt": {"column": "vt", "filter": {"median": 999}}}
    content = several(recording("up", channels=channels), recording("down"))
    with pytest.raises(RecordError, match=r"median: 999 samples; at most 100, a tenth"):
        fit(case_of(content, tmp_path))


def test_a_step_that_may_be_earlier_asks_for_a_simulation_beyond_the_record(tmp_path):
    """Shifted to its lower bound, the response is read behind the end of the record."""
    content = several(recording("up", at=found_in(1.0, 0.8, 1.2)), recording("down"))
    first, second = build_experiments(case_of(content, tmp_path))
    assert first.experiment.simulator.inputs.end == pytest.approx(first.record.time[-1] + 0.2)
    assert second.experiment.simulator.inputs.end == second.record.time[-1]


def test_the_file_of_parameters_names_every_record_with_its_error(tmp_path):
    content = several(recording("up"), recording("down"), estimate={"iterations": 1})
    found = fit(case_of(content, tmp_path))
    heading = parameter_file(found).splitlines()[0]
    for one_of in found.comparisons:
        assert f"{one_of.record}: rmse {one_of.rmse:.4g} pu" in heading
